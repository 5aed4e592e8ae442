"""The reference models against closed forms, against each other and against the reference events."""

import math

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

from reference.lagrange import Array, constant_speed, harmonic
from reference.laws import Elastic, LuGre, flores, hertz, lankarani_nikravesh, liu
from reference.marching import ClearanceJoint, Contact, Load, March, Relative
from reference.multipliers import Multipliers
from reference.slider_crank import SliderCrank
from scissordyn.component.time_function import Harmonic
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.friction.lugre import LuGre as DescribedLuGre
from scissordyn.model.body import Body, bar, point_mass
from scissordyn.model.clearance import Clearance
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor

C, RADIUS, LENGTH = 5e-4, 10e-3, 15e-3
SPEED = math.radians(900.0)  # 150 rpm
START = math.pi / 6.0
PAIRS = {
    "liu + flores": (liu(C, LENGTH), flores(0.9)),
    "hertz + lankarani-nikravesh": (hertz(C, RADIUS), lankarani_nikravesh(0.9)),
}


def clearance_joint(pair: str = "liu + flores", kinetic: float | None = None) -> ClearanceJoint:
    """The reference joint with one of the law pairs."""
    elastic, damping = PAIRS[pair]
    return ClearanceJoint(C, RADIUS, elastic, damping, None if kinetic is None else LuGre(kinetic))


def assert_same(found: list[Contact], expected: list[Contact], tolerance: float) -> None:
    """Every figure of two tables of contacts agrees; a peak is flat, so its time is known to fewer digits."""
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        for name in ("start", "approach_speed", "peak_force", "duration", "rebound_speed"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=tolerance, nan_ok=True), name
        assert one.joint == other.joint
        assert one.angle == pytest.approx(other.angle, abs=tolerance)
        assert one.peak_time == pytest.approx(other.peak_time, rel=1e-5)


def imbalance(run: March, times: np.ndarray) -> float:
    """Spread of the energy balance over its largest term."""
    at = run.at(times)
    balance = at.energy + at.elastic_energy - at.work + at.damping_loss + at.friction_loss
    return float(np.ptp(balance) / np.max(np.abs([at.energy, at.work])))


class FreeMass:
    """A body of mass m that flies with v0 to a fixed surface at a distance c."""

    size = 1

    def __init__(self, mass: float, speed: float, joint: ClearanceJoint) -> None:
        self.mass, self.speed, self.joints = mass, speed, (joint,)

    def start(self):
        """In the middle of the clearance."""
        return np.zeros(1), np.array([self.speed])

    def relative(self, t, q, v):
        """The surface does not move."""
        return [Relative(q[0], 0.0, v[0], 0.0, 0.0, 0.0)]

    def accelerate(self, t, q, v, loads):
        """Newton's law."""
        return np.array([loads[0].fx / self.mass]), 0.0, 0.0

    def energy(self, t, q, v):
        """Kinetic energy."""
        return 0.5 * self.mass * v[0] ** 2

    def settle(self, t, q, v):
        """Nothing drifts."""
        return q, v


@pytest.mark.parametrize("pair", PAIRS)
def test_free_mass_rebounds_with_the_exact_restitution(pair: str) -> None:
    """Closed form: ln[(1+xi)/(1-xi e)] = xi (1+e) for any elastic part, docs/theory (D1)."""
    joint = clearance_joint(pair)
    contact = March(FreeMass(2.0, 0.7, joint)).run(0.01).contacts[0]
    xi = joint.damping
    exact = brentq(lambda e: math.log((1.0 + xi) / (1.0 - xi * e)) - xi * (1.0 + e), 0.5, 1.0, xtol=1e-15)
    assert contact.start == pytest.approx(C / 0.7, rel=1e-12)
    assert contact.approach_speed == pytest.approx(0.7, rel=1e-12)
    assert -contact.rebound_speed / 0.7 == pytest.approx(exact, rel=1e-10)


