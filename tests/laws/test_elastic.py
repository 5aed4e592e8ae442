"""Elastic parts of contact laws: published figures, inverse relations and the shape of the force."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bouncing import JOINT, UNIT_LENGTH, at, by_name, force, row
from mpmath import mp

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.elastic import logarithmic
from scissordyn.laws.elastic.bai_zhao import BaiZhaoAsPrinted
from scissordyn.laws.elastic.braendlein import Braendlein
from scissordyn.laws.elastic.dubowsky_freudenstein import DubowskyFreudenstein
from scissordyn.laws.elastic.esdu import Esdu
from scissordyn.laws.elastic.johnson import Johnson
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.elastic.pereira import Pereira
from scissordyn.laws.elastic.persson import Persson
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.elastic.radzimovsky import Radzimovsky
from scissordyn.laws.evaluate import elastic_force

DEPTHS = np.logspace(-12, -3.4, 200)  # [m] indentations at which laws are evaluated
ALL = list(catalogue.ELASTIC.values())  # All elastic laws
E_STAR = UNIT_LENGTH.modulus  # [Pa] contact modulus E* of the joint


@pytest.mark.parametrize(
    ("law", "figure"),
    [
        (Johnson(), 5.8500e5),
        (Esdu(), 4.2385e5),
        (sd.Liu(), 1.7690e5),
        (Persson(), 8.9771e5),
        (Pereira(), 6.2296e5),
        (DubowskyFreudenstein(), 2.1009e5),
        (sd.Hertz(), 2.0903e3),
    ],
    ids=by_name,
)
def test_figures(law, figure):
    """Published number: force at delta = 10 um, c = 0.5 mm, R_B = 10 mm, steel, per metre of length (Hertz sphere: in all).

    The figures come from an independent evaluation of the printed laws (docs/reference.md), five digits each.
    """
    assert force(law, 1e-5, UNIT_LENGTH) == pytest.approx(figure, rel=1e-4 / 1.7)


def test_braendlein():
    """Closed form: with 1 mm of length and of indentation the force is the law's constant in N; it grows as delta^(10/9)."""
    mm = replace(JOINT, length=1e-3)
    assert force(Braendlein(), 1e-3, mm) == pytest.approx(35948.0, rel=1e-12)
    assert force(Braendlein(), 512e-3, mm) == pytest.approx(35948.0 * 2.0**10, rel=1e-12)  # 512 = 2^9
    assert force(Braendlein(), 1e-3, replace(JOINT, length=0.512)) == pytest.approx(35948.0 * 2.0**8, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "expected"),
    [(Linear(stiffness=3e8), 3e8 * 4e-6), (PowerLaw(coefficient=5e9, exponent=1.5), 5e9 * 8e-9)],
    ids=by_name,
)
def test_laws_with_given_constants(law, expected):
    """Closed form: force of a linear spring and of a power law with exponent 1.5 at 4 um."""
    assert force(law, 4e-6) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("law", "printed"),
    [
        (Johnson(), lambda f: f / (math.pi * E_STAR) * (math.log(4 * math.pi * E_STAR * 0.5e-3 / f) - 1)),
        (Esdu(), lambda f: f / (math.pi * E_STAR) * (math.log(4 * 0.5e-3 / (f / (math.pi * E_STAR))) + 1)),
        (
            Radzimovsky(),
            lambda f: (
                f
                / (math.pi * E_STAR)
                * (
                    2 / 3
                    + math.log(4 * 10e-3 / (2 * math.sqrt(f * 0.19 / (math.pi * E_STAR))))
                    + math.log(4 * 9.5e-3 / (2 * math.sqrt(f * 0.19 / (math.pi * E_STAR))))
                )
            ),
        ),
        (
            DubowskyFreudenstein(),
            lambda f: f / (math.pi * E_STAR) * (math.log(0.5e-3 / (f * 10e-3 * 9.5e-3 / (math.pi * E_STAR))) + 1),
        ),
        (
            DubowskyFreudenstein(length_exponent=1.0),
            lambda f: f / (math.pi * E_STAR) * (math.log(0.5e-3 / (f * 10e-3 * 9.5e-3 / (math.pi * E_STAR))) + 1),
        ),
    ],
    ids=by_name,
)
def test_implicit_laws_invert_to_round_off(law, printed):
    """Identity: the printed indentation of the computed force is the indentation (L_b = 1 m, so that m makes no difference).

    ln(C/f) - 1 amplifies round-off near the turning point by 1/(t - 1) < 10, hence 1e-14.
    """
    turn = law.parameters(UNIT_LENGTH)[2]
    for delta in np.geomspace(1e-13, min(0.999 * turn, 2e-2), 300):
        assert printed(force(law, delta, UNIT_LENGTH)) == pytest.approx(delta, rel=1e-14)


