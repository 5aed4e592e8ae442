"""Forces along the stroke without inertia, also of gears, racks and driven coordinates, by closed forms and slow runs."""

import dataclasses
import math
import re

import numpy as np
import pytest
from tests.build import EXAMPLES, chain, gears, wheel

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.equilibrium.statics import SENSE_PARAMETERS as SENSITIVE
from scissordyn.model.commanded import rigid

G = 9.81  # [m/s^2] gravitational acceleration


def slider_crank(**more):
    """Return a slider-crank with crank 0.1 m and rod 0.3 m, driven at 1 rad/s."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0)
    return dataclasses.replace(crank.driven(speed=1.0), **more)


@pytest.mark.parametrize("units", [1, 2, 3])
def test_jack_of_a_lift_of_several_stages(units):
    """Closed form: N (W + W_a/2) / tan(inclination) across the foot, W on top, W_a the weight of the arms."""
    length, payload, arm = 1.2, 80.0, 5.0
    lift = sd.scissor(
        units=units,
        bar_length=length,
        bar_mass=arm,
        slider_mass=7.0,
        angle=math.radians(75.0),
        gravity=G,
        gravity_direction=math.pi,
    )
    lift = sd.with_payload(lift, f"unit {units}/bar 1.end", payload)
    first, last = (length * math.sin(math.radians(angle)) for angle in (75.0, 30.0))
    jack = sd.Rod("jack", ("ground", "origin"), ("slider", "centre"), motion=sd.Polynomial((first, last - first)))
    found = sd.statics(dataclasses.replace(lift, rods=(jack,)), until=1.0, points=21)
    foot = found["rod_length"].values[:, 0]
    tangent = np.sqrt(length**2 - foot**2) / foot
    np.testing.assert_allclose(
        found["rod_force"].values[:, 0], units * G * (payload + 0.5 * 2 * units * arm) / tangent, rtol=1e-11
    )


def test_every_drive_is_in_the_table():
    """Closed form: the torques of two drives of a double pendulum, each the moment of what hangs on it."""
    arms = chain(*(sd.bar(name, length=0.4, mass=2.0, angle=0.0) for name in ("upper", "lower")), gravity=G)
    found = sd.statics(arms.driven(speed=1.0, body="upper").driven(speed=-0.5, body="lower"), until=1.0, points=5)
    assert found["quantity"].values.tolist() == ["reaction A", "reaction B", "drive torque upper", "drive torque lower"]
    first, second = found["input"].values.T
    # a drive prescribes its body's angle against the ground
    np.testing.assert_allclose(found["quantity_value"].values[:, 2], 2.0 * G * (0.2 + 0.4) * np.cos(first), rtol=1e-12)
    np.testing.assert_allclose(found["quantity_value"].values[:, 3], 2.0 * G * 0.2 * np.cos(second), rtol=1e-12)


def test_loads_have_their_values_of_the_instant():
    """Identity: the torque is proportional to a load that grows with time."""
    growing = sd.Force("cut", ("slider", "centre"), force=(-100.0, 0.0), time_function=sd.Polynomial((0.0, 1.0)))
    constant = dataclasses.replace(growing, time_function=None)
    one, other = (sd.statics(slider_crank(components=(part,)), until=3.0, points=7) for part in (growing, constant))
    assert one["force"].values.tolist() == ["cut"]  # the coordinate of loads, beside the table of forces
    np.testing.assert_allclose(one["drive_torque"], other["drive_torque"] * one["time"], atol=1e-12)


def test_bars_that_bend_rest_as_at_a_static_start():
    """Identity: at t = 0 the forces are those of a run that starts in static equilibrium."""
    case = sd.read_case(EXAMPLES / "lift_table.toml")
    found = sd.statics(case.mechanism, until=0.6, points=5)
    run = sd.simulate(case.mechanism.ideal(), until=1e-3, samples=2, start="static")
    for name in ("reaction", "drive_torque", "beam_axial_force", "beam_start_moment"):
        first, start = found[name].values[0], run[name].values[0]
        np.testing.assert_allclose(first, start, rtol=1e-6, atol=1e-6 * np.abs(start).max())
    along = sd.internal_forces(found, places=[0.5])
    assert float(np.abs(along["bending_moment"]).max()) > 50.0


def test_envelope_locates_between_positions():
    """Closed form: the largest side force of a slider-crank lies between positions."""
    loaded = slider_crank(components=(sd.Force("cut", ("slider", "centre"), force=(-100.0, 0.0)),))
    found = sd.statics(loaded, until=3.0, points=64)
    row = found.sel(quantity="reaction crank pin")
    assert float(row["largest"]) == pytest.approx(100.0 / math.sqrt(1.0 - 1.0 / 9.0), rel=1e-6)
    assert float(row["largest_time"]) == pytest.approx(0.5 * math.pi, abs=1e-3)


def test_servo_is_taken_on_its_reference():
    """Identity: a servo has the torques of a drive on its reference."""
    case = sd.read_case(EXAMPLES / "controlled.toml")
    (servo,) = case.mechanism.components
    driven = case.mechanism.ideal().replace("components", ()).driven(servo.reference)
    torques = [sd.statics(one, until=case.run.until, points=5)["drive_torque"].values for one in (case.mechanism, driven)]
    np.testing.assert_allclose(*torques, rtol=1e-12)
    assert float(np.ptp(torques[1])) > 1.0


def test_servo_between_bodies_follows_its_reference():
    """Closed form: a stiff servo against a driven arm holds the next arm at its reference of each instant."""
    arms = chain(
        *(sd.bar(name, length=0.4, mass=2.0, angle=angle) for name, angle in (("upper", 0.2), ("lower", 0.5))), gravity=G
    )
    servo = {"body": "lower", "base": "upper", "reference": sd.Polynomial((0.3, 1.0))}
    arms = arms.driven(sd.Polynomial((0.2, 0.5)), body="upper").controlled(sd.PID(1e6, derivative=1.0), **servo)
    found = sd.statics(arms, until=1.0, points=5)
    angle = 0.5 + 1.5 * found["time"].values
    np.testing.assert_allclose(found["angle"].sel(body="lower"), angle, atol=1e-5)
    np.testing.assert_allclose(found["control_torque"].values[:, 0], 2.0 * G * 0.2 * np.cos(angle), atol=1e-4)


def test_position_without_equilibrium_is_named():
    """Contract: the error gives the instant."""
    beyond = sd.four_bar(ground=0.4, crank=0.1, coupler=0.25, rocker=0.15, gravity=G)
    with pytest.raises(sd.InputError, match=r"statics at t = [\d.]+ s: "):
        sd.statics(beyond.driven(speed=1.0), until=6.0, points=25)


def test_locking_position_is_named():
    """Closed form: a crank longer than its rod locks where the rod is upright, at asin(40/50) = 53.1301 deg."""
    crank = sd.slider_crank(crank=0.05, rod=0.04).driven(speed=2.0 * np.pi)
    lock = math.asin(0.8) / (2.0 * np.pi)
    place = rf"at t = 0.15 s: locking position at t = {lock:.6g} s \(drive of 'crank' at 53.1301 deg\)"
    says = f"{place}.* for example until = 0.146 s"
    with pytest.raises(sd.InputError, match=f"statics {says}"):
        sd.statics(crank, until=1.0)
    with pytest.raises(sd.InputError, match=says):
        sd.modes(crank, times=[0.0, 0.15], drive="released")
    assert sd.statics(crank, until=0.146, points=5).sizes["time"] == 5


def test_command(tmp_path, capsys):
    """Contract: the command prints the largest forces and writes table and picture; bad input is refused."""
    table, picture = tmp_path / "forces.csv", tmp_path / "forces.png"
    words = ["statics", str(EXAMPLES / "lift_table.toml"), "--points", "9", "-o", str(table), "--plot", str(picture)]
    assert status_of([*words, "--over", "table.x"]) == 0
    printed = capsys.readouterr().out
    assert "drive torque" in printed
    assert "bar unit 1/bar 1: largest axial force 347.4 N" in printed
    head, *rows = table.read_text().splitlines()
    assert head.startswith("time [s],unit 1/bar 1 [rad],reaction O [N]")
    assert len(rows) == 9
    assert picture.stat().st_size > 10_000
    assert status_of([*words, "--over", "roof"]) == 2
    assert "unknown horizontal axis over='roof'; expected time, input, table.x, table.y" in capsys.readouterr().err
    assert status_of(["statics", str(EXAMPLES / "press.toml")]) == 2
    assert "driven rod or driven coordinate; expected a drive, or a rod with a motion" in capsys.readouterr().err
    assert status_of(["statics", str(EXAMPLES / "lift.toml"), "-o", "forces.xlsx"]) == 2
    assert "-o forces.xlsx; expected a name that ends in .nc or .csv; for example -o statics.csv" in capsys.readouterr().err


@pytest.mark.parametrize("case", ["lift", "lift_table", "mast", "solar_array"])
def test_round_off_is_no_force(case, capsys):
    """Contract: no force of the table is minus zero or far below the others: an end stop that nothing touches carries 0 N."""
    assert status_of(["statics", str(EXAMPLES / f"{case}.toml"), "--points", "5"]) == 0
    printed = capsys.readouterr().out
    assert " -0 " not in printed
    assert not re.search(r"\d [pf]N", printed)
    if case == "lift":
        (buffer,) = (line.split() for line in printed.splitlines() if "buffer" in line)
        assert buffer[-4:-2] == ["0", "N"]


def journal_crank(radius, kinetic):
    """Return a slider-crank that presses, with friction in its crank's bearing."""
    force = sd.Force("cut", ("slider", "centre"), force=(-250.0, 0.0))
    return slider_crank(components=(force, sd.PinFriction("bearing", "crank", radius, kinetic)))


