"""Teeth, belts and screws of couplings: where their force acts, its share in bearings and friction, and moving centres."""

import dataclasses
import json
import math

import numpy as np
import pytest
from tests.build import ORIGIN, gears, planetary, warnings_of, wheel

import scissordyn as sd
from reference.balance import Balance

ANGLE, FREE = sd.RelativeAngle, sd.NoFriction()  # Short names of the coordinate class and of the law without friction
LOAD, APART = 30.0, 0.15  # Torque on the wheel [N m] and distance of the centres [m]
PRESSURE_ANGLE = math.radians(20.0)  # [rad] pressure angle
ELASTIC = sd.Clearance(1e-4, damping=sd.Flores(1.0), friction=FREE)  # Clearance without energy losses


def pair(ratio, transmission, *parts, load=LOAD):
    """Return two wheels on the ground: a pinion driven at constant speed, and a loaded wheel."""
    loaded = gears(ratio, sd.Torque("load", "wheel", torque=load), *parts, apart=APART, transmission=transmission)
    return loaded.driven(speed=5.0, body="pinion")


def relation(mechanism):
    """Return the mechanism with couplings without teeth, belts and screws."""
    return dataclasses.replace(
        mechanism, couplings=tuple(dataclasses.replace(part, transmission=None) for part in mechanism.couplings)
    )


def last(run, variable, **where):
    """Return a vector at the last sample."""
    return np.asarray(run[variable].sel(where).values[-1])


@pytest.mark.parametrize("angle", [0.0, PRESSURE_ANGLE])
@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_bearings_of_gears(angle, load):
    """Closed form: F = T/r along the teeth and F tan(a) across, apart for an external pair, on both bearings."""
    run = sd.simulate(pair(-0.5, sd.Teeth(angle), load=load), until=0.1, samples=3)
    force = load / 0.1
    assert last(run, "reaction", joint="B") == pytest.approx([-abs(force) * math.tan(angle), -force], abs=1e-9)
    assert last(run, "reaction", joint="A") == pytest.approx([abs(force) * math.tan(angle), force], abs=1e-9)
    assert last(run, "coupling_transmitted_point", coupling="mesh") == pytest.approx([0.05, 0.0], abs=1e-12)
    assert run["joint_peak_force"].values == pytest.approx(2 * [LOAD / 0.1 / math.cos(angle)])


@pytest.mark.parametrize("ratio", [-0.5, -2.0, 0.5, 2.0, 0.2])
@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_teeth_push(ratio, load):
    """Identity: the force makes the pressure angle with the path of the pitch point and points into external teeth."""
    run = sd.simulate(pair(ratio, sd.Teeth(PRESSURE_ANGLE), load=load), until=0.1, samples=3)
    force, point = (last(run, f"coupling_transmitted_{name}", coupling="mesh") for name in ("force", "point"))
    assert abs(force[1]) / np.linalg.norm(force) == pytest.approx(math.cos(PRESSURE_ANGLE))
    speeds = last(run, "angular_velocity")
    assert speeds[0] * point[0] == pytest.approx(speeds[1] * (point[0] - APART))  # both wheels have one velocity there
    outside = ratio < 0.0
    on_wheel = force if outside or ratio > 1.0 else -force  # of an internal pair the smaller wheel has external teeth
    centre = APART if outside or ratio > 1.0 else 0.0
    assert on_wheel[0] * (centre - point[0]) > 0.0
    assert (point[0] - 0.0) * (-force[1]) == pytest.approx(0.5 * 0.0 - last(run, "drive_torque"), rel=1e-9)


def test_friction_of_a_geared_bearing():
    """Closed form: F r cos(a) = T + M with M = R sin(phi) F, so that the pin rubs by what the teeth press on it."""
    radius, kinetic = 0.015, 0.15
    arm = radius * math.sin(math.atan(kinetic))
    for angle in (0.0, PRESSURE_ANGLE):
        rubbing = pair(-0.5, sd.Teeth(angle), sd.PinFriction("f", "wheel", radius, kinetic))
        run = sd.simulate(rubbing, until=0.1, samples=3)
        force = LOAD / (0.1 * math.cos(angle) - arm)
        assert np.linalg.norm(last(run, "reaction", joint="B")) == pytest.approx(force, rel=1e-6)
        assert last(run, "pin_friction_torque") == pytest.approx([arm * force], rel=1e-6)
        assert max(Balance(run, rubbing).residual()) < 1e-12


