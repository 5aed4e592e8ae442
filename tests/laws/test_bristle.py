"""Bristle laws: fading damping, the limit of friction, passivity and the start of a contact."""

import itertools
import math

import numpy as np
import pytest
from bouncing import NORMAL, Sliding, at, by_name, row
from tests.build import counts_of

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.evaluate import friction_force, friction_limit
from scissordyn.laws.friction.bengisu_akay import BengisuAkay
from scissordyn.laws.friction.brown_mcphee import BrownMcPhee
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.friction.dahl import Dahl
from scissordyn.laws.friction.elastoplastic import ElastoPlastic
from scissordyn.laws.friction.gonthier import GonthierBristle
from scissordyn.laws.friction.stribeck import Stribeck
from scissordyn.laws.friction.threlfall import Threlfall

CONSTANT = 1e6  # [m/s] speed above which damping fades, so high that damping is constant
SLIP = np.concatenate([[0.0], np.geomspace(1e-9, 10.0, 41)])  # [m/s] slip speeds at which laws are evaluated
# Friction laws with bristles
BRISTLES = [law for law in catalogue.FRICTION.values() if "bristle_deflection" in [state.name for state in law.states]]
FADING = [sd.LuGre, ElastoPlastic]  # Friction laws whose bristle damping fades with speed


def force(law, v, z, normal=NORMAL):
    """Return the tangential force and the rates of the states."""
    return Sliding(law, normal)(v, z)


def start(law, v):
    """Return the states at the start of a contact."""
    return Sliding(law).states("start", v)


def states_of(law):
    """Return states over the whole reachable range: bristles up to static friction, dwell from 0 to 1."""
    if not law.states:
        return [()]
    largest = getattr(law, "static", None) or (law.kinetic if law.name == "dahl" else 1.5 * law.kinetic)
    bends = np.linspace(-largest, largest, 21) / law.bristle_stiffness
    return list(itertools.product(bends, (0.0, 0.5, 1.0))) if len(law.states) == 2 else [(bend,) for bend in bends]


@pytest.mark.parametrize(
    ("law", "limit"),
    [
        (Coulomb(0.2), 200.0),
        (sd.Ambrosio(0.2), 200.0),
        (Threlfall(0.2), 200.0),
        (Dahl(0.2), 200.0),
        (BengisuAkay(0.2, 0.5), 500.0),
        (BrownMcPhee(0.2), 300.0),
        (Stribeck(0.2, 0.4, viscous=0.1), 400.0 + 0.1 * 2.0 * 1000.0),
        (sd.LuGre(0.2, 0.4, viscous=0.1), 400.0 + 0.1 * 2.0 * 1000.0),
        (ElastoPlastic(0.2, 0.4, viscous=0.1), 400.0 + 0.1 * 2.0 * 1000.0),
        (GonthierBristle(0.2, 0.4, viscous=0.1), 400.0 + 0.1 * 2.0 * 1000.0),
        (catalogue.FRICTION["none"](), 0.0),
    ],
    ids=by_name,
)
def test_static_limit(law, limit):
    """Closed form: the largest force of a law at 2 m/s under 1 kN, equal in both directions."""
    for v in (2.0, -2.0):
        assert friction_limit(at(law, "limit"), v, NORMAL, row(law)) == pytest.approx(limit, rel=1e-14)


def test_users_friction_has_no_limit():
    """Contract: a user's friction law has no known limit."""
    assert (
        friction_limit(
            at(sd.element(slot="friction")(lambda slip_speed: 0.1 * slip_speed)(), "limit"), 2.0, NORMAL, np.zeros(16)
        )
        == math.inf
    )