def test_johnson_domain():
    """Closed form: the law turns at 4 c/e^2; its tangent begins at TURN e^(1-TURN) = 97.35 % of that, with the same slope."""
    p = row(Johnson(), UNIT_LENGTH)
    assert p[2] == pytest.approx(1.25 * math.exp(-0.25) * 4 * 0.5e-3 / math.e**2, rel=1e-14)
    below, above = (elastic_force(at(Johnson), p[2] * (1 + s * 1e-9), p) for s in (-1, 1))
    assert (above - below) / (2e-9 * p[2]) == pytest.approx(p[4], rel=1e-4)


def test_dubowsky_freudenstein_length():
    """Identity: with m = 3 the law is independent of the unit of length: f depends on L_b^2 c/(R_B R_J) only."""
    law = DubowskyFreudenstein()
    scaled = replace(JOINT, clearance=1e-3, journal_radius=19e-3, length=30e-3)
    assert force(law, 2e-5, scaled) == pytest.approx(4.0 * force(law, 1e-5, JOINT), rel=1e-13)


def test_radzimovsky_half_widths():
    """Closed form: a half width k times Hertz's shifts the logarithm by -2 ln k."""
    hertz, wide = Radzimovsky(), Radzimovsky(half_width=1.6)
    f = force(wide, 1e-5, UNIT_LENGTH)
    shift = 2.0 * math.log(1.6 / (2.0 / math.sqrt(math.pi)))
    assert force(hertz, 1e-5 + f / (math.pi * E_STAR) * shift, UNIT_LENGTH) == pytest.approx(f, rel=1e-13)


def test_pieces_of_the_logarithm():
    """Cross-check: each piece is Lambert's function to 1.1e-16 of its value, of which floats have 1.1e-16 themselves."""
    x = np.linspace(-1.0, 1.0, 9).tolist()
    with mp.workdps(40):
        for k, piece in enumerate(logarithmic._PIECES.tolist()):
            for place in x[k == 0 :]:
                level = ((k + (mp.mpf(place) + 1) / 2) / logarithmic.PIECES_PER_UNIT) ** 2 + 1
                value = mp.polyval([mp.mpf(c) for c in reversed(piece)], mp.mpf(place))
                assert abs(value / -mp.lambertw(-mp.exp(-level), -1) - 1) < 1.1e-16


def test_persson_as_printed():
    """Identity: the half-angle form equals the printed form in eps."""
    for delta in np.geomspace(1e-7, 2.9e-3, 40):
        b = math.tan(0.5 * math.acos(0.5e-3 / (0.5e-3 + delta)))
        printed = E_STAR * 0.5e-3 * math.pi * b**2 * (b**2 + 1) / (2 - math.log(b**2 + 1) - 2 * b**4)
        assert force(Persson(), delta, UNIT_LENGTH) == pytest.approx(printed, rel=1e-9)  # acos loses digits at small arcs


def test_persson_small_arcs():
    """Limit: for delta -> 0 Persson's f tends to pi E* delta/4 (b^2 -> delta/(2 c), denominator -> 2)."""
    assert force(Persson(), 1e-11, UNIT_LENGTH) == pytest.approx(math.pi * E_STAR * 1e-11 / 4.0, rel=1e-7)