def test_free_hertz_impact_without_damping() -> None:
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


@pytest.mark.parametrize(
    ("law", "tabulated"),
    [(liu(C, 1.0), 1.7690e5), (hertz(C, 9.5e-3), 2.0903e3)],
)
def test_elastic_laws_have_the_tabulated_values(law: Elastic, tabulated: float) -> None:
    """Published number: force at an indentation of 10 um, R_B = 10 mm, c = 0.5 mm (docs/reference.md), per metre for Liu."""
    assert law(1e-5) == pytest.approx(tabulated, rel=5e-5)


class Derived:
    """The array's Lagrange equations, derived by sympy from points of the bars."""

    def __init__(self, units: int) -> None:
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

    def rows(self, load: sp.Matrix, moment: sp.Symbol) -> sp.Matrix:
        """d/dt dT/dq' - dT/dq + dU/dq - Q, zero on the free rows and the drive torque on the driven one."""
        momentum = sp.Matrix([self.kinetic]).jacobian(self.v)
        change = momentum.jacobian(self.q) * self.v + momentum.jacobian(self.v) * self.a
        conservative = sp.Matrix([self.kinetic - self.potential]).jacobian(self.q).T
        relative = self.journal - sp.Matrix([0, self.q[2]])
        pushed = relative.jacobian(self.q).T * load + sp.Matrix([0, moment, 0])
        return change - conservative - pushed


@pytest.mark.parametrize("units", [1, 2, 5])
def test_energies_follow_from_the_bars(units: int) -> None:
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
def test_array_obeys_the_derived_equations(units: int, driven_bar: str) -> None:
    """Identity: accelerations, torque and energy of the array fulfil the equations that sympy derives from its points."""
    derived = Derived(units)
    load, moment = sp.Matrix(sp.symbols("F_x F_y")), sp.Symbol("M")
    symbols = [*derived.constants, *derived.q, *derived.v, *derived.a, *load, moment]
    rows = sp.lambdify(symbols, derived.rows(load, moment))
    energy = sp.lambdify(symbols[:10], derived.kinetic + derived.potential)
    array = Array(clearance_joint(), harmonic(0.7, 0.4, 30.0), units, driven_bar)
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
    "liu + flores": [
        (0.0013651259130, 0.73514298384, -107.816990465, 42701.9244, 1.1997917e-4, 2.7482661706e-4, -0.6236406636),
        (0.0031639798805, 0.34484394745, 179.866471441, 82944.8947, 4.0370370e-4, 9.9355989906e-4, -0.2974059743),
        (0.0053665921273, 0.62238044736, -123.959802923, 40856.8058, 1.3061164e-4, 2.9513987981e-4, -0.5760923414),
    ],
    "hertz + lankarani-nikravesh": [
        (0.0013651259130, 0.73514298384, -107.816990465, 41402.2356, 1.3026011e-4, 2.9060184881e-4, -0.6372293868),
        (0.0031734774209, 0.33852654158, 176.860283346, 85352.7892, 4.3873437e-4, 1.0235456389e-3, -0.3013698297),
        (0.0054555513063, 0.63119396447, -121.671267486, 39408.2160, 1.4003879e-4, 3.0793318719e-4, -0.5973451725),
    ],
}


@pytest.mark.parametrize("pair", PAIRS)
def test_array_has_the_reference_events(pair: str) -> None:
    """Cross-check: the contacts of docs/reference.md; the error left by a tolerance of 1e-12 is a few 1e-11."""
    run = March(Array(clearance_joint(pair), constant_speed(START, SPEED))).run(0.01, most_contacts=3)
    for found, (start, speed, angle, peak, peak_time, duration, rebound) in zip(run.contacts, EVENTS[pair], strict=True):
        assert found.start == pytest.approx(start, rel=2e-10)
        assert found.approach_speed == pytest.approx(speed, rel=2e-10)
        assert math.degrees(found.angle) == pytest.approx(angle, rel=2e-10)
        assert found.peak_force == pytest.approx(peak, rel=2e-9)
        assert found.peak_time == pytest.approx(peak_time, rel=1e-6)
        assert found.duration == pytest.approx(duration, rel=2e-10)
        assert found.rebound_speed == pytest.approx(rebound, rel=2e-10)


