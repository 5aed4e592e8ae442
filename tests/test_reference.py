"""The package against reference models: other equations, another integrator, contact by contact; these against closed forms."""

import dataclasses
import math

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

import scissordyn as sd
from reference.lagrange import Array, constant_speed, harmonic
from reference.laws import hertz, liu
from reference.marching import ClearanceJoint, Load, March, Relative
from reference.multipliers import Multipliers, clearance_joint
from reference.slider_crank import SliderCrank

C, RADIUS = 5e-4, 10e-3  # Radial clearance and journal radius [m]
SPEED = math.radians(900.0)  # [rad/s] speed of the drive, 150 rpm
STEADY = constant_speed(math.pi / 6.0, SPEED)  # Motion at constant speed from 30 deg
# Pairs of stiffness and damping law, by name
PAIRS = {"liu": (sd.Liu(), sd.Flores(0.9)), "hertz": (sd.Hertz(), sd.LankaraniNikravesh(0.9))}

TOLERANCE = 1e-11  # Relative and absolute tolerance of the runs
CLOSE = 1e-6
"""Largest relative difference: errors of 1e-11 in a step grow 10 to 300 times in each of three contacts."""
CLOSE_PEAK_TIME = 1e-5  # [contact durations] largest difference of peak times: round-off of 1e-12 moves a flat peak by 1e-6


def pin_clearance(pair="liu", kinetic=None):
    """Return a clearance joint with one of the law pairs, with or without friction."""
    stiffness, damping = PAIRS[pair]
    friction = sd.NoFriction() if kinetic is None else sd.LuGre(kinetic=kinetic)
    # the reference has damping by the approach speed alone
    return sd.Clearance(C, stiffness=stiffness, damping=damping, friction=friction, reference="onset")


def assert_agree(mechanism, model, joints, *, contacts, tolerance, until=0.03):
    """Check that a run and a reference model have equal contacts, eccentricities, torques and energies."""
    reference = March(model, rtol=tolerance, atol=tolerance).run(until, most_contacts=contacts)
    end = reference.pieces[-1].end
    # a microsecond more, so that the last contact has ended in this formulation too
    run = sd.simulate(mechanism, until=end + 1e-6, rtol=TOLERANCE, atol=TOLERANCE)
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


def assert_same_motion(run, reference, joints):
    """Check the variables that are recorded along time."""
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


@pytest.mark.parametrize("kinetic", [None, 0.05])
@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("driven_bar", ["pinned", "slider"])
@pytest.mark.parametrize("units", [1, 2, 5])
def test_arrays_agree_with_lagrange(units, driven_bar, pair, kinetic):
    """Cross-check: three contacts of joint A against Lagrange's equations in minimal coordinates."""
    clearance = pin_clearance(pair, kinetic)
    mechanism = sd.scissor(units=units, driven_bar=driven_bar).driven(speed=SPEED).with_clearance("A", clearance)
    array = Array(clearance_joint(clearance), STEADY, units, driven_bar)
    assert_agree(mechanism, array, ["A"], contacts=3, tolerance=1e-12)


def test_slider_agrees_with_lagrange():
    """Cross-check: the slider's position, through three contacts with friction."""
    clearance = pin_clearance(kinetic=0.05)
    array = Array(clearance_joint(clearance), STEADY)
    reference = March(array).run(0.006)
    run = sd.simulate(
        sd.scissor().driven(speed=SPEED).with_clearance("A", clearance), until=0.006, rtol=TOLERANCE, atol=TOLERANCE, samples=41
    )
    expected = [
        array.slider_position(t, q) for t, q in zip(run["time"].values, reference.at(run["time"]).coordinates, strict=True)
    ]
    assert run["slider_position"].values == pytest.approx(expected, abs=1e-6 * C)


@pytest.mark.parametrize("kinetic", [None, 0.05])
def test_harmonic_drive_agrees_with_lagrange(kinetic):
    """Cross-check: joint A with an oscillating driven angle."""
    clearance = pin_clearance(kinetic=kinetic)
    motion = sd.Harmonic(mean=0.8, amplitude=0.3, angular_frequency=60.0)
    mechanism = sd.scissor().driven(motion).with_clearance("A", clearance)
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
def test_clearance_joints_anywhere_agree_with_multipliers(units, driven_bar, kinetic, joints, contacts):
    """Cross-check: one and several clearance joints against three coordinates per body and multipliers."""
    mechanism = sd.scissor(units=units, driven_bar=driven_bar).driven(speed=SPEED)
    for joint in joints:
        mechanism = mechanism.with_clearance(joint, pin_clearance(kinetic=kinetic))
    model = Multipliers(mechanism)
    names = [joint.name for joint in model.clearance_joints]
    assert_agree(mechanism, model, names, contacts=contacts, tolerance=1e-12)


