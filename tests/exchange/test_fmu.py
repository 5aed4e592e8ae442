"""Functional mock-up units against the package's own runs, in fmpy."""

from __future__ import annotations

import dataclasses
import functools
import io
import math
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from tests.build import chain, gears, one_line_error, wheel

import scissordyn as sd
from scissordyn.casefile.configuration import read_mechanism
from scissordyn.exchange.fmu import pack
from scissordyn.integrate.history import make_history
from scissordyn.run.advance import driver

fmpy = pytest.importorskip("fmpy")
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

LOOSE = sd.Clearance(5e-4, friction=sd.LuGre(kinetic=0.05))  # Clearance of the joints in exported mechanisms

# Flags with which compilers take a fifth of the time
QUICK = tuple("-O0" if flag == "-O2" else flag for flag in pack.COMPILER_FLAGS)


def crane():
    """Return an arm that a motor lifts by a screw between two points, with a tool that is driven against the arm."""
    bars = sd.bar("arm", length=0.6, mass=3.0, angle=0.5), sd.bar("tool", length=0.2, mass=0.5, angle=-0.4)
    nut = sd.Coupling("screw", sd.Distance(("ground", "P"), ("arm", "end")), sd.RelativeAngle("motor"), 0.002)
    elbow = sd.CoordinateDrive("elbow", sd.RelativeAngle("tool", "arm"), sd.Cycloidal(-0.9, 0.3, 0.4))
    arms = chain(*bars, pins="AT", ground={"P": (0.5, 0.0)})
    pin = sd.Revolute("M", ("motor", "c"), ("ground", "P"))
    parts = {"bodies": (*arms.bodies, wheel("motor", 1e-4, (0.5, 0.0))), "joints": (*arms.joints, pin)}
    return dataclasses.replace(arms, **parts, couplings=(nut,), coordinate_drives=(elbow,))


def rattling():
    """Return a wheel between the flanks of a driven pinion."""
    pair = gears(-0.5, inertia=(0.02, 0.02), apart=0.3).driven(speed=4.0, body="pinion")
    return sd.with_backlash(pair, "mesh", 0.02, stiffness=1e5, restitution=0.8)


# Mechanisms with clearance joints, and the ends of their runs [s], by name
CASES_WITH_CLEARANCE = {
    "crank": (sd.slider_crank().with_clearance("slider pin", LOOSE).driven(speed=100.0), 0.06),
    "arm": (sd.scissor(units=2).with_clearance("A", LOOSE).driven(sd.Cycloidal(sd.degrees(30), sd.degrees(60), 0.1)), 0.15),
    "servo": (
        sd.slider_crank()
        .with_clearance("crank pin", LOOSE)
        .controlled(sd.PID(50.0, 3.0, 20.0), reference=sd.Harmonic(0.3, 0.2, 10.0)),
        0.2,
    ),
    "delayed": (
        sd.slider_crank().with_clearance("slider pin", sd.Clearance(5e-4)).controlled(sd.Pyragas(5.0, 0.01), speed=100.0),
        0.03,
    ),
}
# Mechanisms with couplings and stops, and the ends of their runs [s], by name
CASES_WITHOUT_CLEARANCE = {"crane": (crane(), 0.4), "rattling": (rattling(), 0.1)}
CASES = CASES_WITH_CLEARANCE | CASES_WITHOUT_CLEARANCE
"""Mechanisms and the ends of their runs [s], by name."""