def test_slider_crank_has_the_reference_events() -> None:
    """Cross-check: the two contacts of docs/reference.md, to the digits printed there."""
    bearing = 10e-3
    joint = ClearanceJoint(C, bearing - C, hertz(C, bearing - C), lankarani_nikravesh(0.9))
    first, second = March(SliderCrank(joint, 5000.0 * math.pi / 30.0)).run(7e-4).contacts
    assert first.start == pytest.approx(2.27286032e-4, abs=1e-12)
    assert first.approach_speed == pytest.approx(4.38578315, abs=1e-8)
    assert math.degrees(first.angle) == pytest.approx(177.912104, abs=1e-6)
    assert first.peak_force == pytest.approx(45872.3, abs=0.06)
    assert first.duration == pytest.approx(5.3437226e-5, abs=1e-12)
    assert first.rebound_speed == pytest.approx(-3.91149258, abs=1e-8)
    assert second.start == pytest.approx(6.3705643e-4, abs=1e-11)
    assert second.approach_speed == pytest.approx(2.75694915, abs=1e-8)
    assert second.peak_force == pytest.approx(20869.9, abs=0.06)


def described_array(units: int, driven_bar: str, kinetic: float | None, *joints: str) -> Mechanism:
    """A scissor array with default clearance joints."""
    arm = scissor(units=units, driven_bar=driven_bar).driven(speed=SPEED)
    for joint in joints:
        arm = arm.with_clearance(joint, clearance(kinetic))
    return arm


def clearance(kinetic: float | None) -> Clearance:
    """The default laws, with LuGre friction if a coefficient is given."""
    return Clearance(C) if kinetic is None else Clearance(C, friction=DescribedLuGre(kinetic=kinetic))


def test_multipliers_have_the_ideal_torque_and_reaction() -> None:
    """Closed form: torque and force on the journal of joint A in the ideal array of two units, docs/theory (S5), (S6)."""
    model = Multipliers(described_array(2, "pinned", None))
    run = March(model).run(0.02)
    for t, torque, fx, fy in (
        (0.0, 7850.912334, 7464.867308, 1184.650550),
        (0.02, 8911.346064, 5795.014529, 1784.586360),
    ):
        q, v, _ = run.parts(run.pieces[-1].solution(t))
        _, forces = model.solve(t, q, v, [])
        # two rows for the ground pin, two for joint A, the last for the drive
        assert forces[2:4] == pytest.approx([fx, fy], rel=1e-9)
        assert forces[-1] == pytest.approx(torque, rel=1e-9)


@pytest.mark.parametrize(
    ("units", "driven_bar", "kinetic", "contacts"),
    [
        (1, "pinned", None, 3),
        (1, "slider", None, 3),
        (2, "pinned", None, 3),
        (2, "slider", None, 3),
        (5, "pinned", None, 1),
        (8, "slider", None, 1),
        (2, "pinned", 0.05, 2),
    ],
)
def test_multipliers_agree_with_lagrange(units: int, driven_bar: str, kinetic: float | None, contacts: int) -> None:
    """Cross-check: two formulations of the same array have the same contacts, torque and energy balance."""
    # Radau needs a hundred times more steps than 1e-10 asks for before it gains two digits
    tolerance = 1e-12 if kinetic is None else 1e-10
    described = Multipliers(described_array(units, driven_bar, kinetic, "A"))
    array = Array(clearance_joint(kinetic=kinetic), constant_speed(START, SPEED), units, driven_bar)
    one = March(described, rtol=tolerance, atol=tolerance).run(0.02, most_contacts=contacts)
    other = March(array, rtol=tolerance, atol=tolerance).run(0.02, most_contacts=contacts)
    # errors of 1e-12 in a step grow by some powers of ten over the contacts
    assert_same(one.contacts, other.contacts, 1e-7)
    times = np.linspace(0.0, min(one.pieces[-1].end, other.pieces[-1].end), 20)
    a, b = one.at(times), other.at(times)
    assert a.eccentricity == pytest.approx(b.eccentricity, abs=1e-6 * C)
    assert a.torque == pytest.approx(b.torque, abs=1e-6 * np.max(np.abs(b.torque)))
    assert imbalance(one, times) < 1e-10
    assert imbalance(other, times) < 1e-10
    end = one.pieces[-1]
    assert described.drift(end.end, *one.parts(end.solution(end.end))[:2]) < 1e-12