def test_statics_and_largest_force():
    """Cross-check: without inertia the bearings carry what a run at constant speed says, in the same words."""
    mechanism = pair(-0.5, sd.Teeth(PRESSURE_ANGLE))
    forces = sd.statics(mechanism, until=0.1, points=3)
    named = dict(zip(forces["quantity"].values.tolist(), forces["largest"].values.tolist(), strict=True))
    assert named["reaction A"] == pytest.approx(LOAD / 0.1 / math.cos(PRESSURE_ANGLE))
    assert named["coupling transmitted force mesh"] == pytest.approx(LOAD / 0.1 / math.cos(PRESSURE_ANGLE))
    assert "319.3 N at ideal joint" in str(sd.simulate(mechanism, until=0.1).scissordyn.summary())


def test_belts():
    """Closed form: tight and slack side along the common tangents, their difference T/r, their sum that of the pretension."""
    radius = 0.05
    for ratio, pretension in ((0.5, 0.0), (0.5, 500.0), (1.0, 0.0), (-0.5, 400.0), (2.0, 0.0)):
        mechanism = pair(ratio, sd.Belt(radius, pretension))
        run = sd.simulate(mechanism, until=0.1, samples=3)
        other = abs(ratio) * radius
        difference, both = LOAD / radius, max(2.0 * pretension, LOAD / radius)
        tight, slack = 0.5 * (both + difference), 0.5 * (both - difference)
        assert run["coupling_tight_tension"].values[-1, 0] == pytest.approx(tight)
        assert run["coupling_slack_tension"].values[-1, 0] == pytest.approx(slack, abs=1e-9)
        sine = (radius - other if ratio > 0.0 else radius + other) / APART
        cosine = math.sqrt(1.0 - sine * sine)
        # the load turns the wheel left, so that the belt pulls at its upper side, towards the pinion and its own tangent
        spans = np.array([[-cosine, sine], [-cosine, -sine]])
        pull = spans[1] * tight + spans[0] * slack if LOAD < 0.0 else spans[0] * tight + spans[1] * slack
        assert last(run, "reaction", joint="B") == pytest.approx(-pull, rel=1e-9)
        assert max(Balance(run, mechanism).residual()) < 1e-12


def rack(transmission, ratio=0.05):
    """Return a driven pinion above or below a horizontal rack that pulls 40 N."""
    bar = wheel("rack", 0.02, (0.1, -ratio), mass=2.0)
    return sd.Mechanism(
        bodies=(wheel("pinion", 0.001), bar),
        joints=(sd.Revolute("A", ("pinion", "c"), ("ground", "O")),),
        guides=(sd.Guide("bed", ("rack", "c"), through=(0.0, -ratio), aligned=True),),
        ground=ORIGIN,
        gravity=0.0,
        couplings=(sd.Coupling("teeth", sd.Slide(("rack", "c")), ANGLE("pinion"), ratio, transmission=transmission),),
        components=(sd.Force("pull", ("rack", "c"), (-40.0, 0.0)),),
    ).driven(speed=1.0, body="pinion")


@pytest.mark.parametrize("ratio", [0.05, -0.05])
def test_rack(ratio):
    """Closed form: the rack is pressed away from the pinion by F tan(a), at the pitch point, which its guide bears."""
    mechanism = rack(sd.Teeth(PRESSURE_ANGLE), ratio)
    run = sd.simulate(mechanism, until=0.1, samples=3)
    away = -math.copysign(1.0, ratio) * 40.0 * math.tan(PRESSURE_ANGLE)
    assert last(run, "coupling_transmitted_force", coupling="teeth") == pytest.approx([40.0, away])
    assert last(run, "coupling_transmitted_point", coupling="teeth") == pytest.approx([0.0, -ratio], abs=1e-12)
    assert last(run, "reaction", joint="bed") == pytest.approx([0.0, -away], abs=1e-9)
    assert last(run, "reaction", joint="A") == pytest.approx([40.0, away], abs=1e-9)
    along = float(run["position"].sel(body="rack", axis="x").values[-1])
    assert last(run, "reaction_moment", joint="bed") == pytest.approx(along * away, rel=1e-9)


