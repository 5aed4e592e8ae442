"""Case files of mechanisms that consist of single parts, and of motions and loads."""

import math

import pytest

import scissordyn as sd
from scissordyn.components.place import GROUND
from scissordyn.config.template import template

# Body with points, mass centre and start values off its origin
ROD = sd.Body(
    "rod",
    mass=2.0,
    inertia=0.25,
    points={"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (0.5, 0.25)},
    centre=(0.5, 0.125),
    position=(0.5, 0.0),
    angle=math.pi / 2,
    velocity=(0.0, 1.0),
    angular_velocity=2.0 * math.pi,
)
TOOL = sd.Body(
    "tool", mass=0.1, inertia=0.5, points={"base": (0.0, 0.0)}, position=(0.25, 0.5)
)  # Body that is welded to another
# Mechanism with one part of most kinds
MECHANISM = sd.Mechanism(
    bodies=(sd.bar("crank", length=0.5, mass=1.0), ROD, sd.point_mass("block", mass=0.5, position=(0.5, 1.0)), TOOL),
    joints=(
        sd.Revolute("shaft", ("crank", "start"), (GROUND, "O")),
        sd.Revolute("crank pin", ("crank", "end"), ("rod", "a")),
        sd.Revolute("block pin", ("rod", "b"), ("block", "centre"), sd.Clearance(0.25e-3)),
    ),
    guides=(sd.Guide("rail", ("block", "centre"), (0.5, 0.0), math.pi / 2),),
    drives=(sd.Drive("crank", sd.ConstantSpeed(math.pi)),),
    welds=(sd.Weld("holder", ("rod", "c"), ("tool", "base")),),
    components=(
        sd.Spring("rope", ("block", "centre"), (GROUND, "wall"), 2000.0, 0.25, 3.0),
        sd.TorsionSpring("hinge", "rod", "crank", 4.0, math.pi, 0.5),
        sd.Force("push", ("rod", "c"), (1000.0, -2000.0), True, sd.Trapezoidal(0.0, 1.0, 2.0, 0.5)),
        sd.Torque("brake", "crank", -3.0, time_function=sd.Polynomial((1.0, 0.5))),
        sd.Motor("motor", "rod", 5.0, 2.0 * math.pi, limit=4.0, inertia=0.125),
    ),
    ground=(("O", (0.0, 0.0)), ("wall", (1.0, 0.0))),
    gravity=0.0,
    input_body="crank",
    output_body="block",
)
CASE = sd.case_text(MECHANISM)  # Case file that `case_text` writes for `MECHANISM`
# Case file of `MECHANISM` as a user would write it
WRITTEN = """
ground = [{ name = "O", position = "0, 0 mm" }, { name = "wall", position = "1 0 m" }]
joint = [
    { name = "shaft", journal = "crank.start", bearing = "ground.O" },
    { name = "crank pin", journal = "crank.end", bearing = "rod.a" },
    { name = "block pin", journal = "rod.b", bearing = "block.centre" },
]
guide = [{ name = "rail", follower = "block.centre", through = "0.5, 0 m", direction = "90 deg" }]
weld = [{ name = "holder", start = "rod.c", end = "tool.base" }]
clearance = [{ joint = "block pin", clearance = "0.25 mm" }]
drive = { speed = "30 rpm" }
run = { until = "1 ms" }
[structure]
kind = "mechanism"
gravity = "0 m/s^2"
input_body = "crank"
output_body = "block"
[[body]]
name = "crank"
mass = "1 kg"
length = "0.5 m"
[[body]]
name = "rod"
mass = "2 kg"
inertia = "0.25 kg m^2"
points = { a = "0, 0 m", b = "1, 0 m", c = "0.5, 0.25 m" }
centre = "0.5, 0.125 m"
position = "0.5, 0 m"
angle = "90 deg"
velocity = "0, 1 m/s"
angular_velocity = "60 rpm"
[[body]]
name = "block"
mass = "500 g"
points = { centre = "0, 0 m" }
position = "0.5, 1 m"
[[body]]
name = "tool"
mass = "100 g"
inertia = "0.5 kg m^2"
points = { base = "0, 0 m" }
position = "0.25, 0.5 m"
[[spring]]
name = "rope"
start = "block.centre"
end = "ground.wall"
stiffness = "2 kN/m"
free_length = "250 mm"
damping = "3 N s/m"
[[torsion_spring]]
name = "hinge"
body = "rod"
base = "crank"
stiffness = "4 N m/rad"
free_angle = "180 deg"
damping = "0.5 N m s/rad"
[[force]]
name = "push"
point = "rod.c"
force = "1, -2 kN"
follows = true
time_function = { trapezoidal = { start = 0, end = 1, duration = "2 s", ramp = 0.5 } }
[[torque]]
name = "brake"
body = "crank"
torque = "-3 N m"
time_function = { polynomial = [1, "0.5 1/s"] }
[[motor]]
name = "motor"
body = "rod"
stall_torque = "5 N m"
no_load_speed = "60 rpm"
limit = "4 N m"
inertia = "0.125 kg m^2"
"""
# Tables of rods, latches and other connections, to be appended to a case file
CONNECTIONS = """
[[rod]]
name = "jack"
start = "ground.wall"
end = "rod.b"
motion = { trapezoidal = { start = "300 mm", end = "0.4 m", duration = "2 s", ramp = 0.5 } }
[[rod]]
name = "stay"
start = "ground.wall"
end = "rod.c"
length = "0.7 m"
tension_only = true
[[latch]]
name = "catch"
body = "rod"
angle = "80 deg"
[[angle_stop]]
name = "stop"
body = "rod"
angle = "85 deg"
restitution = 0.4
[[travel_stop]]
name = "buffer"
point = "rod.b"
direction = "90 deg"
limit = "900 mm"
stiffness = 2e7
"""


def test_every_part_is_the_one_built_in_python(case_of):
    """Cross-check: a file with each kind of part, as a user writes it, against the same mechanism in Python."""
    assert case_of(WRITTEN).mechanism == MECHANISM
    case = case_of(WRITTEN + CONNECTIONS, ["run.start=static"])
    assert case.mechanism.rods == (
        sd.Rod("jack", ("ground", "wall"), ("rod", "b"), motion=sd.Trapezoidal(0.3, 0.4, 2.0, 0.5)),
        sd.Rod("stay", ("ground", "wall"), ("rod", "c"), length=0.7, tension_only=True),
    )
    assert case.mechanism.latches == (sd.Latch("catch", "rod", angle=sd.degrees(80)),)
    assert case.mechanism.components == (
        *MECHANISM.components,
        sd.AngleStop("stop", "rod", angle=sd.degrees(85), restitution=0.4),
        sd.TravelStop("buffer", ("rod", "b"), direction=sd.degrees(90), limit=0.9, stiffness=2e7),
    )
    assert case.run.start == "static"


@pytest.mark.parametrize(
    ("where", "text", "wanted"),
    [
        ("drive", 'polynomial = ["180 deg", "1 rad/s", "360 deg/s^2"]', sd.Polynomial((math.pi, 1.0, 2.0 * math.pi))),
        ("drive", 'cycloidal = { start = "0 deg", end = "180 deg", duration = "500 ms" }', sd.Cycloidal(0.0, math.pi, 0.5)),
        (
            "drive",
            'trapezoidal = { start = "180 deg", end = "0 deg", duration = "2 s", ramp = 0.125 }',
            sd.Trapezoidal(math.pi, 0.0, 2.0, 0.125),
        ),
        (
            "drive",
            'harmonic = { mean = "180 deg", amplitude = "1 rad", angular_frequency = "1 Hz" }',
            sd.Harmonic(math.pi, 1.0, 2.0 * math.pi),
        ),
        (
            "torque.brake.time_function",
            'harmonic = { mean = 0, amplitude = 1, angular_frequency = "1 Hz", phase = "180 deg" }',
            sd.Harmonic(0.0, 1.0, 2.0 * math.pi, math.pi),
        ),
        ("torque.brake.time_function", 'cycloidal = { start = 0, end = 1, duration = "2 s" }', sd.Cycloidal(0.0, 1.0, 2.0)),
        (
            "torque.brake.time_function",
            'table = { time = "0 1 2 3 4 5 s", factor = [0, 1, 1, 1, 1, 0.5] }',
            sd.Tabulated((0.0, 1.0, 2.0, 3.0, 4.0, 5.0), (0.0, 1.0, 1.0, 1.0, 1.0, 0.5)),
        ),
        (
            "torque.brake.time_function",
            'table = "load.csv"',
            sd.Tabulated((0.0, 1.0, 2.0, 3.0, 4.0, 5.0), (0.0, 1.0, 1.0, 1.0, 1.0, 0.5)),
        ),
    ],
)
def test_every_time_function_can_be_written(tmp_path, case_of, where, text, wanted):
    """Closed form: angles in degrees and their rates are radians and theirs; factors are plain, also in a file beside it."""
    (tmp_path / "load.csv").write_text("time [s], factor [1]\n0, 0\n1, 1\n2, 1\n3, 1\n4, 1\n5, 0.5\n")
    mechanism = case_of(CASE, [f"{where}={{ {text} }}"]).mechanism
    torque = mechanism.components[3]
    assert isinstance(torque, sd.Torque)
    assert (mechanism.drives[0].motion if where == "drive" else torque.time_function) == wanted


def test_several_drives(case_of):
    """Contract: one for each body, the first for the input body; they are found by their body from the command line."""
    several = 'drive=[{ speed = "30 rpm" }, { body = "tool", speed = "60 rpm" }]'
    drives = (sd.Drive("crank", sd.ConstantSpeed(math.pi)), sd.Drive("tool", sd.ConstantSpeed(2.0 * math.pi)))
    assert case_of(CASE, [several]).mechanism.drives == drives
    slower = case_of(CASE, [several, "drive.tool.speed=30 rpm", "motor.motor.limit=1 N m"]).mechanism
    assert slower.drives[1].motion == sd.ConstantSpeed(math.pi)
    assert isinstance(slower.components[4], sd.Motor)
    assert slower.components[4].limit == 1.0


def test_parts_are_added_to_any_structure(case_of):
    """Contract: a payload welded to an array, a spring between its bars, and the array as it was."""
    text = """
[structure]
kind = "scissor"
[[body]]
name = "payload"
mass = "1 kg"
inertia = "0.5 kg m^2"
points = { base = "0, 0 m" }
[[weld]]
name = "holder"
start = "payload.base"
end = "unit 2/bar 1.end"
[[torsion_spring]]
name = "hinge"
body = "unit 1/bar 1"
base = "unit 1/bar 2"
stiffness = "1 N m/rad"
[run]
until = "1 ms"
"""
    mechanism = case_of(text).mechanism
    array = sd.scissor()
    assert mechanism.bodies[:-1] == array.bodies
    assert (mechanism.joints, mechanism.ground, mechanism.input_body) == (array.joints, array.ground, array.input_body)
    assert mechanism.welds == (sd.Weld("holder", ("payload", "base"), ("unit 2/bar 1", "end")),)
    assert mechanism.components == (sd.TorsionSpring("hinge", "unit 1/bar 1", "unit 1/bar 2", 1.0),)


def test_patterns_give_clearance_to_several_joints(tmp_path, case_of):
    """Contract: all pivots, of which the last table that names one has the last word."""
    wanted = sd.mast(units=3).with_clearance("pivots", sd.Clearance(1e-3)).with_clearance("unit 2/pivot", sd.Clearance(2e-3))
    loose = 'clearance=[{ joint = "pivots", clearance = "1 mm" }, { joint = "unit 2/pivot", clearance = "2 mm" }]'
    assert case_of(sd.case_text(sd.mast(units=3)), [loose]).mechanism == wanted
    assert len(wanted.clearance_joints) == 3
    with pytest.raises(sd.InputError, match=r"two .* tables for joint"):
        sd.read_case(tmp_path / "case.toml", [loose.replace("unit 2/pivot", "pivots")])


@pytest.mark.parametrize(
    ("change", "place", "says"),
    [
        ("joint.shaft.journal=crnk.start", "joint 'shaft'", "body 'crnk' (did you mean 'crank'?)"),
        ("joint.shaft.journal=crank.strt", "joint 'shaft'", "point 'strt' of body 'crank' (did you mean 'start'?)"),
        ("joint.shaft.bearing=ground.P", "joint 'shaft'", "point 'P' of body 'ground'"),
        ("joint.shaft.bearing=O", "joint.shaft.bearing", "not a point of a body"),
        ("joint.shaft.bearing=crank.end", "joint.shaft", "joins body 'crank' to itself"),
        ("joint.shaft.name=crank pin", "", "joint 'crank pin' is given 2 times"),
        ("body.rod.mass=-2 kg", "body.rod.mass", "from 1e-12 to 1e+09 [kg]"),
        ("body.rod.centre=1 m", "body.rod.centre", "1 numbers"),
        ("body.rod.points.c=1, 2", "body.rod.points", "point 'c': missing unit"),
        ("body.rod.points=3", "body.rod.points", "not a table of points"),
        ('body.rod.points={"a.b"="0, 0 m"}', "body.rod.points", "the name has a dot"),
        ('body.crank.points={end="0, 0 m"}', "body.crank", "is already a point of the bar"),
        ("body.crank.name=ground", "body.ground", "body name 'ground'"),
        ("body.crank.lngth=1 m", "body.crank", "did you mean 'length'"),
        ("guide.rail.direction=1", "guide.rail.direction", "missing unit"),
        ("guide.rail.body=blck", "guide 'rail'", "body 'blck' (did you mean 'block'?)"),
        ("weld.holder.end=tool.bse", "weld 'holder'", "point 'bse' of body 'tool' (did you mean 'base'?)"),
        ("spring.rope.stiffness=2 N", "spring.rope.stiffness", "wrong dimension"),
        ("spring.rope.end=block.centre", "spring.rope", "between body 'block' and itself"),
        ("torsion_spring.hinge.base=crnk", "torsion spring 'hinge'", "body 'crnk' (did you mean 'crank'?)"),
        ("torsion_spring.hinge.body=block", "", "'hinge' needs the angle of body 'block'"),
        ("force.push.force=1 kN", "force.push.force", "two numbers and their unit [N]"),
        ("force.push.point=ground.O", "force.push", "on the ground"),
        ("force.push.time_function.polynomial=[1]", "force.push.time_function", "2 time functions (polynomial, trapezoidal)"),
        ("torque.brake.time_function.polynomial=[1, 2]", "torque.brake.time_function", "coefficient 1: missing unit"),
        ("torque.brake.time_function.polynomial=3", "torque.brake.time_function.polynomial", "not a list of one to six"),
        ("torque.brake.time_function={}", "torque.brake.time_function", "0 time functions"),
        ("motor.motor.no_load_speed=0 rpm", "motor.motor.no_load_speed", "a number from 1e-09 to 1e+06 [rad/s]"),
        ("motor.2.limit=1 N m", "", "no table '2'"),
        ('drive=[{speed="1 rpm"}, {speed="2 rpm"}]', "drive", "two drives or controllers for body 'crank'"),
        ('drive=[{speed="1 rpm"}, {sped="2 rpm"}]', "drive (the second)", "did you mean 'speed'"),
        (
            'drive.harmonic={mean="1 deg", amplitude="1 deg", angular_frequency="1 Hz"}',
            "drive",
            "2 time functions (speed, harmonic)",
        ),
        ("structure.input_body=crnk", "", "did you mean 'crank'"),
    ],
)
def test_bad_parts_are_refused_with_their_place(case_of, change, place, says):
    """Contract: one line with the place in the file, the body and the joint."""
    with pytest.raises(sd.InputError) as caught:
        case_of(CASE, [change])
    message = str(caught.value)
    assert f"{place}" in message.partition(";")[0]
    assert says in message
    assert "expected " in message
    assert "\n" not in message


def test_parts_of_the_template_can_be_put_in(case_of):
    """Contract: spring, load and motor of the printed case, which are shown as comments, become part of it."""
    text, active = template("mechanism"), list[str]()
    for block in text.split("\n\n"):
        shown = any(f"[[{name}]]" in block for name in ("spring", "torsion_spring", "force", "torque", "motor"))
        lines = [line.removeprefix("# ") if " = " in line or "[[" in line else line for line in block.splitlines()]
        active.append("\n".join(lines) if shown else block)
    mechanism = case_of("\n\n".join(active)).mechanism
    assert [type(element) for element in mechanism.components] == [sd.Spring, sd.TorsionSpring, sd.Force, sd.Torque, sd.Motor]


def test_payload_and_panels(case_of):
    """Identity: masses in the file against the same functions called from Python."""
    text = """
[structure]
kind = "scissor"
[drive]
speed = "20 rpm"
[[payload]]
at = "A"
mass = "3 kg"
[[payload]]
at = "unit 2/bar 1.end"
mass = "2 kg"
inertia = "0.1 kg m^2"
[[panels]]
bodies = "unit */bar 1"
mass = "0.5 kg"
[run]
until = "10 ms"
"""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(20))
    arm = sd.with_payload(arm, "A", 3.0)
    arm = sd.with_payload(arm, ("unit 2/bar 1", "end"), 2.0, inertia=0.1)
    assert case_of(text).mechanism.bodies == sd.with_panels(arm, "unit */bar 1", 0.5).bodies
