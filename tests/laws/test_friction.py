"""Friction laws: steady sliding, sticking, stick-slip and passivity."""

import math

import numpy as np
import pytest
from bouncing import NORMAL, Sliding, by_name
from scipy.integrate import solve_ivp

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.friction.bengisu_akay import BengisuAkay
from scissordyn.laws.friction.brown_mcphee import BrownMcPhee
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.friction.dahl import Dahl
from scissordyn.laws.friction.elastoplastic import ElastoPlastic
from scissordyn.laws.friction.gonthier import GonthierBristle
from scissordyn.laws.friction.maxwell_slip import MaxwellSlip
from scissordyn.laws.friction.stribeck import Stribeck
from scissordyn.laws.friction.threlfall import Threlfall

ALL = [law for name, law in catalogue.FRICTION.items() if name != "none"]  # All friction laws with friction
# [m/s] slip speeds at which laws are evaluated
SPEEDS = np.array([-1.0, -0.03, -2e-3, -5e-4, 5e-4, 1e-3, 1.005e-3, 2e-3, 0.03, 1.0])


def curve(v, *, mu_k=0.05, mu_s=0.075, v_s=1e-3):
    """Return the friction coefficient of the Stribeck curve with the default parameters."""
    return mu_k + (mu_s - mu_k) * math.exp(-((v / v_s) ** 2))


@pytest.mark.parametrize(
    ("law", "coefficient"),
    [
        (Coulomb(0.05, ramp_speed=0.0), lambda v: 0.05),
        (Coulomb(0.05, ramp_speed=1e-3), lambda v: 0.05 * math.tanh(v / 1e-3)),
        (sd.Ambrosio(), lambda v: 0.05 * min(1.0, max(0.0, (v - 1e-4) / 9e-4))),
        (Threlfall(), lambda v: 0.05 * (1 - math.exp(-3 * v / 1e-3))),
        (
            BengisuAkay(),
            lambda v: 0.075 - 0.075 * (v / 1e-3 - 1) ** 2 if v < 1e-3 else 0.05 + 0.025 * math.exp(-1e3 * (v - 1e-3)),
        ),
        (BrownMcPhee(), lambda v: 0.05 * math.tanh(4e3 * v) + 0.025 * 1e3 * v / (250e3 * v * v + 0.75) ** 2),
        (
            BrownMcPhee(0.1, 0.25, transition_speed=2e-3),
            lambda v: 0.1 * math.tanh(2e3 * v) + 0.15 * 500.0 * v / (62.5e3 * v * v + 0.75) ** 2,
        ),
        (Stribeck(ramp_speed=0.0, viscous=0.1), lambda v: curve(v) + 0.1 * v),
        (Dahl(), lambda v: 0.05),
        (MaxwellSlip(), lambda v: 0.05),
        (sd.LuGre(viscous=0.1), lambda v: curve(v) + 0.1 * v),
        (ElastoPlastic(viscous=0.1), lambda v: curve(v) + 0.1 * v),
        (
            GonthierBristle(viscous=0.1),
            lambda v: min(curve(v), 0.05 + 10.0 * v * math.exp(-((v / 1e-3) ** 2)) / -math.expm1(-((v / 1e-3) ** 2))) + 0.1 * v,
        ),
    ],
    ids=by_name,
)
def test_steady_sliding(law, coefficient):
    """Closed form: the force of steady sliding follows the law's curve and is odd in v (laws with states: after 0.1 s)."""
    sliding = Sliding(law)
    for v in SPEEDS:
        expected = math.copysign(coefficient(abs(v)) * NORMAL, v)
        assert sliding.settled(v) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("law", [law for law in ALL if law.states], ids=by_name)
def test_contact_starts_in_steady_sliding(law):
    """Limit: at 1 mm/s and more a contact starts with states that do not change and give the settled force."""
    sliding = Sliding(law())
    for v in (-1.0, -0.05, 0.05, 1.0):
        z = sliding.states("start", v)
        force, rate = sliding(v, z)
        assert np.all(np.abs(rate) < 1e-9 * abs(v))
        assert force == pytest.approx(sliding.settled(v), rel=1e-7)
    assert np.all(np.isfinite(sliding.states("start", 0.0)))