def nut(transmission):
    """Return a nut in a guide, pushed back by 100 N, on the screw of a motor."""
    block = wheel("nut", 0.01, (0.2, 0.0), mass=2.0)
    return sd.Mechanism(
        bodies=(block, wheel("motor", 1e-4)),
        joints=(sd.Revolute("thrust", ("motor", "c"), ("ground", "O")),),
        guides=(sd.Guide("way", ("nut", "c"), aligned=True),),
        ground=ORIGIN,
        gravity=0.0,
        couplings=(sd.Coupling("screw", sd.Slide(("nut", "c")), ANGLE("motor"), 0.002, transmission=transmission),),
        components=(sd.Force("push", ("nut", "c"), (-100.0, 0.0)),),
    ).driven(speed=3.0, body="motor")


def test_screw():
    """Closed form: the thrust of the nut is borne by the bearing of the screw; as a relation it was borne by the base."""
    run, bare = (sd.simulate(nut(kind), until=0.1, samples=3) for kind in (sd.Screw(), None))
    assert last(run, "reaction", joint="thrust") == pytest.approx([100.0, 0.0], abs=1e-9)
    assert last(bare, "reaction", joint="thrust") == pytest.approx([0.0, 0.0], abs=1e-9)
    assert last(run, "drive_torque") == pytest.approx(0.2)
    assert max(Balance(run, nut(sd.Screw())).residual()) < 1e-12


def loaded_planetary(transmission):
    """Return a planetary gear whose sun is driven, with a load on its arm."""
    return planetary(sd.Torque("load", "arm", torque=-1.0), transmission=transmission).driven(speed=1.0, body="sun")


def test_planetary_gear():
    """Closed form: sun and ring push the planet alike, and its pin drives the arm: 2 F a = T, beside centripetal forces."""
    mechanism = loaded_planetary(sd.Teeth(PRESSURE_ANGLE))
    run = sd.simulate(mechanism, until=1.0, samples=11)
    force = 1.0 / (2.0 * 0.037)
    slow = 0.25 * 0.037 * (20.0 / 74.0) ** 2
    for sample in range(11):
        angle = float(run["angle"].sel(body="arm").values[sample])
        along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        pin = -run["reaction"].sel(joint="P").values[sample]  # on the arm
        assert pin @ across == pytest.approx(2.0 * force, rel=1e-9)
        # the sun presses the planet outwards and the ring inwards, by the same force
        assert pin @ along == pytest.approx(slow, rel=1e-6)
        inner, outer = run["coupling_transmitted_force"].values[sample]
        assert inner @ along == pytest.approx(force * math.tan(PRESSURE_ANGLE), rel=1e-9)
        assert outer @ along == pytest.approx(-force * math.tan(PRESSURE_ANGLE), rel=1e-9)
    assert max(Balance(run, mechanism).residual()) < 1e-12