def test_persson_tangent():
    """Identity: force and slope are continuous where the tangent begins, at six clearances."""
    p = row(Persson(), UNIT_LENGTH)
    assert p[2] == pytest.approx(6 * 0.5e-3, rel=1e-14)
    h = 1e-7 * p[2]
    below = [elastic_force(at(Persson), p[2] - k * h, p) for k in (1, 2)]
    assert below[0] == pytest.approx(p[3] - p[4] * h, rel=1e-10)
    assert (below[0] - below[1]) / h == pytest.approx(p[4], rel=1e-5)


def test_pereira_pieces_meet():
    """Identity: the exponent's two pieces meet at 0.34954 mm to the digits of their constants."""
    below, above = (Pereira().parameters(replace(JOINT, clearance=c)) for c in (0.3495399e-3, 0.3495401e-3))
    assert below[1] == pytest.approx(above[1], rel=3e-5)


def test_pereira_small_clearance():
    """Closed form: c = 0.1 mm by hand, Y = 1.51/(ln 100)^0.151 = 1.19904, n = Y 0.1^-0.005 = 1.21293, factor 1.93 E* L_b/mm."""
    joint = replace(UNIT_LENGTH, clearance=0.1e-3)
    stiffness, exponent = Pereira().parameters(joint)
    assert exponent == pytest.approx(1.51 / 4.605170186**0.151 * 1.011579454, rel=1e-9)
    # at delta = 1 mm the power is 1: (0.965 * 0.1 + 0.0965)/0.1 = 1.93
    assert stiffness * 1e-3**exponent == pytest.approx(1.93 * E_STAR * 1e-6 * 1e3, rel=1e-12)


@pytest.mark.parametrize("clearance", [4.99e-6, 10.05e-3])
def test_pereira_range(clearance):
    """Contract: outside the clearances of its fit the law is refused."""
    with pytest.raises(sd.InputError, match="Pereira"):
        Pereira().parameters(replace(JOINT, clearance=clearance, journal_radius=1.0))
    assert Pereira().parameters(replace(JOINT, clearance=5.01e-6))[1] > 1.0


def test_pereira_large_clearance():
    """Closed form: just above 0.34954 mm the exponent is that of the straight piece."""
    exponent = Pereira().parameters(replace(JOINT, clearance=0.351e-3))[1]
    assert exponent == pytest.approx((0.0151 * 0.351 + 1.151) * 0.351**-0.005, rel=1e-9)


def test_bai_zhao_as_printed_is_the_slope_of_liu():
    """Identity: the printed K_n is dF/d delta of Liu's law per unit length, by a sixth-order difference."""
    weights = {-3: -1 / 60, -2: 9 / 60, -1: -45 / 60, 1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    for delta in (1e-7, 1e-5, 3e-4):
        h = 1e-3 * delta
        slope = sum(w * force(sd.Liu(), delta + k * h, UNIT_LENGTH) for k, w in weights.items()) / h
        assert force(BaiZhaoAsPrinted(), delta, UNIT_LENGTH) / delta**1.5 == pytest.approx(slope, rel=1e-11)


@pytest.mark.parametrize("law", ALL, ids=by_name)
def test_monotone_from_zero(law):
    """Limit: every elastic part starts at zero and grows with the indentation, tangents included."""
    values = [force(law(), delta) for delta in [*DEPTHS, 5e-4, 1e-3, 3e-3, 5e-3]]
    assert np.all(np.diff(values) > 0.0)
    assert values[0] < 1e-2


@pytest.mark.parametrize("law", [law for law in ALL if law.name not in ("linear", "power", "braendlein")], ids=by_name)
def test_force_is_proportional_to_the_modulus(law):
    """Limit: doubling both compliances halves the force at the same indentation."""
    soft = replace(JOINT.journal, youngs_modulus=0.5 * JOINT.journal.youngs_modulus)
    halved = force(law(), 1e-5, replace(JOINT, journal=soft, bearing=soft))
    assert halved == pytest.approx(0.5 * force(law(), 1e-5), rel=1e-12)