@pytest.mark.parametrize("law", [law for law in ALL if law.states], ids=by_name)
def test_steady_states(law):
    """Limit: the states of steady sliding give the force that is reached after 0.1 s, also below the Stribeck speed."""
    sliding = Sliding(law())
    for v in SPEEDS:
        assert sliding(v, sliding.states("steady", v))[0] == pytest.approx(sliding.settled(v), rel=1e-7)
    assert sliding.states("steady", 0.0)[0] == 0.0


@pytest.mark.parametrize("law", ALL, ids=by_name)
def test_sliding_dissipates(law):
    """Limit: in steady sliding friction has the sign of the slip speed; at rest it is zero."""
    sliding = Sliding(law())
    for v in SPEEDS:
        assert sliding(v, sliding.states("start", v))[0] * v > 0.0
    assert sliding(0.0, np.zeros(sliding.count))[0] == 0.0


@pytest.mark.parametrize("law", ALL, ids=by_name)
def test_passive_in_closed_cycles(law):
    """Limit: over closed cycles of slip, from micrometres to millimetres, no law returns more work than it received.

    The bristles start undeflected, so that the work done on the surfaces is never negative.
    """
    for amplitude in (2e-7, 2e-6, 1e-3):
        sliding = Sliding(law())
        omega = 2 * math.pi * 50.0
        size = sliding.count + 1

        def motion(t, y, sliding=sliding, amplitude=amplitude, omega=omega):
            v = amplitude * omega * math.cos(omega * t)
            force, dz = sliding(v, y[:-1])
            return np.array([*dz, force * v])

        found = solve_ivp(motion, (0.0, 3 / 50.0), np.zeros(size), method="LSODA", rtol=1e-7, atol=1e-12, max_step=1e-4)
        work = found.y[-1]
        assert np.all(work >= -1e-9)
    assert work[-1] > 0.0


def test_lugre_stick_slip_reference():
    """Published number: Canudas de Wit et al. 1995, doi:10.1109/9.376053: a mass pulled by a spring at 0.1 m/s.

    m = 1 kg, k = 2 N/m, sigma_0 = 1e5, sigma_1 = sqrt(1e5), sigma_2 = 0.4, F_C = 1 N, F_S = 1.5 N, v_s = 1 mm/s; after 25 s
    x = 1.908839199 m and z = 1.18167955e-5 m (docs/reference.md, friction). By LSODA of scipy at 1e-10.
    """
    law = sd.LuGre(kinetic=1.0, static=1.5, bristle_damping=math.sqrt(1e5), viscous=0.4, damping_speed=1e6)
    sliding = Sliding(law, normal=1.0)

    def motion(t, y):
        force, dz = sliding(y[1], y[2:])
        return np.array([y[1], 2.0 * (0.1 * t - y[0]) - force, dz[0]])

    found = solve_ivp(motion, (0.0, 25.0), np.zeros(3), method="LSODA", rtol=1e-10, atol=1e-13)
    assert found.y[0, -1] == pytest.approx(1.908839199, rel=1e-6)
    assert found.y[2, -1] == pytest.approx(1.18167955e-5, rel=1e-6)


@pytest.mark.parametrize("law", [sd.LuGre(), Dahl(), ElastoPlastic()], ids=by_name)
def test_bristles_bend_first(law):
    """Limit: for slips far below mu/sigma_0 = 0.5 um the law is a spring sigma_0 F_n."""
    sliding = Sliding(law)
    slip, time = 1e-10, 1.0
    force = sliding.settled(slip / time, time=time)
    extra = 316.0 * slip / time * NORMAL if law.name != "dahl" else 0.0
    assert force == pytest.approx(1e5 * slip * NORMAL + extra, rel=1e-3)


def test_dahl_exponential():
    """Closed form: from rest the dahl force is F_n mu (1 - exp(-sigma_0 x/mu)) for n = 1.

    For n = 2 the equation dF/dx = sigma_0 (1 - F/mu)^2 gives F = mu (1 - 1/(1 + sigma_0 x/mu)).
    """
    x = 7e-7
    s = 1e5 * x / 0.05
    assert Sliding(Dahl()).settled(x, time=1.0) == pytest.approx(NORMAL * 0.05 * -math.expm1(-s), rel=1e-8)
    assert Sliding(Dahl(shape=2.0)).settled(x, time=1.0) == pytest.approx(NORMAL * 0.05 * (1 - 1 / (1 + s)), rel=1e-8)