@pytest.mark.parametrize(("units", "joints"), [(3, ["unit 3/pivot"]), (6, ["A", "unit 5/upper"])])
def test_slow_arrays_agree_with_multipliers(units, joints):
    """Cross-check: the same where loads, not inertia, open contacts."""
    mechanism = sd.scissor(units=units).driven(speed=math.radians(60.0)).with_clearance(joints, pin_clearance())
    model = Multipliers(mechanism)
    names = [joint.name for joint in model.clearance_joints]
    assert_agree(mechanism, model, names, contacts=2, tolerance=1e-12, until=0.1)


class FreeMass:
    """A body of mass m that flies with v0 to a fixed surface at a distance c."""

    size = 1

    def __init__(self, mass, speed, joint):
        self.mass, self.speed, self.joints = mass, speed, (joint,)

    def start(self):
        """Return the start in the middle of the clearance."""
        return np.zeros(1), np.array([self.speed])

    def relative(self, t, q, v):
        """Return the surface does not move."""
        return [Relative(q[0], 0.0, v[0], 0.0, 0.0, 0.0)]

    def accelerate(self, t, q, v, loads):
        """Newton's law."""
        return np.array([loads[0].fx / self.mass]), 0.0, 0.0

    def energy(self, t, q, v):
        """Kinetic energy."""
        return 0.5 * self.mass * v[0] ** 2

    def settle(self, t, q, v):
        """Return coordinates and rates unchanged, because there are no constraints that they could violate."""
        return q, v


@pytest.mark.parametrize("pair", PAIRS)
def test_free_mass_rebounds_with_the_exact_restitution(pair):
    """Closed form: ln[(1+xi)/(1-xi e)] = xi (1+e) for any elastic part, docs/theory (D1)."""
    joint = clearance_joint(pin_clearance(pair))
    contact = March(FreeMass(2.0, 0.7, joint)).run(0.01).contacts[0]
    xi = joint.damping
    exact = brentq(lambda e: math.log((1.0 + xi) / (1.0 - xi * e)) - xi * (1.0 + e), 0.5, 1.0, xtol=1e-15)
    assert contact.start == pytest.approx(C / 0.7, rel=1e-12)
    assert contact.approach_speed == pytest.approx(0.7, rel=1e-12)
    assert -contact.rebound_speed / 0.7 == pytest.approx(exact, rel=1e-10)


def test_free_hertz_impact_without_damping():
    """Closed form: F_max = K d^1.5 with d = (5 m v^2/(4 K))^0.4, duration 2.943275 d/v (Hertz)."""
    elastic = hertz(C, RADIUS)
    contact = March(FreeMass(2.0, 0.7, ClearanceJoint(C, RADIUS, elastic, 0.0))).run(0.01).contacts[0]
    stiffness = elastic(1.0)
    depth = (1.25 * 2.0 * 0.49 / stiffness) ** 0.4
    factor = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
    assert stiffness == pytest.approx(4.0 / 3.0 * 1.137362637e11 * math.sqrt(10e-3 * 10.5e-3 / C), rel=1e-9)
    assert contact.peak_force == pytest.approx(stiffness * depth**1.5, rel=1e-10)
    assert contact.peak_time == pytest.approx(0.5 * factor * depth / 0.7, rel=1e-6)
    assert contact.duration == pytest.approx(factor * depth / 0.7, rel=1e-10)


@pytest.mark.parametrize(("law", "tabulated"), [(liu(C, 1.0), 1.7690e5), (hertz(C, 9.5e-3), 2.0903e3)])
def test_elastic_laws_have_the_tabulated_values(law, tabulated):
    """Published number: force at an indentation of 10 um, R_B = 10 mm, c = 0.5 mm (docs/reference.md), per metre for Liu."""
    assert law(1e-5) == pytest.approx(tabulated, rel=5e-5)