def train(seed, *, gravity=9.81):
    """Return a carriage in an aligned guide with coupled wheels or a rack, a welded crank, a loose pendulum and springs."""
    random = np.random.default_rng(seed)
    turn, size, kind = float(random.uniform(-3.0, 3.0)), float(random.uniform(0.05, 0.5)), seed % 6
    x, y = (random.uniform(0.4, 1.0, 2) * size).tolist()
    place = lambda px, py: (  # noqa: E731
        px * math.cos(turn) - py * math.sin(turn),
        px * math.sin(turn) + py * math.cos(turn),
    )
    carriage = sd.Body(
        "carriage", mass=3.0, inertia=0.05, points={"c": (0.0, 0.0), "O": (0.1 * size, 0.0), "P": (x, y)}, position=(0.0, 0.0),
        angle=turn, centre=(0.2 * size, 0.1 * size),
    )  # fmt: skip
    near, far = place(0.1 * size, 0.0), place(x, y)
    second = sd.Body(
        "second", mass=1.3, inertia=0.02 * size**2, points={"c": (0.0, 0.0), "e": (size, 0.0)}, position=far,
        angle=float(random.uniform(-1.0, 1.0)) if kind < 4 else turn,
    )  # fmt: skip
    arm = sd.bar("crank", length=size, mass=0.8, position=second.place("e"), angle=0.3)
    hanging = sd.bar("pendulum", length=0.7 * size, mass=0.5, position=arm.place("end"), angle=-1.2)
    pressed = sd.Teeth(float(random.uniform(0.0, 0.5)))
    ratio = float(random.uniform(0.3, 3.0)) + 0.07
    angles = ANGLE("second", "carriage"), ANGLE("first", "carriage")
    slide = sd.Slide(("second", "c"), 0.4, "carriage")
    apart = math.dist((0.1 * size, 0.0), (x, y))
    made = [
        sd.Coupling("mesh", *angles, -ratio, transmission=pressed),
        sd.Coupling("mesh", *angles, ratio if abs(ratio - 1.0) > 0.05 else 1.5, transmission=pressed),
        sd.Coupling("mesh", *angles, ratio, transmission=sd.Belt(0.3 * apart / max(1.0, ratio), float(random.uniform(0, 50)))),
        sd.Coupling("mesh", *angles, -ratio, transmission=sd.Belt(0.3 * apart / max(1.0, ratio))),
        sd.Coupling("mesh", slide, angles[1], 0.2 * size * float(random.choice((-1.0, 1.0))), transmission=pressed),
        sd.Coupling("mesh", angles[1], slide, 5.0 / size, transmission=pressed),
    ][kind]
    guided = kind > 3
    way = sd.Guide("way", ("second", "c"), (x, y), 0.4, "carriage", aligned=True)
    return sd.Mechanism(
        bodies=(carriage, wheel("first", 0.01 * size**2, near), second, arm, hanging),
        joints=(
            sd.Revolute("first pin", ("first", "c"), ("carriage", "O")),
            *(() if guided else (sd.Revolute("second pin", ("second", "c"), ("carriage", "P")),)),
            sd.Revolute("loose", ("pendulum", "start"), ("crank", "end"), sd.Clearance(1e-3 * size, friction=sd.LuGre(0.1))),
        ),
        guides=(sd.Guide("rail", ("carriage", "c"), direction=turn + 0.3, aligned=True), *((way,) if guided else ())),
        welds=(sd.Weld("root", ("crank", "start"), ("second", "e")),),
        ground=(("H", (0.0, size)),),
        gravity=gravity,
        components=(
            sd.Spring("spring", ("ground", "H"), ("carriage", "c"), stiffness=200.0 / size, damping=1.0),
            sd.Torque("load", "first", torque=2.0 * size, base="carriage"),
            sd.PinFriction("rub", "first", 0.05 * size, 0.2, "carriage"),
        ),
        couplings=(made,),
    )


def test_newton_for_trains_on_carriages():
    """Identity: every body's balance from reported forces alone, with welds, aligned guides, friction, contact, couplings."""
    for seed in range(18):
        mechanism = train(seed)
        run = sd.simulate(mechanism, until=0.05, samples=11)
        assert run.attrs["status"] == "complete"
        assert max(Balance(run, mechanism).residual()) < 1e-8, seed


def test_the_motion_is_that_of_the_relation():
    """Identity: without friction and clearance teeth, belts and screws change forces, and no motion by a bit."""
    made = [pair(-0.5, sd.Teeth()), pair(0.5, sd.Belt(0.05)), rack(sd.Teeth()), nut(sd.Screw()), loaded_planetary(sd.Teeth())]
    for mechanism in made:
        runs = [sd.simulate(each, until=0.3, samples=31) for each in (mechanism, relation(mechanism))]
        for name in ("position", "angle", "angular_velocity", "drive_torque", "coupling_force"):
            np.testing.assert_array_equal(*(run[name].values for run in runs))


# Functions that build a mechanism with a loose bearing, and its ideal mechanism, and the joint, by name
LOOSE = {
    "wheel": (
        lambda: pair(-0.5, sd.Teeth(PRESSURE_ANGLE, flank="backward")),
        lambda: pair(-0.5, sd.Teeth(PRESSURE_ANGLE)),
        "B",
    ),
    "ring": (lambda: pair(0.5, sd.Teeth(PRESSURE_ANGLE, flank="backward")), lambda: pair(0.5, sd.Teeth(PRESSURE_ANGLE)), "A"),
    "pinion on a rack": (lambda: rack(sd.Teeth(PRESSURE_ANGLE, flank="forward")), lambda: rack(sd.Teeth(PRESSURE_ANGLE)), "A"),
    "planet": (lambda: loaded_planetary(sd.Teeth(0.0)), lambda: loaded_planetary(sd.Teeth(0.0)), "P"),
}