def test_lugre_rate():
    """Closed form: z' and force of lugre with constant damping at one state, computed by hand."""
    force, rate = Sliding(sd.LuGre(damping_speed=1e6))(1e-3, [3e-7])
    z_rate = 1e-3 - 1e5 * 1e-3 * 3e-7 / (0.05 + 0.025 / math.e)
    assert rate[0] == pytest.approx(z_rate, rel=1e-14)
    assert force == pytest.approx(NORMAL * (1e5 * 3e-7 + 316.0 * z_rate), rel=1e-14)


def test_elasto_plastic_does_not_creep():
    """Limit: below the breakaway deflection elasto-plastic bristles only bend (Dupont et al. 2002); LuGre's creep.

    A pull of half the breakaway force plus a ripple moves a mass back and forth; the drift between two equal phases is zero.
    """
    drift = {}
    for law in (ElastoPlastic(bristle_damping=500.0), sd.LuGre(bristle_damping=500.0)):
        sliding = Sliding(law, normal=1.0)

        def motion(t, y, sliding=sliding):
            pull = 0.01 + 0.01 * math.sin(2 * math.pi * 20.0 * t)
            force, dz = sliding(y[1], y[2:])
            return np.array([y[1], pull - force, dz[0]])

        instants = np.array([0.1, 0.4])  # six whole ripples apart
        found = solve_ivp(motion, (0.0, 0.4), np.zeros(3), method="LSODA", t_eval=instants, rtol=1e-10, atol=1e-16)
        drift[law.name] = found.y[0, 1] - found.y[0, 0]
    assert abs(drift["elasto-plastic"]) < 1e-13
    assert drift["lugre"] > 1e-10


def test_elasto_plastic_transition():
    """Closed form: alpha is 0 at z_ba, 1/2 halfway to z_max and 1 at z_max; it is 0 when v has the other sign."""
    sliding = Sliding(ElastoPlastic(breakaway=0.6))
    v = 0.5  # far above the Stribeck speed: z_max = mu_k/sigma_0
    farthest, breakaway = 0.05 / 1e5, 0.6 * 0.05 / 1e5
    halfway = 0.5 * (farthest + breakaway)
    quarter = 0.75 * breakaway + 0.25 * farthest
    soon = breakaway + 0.01 * (farthest - breakaway)
    shares = (0.99 * breakaway, 0.0), (soon, 0.5 - 0.5 * math.cos(0.01 * math.pi)), (quarter, 0.5 - 0.5 * math.sqrt(0.5))
    for bend, alpha in (*shares, (halfway, 0.5), (farthest, 1.0)):
        assert sliding(v, [bend])[1][0] == pytest.approx(v * (1 - alpha * bend / farthest), rel=1e-9, abs=1e-12)
        assert sliding(-v, [bend])[1][0] == -v


def test_gonthier_bristle_dwell():
    """Closed form: at rest the dwell grows as 1 - exp(-t/tau_d); in sliding it falls with sigma_1/sigma_0.

    The largest force before sliding follows the dwell: mu_k + (mu_s - mu_k) w.
    """
    law = GonthierBristle(dwell_time=2e-3)
    sliding = Sliding(law)
    for time in (1e-3, 5e-3):
        found = solve_ivp(lambda t, y: sliding(0.0, y)[1], (0, time), [0.0, 0.0], method="LSODA", rtol=1e-10, atol=1e-14)
        grown = -math.expm1(-time / 2e-3)
        assert found.y[1, -1] == pytest.approx(grown, rel=1e-8)
        assert sliding(0.0, [1.0, grown])[0] == pytest.approx(NORMAL * (0.05 + 0.025 * grown), rel=1e-12)
        assert sliding(0.0, [-1.0, grown])[0] == pytest.approx(-NORMAL * (0.05 + 0.025 * grown), rel=1e-12)
    found = solve_ivp(lambda t, y: sliding(1.0, y)[1], (0, 2e-4), [5e-7, 1.0], method="LSODA", rtol=1e-10, atol=1e-14)
    assert found.y[1, -1] == pytest.approx(math.exp(-2e-4 * 1e5 / 10.0), rel=1e-8)