class Derived:
    """The array's Lagrange equations, derived by sympy from points of the bars."""

    def __init__(self, units):
        self.units = units
        m, length, slider, g = sp.symbols("m L m_s g", positive=True)
        self.constants = (m, length, slider, g)
        names = sp.symbols("p k y"), sp.symbols("p1 k1 y1"), sp.symbols("p2 k2 y2")
        self.q, self.v, self.a = (sp.Matrix(row) for row in names)
        along_p, along_k = (sp.Matrix([sp.cos(angle), sp.sin(angle)]) for angle in self.q[:2])
        pinned, coupler = sp.zeros(2, 1), length / 2 * (along_p - along_k)
        self.journal = coupler
        self.kinetic, self.potential = slider * self.v[2] ** 2 / 2, slider * g * self.q[2]
        for _ in range(units):
            for start, direction, turn in ((pinned, along_p, self.v[0]), (coupler, along_k, self.v[1])):
                centre = start + length / 2 * direction
                speed = centre.jacobian(self.q) * self.v
                self.kinetic += m * speed.dot(speed) / 2 + m * length**2 * turn**2 / 24
                self.potential += m * g * centre[1]
            assert sp.simplify(pinned + length / 2 * along_p - coupler - length / 2 * along_k) == sp.zeros(2, 1)
            pinned, coupler = coupler + length * along_k, pinned + length * along_p

    def rows(self, load, moment):
        """d/dt dT/dq' - dT/dq + dU/dq - Q, zero on the free rows and the drive torque on the driven one."""
        momentum = sp.Matrix([self.kinetic]).jacobian(self.v)
        change = momentum.jacobian(self.q) * self.v + momentum.jacobian(self.v) * self.a
        conservative = sp.Matrix([self.kinetic - self.potential]).jacobian(self.q).T
        relative = self.journal - sp.Matrix([0, self.q[2]])
        pushed = relative.jacobian(self.q).T * load + sp.Matrix([0, moment, 0])
        return change - conservative - pushed


@pytest.mark.parametrize("units", [1, 2, 5])
def test_energies_follow_from_the_bars(units):
    """Identity: T and U of docs/theory (S2), (S3) are the energies of 2 N uniform bars pinned end to end."""
    derived = Derived(units)
    m, length, slider, g = derived.constants
    p, k, y = derived.q
    w_p, w_k, y_rate = derived.v
    n = units
    squares, fewer = sp.Rational(n * (n + 1) * (2 * n + 1), 6), sp.Rational((n - 1) * n * (2 * n - 1), 6)
    products = sp.Rational((n - 1) * n * (n + 1), 3)
    stated = m * length**2 / 4 * (squares * w_p**2 + fewer * w_k**2 + 2 * products * sp.cos(p - k) * w_p * w_k)
    stated += n * m * length**2 / 24 * (w_p**2 + w_k**2) + slider * y_rate**2 / 2
    weight = (
        m * g * length * (sp.Rational(n * (n + 1), 2) * sp.sin(p) + sp.Rational(n * (n - 1), 2) * sp.sin(k)) + slider * g * y
    )
    assert sp.simplify(sp.expand_trig(sp.expand(derived.kinetic - stated))) == 0
    assert sp.simplify(derived.potential - weight) == 0


@pytest.mark.parametrize("driven_bar", ["pinned", "slider"])
@pytest.mark.parametrize("units", [1, 2, 5])
def test_array_obeys_the_derived_equations(units, driven_bar):
    """Identity: accelerations, torque and energy of the array fulfil the equations that sympy derives from its points."""
    derived = Derived(units)
    load, moment = sp.Matrix(sp.symbols("F_x F_y")), sp.Symbol("M")
    symbols = [*derived.constants, *derived.q, *derived.v, *derived.a, *load, moment]
    rows = sp.lambdify(symbols, derived.rows(load, moment))
    energy = sp.lambdify(symbols[:10], derived.kinetic + derived.potential)
    array = Array(clearance_joint(pin_clearance()), harmonic(0.7, 0.4, 30.0), units, driven_bar)
    constants = array.mass, array.length, array.slider, array.gravity
    random = np.random.default_rng(20)
    for _ in range(5):
        t, q, v = random.uniform(0.0, 0.2), random.normal(size=2) * 0.1, random.normal(size=2)
        push = Load(*(random.normal(size=3) * 1e4).tolist(), 0.0)
        a, torque, _ = array.accelerate(t, q, v, [push])
        _, _, a_d = array.motion(t)
        p, k, w_p, w_k = array.angles(t, q[0], v[0])
        a_p, a_k = (a_d, a[0] - a_d) if driven_bar == "pinned" else (a[0] - a_d, a_d)
        half = 0.5 * array.length
        rise = half * (math.cos(p) * w_p - math.cos(k) * w_k) - v[1]
        lift = half * (math.cos(p) * a_p - math.sin(p) * w_p**2 - math.cos(k) * a_k + math.sin(k) * w_k**2) - a[1]
        state = [p, k, array.slider_position(t, q), w_p, w_k, rise]
        residual = rows(*constants, *state, a_p, a_k, lift, *push[:3]).ravel()
        expected = [torque, 0.0, 0.0] if driven_bar == "pinned" else [0.0, torque, 0.0]
        assert residual == pytest.approx(expected, rel=1e-11, abs=1e-8)
        assert array.energy(t, q, v) == pytest.approx(energy(*constants, *state), rel=1e-12)
        at = array.relative(t, q, v)[0]
        assert (at.ex, at.ey) == pytest.approx((half * (math.cos(p) - math.cos(k)), q[1]), rel=1e-12)
        assert (at.ux, at.uy) == pytest.approx((half * (math.sin(k) * w_k - math.sin(p) * w_p), v[1]), rel=1e-12)