@pytest.mark.parametrize("name", LOOSE)
def test_teeth_over_loose_bearings(name):
    """Limit: elastic contacts keep the energy, bodies their balance, and the mean force is that of an ideal bearing."""
    make, ideal, joint = LOOSE[name]
    mechanism = make().with_clearance(joint, ELASTIC)
    run, reference = sd.simulate(mechanism, until=0.3, samples=6001), sd.simulate(ideal(), until=0.3, samples=11)
    assert max(Balance(run, mechanism).residual()) < 1e-9
    assert np.abs(run["energy_residual"].values).max() < 1e-7
    mean = run["reaction"].sel(joint=joint).mean("time").values
    exact = reference["reaction"].sel(joint=joint).mean("time").values
    assert mean == pytest.approx(exact, abs=0.03 * np.linalg.norm(exact))


def test_teeth_on_a_bar_that_bends():
    """Limit: a stiff arm that bends carries its planet as a rigid one; the pressure is in its internal forces."""
    arm = sd.bar("arm", length=0.4, mass=0.5, position=(0.0, 0.0), angle=0.0)
    rigid = sd.Mechanism(
        bodies=(wheel("sun"), arm, wheel("planet", 0.007, (0.4, 0.0))),
        joints=(
            sd.Revolute("S", ("sun", "c"), ("ground", "O")),
            sd.Revolute("A", ("arm", "start"), ("ground", "O")),
            sd.Revolute("P", ("planet", "c"), ("arm", "end")),
        ),
        ground=ORIGIN,
        gravity=0.0,
        components=(sd.Torque("load", "planet", torque=-5.0),),
        couplings=(
            sd.Coupling("mesh", ANGLE("planet", "arm"), ANGLE("sun", "arm"), -1.0, transmission=sd.Teeth(flank="forward")),
        ),
    ).driven(speed=1.0, body="sun")
    bent = sd.with_bending(rigid, "arm", bending_stiffness=200.0, axial_stiffness=1e7, modes=2, damping=1e-3)
    run, exact = (sd.simulate(each, until=0.2, samples=5) for each in (bent, rigid))
    size = np.linalg.norm(last(exact, "reaction", joint="P"))
    assert last(run, "reaction", joint="P") == pytest.approx(last(exact, "reaction", joint="P"), abs=2e-3 * size)
    along = float(last(exact, "angle")[1])
    pressure = -float(last(exact, "reaction", joint="P") @ np.array([math.cos(along), math.sin(along)]))
    axial = sd.internal_forces(run, bent, places=[1.0])["axial_force"].values[-1, 0, 0]
    assert axial == pytest.approx(pressure, rel=2e-2)


def test_backlash_and_teeth():
    """Contract: after the flanks have come to rest on each other the bearings carry what those without backlash do."""
    for load in (LOAD, -LOAD):
        rigid = pair(-0.5, sd.Teeth(PRESSURE_ANGLE), load=load)
        loose = sd.with_backlash(rigid, "mesh", sd.degrees(0.5), restitution=0.1)
        run = sd.simulate(loose, until=0.5, samples=101)
        assert max(Balance(run, loose).residual()) < 1e-9
        for joint in "AB":
            exact = last(sd.simulate(rigid, until=0.1, samples=3), "reaction", joint=joint)
            assert last(run, "reaction", joint=joint) == pytest.approx(exact, rel=1e-3)


def meshed(pinion, driven, drive):
    bodies = tuple(
        dataclasses.replace(body, angular_velocity=speed)
        for body, speed in zip(pair(-0.4, None).bodies, (pinion, driven), strict=True)
    )
    mechanism = dataclasses.replace(pair(-0.4, None, load=0.0), bodies=bodies, drives=())
    return mechanism if drive is None else mechanism.driven(speed=drive, body="pinion")


