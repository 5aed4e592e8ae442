"""Largest Lyapunov exponents of mechanisms."""

import dataclasses
import math

import numpy as np
import pytest

from scissordyn.component.place import GROUND
from scissordyn.component.time_function import Tabulated
from scissordyn.component.torque import Torque
from scissordyn.errors import InputError
from scissordyn.laws.damping.none import NoDamping
from scissordyn.model.body import bar
from scissordyn.model.clearance import Clearance
from scissordyn.model.joint import Revolute
from scissordyn.model.linkage import slider_crank
from scissordyn.model.mechanism import Mechanism
from scissordyn.periodic.lyapunov import separation_exponent, variational_exponent


@pytest.fixture(scope="module")
def upright():
    """A uniform bar of 1 m that stands on its pin."""
    return Mechanism(
        bodies=(bar("bar", length=1.0, mass=2.0, position=(0.0, 0.0), angle=0.5 * math.pi),),
        joints=(Revolute("pin", ("bar", "start"), (GROUND, "origin")),),
        ground=(("origin", (0.0, 0.0)),),
    )


@pytest.mark.parametrize(
    ("road", "options", "error"),
    [(separation_exponent, {"distance": 1e-7}, 1e-6), (variational_exponent, {"substeps": 50}, 1e-5)],
)
def test_inverted_pendulum(upright, road, options, error):
    """Closed form: sqrt(3 g/(2 L)) where a bar stands upright; measured 7e-9 and 2e-6.

    Round-off makes it fall after some ten times 1/sqrt(3 g/(2 L)), longer than is looked at. The error of the implicit
    midpoint rule is (h lambda)^2/12 = 1.9e-6.
    """
    found = road(upright, cycles=4, period=1.0, skip=2, **options)
    assert float(found["exponent"]) == pytest.approx(math.sqrt(1.5 * 9.81), rel=error)
    assert found.attrs["status"] == "complete"


def test_both_methods_agree(periodic):
    """Cross-check by a second formulation: growth in the first six 32nds of a cycle of an undamped joint, during impacts.

    The midpoint rule meets kinks of dF/d delta at every touch; measured 0.008 in the worst interval, 0.006 in the sum of 12.2.
    After twice that time neither follows the other's trajectory, which is what the exponent says.
    """
    mechanism = periodic.with_clearance("A", Clearance(0.2e-3, damping=NoDamping()))
    options = {"cycles": 1, "intervals": 32, "rtol": 1e-12, "atol": 1e-12}
    two = separation_exponent(mechanism, distance=1e-4, **options)["log_growth"].values[:6]
    one = variational_exponent(mechanism, substeps=4000, **options)["log_growth"].values[:6]
    assert np.sum(one) > 10.0
    np.testing.assert_allclose(two, one, rtol=0.0, atol=0.02)


def test_a_settled_orbit_attracts(frictional):
    """Limit: with friction, where the map has a fixed point, the exponent is negative."""
    found = separation_exponent(frictional, cycles=8, intervals=4, skip=4, distance=1e-2, rtol=1e-8, atol=1e-8)
    assert float(found["exponent"]) < 0.0


def test_what_cannot_be_used(periodic, frictional, impacting, upright):
    """Contract: one-line errors."""
    for mechanism in (frictional, impacting):
        with pytest.raises(InputError, match="variational equation is not defined"):
            variational_exponent(mechanism, cycles=1)
    for method in (separation_exponent, variational_exponent):
        with pytest.raises(InputError, match="drives prescribe its whole motion"):
            method(periodic, cycles=1)
    with pytest.raises(InputError, match="cycles = 0"):
        separation_exponent(upright, cycles=0, period=1.0)
    with pytest.raises(InputError, match="no interval left"):
        separation_exponent(upright, cycles=1, period=0.1, intervals=1, skip=1)


@pytest.mark.parametrize("measure", [separation_exponent, variational_exponent])
def test_tables_that_end_early_are_refused(measure):
    """Contract: no cycle is computed beyond the end of a table, as in runs and maps."""
    instants = tuple(np.linspace(0.0, 0.1, 7).tolist())
    load = Torque("load", "crank", torque=1.0, time_function=Tabulated(instants, tuple(0.0 * t for t in instants)))
    crank = dataclasses.replace(slider_crank(crank=0.05, rod=0.12, angle=0.4), components=(load,)).driven(speed=20.0)
    with pytest.raises(InputError, match=r"time function of 'load' is tabulated until 0.1 s"):
        measure(crank, cycles=2)
