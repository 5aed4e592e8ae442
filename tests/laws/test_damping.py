"""Damping factors and the restitution that they return."""

import itertools
import math

import numpy as np
import pytest
from bouncing import JOINT, STATELESS, at, bounce, by_name, row, step, work

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.damping import kelvin_voigt, proportional
from scissordyn.laws.damping.anagnostopoulos import Anagnostopoulos
from scissordyn.laws.damping.exact import Exact, exact_factor, returned_restitution
from scissordyn.laws.damping.gonthier import Gonthier
from scissordyn.laws.damping.kelvin_voigt import KelvinVoigt
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.evaluate import normal_force

# Damping laws that are one formula of the restitution coefficient
FACTORS = [
    law for law in catalogue.DAMPING.values() if law.declaration.kernels["force"] is proportional.force and law.name != "none"
]
MASS = 2.0  # [kg] mass that bounces


def made(law, restitution):
    """Return the law for a restitution; the undamped law has none."""
    return law() if law.name == "none" else law(restitution=restitution)


@pytest.mark.parametrize(
    ("name", "half", "four_fifths"),
    [
        ("hunt-crossley", 3 / 4, 3 / 10),
        ("herbert-mcwhannell", 1.0, 1.2 / 3.36),
        ("lee-wang", 3 / 8, 3 / 20),
        ("lankarani-nikravesh", 9 / 16, 27 / 100),
        ("zhiying-qishao", 9 / 16 * math.e, 27 / 100 * math.exp(0.4)),
        ("flores", 8 / 5, 2 / 5),
        ("hu-guo", 3 / 2, 3 / 8),
        ("carvalho-martins", 63 / 44, 3.06 / 8.2),
        ("safaeifar-farshidianfar", 5 / 4, 5 / 16),
    ],
)
def test_factors_by_hand(name, half, four_fifths):
    """Closed form: every published factor at c_e = 1/2 and 4/5, computed by hand with fractions."""
    law = catalogue.DAMPING[name]
    assert law(restitution=0.5).factor == pytest.approx(half, rel=1e-14)
    assert law(restitution=0.8).factor == pytest.approx(four_fifths, rel=1e-13)


@pytest.mark.parametrize(
    ("law", "figure"),
    [
        *((catalogue.DAMPING["hunt-crossley"](0.5), 0.66296), (catalogue.DAMPING["lankarani-nikravesh"](0.5), 0.72524)),
        *((catalogue.DAMPING["flores"](0.5), 0.47044), (Gonthier(0.5, approximate=True), 0.48774)),
    ],
    ids=by_name,
)
def test_returned_restitution_figures(law, figure):
    """Published number: returned restitution at c_e = 0.5 (docs/reference.md, normal force laws), five digits."""
    assert returned_restitution(law.factor) == pytest.approx(figure, abs=5e-6)


@pytest.mark.parametrize(("restitution", "figure"), [(0.9, 0.16648), (0.5, 1.43275), (0.1, 9.99816)])
def test_exact_factor_figures(restitution, figure):
    """Published number: the exact xi (docs/theory/contact.md), six digits; gonthier's d/c_e is the same number."""
    assert Exact(restitution).factor == pytest.approx(figure, abs=5e-6)
    d = Gonthier(restitution).factor * restitution
    assert (1 + d / restitution) / (1 - d) == pytest.approx(math.exp(d * (1 + 1 / restitution)), rel=1e-9)


def test_exact_factor_over_the_range():
    """Limit: exact tends to 3/2 (1-c_e) for c_e -> 1 and to 1/c_e for c_e -> 0; its inverse returns c_e."""
    assert exact_factor(1.0) == 0.0
    assert exact_factor(1 - 1e-7) == pytest.approx(1.5e-7, rel=1e-6)
    assert exact_factor(1e-3) == pytest.approx(1e3, rel=1e-14)
    for restitution in np.linspace(0.01, 0.999, 60):
        assert returned_restitution(exact_factor(restitution)) == pytest.approx(restitution, rel=1e-11)


def test_carvalho_martins_fits_exact():
    """Cross-check: carvalho-martins fits the exact factor; from c_e = 0.55 up it differs by at most 1.9e-4."""
    law = catalogue.DAMPING["carvalho-martins"]
    for restitution in np.linspace(0.55, 0.99, 40):
        assert law(restitution=restitution).factor == pytest.approx(exact_factor(restitution), rel=1.9e-4)


