"""The package against the reference models: other equations, another integrator, contact by contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
import xarray as xr

from reference.lagrange import Array, constant_speed, harmonic
from reference.marching import March, Model
from reference.multipliers import Multipliers, clearance_joint
from scissordyn.component.time_function import Harmonic
from scissordyn.laws.damping import proportional
from scissordyn.laws.damping.factors import Flores, LankaraniNikravesh
from scissordyn.laws.elastic import hertz, liu
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.evaluate import friction_force, friction_states
from scissordyn.laws.friction.lugre import LuGre
from scissordyn.laws.friction.none import NoFriction
from scissordyn.model.clearance import Clearance
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor
from scissordyn.plugin.element import pointers
from scissordyn.run.simulate import simulate

C = 5e-4
SPEED = math.radians(900.0)  # 150 rpm
TOLERANCE = 1e-11
PAIRS = {"liu": (Liu(), Flores(0.9)), "hertz": (Hertz(), LankaraniNikravesh(0.9))}

CLOSE = 1e-6
"""Both roads err by about 1e-11 in a step, and each contact multiplies an error by 10 to 300: three leave about 1e-7."""
CLOSE_PEAK_TIME = 1e-5  # A force is flat at its peak: its round-off of 1e-12 shifts the peak by 1e-6 of the contact's length


def pin_clearance(pair: str = "liu", kinetic: float | None = None) -> Clearance:
    """A clearance joint with one of the law pairs, with or without friction."""
    stiffness, damping = PAIRS[pair]
    friction = NoFriction() if kinetic is None else LuGre(kinetic=kinetic)
    return Clearance(C, stiffness=stiffness, damping=damping, friction=friction)


def assert_agree(mechanism: Mechanism, model: Model, joints: Sequence[str], *, contacts: int, tolerance: float) -> None:
    """The package's run and a reference model's have the same contacts, eccentricities, torque and energies."""
    reference = March(model, rtol=tolerance, atol=tolerance).run(0.03, most_contacts=contacts)
    end = reference.pieces[-1].end
    # a microsecond more, so that the last contact has ended in this formulation too
    run = simulate(mechanism, until=end + 1e-6, rtol=TOLERANCE, atol=TOLERANCE)
    assert run.attrs["status"] == "complete"
    ended = [contact for contact in reference.contacts if not math.isnan(contact.duration)]
    assert len(ended) == contacts
    assert run.sizes["contact"] == len(reference.contacts)
    assert run["contact_joint"].values.tolist() == [joints[contact.joint] for contact in reference.contacts]
    for k, contact in enumerate(reference.contacts):
        here = run.isel(contact=k)
        assert float(here["contact_start"]) == pytest.approx(contact.start, rel=CLOSE)
        assert float(here["approach_speed"]) == pytest.approx(contact.approach_speed, rel=CLOSE)
        assert float(here["contact_angle"]) == pytest.approx(contact.angle, abs=CLOSE)
        if contact not in ended:
            continue
        assert float(here["peak_normal_force"]) == pytest.approx(contact.peak_force, rel=CLOSE)
        assert float(here["peak_normal_time"]) == pytest.approx(contact.peak_time, rel=CLOSE_PEAK_TIME)
        assert float(here["contact_duration"]) == pytest.approx(contact.duration, rel=CLOSE)
        assert float(here["rebound_speed"]) == pytest.approx(contact.rebound_speed, rel=CLOSE)
    assert_same_motion(run.sel(time=run["time"] <= end).isel(time=slice(None, None, 50)), reference, joints)


def assert_same_motion(run: xr.Dataset, reference: March, joints: Sequence[str]) -> None:
    """What is recorded along time."""
    at = reference.at(run["time"].values)
    largest = np.max(np.abs(at.torque))
    assert run["eccentricity"].sel(joint=list(joints)).values == pytest.approx(at.eccentricity, abs=1e-5 * C)
    assert run["drive_torque"].values == pytest.approx(at.torque, abs=1e-5 * largest)
    force = np.max(at.normal)
    assert run["normal_force"].sel(joint=list(joints)).values == pytest.approx(at.normal, abs=1e-5 * force)
    assert run["friction_force"].sel(joint=list(joints)).values == pytest.approx(at.tangential, abs=1e-5 * force)
    touching = at.normal > 0.0
    slip = run["slip_speed"].sel(joint=list(joints)).values
    assert slip[touching] == pytest.approx(at.slip[touching], abs=1e-5)
    stored = run["kinetic_energy"] + run["potential_energy"]
    assert stored.values == pytest.approx(at.energy, abs=1e-7 * np.max(np.abs(at.energy)))
    for name, values in (
        ("drive_work", at.work),
        ("elastic_energy", at.elastic_energy),
        ("damping_loss", at.damping_loss),
        ("friction_loss", at.friction_loss),
    ):
        assert run[name].values == pytest.approx(values, abs=1e-5 * np.max(np.abs(values))), name


@pytest.mark.parametrize("pair", PAIRS)
def test_normal_laws_agree(pair: str) -> None:
    """Cross-check: the kernels against plain Python, from light to heavy contacts."""
    clearance = pin_clearance(pair)
    described, other = clearance.surfaces, clearance_joint(clearance)
    kernel = {"liu": liu.force, "hertz": hertz.force}[pair]
    parameters = clearance.stiffness.parameters(described)
    for depth in np.geomspace(1e-9, 1e-3, 13).tolist():
        elastic = kernel(depth, *parameters)
        assert elastic == pytest.approx(other.elastic(depth), rel=1e-13)
        (factor,) = clearance.damping.parameters(described)
        for rate in (-0.4, 0.0, 0.7):
            damped = other.elastic(depth) * (1.0 + other.damping * rate / 0.7)
            assert proportional.force(elastic, rate, 0.7, factor) == pytest.approx(damped, rel=1e-13)


@pytest.mark.parametrize("kinetic", [0.01, 0.1])
def test_lugre_agrees(kinetic: float) -> None:
    """Cross-check: force, bristle rate and first deflection, also about the Stribeck speed, where runs hardly stay."""
    clearance = pin_clearance(kinetic=kinetic)
    parameters = clearance.friction.parameters(clearance.surfaces)
    other = clearance_joint(clearance).friction
    z, dz, row, at = np.zeros(1), np.zeros(1), np.array(parameters), pointers(clearance.friction)

    def friction(slip: float, bristle: float) -> tuple[float, float]:
        z[0] = bristle
        return friction_force(at["force"], slip, 300.0, z, dz, row), dz[0]

    def start(slip: float) -> float:
        friction_states(at["start"], slip, z, row)
        return float(z[0])

    for slip in (-0.3, -2e-3, -4e-4, 1e-5, 7e-4, 1.5e-3, 0.05):
        for fraction in (-0.8, 0.0, 0.5, 1.0):
            bristle = fraction * kinetic / 1e5
            force, rate = friction(slip, bristle)
            coefficient, growth = other.evaluate(slip, bristle)
            assert force == pytest.approx(300.0 * coefficient, rel=1e-12)
            assert rate == pytest.approx(growth, rel=1e-12)
        bristle = start(slip)
        assert bristle == pytest.approx(other.begin(slip), rel=1e-13)


@pytest.mark.parametrize("kinetic", [None, 0.05])
@pytest.mark.parametrize(
    ("units", "driven_bar", "pair"),
    [
        *((units, driven_bar, pair) for units in (1, 2) for driven_bar in ("pinned", "slider") for pair in PAIRS),
        (5, "pinned", "liu"),
        (5, "slider", "hertz"),
        pytest.param(5, "pinned", "hertz", marks=pytest.mark.slow),
        pytest.param(5, "slider", "liu", marks=pytest.mark.slow),
    ],
)
def test_arrays_agree_with_lagrange(units: int, driven_bar: str, pair: str, kinetic: float | None) -> None:
    """Cross-check: three contacts of joint A against Lagrange's equations in minimal coordinates."""
    clearance = pin_clearance(pair, kinetic)
    mechanism = scissor(units=units, driven_bar=driven_bar).driven(speed=SPEED).with_clearance("A", clearance)
    array = Array(clearance_joint(clearance), constant_speed(math.pi / 6.0, SPEED), units, driven_bar)
    assert_agree(mechanism, array, ["A"], contacts=3, tolerance=1e-12)