@pytest.mark.parametrize(
    "law", [law for name, law in catalogue.FRICTION.items() if name not in ("none", "maxwell-slip")], ids=by_name
)
@pytest.mark.parametrize("kinetic", [0.01, 0.1, 0.6])
def test_friction_keeps_to_its_limit(law, kinetic):
    """Limit: at any slip speed and any reachable state the force stays within the law's own static limit."""
    options = [{}]
    if "static" in law.__dataclass_fields__:
        options = [{}, {"static": kinetic}, {"static": 3.0 * kinetic}]
    if "viscous" in law.__dataclass_fields__:
        options.append({"viscous": 0.2})
    for given in options:
        sliding = Sliding(law(kinetic, **given))
        states, limit_at = states_of(sliding.law), at(law, "limit")
        for v in (*SLIP, *-SLIP[1:]):
            limit = friction_limit(limit_at, v, NORMAL, sliding.p)
            assert max(abs(sliding(v, z)[0]) for z in states) <= limit * (1.0 + 1e-13)


def test_lugre_reaches_its_limit_with_more_damping():
    """Limit: LuGre exceeds static friction with 1.25 times the default damping speed, and not with 1.19 times.

    At a slip speed where g = mu_k the bound is sigma_1 |v| <= 2 mu_s mu_k/(mu_s + mu_k) = 1.2 mu_k.
    """
    law = sd.LuGre(0.1)
    speed = row(law)[7]
    faster = sd.LuGre(0.1, stribeck_speed=1e-6, damping_speed=1.25 * speed)
    within = sd.LuGre(0.1, stribeck_speed=1e-6, damping_speed=1.19 * speed)
    for friction, exceeds in ((faster, True), (within, False)):
        slip = np.linspace(0.5, 1.0, 51) * speed
        sliding = Sliding(friction)
        largest = max(abs(sliding(v, z)[0]) for v, z in itertools.product(slip, states_of(friction)))
        assert (largest > 150.0 * (1.0 + 1e-6)) == exceeds


@pytest.mark.parametrize("law", FADING, ids=by_name)
def test_fading_damping(law):
    """Closed form: sigma_1 falls to 1/e at the damping speed; with a damping speed of 1e6 m/s it is constant."""
    v, sigma_1 = 2e-3, 300.0
    for speed, share in ((v, math.exp(-1.0)), (2.0 * v, math.exp(-0.25)), (CONSTANT, 1.0)):
        found, rate = force(law(0.1, bristle_damping=sigma_1, damping_speed=speed), v, [0.0])
        assert rate[0] == v
        assert found == pytest.approx(NORMAL * sigma_1 * share * v, rel=1e-12)


def test_lugre_damping_speed():
    """Closed form: the default v_d makes the peak of sigma_1 |v| exp(-(v/v_d)^2), at v_d/sqrt 2, the kinetic coefficient."""
    law = sd.LuGre(0.08, bristle_damping=200.0)
    speed = row(law)[7]
    peak = force(law, speed / math.sqrt(2.0), [0.0])[0]
    assert peak == pytest.approx(NORMAL * 0.08, rel=1e-14)
    assert force(law, 1.01 * speed / math.sqrt(2.0), [0.0])[0] < peak > force(law, 0.99 * speed / math.sqrt(2.0), [0.0])[0]
    assert row(sd.LuGre(0.08, damping_speed=3e-3))[7] == 3e-3
    assert force(sd.LuGre(0.08, bristle_damping=0.0), 1e-3, [2e-7])[0] == pytest.approx(NORMAL * 1e5 * 2e-7, rel=1e-14)


def test_elasto_plastic_damping_speed():
    """Limit: with 2 % more than the default v_d, friction exceeds mu_s at some deflection near breakaway.

    The slip speed is far below the Stribeck speed, where g = mu_s.
    """
    for breakaway in (0.4, 0.7, 0.95):
        law = ElastoPlastic(0.1, breakaway=breakaway, stribeck_speed=1.0)
        speed = row(law)[7]
        for factor, exceeds in ((1.02, True), (0.999, False)):
            friction = ElastoPlastic(0.1, breakaway=breakaway, stribeck_speed=1.0, damping_speed=factor * speed)
            v = factor * speed / math.sqrt(2.0)
            sliding = Sliding(friction)
            largest = max(sliding(v, [bend])[0] for bend in np.linspace(0.0, 1.5e-6, 4001))
            assert (largest > 150.0 * (1.0 + 1e-6)) == exceeds


