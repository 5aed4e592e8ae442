"""Elastic energy of a contact, compared with quadrature of its force."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from bouncing import JOINT, at, by_name, row
from scipy.integrate import quad

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.contact import TangentElastic
from scissordyn.laws.elastic.dubowsky_freudenstein import DubowskyFreudenstein
from scissordyn.laws.elastic.johnson import Johnson
from scissordyn.laws.elastic.persson import Persson
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.elastic.radzimovsky import Radzimovsky
from scissordyn.laws.evaluate import elastic_energy, elastic_force

C = JOINT.clearance  # [m] radial clearance of the joint
INDENTATIONS = (1e-6, 1e-3, 0.1, 0.5, 0.525, 0.999, 1.0, 1.001, 2.0, 3.0, 5.999, 6.001, 8.0, 18.0)
"""Indentations in clearances, up to the journal radius, on both sides of each value at which a law changes its formula."""
ALL = [law() for law in catalogue.ELASTIC.values()]  # All elastic laws with their default parameters


def energy(law, delta, joint=JOINT):
    """Return the elastic energy as the kernel computes it."""
    return elastic_energy(at(law, "energy"), at(law), delta, row(law, joint))


def work(law, delta, joint=JOINT, breaks=()):
    """Integrate the force by scipy's adaptive quadrature in s = sqrt(delta), piece by piece."""
    p = row(law, joint)
    ends = np.sqrt([0.0, *sorted(b for b in breaks if b < delta), delta])
    return math.fsum(
        quad(lambda s: elastic_force(at(law), s * s, p) * 2.0 * s, a, b, epsabs=0.0, epsrel=5e-13, limit=200)[0]
        for a, b in itertools.pairwise(ends)
    )


@pytest.mark.parametrize("law", [*ALL, Radzimovsky(half_width=1.6), DubowskyFreudenstein(1.0), PowerLaw(1e8, 0.5)], ids=by_name)
@pytest.mark.parametrize("clearance", [C, 0.02e-3])
def test_energy_is_the_work_of_the_force(law, clearance):
    """Cross-check: the energy is the work of the force to 1e-12, from a nanometre to the journal's radius."""
    joint = replace(JOINT, clearance=clearance)
    breaks = [law.deepest(joint)] if isinstance(law, TangentElastic) else []
    depths = [share * clearance for share in INDENTATIONS]
    depths += [b * (1.0 + sign * 1e-9) for b in breaks for sign in (-1, 0, 1)]
    for delta in depths:
        assert energy(law, delta, joint) == pytest.approx(work(law, delta, joint, breaks), rel=1e-12)
    assert energy(law, 0.0, joint) == 0.0
    assert energy(law, -1e-4, joint) == 0.0


def test_where_continued_laws_begin_their_tangent():
    """Closed form: tangents begin at TURN e^(1-TURN) of the turning point, Persson's at six clearances."""
    names = {law.name for law in ALL if isinstance(law, TangentElastic)}
    assert names == {"johnson", "esdu-78035", "radzimovsky", "dubowsky-freudenstein", "persson"}
    assert Persson().deepest(JOINT) == pytest.approx(6.0 * C, rel=1e-14)
    assert Johnson().deepest(JOINT) == pytest.approx(1.25 * math.exp(-0.25) * 4.0 * C / math.e**2, rel=1e-14)


def stiffness(function):
    """Return a stiffness law made of one function without parameters."""
    return sd.element(slot="stiffness")(function)()


def test_users_laws():
    """Closed form: energy of a user's power law, of laws with two kinks or a flat start, and NaN of an undefined force."""

    def kinked(indentation):
        return 1e8 * indentation + 3e9 * max(indentation - 1.1e-4, 0.0) - 1e9 * max(indentation - 2.3e-4, 0.0)

    def late(indentation):
        return 5e8 * max(indentation - 1e-4, 0.0)

    power = stiffness(lambda indentation: 2e9 * indentation**1.3)
    assert energy(power, 3e-4) == pytest.approx(2e9 * 3e-4**2.3 / 2.3, rel=1e-12)
    expected = 0.5 * (1e8 * 4e-4**2 + 3e9 * 2.9e-4**2 - 1e9 * 1.7e-4**2)
    assert energy(stiffness(kinked), 4e-4) == pytest.approx(expected, rel=1e-12)
    assert energy(stiffness(late), 4e-4) == pytest.approx(0.5 * 5e8 * 3e-4**2, rel=1e-12)
    hole = stiffness(lambda indentation: math.nan if 1.2e-4 < indentation < 1.6e-4 else 1e8 * indentation)
    assert math.isnan(elastic_energy(at(hole, "energy"), at(hole), 4e-4, row(hole, replace(JOINT, clearance=1e-4))))


def test_users_law_that_is_not_smooth():
    """Limit: quadrature of a force with ripples too fine to resolve ends, near the work without ripples."""
    rippled = stiffness(lambda indentation: 1e8 * indentation * (1.0 + 0.5 * math.sin(3e9 * indentation)))
    assert energy(rippled, 4e-4) == pytest.approx(0.5 * 1e8 * 4e-4**2, rel=0.05)