# Start, approach speed, angle [deg], peak, time to it, duration, rebound, as in docs/reference.md: the digits to which
# tolerances of 2e-13 and 3e-14 agree.
EVENTS = {
    "liu": [
        (0.0013651259130, 0.73514298384, -107.816990465, 42701.9244, 1.1997917e-4, 2.7482661706e-4, -0.6236406636),
        (0.0031639798805, 0.34484394745, 179.866471441, 82944.8947, 4.0370370e-4, 9.9355989906e-4, -0.2974059743),
        (0.0053665921273, 0.62238044736, -123.959802923, 40856.8058, 1.3061164e-4, 2.9513987981e-4, -0.5760923414),
    ],
    "hertz": [
        (0.0013651259130, 0.73514298384, -107.816990465, 41402.2356, 1.3026011e-4, 2.9060184881e-4, -0.6372293868),
        (0.0031734774209, 0.33852654158, 176.860283346, 85352.7892, 4.3873437e-4, 1.0235456389e-3, -0.3013698297),
        (0.0054555513063, 0.63119396447, -121.671267486, 39408.2160, 1.4003879e-4, 3.0793318719e-4, -0.5973451725),
    ],
}


@pytest.mark.parametrize("pair", PAIRS)
def test_array_has_the_reference_events(pair):
    """Cross-check: the contacts of docs/reference.md; the error left by a tolerance of 1e-12 is a few 1e-11."""
    run = March(Array(clearance_joint(pin_clearance(pair)), STEADY)).run(0.01, most_contacts=3)
    for found, (start, speed, angle, peak, peak_time, duration, rebound) in zip(run.contacts, EVENTS[pair], strict=True):
        assert found.start == pytest.approx(start, rel=2e-10)
        assert found.approach_speed == pytest.approx(speed, rel=2e-10)
        assert math.degrees(found.angle) == pytest.approx(angle, rel=2e-10)
        assert found.peak_force == pytest.approx(peak, rel=2e-9)
        assert found.peak_time == pytest.approx(peak_time, rel=1e-6)
        assert found.duration == pytest.approx(duration, rel=2e-10)
        assert found.rebound_speed == pytest.approx(rebound, rel=2e-10)


CRANK_EVENTS = (
    {
        "contact_start": (2.27286032e-4, 1e-12),
        "approach_speed": (4.38578315, 1e-8),
        "contact_angle": (math.radians(177.912104), math.radians(1e-6)),
        "peak_force": (45872.3, 0.06),
        "contact_duration": (5.3437226e-5, 1e-12),
        "rebound_speed": (-3.91149258, 1e-8),
    },
    {"contact_start": (6.3705643e-4, 1e-11), "approach_speed": (2.75694915, 1e-8), "peak_force": (20869.9, 0.06)},
)
"""Events of the slider-crank in docs/reference.md: value and allowed error of each quantity."""


def test_slider_crank_has_the_reference_events():
    """Cross-check: two contacts of docs/reference.md, to the digits printed there; by the package to 1e-7, peaks to 1e-4.

    5000 rpm, c = 0.5 mm, Hertz with Lankarani and Nikravesh at a restitution of 0.9, no friction, started concentric.
    """
    pin, speed = dataclasses.replace(pin_clearance("hertz"), journal_radius=9.5e-3), sd.rpm(5000)
    contacts = March(SliderCrank(clearance_joint(pin), speed)).run(7e-4).contacts
    crank = sd.slider_crank().driven(speed=speed).with_clearance("slider pin", pin)
    run = sd.simulate(crank, until=8e-4, samples=11, rtol=TOLERANCE, atol=TOLERANCE)
    for k, (contact, events) in enumerate(zip(contacts, CRANK_EVENTS, strict=True)):
        for name, (figure, digits) in events.items():
            assert getattr(contact, name.removeprefix("contact_")) == pytest.approx(figure, abs=digits), name
            assert float(run[name][k]) == pytest.approx(figure, rel=1e-4 if name == "peak_force" else 1e-7), name


def test_multipliers_have_the_ideal_torque_and_reaction():
    """Closed form: torque and force on the journal of joint A in the ideal array of two units, docs/theory (S5), (S6)."""
    model = Multipliers(sd.scissor(units=2).driven(speed=SPEED))
    run = March(model).run(0.02)
    for t, torque, fx, fy in ((0.0, 7850.912334, 7464.867308, 1184.650550), (0.02, 8911.346064, 5795.014529, 1784.586360)):
        q, v, _ = run.parts(run.pieces[-1].solution(t))
        _, forces = model.solve(t, q, v, [])
        # two rows for the ground pin, two for joint A, the last for the drive
        assert forces[2:4] == pytest.approx([fx, fy], rel=1e-9)
        assert forces[-1] == pytest.approx(torque, rel=1e-9)