@pytest.mark.parametrize("breakaway", [0.05, 0.95])
def test_elasto_plastic_keeps_to_its_limit_to_rounding(breakaway):
    """Limit: at the speed of the largest damping, friction reaches mu_s at one deflection and exceeds it nowhere.

    With mu_s = mu_k the curve is flat, so that the slip speed does not matter.
    """
    law = ElastoPlastic(0.1, 0.1, breakaway=breakaway)
    v = row(law)[7] / math.sqrt(2.0)
    bends = np.linspace(0.0, 0.999e-6, 2001)
    forces = [force(law, v, [bend])[0] for bend in bends]
    first, last = bends[max(0, int(np.argmax(forces)) - 1) :][[0, 2]]
    largest = max(*forces, *(force(law, v, [bend])[0] for bend in np.linspace(first, last, 401)))
    assert 1.0 - 1e-7 < largest / (0.1 * NORMAL) <= 1.0 + 1e-14


@pytest.mark.parametrize("law", FADING, ids=by_name)
def test_slip_reversal_under_load(law):
    """Limit: slip that reverses at 5 km/s^2, as in the paper's case, never meets more than static friction.

    With constant damping it meets more than a hundred times as much. Integrated by Heun's method in steps of 1 ns.
    """
    largest = {}
    for name, friction in (("fading", law(0.1)), ("constant", law(0.1, damping_speed=CONSTANT))):
        h, p = 1e-9, row(friction)
        z, dz = start(friction, 0.05), np.zeros(1)
        largest[name] = 0.0
        for k in range(20_000):
            v = 0.05 - 5e3 * k * h
            found = friction_force(at(friction), v, 1.0, z, dz, p)
            largest[name] = max(largest[name], abs(found))
            here, first = z[0], dz[0]
            z[0] = here + h * first
            friction_force(at(friction), v - 5e3 * h, 1.0, z, dz, p)
            z[0] = here + 0.5 * h * (first + dz[0])
    assert largest["fading"] <= 0.15 * (1.0 + 1e-12)
    assert largest["constant"] > 100.0 * 0.15


def cycle_work(law, fast, *, slow=1e-4, length=3e-6, steps=1000):
    """Return the work of friction in the third cycle of slow and fast slip back and forth, over mu_k times the path."""
    p, z, dz = row(law), np.zeros(len(law.states)), np.zeros(len(law.states))
    work = 0.0
    for turn, speed in itertools.product(range(3), (slow, fast, -slow, -fast)):
        h = length / abs(speed) / steps
        for _ in range(steps):
            before, here = friction_force(at(law), speed, 1.0, z, dz, p), z.copy()
            first = dz.copy()
            z[:] = here + h * first
            after = friction_force(at(law), speed, 1.0, z, dz, p)
            z[:] = here + 0.5 * h * (first + dz)
            work += 0.5 * (before + after) * speed * h * (turn == 2)
    return work / (law.kinetic * 4.0 * length)


@pytest.mark.parametrize("law", FADING, ids=by_name)
def test_passive_in_cycles_of_slow_and_fast_slip(law):
    """Limit: slow slip that bends the bristles to static friction, then fast slip, costs energy in every closed cycle.

    With constant damping, lugre's fast slip returns eighty times mu_k F_n over the path.
    """
    for fast in (1e-3, 3e-3, 1e-2, 1e-1, 1.0):
        assert cycle_work(law(0.1), fast) > 0.5
    if law is sd.LuGre:
        assert cycle_work(law(0.1, damping_speed=CONSTANT), 1.0) == pytest.approx(-78.5, rel=1e-2)


