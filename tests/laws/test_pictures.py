"""Small experiments that show a law, and their pictures."""

import numpy as np
import pytest
from bouncing import JOINT

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.damping.exact import returned_restitution
from scissordyn.laws.experiment import impact, oscillation, steady_coefficient
from scissordyn.plot.law import draw_gallery, draw_law

ENTRIES = [(kind, name) for kind, laws in catalogue.BY_KIND.items() for name in laws]  # Pairs of kind and name of all laws


def test_impact():
    """Identity: the rebound is the root of the energy integral, and the loop's area is the energy lost."""
    history = impact(sd.Liu(), sd.Flores(0.6), JOINT, mass=3.0, speed=0.4, samples=4001)
    assert history.restitution == pytest.approx(returned_restitution(sd.Flores(0.6).factor), rel=1e-7)
    area = np.trapezoid(history.force, history.indentation)
    assert area == pytest.approx(0.5 * 3.0 * 0.4**2 * (1.0 - history.restitution**2), rel=1e-5)


def test_oscillation_loses_the_work_of_friction():
    """Limit: when sliding far exceeds the bristles' deflection, a period of Dahl's friction costs 4 a mu."""
    dahl = catalogue.FRICTION["dahl"](kinetic=0.05)
    history = oscillation(dahl, JOINT, amplitude=1e-2, frequency=10.0, samples=4001)
    loss = np.trapezoid(history.coefficient, history.displacement)
    assert loss == pytest.approx(4 * 1e-2 * 0.05, rel=1e-3)


def test_steady_coefficient():
    """Limit: the coefficient is odd in the slip speed and has the shape of the argument."""
    speeds = np.array([[-1.0, -1e-3], [1e-3, 1.0]])
    found = steady_coefficient(catalogue.FRICTION["lugre"](), JOINT, speeds)
    assert found.shape == speeds.shape
    assert found[0, ::-1] == pytest.approx(-found[1], rel=1e-15)
    assert found[1, 1] == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize("name", ["lugre", "elasto-plastic", "gonthier-bristle", "dahl"])
def test_steady_coefficient_of_creep(name):
    """Limit: far below the Stribeck speed steady sliding gives static friction (dahl: its only coefficient)."""
    (found,) = steady_coefficient(catalogue.FRICTION[name](), JOINT, [1e-6])
    assert found == pytest.approx(0.05 if name == "dahl" else 0.075, rel=1e-5)


@pytest.mark.parametrize(("kind", "name"), ENTRIES)
def test_picture_of_each_law(kind, name):
    """Contract: the curves are finite, start and end at their limits, and the title names the law."""
    axes = draw_law(catalogue.law(kind, name)())
    assert len(axes) == (2 if kind == "friction" else 1)
    assert name in axes[0].get_title(loc="left")
    for line in [line for panel in axes for line in panel.lines]:
        assert np.all(np.isfinite(np.asarray(line.get_xydata(), float)))
    if kind != "friction":
        loop = np.asarray(axes[0].lines[0].get_xydata())
        assert loop[0] == pytest.approx([0.0, 0.0])
        assert loop[-1] == pytest.approx([0.0, 0.0])
        assert loop[:, 1].max() > 1.0


def test_gallery_of_laws():
    """Contract: the gallery has one curve for each law of the catalogue."""
    axes = draw_gallery()
    for panel, laws in zip(axes, catalogue.BY_KIND.values(), strict=True):
        assert [line.get_label().split(" ")[0] for line in panel.lines] == list(laws)