# Tolerances of the runs with which FMUs are compared, by name of the case
RUN_OPTIONS = {name: {"rtol": 1e-10} | ({"atol": 1e-12} if name in CASES_WITHOUT_CLEARANCE else {}) for name in CASES}
TOLERANCE, SAMPLES = {"CoSimulation": 1e-10, "ModelExchange": 1e-12}, 4001
"""Relative tolerance of CVode, by FMI interface, and number of samples.

Over these contacts the errors of CVode add up to a thousand times its tolerance (docs/files.md); it makes at
most 500 steps between two samples."""


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Return a function that makes a unit when it is first requested, by a compiler that does not optimise."""
    folder = tmp_path_factory.mktemp("units")

    @functools.cache
    def unit(name):
        mechanism, until = CASES[name]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(driver, "make_history", lambda signals: make_history(signals, steps=3000))
            patch.setattr(pack, "COMPILER_FLAGS", QUICK)
            content = pack.fmu(mechanism, sd.Options(until=until, **RUN_OPTIONS[name]), name=name)
        (folder / f"{name}.fmu").write_bytes(content)
        return str(folder / f"{name}.fmu")

    return unit


def simulated(unit, kind, until, **options):
    found = fmpy.simulate_fmu(
        unit,
        stop_time=until,
        output_interval=until / (SAMPLES - 1),
        fmi_type=kind,
        relative_tolerance=TOLERANCE[kind],
        **options,
    )
    # at an event there are two rows, before and after it
    rows = [int(np.argmin(abs(found["time"] - until * k / (SAMPLES - 1)))) for k in range(SAMPLES)]
    return {name: np.array(found[name], float)[rows] for name in found.dtype.names}


@functools.cache
def reference(name):
    """Return the run of a case by the package."""
    mechanism, until = CASES[name]
    return sd.simulate(mechanism, until=until, samples=SAMPLES, trust=name in CASES_WITH_CLEARANCE, **RUN_OPTIONS[name])


def apart(found, exact):
    return float(np.max(abs(np.asarray(found) - np.asarray(exact))))


# Pairs of case and FMI interface that are tested
CASES_AND_INTERFACES = [
    (name, kind) for name in CASES_WITH_CLEARANCE for kind in TOLERANCE if (name, kind) != ("delayed", "ModelExchange")
]


@pytest.mark.parametrize(("name", "kind"), CASES_AND_INTERFACES)
def test_a_unit_moves_as_the_mechanism(units, name, kind):
    """Cross-check: positions and angles to 1e-6 over contacts with clearance, forces to a thousandth of the largest.

    The whole time is within the horizon of predictability that the run itself states. A force is the millionfold of an
    indentation, and a sample may lie between the instants that two programs find for the start of a contact. Co-simulation
    runs the package's loop in C; model exchange is integrated by CVode of fmpy. The delayed controller looks back over more
    steps than its store has rows, so that rows are dropped in between.
    """
    mechanism, until = CASES[name]
    run = reference(name)
    assert run.attrs["trusted_until"] == until
    assert run.sizes["contact"] >= 3
    found = simulated(units(name), kind, until)
    for body in mechanism.bodies:
        place = run["position"].sel(body=body.name).values
        for axis, letter in enumerate("xy"):
            assert apart(found[f"bodies.{body.name}.{letter}"], place[:, axis]) < 1e-6
        if body.rotates:
            assert apart(found[f"bodies.{body.name}.angle"], run["angle"].sel(body=body.name)) < 1e-6
    joint = mechanism.clearance_joints[0].name
    force = run["reaction"].sel(joint=joint).values
    for axis, letter in enumerate("xy"):
        assert apart(found[f"joints.{joint}.force_{letter}"], force[:, axis]) < 1e-3 * np.max(abs(force))
    for drive in mechanism.drives:
        torque = run["drive_torque"].values
        assert apart(found[f"drives.{drive.body}.torque"], torque) < 1e-3 * np.max(abs(torque))


def test_the_description_is_valid(units):
    """Contract: the checks of fmpy, against the standard's schema and its rules for references."""
    for name in CASES_WITH_CLEARANCE:
        assert validate_fmu(units(name)) == []
    description = fmpy.read_model_description(units("servo"))
    assert description.fmiVersion == "3.0"
    assert description.numberOfEventIndicators == 1
    names = {variable.name for variable in description.modelVariables}
    assert {"references.actuator of crank.angle", "components.actuator of crank.torque", "joints.crank pin.normal"} <= names
    units_of = {variable.name: variable.unit for variable in description.modelVariables}
    assert units_of["components.actuator of crank.torque"] == "N.m"
    assert units_of["components.actuator of crank.angle"] == "rad"
    delayed = fmpy.read_model_description(units("delayed"))  # the integrator of an importer keeps no history
    assert delayed.modelExchange is None
    assert delayed.coSimulation is not None


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name in CASES_WITHOUT_CLEARANCE for kind in TOLERANCE])
def test_couplings_and_driven_coordinates_in_a_unit(units, name, kind):
    """Cross-check: angles to the accuracy of the solver, and what couplings and coordinate drives exert."""
    mechanism, until = CASES[name]
    run = reference(name)
    found = simulated(units(name), kind, until)
    for body in mechanism.bodies:
        assert apart(found[f"bodies.{body.name}.angle"], run["angle"].sel(body=body.name)) < 2e-8  # of up to 52 rad
    label = {"crane": "couplings.screw.force", "rattling": "couplings.mesh.torque"}[name]
    force = run["coupling_force"].values[:, 0]
    largest = np.max(abs(force))
    assert largest > 0.1
    assert apart(found[label], force) < (1e-6 if name == "crane" else 1e-4) * largest
    if name == "crane":
        torque = run["coordinate_drive_force"].values[:, 0]
        assert apart(found["drives.elbow.torque"], torque) < 1e-6 * np.max(abs(torque))


