"""Joint forces balance the motion of bodies, speeds agree with accelerations, and largest forces are consistent."""

import dataclasses

import numpy as np
import pytest
from benchmarks.random_cases import random_case
from tests.build import EXAMPLES, in_bearing

import scissordyn as sd
from reference.balance import Balance, rotated
from scissordyn.casefile.configuration import read_configuration
from scissordyn.record.joint_force import START_DURATION, force_after_start, joint_summaries
from scissordyn.record.summary import summary_of

OIL = sd.Clearance(4e-4, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=0.1))  # Clearance with an oil film
# Clearance with an oil film and friction
RUBBED = sd.Clearance(4e-4, friction=sd.LuGre(0.1), lubrication=sd.Lubrication(viscosity=0.02))
DRY = sd.Clearance(4e-4, friction=sd.LuGre(0.1))  # Clearance with friction


def array(units=2, **clearances):
    """Return an array with clearances at named joints."""
    made = sd.scissor(units=units)
    for name, clearance in clearances.items():
        made = made.with_clearance(name, clearance)
    return made.driven(speed=sd.rpm(150))


def sprung(clearance):
    """Return a slider-crank with a spring and a bushing next to its loose pin."""
    made = sd.slider_crank(gravity=9.81).with_clearance("slider pin", clearance)
    parts = (
        sd.Spring("spring", ("ground", "origin"), ("rod", "end"), stiffness=400.0, free_length=0.1, damping=2.0),
        sd.Bushing(
            "mount",
            ("rod", "end"),
            ("slider", "centre"),
            stiffness_x=1e4,
            stiffness_y=2e4,
            torsional_damping=1e-3,
            damping_x=5.0,
        ),
    )
    return dataclasses.replace(made, components=parts).driven(speed=50.0)


def bent(where, clearance):
    """Return an array of tubes."""
    arm = sd.scissor(units=2).with_clearance(where, clearance)
    return sd.with_bending(arm, section="tube 60x60x1.56 mm", material="steel", modes=6).driven(speed=sd.rpm(150))


# Functions that build a mechanism, and the end of its run [s], by name
CASES = {
    "dry": (lambda: array(A=DRY), 0.01),
    "oiled": (lambda: array(A=OIL), 0.05),
    "oiled, rubbing": (lambda: array(A=RUBBED), 0.02),
    "springs": (lambda: sprung(DRY), 0.05),
    "springs and oil": (lambda: sprung(RUBBED), 0.05),
    "hard contact": (lambda: array(A=sd.Clearance(4e-4, contact="hard")), 0.01),
    "bars that bend": (lambda: bent("A", DRY), 0.003),
    "bars that bend, oiled, rubbing": (lambda: bent("A", RUBBED), 0.001),
    "bars that bend, an oiled pivot": (lambda: bent("unit 1/pivot", OIL), 0.001),
}


@pytest.mark.parametrize("name", CASES)
def test_forces_balance_the_motion(name):
    """Identity: m a and J alpha of each body are the sum of the reported forces and moments, to rounding."""
    make, until = CASES[name]
    mechanism = make()
    run = sd.simulate(mechanism, until=until, samples=201 if "bend" not in name else 41)
    force, moment = Balance(run, mechanism).residual()
    assert force < 1e-8
    # a torque on the slope of a bar counts (1 + e)^2 times, with the axial strain e
    assert moment < (1e-7 if "bend" in name else 1e-8)


def test_forces_of_random_mechanisms():
    """Identity: forces balance the motion with any laws, components, drives, controllers, rods and latches."""
    for seed in range(40):
        case = random_case(seed)
        run = sd.simulate(case.mechanism, until=case.until, start=case.start, samples=21, most_steps=20_000)
        assert max(Balance(run, case.mechanism).residual()) < 1e-8, seed


def test_rods_and_latches_among_the_components_act():
    """Contract: rods and latches given as components become those of the mechanism."""
    beam = sd.bar("beam", length=1.0, mass=2.0, angle=-0.5, position=(0.1, 0.0))
    rods = sd.Rod("rod", ("ground", "O"), ("beam", "start")), sd.Latch("latch", "beam", -1.0)
    mechanism = sd.Mechanism((beam,), ground=(("O", (0.0, 0.0)),), components=rods)
    assert (mechanism.components, mechanism.rods, mechanism.latches) == ((), rods[:1], rods[1:])
    run = sd.simulate(mechanism, until=0.2, samples=21)
    ends = Balance(run, mechanism).at("beam", "start")
    np.testing.assert_allclose(np.linalg.norm(ends, axis=1), 0.1, rtol=1e-9)
    assert max(Balance(run, mechanism).residual()) < 1e-10