def test_backward_motion_is_computed_for_one_way_loads_alone():
    """Identity: a load that acts backward, in a backward motion, is one that acts always; forward it is none."""
    load = sd.StrokeLoad("cut", ("slider", "centre"), 0.0, ((0.1, -100.0), (0.5, -100.0)), acts="backward")
    always, back = (slider_crank(components=(dataclasses.replace(load, acts=acts),)) for acts in ("both", "backward"))
    options = {"until": 3.0, "points": 31}
    sense = np.sign(np.gradient(sd.statics(always, **options)["position"].sel(body="slider", axis="x").values))[1:-1]
    both = sd.statics(always, **options)["drive_torque"].values[1:-1]
    backward, forward = (sd.statics(back, friction=way, **options)["drive_torque"].values[1:-1] for way in ("backward", "none"))
    bare = sd.statics(slider_crank(), **options)["drive_torque"].values[1:-1]
    np.testing.assert_allclose(backward, np.where(sense > 0.0, both, bare), atol=1e-9)
    np.testing.assert_allclose(forward, np.where(sense < 0.0, both, bare), atol=1e-9)
    with pytest.raises(sd.InputError, match="or one-way loads"):
        sd.statics(always, friction="backward", **options)


def test_friction_that_is_not_there_or_jams():
    """Contract: no friction, and motion that the drives do not determine, are refused; a jam is a warning with its instant."""
    with pytest.raises(sd.InputError, match="friction = 'forward' for a mechanism whose forces do not depend"):
        sd.statics(slider_crank(), until=1.0, points=3, friction="forward")
    free = dataclasses.replace(
        journal_crank(0.02, 0.2),
        bodies=(*journal_crank(0.02, 0.2).bodies, sd.bar("pendulum", length=0.2, mass=1.0, angle=-1.5)),
    )
    pin = sd.Revolute("pendulum pin", ("pendulum", "start"), ("slider", "centre"))
    hanging = dataclasses.replace(free, joints=(*free.joints, pin), gravity=G)
    with pytest.raises(
        sd.InputError,
        match="statics with 'bearing', which depends on the sense of motion: the drives do not determine the motion",
    ):
        sd.statics(hanging, until=1.0, points=3, friction="forward")
    # a drawer that is pulled aside of its rails
    box = sd.Body("box", mass=2.0, inertia=0.05, points={"c": (0.0, 0.0), "pull": (0.0, 0.2)})
    rails = sd.GuideFriction("rails", ("ground", "O"), ("box", "c"), 0.0, 1.1, length=0.4)
    hand = sd.Rod("hand", ("ground", "far"), ("box", "pull"), motion=sd.Polynomial((2.0, 0.1)))
    drawer = sd.Mechanism(
        (box,),
        guides=(sd.Guide("rails", ("box", "c"), aligned=True),),
        rods=(hand,),
        components=(rails, sd.Force("side", ("box", "c"), (-30.0, 0.0))),
        ground=(("O", (0.0, 0.0)), ("far", (-2.0, 0.2))),
        gravity=0.0,
    )
    jammed = sd.statics(drawer, until=1.0, points=3, friction="forward")
    assert "the mechanism jams: no reactions are in balance with friction 'rails', first at t = " in jammed.attrs["warnings"]