def test_multipliers_agree_with_lagrange_under_a_harmonic_drive() -> None:
    """Cross-check: as before, the driven angle oscillating about 0.8 rad."""
    arm = scissor().driven(Harmonic(mean=0.8, amplitude=0.3, angular_frequency=60.0)).with_clearance("A", Clearance(C))
    one = March(Multipliers(arm)).run(0.02, most_contacts=2)
    other = March(Array(clearance_joint(), harmonic(0.8, 0.3, 60.0))).run(0.02, most_contacts=2)
    assert_same(one.contacts, other.contacts, 1e-7)


def described_crank(kinetic: float | None) -> Mechanism:
    """The slider-crank of docs/reference.md as a mechanism."""
    friction = {} if kinetic is None else {"friction": DescribedLuGre(kinetic=kinetic)}
    joint = Clearance(C, journal_radius=9.5e-3, stiffness=Hertz(), damping=LankaraniNikravesh(0.9), **friction)
    crank: Body = bar("crank", length=0.05, mass=0.3)
    return Mechanism(
        bodies=(
            crank,
            bar("rod", length=0.12, mass=0.21, inertia=2.5e-4, position=(0.05, 0.0)),
            point_mass("slider", mass=0.14, position=(0.17, 0.0)),
        ),
        joints=(
            Revolute("O", ("crank", "start"), ("ground", "origin")),
            Revolute("crank pin", ("rod", "start"), ("crank", "end")),
            Revolute("slider pin", ("rod", "end"), ("slider", "centre"), joint),
        ),
        guides=(Guide("guide", ("slider", "centre")),),
        ground=(("origin", (0.0, 0.0)),),
        gravity=0.0,
    ).driven(speed=5000.0 * math.pi / 30.0, body="crank")


@pytest.mark.parametrize("kinetic", [None, 0.05])
def test_multipliers_agree_with_the_slider_crank(kinetic: float | None) -> None:
    """Cross-check: two formulations of the slider-crank have the same first contacts and drive torque."""
    tolerance = 1e-12 if kinetic is None else 1e-10
    friction = None if kinetic is None else LuGre(kinetic)
    joint = ClearanceJoint(C, 9.5e-3, hertz(C, 9.5e-3), lankarani_nikravesh(0.9), friction)
    crank = SliderCrank(joint, 5000.0 * math.pi / 30.0)
    one = March(Multipliers(described_crank(kinetic)), rtol=tolerance, atol=tolerance, max_step=1e-5).run(1e-3, most_contacts=2)
    other = March(crank, rtol=tolerance, atol=tolerance, max_step=1e-5).run(1e-3, most_contacts=2)
    assert_same(one.contacts, other.contacts, 1e-7)
    times = np.linspace(0.0, min(one.pieces[-1].end, other.pieces[-1].end), 20)
    assert one.at(times).torque == pytest.approx(other.at(times).torque, abs=1e-6 * np.max(np.abs(other.at(times).torque)))
    assert imbalance(other, times) < 1e-9