@pytest.fixture(scope="module")
def stroke():
    mechanism = array(A=OIL)
    return mechanism, sd.simulate(mechanism, until=0.05, samples="auto")


def test_largest_force_of_an_oiled_joint(stroke):
    """Cross-check: the located peak is the size of metal and film force together at its instant."""
    mechanism, run = stroke
    film = rotated(run["film_force"].sel(film="A").values, run["angle"].sel(body=mechanism.joint("A").bearing[0]).values)
    normal, (ex, ey) = run["normal_force"].sel(joint="A").values, run["eccentricity"].sel(joint="A").values.T
    away = np.hypot(ex, ey)
    size = np.hypot(*(film - (normal / np.where(away > 0.0, away, 1.0))[:, None] * np.stack([ex, ey], axis=1)).T)
    peak, metal = float(run["joint_peak_force"].sel(joint="A")), float(run["peak_force"].max())
    assert peak == pytest.approx(float(size.max()), rel=1e-6)
    assert peak > 20.0 * metal
    assert float(run["film_peak_force"].max()) == pytest.approx(peak, rel=0.05)
    answer = summary_of(run).force.loose
    assert (answer.force, answer.metal) == (peak, metal)
    assert "its film alone" in str(answer)


def test_forces_of_an_oiled_joint_agree(stroke):
    """Contract: measures of batches, the table of joints and envelopes agree with the run."""
    mechanism, run = stroke
    peak = float(run["joint_peak_force"].sel(joint="A"))
    batch = sd.simulate_many(mechanism, {"A.clearance": [4e-4]}, until=0.05, measures=("peak_force",))
    assert float(batch["peak_force"].sel(joint="A").item()) == pytest.approx(peak, rel=1e-12)
    whole = float(np.nanmax(run["joint_peak_force"].values))
    assert float(batch["peak_force"].max()) == pytest.approx(whole, rel=1e-3)
    assert [joint.largest for joint in joint_summaries(run)] == [peak]
    forces = sd.pin_forces(run, mechanism)
    at_joint = forces["end_joint"].values == "A"
    size = np.linalg.norm(forces["force"].values[:, at_joint], axis=2)
    assert size.max() == pytest.approx(peak, rel=1e-6)
    assert np.all(forces["located_peak"].values[at_joint] == peak)
    assert np.abs(forces["other_force"].values).max() < 1e-8 * peak


def test_largest_force_of_a_film():
    """Limit: a joint whose metal never touches has the force of its film."""
    run = sd.simulate(array(A=OIL), until=2e-4, samples=21)
    assert run.sizes["contact"] == 0
    answer = summary_of(run).force.loose
    assert answer.force == pytest.approx(float(run["film_peak_force"].max()), rel=1e-12)
    assert answer.metal == 0.0
    assert not answer.estimated


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_largest_force_of_a_dry_joint(method):
    """Cross-check: the located peak is the size of the reaction, with friction, at its instant, in all answers."""
    mechanism = array(A=DRY)
    run = sd.simulate(mechanism, until=0.01, samples="auto", method=method)
    size = np.hypot(*run["reaction"].sel(joint="A").values.T)
    peak, normal = run["peak_force"].values, run["peak_normal_force"].values
    for start, when, force in zip(run["contact_start"].values, run["peak_time"].values, peak, strict=True):
        assert force == pytest.approx(size[np.argmin(np.abs(run["time"].values - start - when))], rel=1e-6)
    assert np.all(peak >= normal)
    assert peak.max() > 1.004 * normal.max()
    assert peak.max() == pytest.approx(size.max(), rel=1e-9)
    assert summary_of(run).force.loose.force == peak.max()
    batch = sd.simulate_many(mechanism, {"A.clearance": [4e-4]}, until=0.01, measures=("peak_force",), method=method)
    assert float(batch["peak_force"].sel(joint="A").item()) == peak.max()
    located = sd.pin_forces(run, mechanism)["located_peak"]
    assert np.all(located.values[located["end_joint"].values == "A"] == peak.max())