def test_lift_table_in_statics_preview_and_runs():
    """Limit: preview and run have the torque of statics where the drive rests, and tend to it with the square of the speed."""
    table = rigid(sd.read_case(EXAMPLES / "lift_table.toml").mechanism.ideal())
    still = sd.statics(table, until=0.5)
    assert float(still["least"].sel(quantity="drive torque")) == pytest.approx(-355.5, abs=0.05)
    beyond = []
    for duration in (0.5, 5.0, 10.0):
        slow = table.driven(sd.Cycloidal(math.radians(70.0), math.radians(45.0), duration))
        ideal, run = sd.ideal_kinematics(slow, until=duration, samples=201), sd.simulate(slow, until=duration, samples=201)
        for one, other in ((ideal, still), (run, ideal)):
            difference = np.abs(one["drive_torque"].values - other["drive_torque"].values)
            assert max(difference[0], difference[-1]) < 1e-9
        assert difference.max() < 1e-8
        beyond.append(float(np.abs(ideal["drive_torque"].values - still["drive_torque"].values).max()))
    assert beyond == pytest.approx([653.64, 6.5364, 1.63411], rel=1e-4)
    # what the example does in half a second takes 2.8 times the torque at rest
    assert float(np.abs(sd.ideal_kinematics(table, until=0.5)["drive_torque"]).max()) == pytest.approx(1004.5, abs=0.5)