def inputs(label, time, angle, speed, acceleration):
    """Return the inputs that prescribe a motion, with the flag that makes the unit use them."""
    given = np.zeros(time.size, [("time", "f8"), *((f"{label}.{x}", "f8") for x in ("angle", "speed", "acceleration"))])
    given["time"] = time
    given[f"{label}.angle"], given[f"{label}.speed"], given[f"{label}.acceleration"] = angle, speed, acceleration
    return {"input": given, "start_values": {f"{label}.external": True}}


SERVO = "references.actuator of crank"  # Name of the inputs of the servo's reference


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_an_input_takes_the_place_of_a_reference(units, kind):
    """Limit: the inputs prescribe the motion that the reference had; communication is fine enough for a parabola between."""
    until = 0.02
    run = sd.simulate(CASES["servo"][0], until=until, samples=SAMPLES, **RUN_OPTIONS["servo"])
    time = np.linspace(0.0, until, 40001 if kind == "CoSimulation" else 501)
    phase = 10.0 * time
    motion = 0.3 + 0.2 * np.sin(phase), 2.0 * np.cos(phase), -20.0 * np.sin(phase)
    found = simulated(units("servo"), kind, until, **inputs(SERVO, time, *motion))
    assert apart(found["bodies.crank.angle"], run["angle"].sel(body="crank")) < 1e-6
    still = {f"{SERVO}.external": True, f"{SERVO}.speed": 0.0, f"{SERVO}.acceleration": 0.0}
    other = simulated(units("servo"), kind, until, start_values=still)
    assert apart(other["bodies.crank.angle"], run["angle"].sel(body="crank")) > 1e-4


def moved_by(name, motion):
    """Return a case with another motion."""
    mechanism = CASES[name][0]
    if name == "servo":
        return mechanism.replace("actuator of crank.reference", motion)
    drives = "drives" if name == "arm" else "coordinate_drives"
    return dataclasses.replace(mechanism, **{drives: (dataclasses.replace(getattr(mechanism, drives)[0], motion=motion),)})


@pytest.mark.parametrize(
    ("name", "label", "first", "speed", "acceleration", "until", "allowed"),
    [
        ("arm", "drives.unit 1/bar 1", sd.degrees(30), 0.0, 40.0, 0.02, 1e-6),
        ("servo", SERVO, 0.3, 2.0, 150.0, 0.02, 1e-6),
        ("crane", "drives.elbow", -0.9, -0.5, 30.0, 0.1, 1e-8),
    ],
)
def test_inputs_give_another_motion(units, name, label, first, speed, acceleration, until, allowed):
    """Cross-check: a unit that was made with one motion, moved by inputs on another one, is our run with that other motion.

    The inputs are a drive's, the reference of a servo's controller, and a coordinate's. Between two calls they go on as
    parabolas; motions with a constant acceleration are given exactly.
    """
    mechanism = CASES[name][0]
    moved = moved_by(name, sd.Polynomial((first, speed, 0.5 * acceleration)))
    run, still = (sd.simulate(each, until=until, samples=SAMPLES, **RUN_OPTIONS[name]) for each in (moved, mechanism))
    time = np.linspace(0.0, until, SAMPLES)
    motion = first + speed * time + 0.5 * acceleration * time**2, speed + acceleration * time, acceleration
    found = simulated(units(name), "CoSimulation", until, **inputs(label, time, *motion))
    for body in mechanism.bodies:
        if body.rotates and body.name != "motor":
            assert apart(found[f"bodies.{body.name}.angle"], run["angle"].sel(body=body.name)) < allowed
    assert apart(run["angle"], still["angle"]) > 1e-4