def test_impact_identities_for_all_pairs():
    """Identity: ln[(1+xi)/(1-xi e)] = xi (1+e) and int F_el = m v0^2 [xi - ln(1+xi)]/xi^2 for every elastic part and factor.

    The impact is integrated by a fourth-order Runge-Kutta method with 4000 steps to the deepest point (error about 1e-10).
    """
    worst = {}
    for elastic, damping in itertools.product(catalogue.ELASTIC.values(), [*FACTORS, catalogue.DAMPING["none"]]):
        stiffness = elastic()
        p = row(stiffness)
        for restitution, speed in itertools.product((0.3, 0.6, 0.95), (0.05, 1.0)):
            law = made(damping, restitution)
            xi = law.factor
            deepest, rebound = bounce(at(stiffness), p, at(law), row(law), speed, MASS, step(stiffness, MASS, speed))
            returned = rebound / speed
            energy = MASS * speed**2 * ((xi - math.log1p(xi)) / xi**2 if xi else 0.5)
            first = abs(math.log((1 + xi) / (1 - xi * returned)) - xi * (1 + returned)) if xi else abs(returned - 1.0)
            second = abs(work(stiffness, deepest) / energy - 1.0)
            key = (elastic.name, damping.name)
            worst[key] = max(worst.get(key, 0.0), first, second)
    failing = {key: value for key, value in worst.items() if not value < 1e-8}
    assert not failing
    assert len(worst) == len(catalogue.ELASTIC) * (len(FACTORS) + 1)


@pytest.mark.parametrize("restitution", [0.4, 0.7, 0.9])
def test_dashpot_closed_form(restitution):
    """Closed form: anagnostopoulos on a linear spring, the tension set to zero, after Schwager and Poeschel 2007.

    e = exp(-zeta w0 t), w_d t = pi - arctan(2 zeta sqrt(1-zeta^2)/(1-2 zeta^2)); doi:10.1007/s10035-007-0065-z.
    """
    k, speed = 1e8, 0.5
    law = Anagnostopoulos(restitution, stiffness=k, mass=MASS)
    zeta = -math.log(restitution) / math.sqrt(math.pi**2 + math.log(restitution) ** 2)
    root = math.sqrt(1 - zeta**2)
    expected = math.exp(-zeta / root * (math.pi - math.atan2(2 * zeta * root, 1 - 2 * zeta**2)))
    stiffness = Linear(k)
    _, rebound = bounce(at(stiffness), row(stiffness), at(law), row(law), speed, MASS, step(stiffness, MASS, speed))
    assert rebound / speed == pytest.approx(expected, rel=1e-6)
    # with the tension included the given restitution is returned: the duration is pi/w_d
    assert math.exp(-zeta / root * math.pi) == pytest.approx(restitution, rel=1e-12)


def test_anagnostopoulos_figure():
    """Closed form: c_e = e^-pi makes zeta = 1/sqrt 2, so C = sqrt(2 k m)."""
    law = Anagnostopoulos(math.exp(-math.pi), stiffness=8.0, mass=4.0)
    assert law.parameters(JOINT)[0] == pytest.approx(8.0, rel=1e-14)


def test_kelvin_voigt():
    """Closed form: kelvin-voigt adds C delta' and is never negative."""
    law = KelvinVoigt(coefficient=50.0)
    q = row(law)
    assert normal_force(at(law), 100.0, 1e-5, 0.5, 1.0, STATELESS, STATELESS, q) == pytest.approx(125.0, rel=1e-15)
    assert normal_force(at(law), 100.0, 1e-5, -3.0, 1.0, STATELESS, STATELESS, q) == 0.0
    assert law.declaration.kernels["force"] is kelvin_voigt.force


@pytest.mark.parametrize("damping", [law for law in catalogue.DAMPING.values() if not law.states], ids=by_name)
def test_damping_neither_pulls_nor_adds_energy(damping):
    """Limit: no damping gives tension, lowers the force on approach or raises it on rebound."""
    law = damping()
    q = row(law)
    for elastic, rate in itertools.product((0.0, 1.0, 1e4), (-5.0, -0.1, 0.0, 0.1, 5.0)):
        force = normal_force(at(law), elastic, 1e-5, rate, 0.5, STATELESS, STATELESS, q)
        assert force >= 0.0
        assert (force - elastic) * rate >= 0.0


@pytest.mark.parametrize("law", FACTORS, ids=by_name)
def test_restitution_bounds(law):
    """Contract: a restitution above 1 is refused, and c_e = 1 means no loss.

    Sources that mention high restitution without a number claim no range; the others claim the whole range.
    """
    silent = ("hunt-crossley", "herbert-mcwhannell", "lee-wang", "lankarani-nikravesh")
    assert law.restitution_range == (None if law.name in silent else (0.0, 1.0))
    with pytest.raises(sd.InputError, match="restitution"):
        law(restitution=1.01)
    assert law(restitution=1.0).factor == 0.0


def test_returned_restitution_without_damping():
    """Limit: without damping the impact is elastic."""
    assert returned_restitution(0.0) == 1.0
    assert returned_restitution(1e-9) == pytest.approx(1.0, rel=1e-8)