def test_many_turns():
    """Closed form: a measure has the largest torque of a crank over many turns; statics with too few positions says so."""
    crank = slider_crank(components=(sd.Force("cut", ("slider", "centre"), force=(-250.0, 0.0)),))
    angle = np.linspace(0.0, 2.0 * math.pi, 100_001)
    slope = 0.1 * np.sin(angle) + 0.3 * (np.sin(angle) / 3.0) * (np.cos(angle) / 3.0) / np.sqrt(
        1.0 - (np.sin(angle) / 3.0) ** 2
    )
    batch = sd.simulate_many(crank, {"gravity": [0.0]}, until=8.0 * math.pi, measures=("static_drive_torque",))
    assert float(batch["static_drive_torque"].values[0, 0]) == pytest.approx(250.0 * slope.max(), rel=1e-3)
    coarse = sd.statics(crank, until=4.0 * math.pi, points=6)
    assert "positions are up to 144 deg apart" in coarse.attrs["warnings"]
    assert sd.statics(crank, until=6.0, points=31).attrs["warnings"] == "[]"


def test_preview_has_the_forces_at_rest(capsys):
    """Closed form: the jack of the lift, 3 (W + W_a/2) / tan(20 deg); nothing where nothing is loaded."""
    assert status_of(["preview", str(EXAMPLES / "lift.toml")]) == 0
    assert "At most without inertia: rod force 4.69 kN at 'jack', reaction 7.504 kN at" in capsys.readouterr().out.replace(
        "\n", " "
    )
    assert status_of(["preview", str(EXAMPLES / "slider_crank.toml")]) == 0
    assert "inertia" not in capsys.readouterr().out