def slave(unit, tmp_path, **options):
    description = fmpy.read_model_description(unit)
    made = FMU3Slave(
        guid=description.instantiationToken,
        unzipDirectory=fmpy.extract(unit, str(tmp_path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    made.instantiate(**options)
    made.enterInitializationMode(tolerance=1e-10)
    made.exitInitializationMode()
    return made, {variable.name: variable.valueReference for variable in description.modelVariables}


def test_a_step_ends_early_where_a_contact_begins_or_ends(units, tmp_path):
    """Cross-check: the instants are those of the contacts of our own run."""
    mechanism, until = CASES["crank"]
    run = sd.simulate(mechanism, until=until, rtol=1e-10)
    made, _ = slave(units("crank"), tmp_path, earlyReturnAllowed=True)
    time, instants = 0.0, []
    while time < until:
        _, _, early, time = made.doStep(time, until - time)
        instants += [time] if early else []
    made.terminate()
    made.freeInstance()
    starts = run["contact_start"].values
    ends = starts + run["contact_duration"].values
    expected = np.sort([t for t in (*starts, *ends) if 0.0 < t < until - 1e-9])
    assert len(instants) == expected.size
    assert instants == pytest.approx(expected, abs=1e-8)


def test_a_kept_state_is_where_it_goes_on(units, tmp_path):
    """Contract: a step from a state that was put back, or read from bytes, is the same to the last bit."""
    made, references = slave(units("crank"), tmp_path)
    wanted = [references["bodies.slider.x"], references["joints.slider pin.force_x"]]
    made.doStep(0.0, 0.004)
    state = made.getFMUState()
    content = made.serializeFMUState(state)
    found = []
    for kept in (None, state, made.deserializeFMUState(content)):
        if kept is not None:
            made.setFMUState(kept)
        made.doStep(0.004, 0.004)
        found.append(list(made.getFloat64(wanted)))
    made.reset()
    made.enterInitializationMode(tolerance=1e-10)
    made.exitInitializationMode()
    made.doStep(0.0, 0.004)
    made.doStep(0.004, 0.004)
    found.append(list(made.getFloat64(wanted)))
    made.freeInstance()
    assert found[0] == found[1] == found[2] == found[3]
    assert all(math.isfinite(value) for value in found[0])


def test_attacks_end_as_the_standard_requires(units):
    """Contract: wrong states, null pointers, times, values and bytes are errors, after which an instance can be repaired."""
    command = [sys.executable, "-m", "benchmarks.fmu_attacks", units("arm"), "--together"]
    run = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2], timeout=120)
    assert run.returncode == 0, run.stdout + run.stderr
    assert re.fullmatch(r"(\d+) of \1 attacks ended as FMI 3.0 requires\n", run.stdout)


def test_misuse_is_told_in_one_line(units, tmp_path, capfd):
    """Contract: a message names the call, what is wrong and what is expected."""
    made, references = slave(units("crank"), tmp_path)
    made.doStep(0.0, 1e-3)
    for call, text in (
        (
            lambda: made.doStep(0.0, 1e-3),
            "currentCommunicationPoint = 0: must be 0.001; to repeat a step, call fmi3SetFMUState",
        ),
        (lambda: made.enterEventMode(), "fmi3EnterEventMode is a function of model exchange"),
        (lambda: made.doStep(1e-3, 1e-3), "fmi3DoStep must not be called in state Terminated"),
    ):
        with pytest.raises(fmpy.fmi1.FMICallException):
            call()
        assert text in capfd.readouterr().out
    made.reset()
    flag = [references["drives.crank.external"]]
    made.setBoolean(flag, [True])
    made.enterInitializationMode()
    made.exitInitializationMode()
    with pytest.raises(fmpy.fmi1.FMICallException):
        made.setBoolean(flag, [False])
    made.freeInstance()
    assert f"parameter {flag[0]} is fixed: it must be set before fmi3ExitInitializationMode" in capfd.readouterr().out


def test_without_a_compiler_only_the_sources_are_written(monkeypatch):
    """Contract: one line for the whole unit; the sources alone need no compiler."""
    mechanism, until = CASES["crank"]
    monkeypatch.setenv("CC", "no-such-compiler")
    with one_line_error(match="needs a C compiler: no C compiler"):
        pack.fmu(mechanism, sd.Options(until=until))
    with zipfile.ZipFile(io.BytesIO(pack.fmu(mechanism, sd.Options(until=until), sources_only=True))) as archive:
        names = {"modelDescription.xml", "resources/case.toml", "sources/model.c", "sources/buildDescription.xml"}
        assert set(archive.namelist()) == names
        assert read_mechanism(archive.read("resources/case.toml").decode()) == mechanism
        assert "fmi3DoStep" in archive.read("sources/model.c").decode()


def own_clutch(angle, speed, load, factor, capacity, yield_angle):
    """Return torque, stored energy, dissipated power and the rate of the state."""
    torque = factor * capacity * load
    return -torque, 0.0, torque * speed, (speed - abs(speed) * load) / yield_angle


@sd.component(
    port="hinge", force=own_clutch, section="own_clutch", states=(sd.State("load", "1", scale=1.0),), context=("factor",)
)
class OwnClutch:
    """Clutch that a user defines."""

    name: str
    body: str
    capacity: Annotated[float, sd.Quantity("N m", above=0.0)] = 1.0
    yield_angle: Annotated[float, sd.Quantity("rad", above=0.0)] = 1e-3
    base: str = "ground"
    time_function: sd.Cycloidal | None = None


@sd.element(slot="stiffness")
def soft(indentation, stiffness):
    """Return the force of a contact law that a user defines."""
    return stiffness * indentation**1.5


def test_elements_of_a_users_own_are_in_a_unit():
    """Contract: kernels of a class and of a function are translated."""
    mechanism, until = CASES["crank"]
    changed = dataclasses.replace(mechanism, components=(OwnClutch("clutch", "rod"),)).replace(
        "slider pin.stiffness", soft(1e10)
    )
    content = pack.fmu(changed, sd.Options(until=until), sources_only=True)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        for part, text in (
            ("sources/model.c", "k_own_clutch(double angle"),
            ("sources/model.c", "k_soft(double indentation"),
            ("modelDescription.xml", 'name="components.clutch.torque"'),
        ):
            assert text in archive.read(part).decode()


def test_change_point_is_refused(tmp_path, monkeypatch, capfd):
    """Contract: a unit, which makes no steps across singular positions, ends short of one and says where."""
    from benchmarks.change_points import linkage

    monkeypatch.setattr(pack, "COMPILER_FLAGS", QUICK)
    mechanism = linkage((4.0, 1.0, 3.0, 2.0), math.pi - 0.2, -1.0, "driven", 1.0)
    unit = tmp_path / "unit.fmu"
    unit.write_bytes(pack.fmu(mechanism, sd.Options(until=1.0), name="unit"))
    for kind in ("CoSimulation", "ModelExchange"):
        with pytest.raises(fmpy.fmi1.FMICallException):
            fmpy.simulate_fmu(str(unit), stop_time=1.0, fmi_type=kind, output_interval=0.01)
        said = capfd.readouterr().out
        assert "a singular position ahead" in said
        assert 0.17 < float(said.rpartition("t = ")[2].split(" s")[0]) < 0.2