def test_gonthier_bristle_smoothing():
    """Closed form: d(v) is 3/4 - 1/16 = 11/16 at half the smoothing speed and 1 from that speed on."""
    sliding = Sliding(GonthierBristle(smoothing_speed=0.2, stribeck_speed=1e-3))
    assert sliding(0.1, [0.0, 0.0])[1][0] == pytest.approx(0.05 * 11 / 16 / 10.0, rel=1e-12)
    for v in (0.2008, 0.3):
        assert sliding(v, [0.0, 0.0])[1][0] == pytest.approx(0.05 / 10.0, rel=1e-12)
    assert sliding.states("start", 0.1)[0] * 1e5 == pytest.approx(0.05 * 11 / 16, rel=1e-12)


@pytest.mark.parametrize("v", [5e-4, -5e-4, 2e-3])
def test_gonthier_bristle_between_sticking_and_sliding(v):
    """Closed form: friction below its limit is s (sigma_0 z + sigma_1 v) + (1 - s) mu_k sgn v."""
    found, rate = Sliding(GonthierBristle())(v, [math.copysign(2e-7, v), 0.0])
    stick = math.exp(-((v / 1e-3) ** 2))
    assert found == pytest.approx(NORMAL * math.copysign(stick * (0.02 + 10.0 * abs(v)) + (1.0 - stick) * 0.05, v), rel=1e-13)
    assert rate[0] == pytest.approx(stick * v + (1.0 - stick) * math.copysign(0.03 / 10.0, v), rel=1e-13)


def test_gonthier_bristle_steady_states():
    """Closed form: below v_s bristles bend to the static friction of their dwell e^(-(v/v_s)^2), above to kinetic friction.

    In between, sigma_0 z = mu_k + sigma_1 v s/(1 - s).
    """
    sliding = Sliding(GonthierBristle(0.1, 0.3, bristle_damping=50.0))
    for v, bend in ((1e-4, 0.1 + 0.2 * math.exp(-0.01)), (-1e-4, -0.1 - 0.2 * math.exp(-0.01)), (0.05, 0.1)):
        assert sliding.states("steady", v) == pytest.approx([bend / 1e5, math.exp(-((v / 1e-3) ** 2))], rel=1e-13, abs=0.0)
    assert sliding.states("steady", 2e-3)[0] * 1e5 == pytest.approx(
        0.1 + 50.0 * 2e-3 * math.exp(-4.0) / (1.0 - math.exp(-4.0)), rel=1e-13, abs=0.0
    )


@pytest.mark.parametrize(
    ("law", "points"),
    [
        (Threlfall(), [0.0]),
        (BrownMcPhee(), [0.0, 1e-3, -1e-3]),
        (BengisuAkay(), [0.0]),
        (Coulomb(), [0.0]),
        (Stribeck(), [0.0]),
    ],
    ids=by_name,
)
def test_smooth_curves(law, points):
    """Limit: the slopes on both sides of the joints of a smooth curve agree, to first order in the distance."""
    sliding = Sliding(law)
    h = 1e-8
    for v in points:
        right = (sliding(v + h, [])[0] - sliding(v, [])[0]) / h
        left = (sliding(v, [])[0] - sliding(v - h, [])[0]) / h
        scale = NORMAL * 0.05 / 1e-3
        assert abs(right - left) < 2e-3 * scale


@pytest.mark.parametrize("law", ALL, ids=by_name)
def test_proportional_to_the_normal_force(law):
    """Limit: twice the normal force gives twice the friction, and no normal force gives none."""
    one, two, nothing = (Sliding(law(), normal=n) for n in (NORMAL, 2 * NORMAL, 0.0))
    z = one.states("start", 0.02)
    assert two(0.02, z)[0] == pytest.approx(2 * one(0.02, z)[0], rel=1e-14)
    assert nothing(0.02, z)[0] == 0.0


@pytest.mark.parametrize("law", [law for law in ALL if "static" in law.__dataclass_fields__], ids=by_name)
def test_static_at_least_kinetic(law):
    """Contract: a static coefficient below the kinetic one is refused."""
    with pytest.raises(sd.InputError, match="static"):
        law(kinetic=0.2, static=0.1)