@pytest.mark.parametrize(
    ("pinion", "driven", "drive"),
    [(4.0, 0.0, None), (4.0, -1.6, None), (0.0, 3.0, None), (None, 3.0, None), (4.0, None, None), (None, 0.0, 4.0)],
)
def test_speeds_of_a_backlash(pinion, driven, drive):
    """Contract: both wheels start with the speeds given, the flanks with that of the pinion, and nothing contradicts them."""
    run = sd.simulate(sd.with_backlash(meshed(pinion, driven, drive), "mesh", 0.02), until=1e-3, samples=3)
    speed = pinion or drive or 0.0
    assert run["angular_velocity"].values[0] == pytest.approx([speed, driven or 0.0, -0.4 * speed])
    assert [data["kind"] for data in json.loads(run.attrs["warning_data"])] == ["unseen force"]


def test_the_bearing_carries_wheel_and_flanks():
    """Closed form: the weight of the wheel is on its bearing, whatever part of it moves with the flanks."""
    heavy = dataclasses.replace(pair(-0.4, None, load=0.0), gravity=9.81)
    mechanism = sd.with_backlash(heavy, "mesh", 0.02, share=0.3)
    run = sd.simulate(mechanism, until=1e-3, samples=3)
    assert last(run, "reaction", joint="B") == pytest.approx([0.0, 9.81])


@pytest.mark.parametrize(
    ("make", "line"),
    [
        (lambda: pair(-0.5, sd.Teeth(radius=0.09)), r"radius = 0\.09 m, but centres 0\.15 m apart make 0\.1 m"),
        (lambda: pair(0.5, sd.Belt(0.5)), r"no open belt over radii 0\.5 and 0\.25 m with centres 0\.15 m apart"),
        (lambda: pair(1.0, sd.Teeth()), "teeth with ratio = 1"),
        (lambda: pair(-0.5, sd.Teeth(output_centre="x")), r"output_centre = 'x'.* a point of 'wheel'"),
        (lambda: pair(-0.5, sd.Teeth()).with_clearance("B", ELASTIC), "need the loaded flank"),
        (lambda: pair(-0.5, sd.Belt(0.05)).with_clearance("B", ELASTIC), "the bearings of a belt move relative to its base"),
        (lambda: pair(-0.5, sd.Teeth(flank="left")), "flank = 'left'"),
        (lambda: pair(-0.5, sd.Screw()), "screw cannot connect these coordinates"),
        (lambda: nut(sd.Belt(0.1)), "belt cannot connect these coordinates; expected two angles"),
        (
            lambda: dataclasses.replace(nut(sd.Screw()), ground=(("O", (0.0, 0.1)),)),
            r"misses the thrust bearing of the screw by 0\.1 m",
        ),
    ],
)
def test_bad_input(make, line):
    """Contract: one line that says what came and what is allowed."""
    with pytest.raises(sd.InputError, match=line):
        sd.simulate(make(), until=0.01)


def test_a_flank_that_pulls_is_named():
    """Contract: a run whose load is on the other flank than the one given says so."""
    pulled = pair(-0.5, sd.Teeth(flank="forward")).with_clearance("B", ELASTIC)
    assert any("the given flank pulls" in line for line in warnings_of(sd.simulate(pulled, until=0.05)))


def test_case_file_and_words(tmp_path, answer):
    """Contract: files hold teeth, belts, screws and backlash; check, run and statics say where no force acts."""
    made = [
        pair(-0.5, sd.Teeth()),
        pair(-0.5, sd.Teeth(0.0, radius=0.1, flank="forward")),
        pair(0.5, sd.Belt(0.05, 100.0)),
        nut(sd.Screw("c")),
        sd.with_backlash(pair(-0.5, sd.Teeth(0.3, output_centre="c")), "mesh", 0.01),
    ]
    for number, mechanism in enumerate(made):
        assert sd.read_case(sd.write_case(mechanism, tmp_path / f"{number}.toml")).mechanism == mechanism
    words = "bearings carry the torques of this coupling, but not its force"
    said = answer("check", tmp_path / "0.toml")
    assert words not in said
    assert "in opposite senses, teeth with a pressure angle of 20 deg." in said
    path = sd.write_case(relation(made[0]), tmp_path / "relation.toml")
    for command in ("check", "run", "statics"):
        assert words in answer(command, path), command