@pytest.mark.parametrize("law", FADING, ids=by_name)
def test_dissipation_inequality(law):
    """Identity: F_t v - F_n sigma_0 z z' >= 0 in every state: at constant F_n the bristle energy is a storage function.

    It is mu^2 - s mu + s g >= 0 with s = sigma_1(v) |v|, which holds for s <= 4 g (Olsson 1996, Lund); the default has
    s <= g. A constant sigma_1 breaks it.
    """
    worst = {}
    for name, friction in (("fading", law(0.1)), ("constant", law(0.1, damping_speed=CONSTANT))):
        values = []
        for v, (bend,) in itertools.product(SLIP[1:], states_of(friction)):
            found, rate = force(friction, v, [bend], 1.0)
            values.append((found * v - 1e5 * bend * rate[0]) / v)
        worst[name] = min(values)
    assert worst["fading"] >= -1e-15
    assert worst["constant"] < -1.0


@pytest.mark.parametrize("law", BRISTLES, ids=by_name)
def test_contact_that_begins_near_rest(law):
    """Limit: the first deflection is odd and continuous in the slip speed; a dwell starts at zero.

    At 1e-4 of the Stribeck speed it is 1e-4 of the steady one.
    """
    friction = law(0.1)
    assert np.all(start(friction, 0.0) == 0.0)
    steady = 1.5e-6 if "static" in law.__dataclass_fields__ and law.name != "gonthier-bristle" else 1e-6
    assert start(friction, 1e-7)[0] == pytest.approx(1e-4 * steady, rel=1e-6, abs=0.0)
    bends = np.array([start(friction, v)[0] for v in SLIP])
    assert np.array_equal([start(friction, -v)[0] for v in SLIP], -bends)
    assert np.max(np.abs(np.diff([start(friction, v)[0] for v in np.linspace(-5e-3, 5e-3, 2001)]))) < 0.01 * steady
    for v in SLIP:
        assert not np.any(start(friction, v)[1:])
        found = abs(force(friction, v, start(friction, v))[0])
        assert found <= friction_limit(at(law, "limit"), v, NORMAL, row(friction)) * (1.0 + 1e-13)


@pytest.mark.parametrize("law", BRISTLES, ids=by_name)
def test_contact_that_begins_in_sliding(law):
    """Closed form: the first deflection is steady sliding's from twenty Stribeck speeds on, and tanh 1 of it at one."""
    friction = law(0.1)
    for v in (0.02, 0.5, -3.0):
        assert start(friction, v)[0] == pytest.approx(math.copysign(1e-6, v), rel=1e-15, abs=0.0)
    curve = 1e-6 if law.name in ("dahl", "gonthier-bristle") else 1e-6 * (1.0 + 0.5 / math.e)
    assert start(friction, 1e-3)[0] == pytest.approx(math.tanh(1.0) * curve, rel=1e-14, abs=0.0)


def test_explicit_steps_pass_states_near_the_smallest_numbers() -> None:
    """Second road: DOP853 agrees with Rodas5P although the dwell of a sliding journal is 1e-311."""
    laws = {"stiffness": Linear(1e9), "damping": Flores(0.5), "friction": GonthierBristle()}
    gap = sd.Clearance(1.7e-3, journal_radius=0.017, **laws)
    thrown = {"velocity": (0.177, -0.0547), "angular_velocity": 2.9}
    body = sd.Body("ball", 2.35, 6.85e-4, {"centre": (0.0, 0.0)}, position=(0.0, 0.0), **thrown)
    pin = sd.Revolute("pin", ("ball", "centre"), ("ground", "o"), gap)
    ball = sd.Mechanism((body,), joints=(pin,), ground=(("o", (0.0, 0.0)),), gravity=0.0)
    runs = [sd.simulate(ball, until=0.0275, start="as-placed", method=name, rtol=1e-9) for name in ("dop853", "rodas5p")]
    assert counts_of(runs[0])["steps"] < 500
    np.testing.assert_allclose(runs[0]["velocity"].values[-1], runs[1]["velocity"].values[-1], rtol=1e-6)