def loose_four_bar():
    """Return a four-bar with two oiled pins, of which an ideal pin carries most."""
    oiled = sd.Clearance(2e-4, friction=sd.LuGre(0.1), lubrication=sd.Lubrication(viscosity=0.05))
    sizes = {"ground": 0.5, "crank": 0.15, "coupler": 0.5, "rocker": 0.35}
    bars = sd.four_bar(**sizes, crank_mass=0.7, coupler_mass=1.3, rocker_mass=0.9, angle=1.0)
    return bars.with_clearance(["crank pin", "rocker pin"], oiled).driven(speed=20.0)


def welded():
    """Return a foot in an aligned guide with a bar welded to it, loaded at its end."""
    arm = sd.bar("arm", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.0)
    foot = sd.Body("foot", mass=1.0, inertia=0.1, points={"c": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    return sd.Mechanism(
        bodies=(foot, arm),
        guides=(sd.Guide("rail", ("foot", "c"), direction=np.pi / 2, aligned=True),),
        welds=(sd.Weld("root", ("arm", "start"), ("foot", "c")),),
        gravity=0.0,
        components=(sd.Force("load", ("arm", "end"), (0.0, -100.0)),),
        coordinate_drives=(sd.CoordinateDrive("lift", sd.Slide(("foot", "c"), np.pi / 2), sd.Cycloidal(0.0, 0.1, 1.0)),),
    )


def test_weld_to_a_point_mass_is_refused():
    """Contract: a point mass cannot carry a moment."""
    parts = (
        sd.bar("bar", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.0),
        sd.point_mass("tip", mass=1.0, position=(1.0, 0.0)),
    )
    weld = sd.Weld("tip weld", ("bar", "end"), ("tip", "centre"))
    with pytest.raises(sd.InputError, match="weld 'tip weld' fixes body 'bar' to body 'tip', which has no inertia"):
        sd.Mechanism(parts, welds=(weld,))


# Function that builds a mechanism, end of the run [s], and kind of the joint with the largest force
LARGEST = {
    "ideal pin beside oiled ones": (loose_four_bar, 0.02, "ideal joint"),
    "guide beside a loose pin": (lambda: sprung(DRY).ideal("slider pin").with_clearance("ground pin", DRY), 0.01, ""),
    "no clearance at all": (lambda: sd.slider_crank(gravity=9.81).driven(speed=20.0), 0.1, "ideal joint"),
    "weld": (welded, 1.0, "weld"),
    "bars that bend": (lambda: bent("A", DRY), 0.002, ""),
}


@pytest.mark.parametrize("name", LARGEST)
def test_no_joint_transmits_more_than_the_largest_force(name):
    """Identity: the largest force of a run is that of all joints, guides and welds, and no sample exceeds it."""
    make, until, kind = LARGEST[name]
    run = sd.simulate(make(), until=until, samples="auto")
    sizes = {}
    for dim, force in (("joint", "reaction"), ("weld", "weld_force")):
        if force in run:
            largest = np.nanmax(np.linalg.norm(run[force].values, axis=2), axis=0)
            sizes |= dict(zip(run[dim].values.tolist(), largest.tolist(), strict=True))
    answer = summary_of(run).force
    assert answer.force == pytest.approx(max(sizes.values()), rel=1e-9)
    assert answer.force == pytest.approx(sizes[answer.joint], rel=1e-9)
    assert not kind or answer.kind == kind
    assert f"at {answer.kind} {answer.joint}" in str(answer)


def test_impacts_of_a_loose_joint_pass_through_ideal_ones():
    """Contract: the largest force of an ideal joint includes impacts between samples, also in batches."""
    mechanism = sd.slider_crank().with_clearance("slider pin", sd.Clearance(5e-4)).driven(speed=50.0)
    few, dense = (sd.simulate(mechanism, until=0.02, samples=samples) for samples in (21, "auto"))
    sampled, located, exact = (
        np.linalg.norm(few["reaction"].sel(joint="ground pin"), axis=1).max(),
        float(few["joint_peak_force"].sel(joint="ground pin")),
        np.linalg.norm(dense["reaction"].sel(joint="ground pin"), axis=1).max(),
    )
    assert sampled < 0.9 * exact
    assert located == pytest.approx(exact, rel=1e-3)
    batch = sd.simulate_many(mechanism, {"slider pin.clearance": [5e-4]}, until=0.02, measures=("peak_force", "peak_reaction"))
    assert batch["peak_reaction"].sel(transmitting="ground pin").item() == pytest.approx(exact, rel=1e-3)
    others = float(few["joint_peak_force"].drop_sel(joint="slider pin").max())
    assert batch["peak_force"].sel(joint="ideal joints").item() == pytest.approx(others, rel=1e-3)


GRAVITY, CLEARANCE = 9.81, 1e-4  # Gravity [m/s^2] and clearance [m]


@pytest.mark.parametrize("contact", ["compliant", "hard"])
def test_journal_that_falls_through_its_clearance(contact):
    """Closed form: the fall takes sqrt(2 c/g); twenty times later the force is the weight."""
    gap = sd.Clearance(CLEARANCE, damping=sd.Flores(0.5), contact=contact)
    hung = in_bearing(gap, mass=2.0)
    run = sd.simulate(hung, until=0.5, samples=2001)
    answer = summary_of(run).force
    assert answer.start == pytest.approx(START_DURATION * np.sqrt(2.0 * CLEARANCE / GRAVITY), rel=1e-6)
    assert answer.when < 2.0 * np.sqrt(2.0 * CLEARANCE / GRAVITY)
    assert answer.after == pytest.approx(2.0 * GRAVITY, rel=1e-2)
    assert "belongs to the start" in str(answer)
    assert read_configuration(run).options is not None
    assert force_after_start(run, "static", joint_summaries(run)[0]) is None
    short = summary_of(sd.simulate(hung, until=0.5 * answer.start, samples=101)).force
    assert short.after is None


def test_load_that_fades_after_the_start():
    """Limit: where the load fades within the start, the largest force is not attributed to the start."""
    hung = in_bearing(sd.Clearance(CLEARANCE, damping=sd.Flores(0.5)), mass=2.0)
    pull = sd.Force("pull", ("ball", "centre"), (0.0, -20.0), time_function=sd.Cycloidal(1.0, 0.1, 0.08))
    pulled = dataclasses.replace(hung, gravity=0.0, components=(pull,))
    answer = summary_of(sd.simulate(pulled, until=0.5, samples=2001)).force
    assert answer.when < START_DURATION * np.sqrt(2.0 * CLEARANCE * 2.0 / 20.0)
    assert answer.start is None


FILES = {path.stem: path for path in sorted(EXAMPLES.glob("*.toml"))}  # Case files of all examples by name

# Names of all examples and of all mechanisms of the zoo
NAMES = [*(f"example {name}" for name in FILES), *(f"zoo {name}" for name in sd.zoo)]

ALLOWED = 1e-3  # Largest change of speed over a sample that forces do not explain, as a fraction of the largest speed


def largest_jump(run, instants):
    """Return the change of velocities that accelerations do not explain, relative to the largest, except near `instants`.

    If an acceleration is monotone between two samples, the change of speed is between those of both ends.
    """
    time = run["time"].values
    quiet = np.histogram(instants, time)[0] == 0
    step, worst = np.diff(time)[quiet], 0.0
    for speed, rate in (("velocity", "acceleration"), ("angular_velocity", "angular_acceleration")):
        v, a = (run[name].transpose("time", ...).values.reshape(time.size, -1) for name in (speed, rate))
        change, mean, spread = np.diff(v, axis=0)[quiet], 0.5 * (a[1:] + a[:-1])[quiet], 0.5 * np.abs(np.diff(a, axis=0))[quiet]
        beyond = np.abs(change - step[:, None] * mean) - step[:, None] * spread
        worst = max(worst, float(np.nanmax(beyond, initial=0.0) / max(np.nanmax(np.abs(v), initial=0.0), 1e-12)))
    return worst


@pytest.mark.parametrize("name", NAMES)
def test_speeds_are_continuous(name):
    """Identity: speeds change as their accelerations say, except at listed events.

    Where bars vibrate between two samples the run is repeated with more: a jump of speed would stay.
    """
    kind, _, which = name.partition(" ")
    case = sd.read_case(FILES[which]) if kind == "example" else sd.zoo[which].case
    jump = np.inf
    for samples in (2001, 6001):
        run = sd.simulate(case.mechanism.ideal(), until=case.run.until, samples=samples)
        jump = largest_jump(run, run["event_time"].values if "event_time" in run else np.empty(0))
        if jump < ALLOWED:
            break
    assert jump < ALLOWED