def test_slider_agrees_with_lagrange() -> None:
    """Cross-check: the slider's position, through three contacts with friction."""
    clearance = pin_clearance(kinetic=0.05)
    array = Array(clearance_joint(clearance), constant_speed(math.pi / 6.0, SPEED))
    reference = March(array).run(0.006)
    run = simulate(
        scissor().driven(speed=SPEED).with_clearance("A", clearance), until=0.006, rtol=TOLERANCE, atol=TOLERANCE, samples=41
    )
    expected = [
        array.slider_position(t, q) for t, q in zip(run["time"].values, reference.at(run["time"]).coordinates, strict=True)
    ]
    assert run["slider_position"].values == pytest.approx(expected, abs=1e-6 * C)


@pytest.mark.parametrize("kinetic", [None, 0.05])
def test_harmonic_drive_agrees_with_lagrange(kinetic: float | None) -> None:
    """Cross-check: joint A with an oscillating driven angle."""
    clearance = pin_clearance(kinetic=kinetic)
    motion = Harmonic(mean=0.8, amplitude=0.3, angular_frequency=60.0)
    mechanism = scissor().driven(motion).with_clearance("A", clearance)
    assert_agree(mechanism, Array(clearance_joint(clearance), harmonic(0.8, 0.3, 60.0)), ["A"], contacts=3, tolerance=1e-12)


@pytest.mark.parametrize(
    ("units", "driven_bar", "kinetic", "joints", "contacts"),
    [
        (1, "pinned", None, ["O"], 3),
        (2, "pinned", None, ["unit 1/pivot"], 2),
        (2, "slider", 0.05, ["unit 1/upper"], 2),
        (3, "pinned", None, ["unit 2/lower"], 3),
        (4, "slider", None, ["unit 3/upper"], 2),
        (8, "pinned", None, ["A"], 1),
        (8, "slider", None, ["unit 4/pivot"], 1),
        (2, "pinned", None, ["O", "A"], 3),
        (3, "slider", None, ["A", "unit 1/upper", "unit 2/pivot"], 3),
        (2, "pinned", 0.05, ["A", "unit 1/lower"], 2),
    ],
)
def test_clearance_joints_anywhere_agree_with_multipliers(
    units: int, driven_bar: str, kinetic: float | None, joints: list[str], contacts: int
) -> None:
    """Cross-check: one and several clearance joints against three coordinates per body and multipliers."""
    mechanism = scissor(units=units, driven_bar=driven_bar).driven(speed=SPEED)
    for joint in joints:
        mechanism = mechanism.with_clearance(joint, pin_clearance(kinetic=kinetic))
    model = Multipliers(mechanism)
    names = [joint.name for joint in model.clearance_joints]
    assert_agree(mechanism, model, names, contacts=contacts, tolerance=1e-12 if kinetic is None else 1e-10)