def test_components_that_depend_on_the_sense_of_motion_are_known():
    """Contract: statics lets creep every component with a speed over which a force changes its sense, and contacts."""
    over = {"transition", "friction_speed"}
    parts = [part.declaration for part in COMPONENTS.values()]
    assert {part.section for part in parts if part.contact or over & set(part.numbers)} == set(SENSITIVE)


ANGLE = sd.RelativeAngle  # Short name of the coordinate class
GROUND = (("O", (0.0, 0.0)), ("P", (0.5, 0.0)))  # Ground with the points "O" and "P"


@pytest.mark.parametrize(("ratio", "end"), [(-1.7, 20.0), (40.0, 0.5)])
def test_gear_pair(ratio, end):
    """Closed form: the drive torque is minus the ratio times the load, over several turns; the mesh carries the load."""
    load = 3.0
    pair = gears(ratio, sd.Torque("load", "wheel", torque=load)).driven(sd.Cycloidal(0.0, end, 1.0), body="pinion")
    forces = sd.statics(pair, until=1.0, points=7)
    np.testing.assert_allclose(forces["drive_torque"], -ratio * load, rtol=1e-13)
    np.testing.assert_allclose(forces["coupling_force"], -load, rtol=1e-13)
    np.testing.assert_allclose(forces["coupling_input_force"], ratio * load, rtol=1e-13)
    np.testing.assert_allclose(forces["angle"].sel(body="wheel"), ratio * forces["input"].values[:, 0])
    row = forces.sel(quantity="coupling input torque mesh")
    assert (str(row["quantity_unit"].values), float(row["largest"])) == ("N m", pytest.approx(ratio * load))
    # the panels leave out pins, which carry round-off only
    labels = [axes.get_ylabel() for axes in sd.plot.statics(forces)]
    assert [label.split(" [")[0] for label in labels] == [f"torque of {kind}" for kind in ("drives", "components", "couplings")]


def test_pictures_of_no_force_and_of_many_forces():
    """Contract: without any force the axes keep a range; curves that are left out are counted."""
    idle = sd.statics(sd.scissor(units=2, gravity=0.0).driven(speed=0.1), until=1.0, points=3)
    for axes in sd.plot.statics(idle):
        low, high = axes.get_ylim()
        assert low < 0.0 < high
    jack = sd.statics(sd.read_case(EXAMPLES / "lift.toml").mechanism, until=1.0, points=3)
    drawn = sd.plot.statics(jack)
    (reactions,) = [axes for axes in drawn if axes.get_ylabel().startswith("force of joints")]
    left_out = [line.get_label() for line in reactions.lines if line.get_label().endswith("left out")]
    assert left_out == [f"{10 - 6} more left out"]
    assert drawn[-1].get_xlabel() == "length of jack [mm]"


def lifted(screw):
    """Return an arm raised from the ground to its end by a screw of 2 mm/rad, or by a cylinder of the same length."""
    arm = sd.bar("arm", length=0.6, mass=3.0, position=(0.0, 0.0), angle=0.5)
    distance, length = sd.Distance(("ground", "P"), ("arm", "end")), math.dist((0.5, 0.0), arm.place("end"))
    lift = sd.Mechanism((arm,), (sd.Revolute("A", ("arm", "start"), ("ground", "O")),), ground=GROUND, gravity=G)
    if not screw:
        cylinder = sd.CoordinateDrive("cylinder", distance, sd.Polynomial((length, 0.1)))
        return dataclasses.replace(lift, drives=(cylinder,))
    return dataclasses.replace(
        lift,
        bodies=(arm, wheel("motor", place=(0.5, 0.0), angle=0.3)),
        joints=(*lift.joints, sd.Revolute("M", ("motor", "c"), ("ground", "P"))),
        drives=(sd.Drive("motor", sd.Polynomial((0.3, 50.0))),),
        couplings=(sd.Coupling("screw", distance, ANGLE("motor"), 0.002),),
    )


def test_screw_and_cylinder():
    """Closed form: moment of the weight over the arm of the cylinder's force, by the lead the torque of the screw."""
    screw, cylinder = (sd.statics(lifted(kind), until=1.0, points=11) for kind in (True, False))
    angle = cylinder["angle"].sel(body="arm").values
    length = np.hypot(0.6 * np.cos(angle) - 0.5, 0.6 * np.sin(angle))
    push = 3.0 * G * 0.3 * np.cos(angle) * length / (0.5 * 0.6 * np.sin(angle))
    np.testing.assert_allclose(cylinder["coordinate_drive_force"].values[:, 0], push, rtol=1e-12)
    np.testing.assert_allclose(screw["coupling_force"].values[:, 0], push, rtol=1e-12)
    np.testing.assert_allclose(screw["drive_torque"], 0.002 * push, rtol=1e-12)
    assert screw["quantity_unit"].sel(quantity="coupling force screw") == "N"
    assert screw["quantity_unit"].sel(quantity="coupling input torque screw") == "N m"
    np.testing.assert_allclose(screw["angle"].sel(body="arm"), angle, rtol=1e-13)


def belted(speed):
    """Return two arms whose belt turns the second by the first, driven at a speed."""
    bars = sd.bar("upper", length=0.3, mass=1.0, angle=0.4), sd.bar("lower", length=0.2, mass=0.7, angle=0.4)
    belt = sd.Coupling("belt", ANGLE("lower", "upper"), ANGLE("upper"), -0.6)
    return chain(*bars, gravity=G, couplings=(belt,)).driven(speed=speed, body="upper")


def four_bar(speed):
    return sd.four_bar(ground=0.4, crank=0.1, coupler=0.3, rocker=0.35, gravity=G).driven(speed=speed)


@pytest.mark.parametrize(
    ("driven", "until", "names"),
    [(four_bar, 6.0, ["reaction"]), (belted, 8.0, ["reaction", "coupling_force", "coupling_input_force", "drive_torque"])],
)
def test_slow_motion_tends_to_statics(driven, until, names):
    """Order of convergence: the forces of a run differ from those at rest with the square of its speed."""
    still, differences = sd.statics(driven(1.0), until=until, points=25), []
    for speed in (0.2, 0.1):
        run = sd.simulate(driven(speed), until=until / speed, samples=25)
        differences.append([np.abs(run[name].values - still[name].values).max() for name in names])
    np.testing.assert_allclose(np.log2(np.divide(*differences)), 2.0, atol=0.02)


def test_modes_along_the_motion():
    """Closed form: a wheel on a spring behind a gear that turns several times oscillates as at the start."""
    pair, third = gears(-3.0), wheel("third", place=(0.15, 0.0))
    shaft = sd.TorsionSpring("shaft", "third", base="wheel", stiffness=4.0)
    driven = dataclasses.replace(
        pair,
        bodies=(*pair.bodies, third),
        joints=(*pair.joints, sd.Revolute("C", ("third", "c"), ("ground", "P"))),
        components=(shaft,),
    ).driven(speed=1.0, body="pinion")
    modes = sd.modes(driven, times=[2.0, 5.0])
    np.testing.assert_allclose(modes["angular_frequency"].values[:, 0], math.sqrt(4.0 / 0.01), rtol=1e-12)
    np.testing.assert_allclose(modes["angle"].sel(body="third"), [-6.0, -15.0], atol=1e-9)


def test_a_mechanism_without_joints():
    """A weight on a rod that a drive lengthens."""
    ball = sd.Body("ball", mass=2.0, inertia=1e-3, points={"eye": (0.0, 0.0)})
    hoist = sd.Rod("hoist", ("ball", "eye"), ("ground", "hook"), motion=sd.Cycloidal(1.0, 1.2, 1.0))
    hanging = sd.Mechanism((ball,), rods=(hoist,), ground=(("hook", (0.0, 1.0)),))
    still = sd.statics(hanging, until=1.0, points=5)
    np.testing.assert_allclose(still["rod_force"].values, 2.0 * G, rtol=1e-12)
    assert still["quantity"].values.tolist() == ["rod force hoist"]


def swinging(*components, motion):
    """Return a bar without weight on a pin, driven, with components."""
    bar = sd.Body("bar", 1.0, 0.1, {"start": (0.0, 0.0), "end": (1.0, 0.0)}, centre=(0.0, 0.0), position=(0.0, 0.0))
    held = sd.Mechanism(
        (bar,),
        (sd.Revolute("pin", ("bar", "start"), ("ground", "origin")),),
        ground=(("origin", (0.0, 0.0)), ("wall", (1.0, 1.0))),
        components=components,
    )
    return held.driven(motion, body="bar")


def test_a_tape_spring_stays_folded_until_it_snaps_back():
    """Closed form: on the way back the fold keeps its moment below the snap, down to the angle of the same straight moment."""
    tape = sd.TapeSpring(
        "tape",
        "bar",
        stiffness=20.0,
        peak_moment=4.0,
        steady_moment=1.0,
        peak_moment_equal=2.0,
        steady_moment_equal=0.5,
    )
    found = sd.statics(swinging(tape, motion=sd.Harmonic(0.0, 0.6, 2.0 * math.pi)), until=1.0, points=41)
    folded, wanted = 0, []
    for angle in found["input"].values[:, 0].tolist():
        snapped, held = angle > 0.2 or angle < -0.1, folded and folded * angle > (0.05 if folded > 0 else 0.025)
        folded = int(math.copysign(1, angle)) if snapped or held else 0
        wanted.append(-20.0 * angle if not folded else -1.0 if folded > 0 else 0.5)
    np.testing.assert_allclose(found["tape_spring_torque"].values[:, 0], wanted, atol=1e-12)
    assert -float(found["least"].sel(quantity="tape spring torque tape")) == pytest.approx(20.0 * 0.6 * math.sin(0.1 * math.pi))
    assert "tape spring 'tape' snaps 4 times, first between 0.05 s and 0.075 s" in found.attrs["warnings"]


def test_extremes_of_a_cable_that_becomes_slack():
    """Limit: a cable carries tension only, also between the positions, and a smooth extreme is still located."""
    cable = sd.Cable("cable", ("bar", "end"), ("ground", "wall"), stiffness=300.0, free_length=0.8)
    found = sd.statics(swinging(cable, motion=sd.Polynomial((-1.0, 2.0))), until=1.0, points=21)
    forces = found.sel(quantity="cable force cable")
    assert float(forces["least"]) == 0.0
    spring = sd.Spring("spring", ("bar", "end"), ("ground", "wall"), stiffness=300.0, free_length=0.1)
    near = sd.statics(swinging(spring, motion=sd.Polynomial((-1.0, 2.0, 0.7))), until=1.0, points=81)
    # the end is nearest to the wall at 45 deg, between two positions
    assert near["spring_force"].values.min() > 300.0 * (math.sqrt(2.0) - 1.1) * (1.0 + 1e-4)
    assert float(near.sel(quantity="spring force spring")["least"]) == pytest.approx(300.0 * (math.sqrt(2.0) - 1.1), rel=1e-5)


def test_a_latch_that_would_lock_is_named():
    """Contract: a bar hangs from a driven one and passes the angle of its latch; positions before it say nothing."""
    hanging = chain(*(sd.bar(name, length=1.0, mass=1.0, angle=angle) for name, angle in (("arm", 0.0), ("rod", -math.pi / 2))))
    latch = sd.Latch("latch", "rod", -math.pi / 2 - 0.3, base="arm")
    hanging = dataclasses.replace(hanging, gravity=G, latches=(latch,)).driven(sd.Polynomial((0.0, 0.5)), body="arm")
    said = "latch 'latch' locks between 0.5 s and 0.75 s: forces after it are those of an open latch"
    assert said in sd.statics(hanging, until=2.0, points=9).attrs["warnings"]
    assert "latch" not in sd.statics(hanging, until=0.5, points=3).attrs["warnings"]
