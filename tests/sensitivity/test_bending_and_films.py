"""Derivatives of runs with bars that bend and with oil films, against differences of runs and an identity of short bearings."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.model.parameter_path import changed
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

ROOT = Path(__file__).parent.parent.parent

LIFT_TABLE = ("examples/lift_table.toml",)  # Case file and changes of it
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # Central differences of eighth order


@cache
def mechanism_of(case):
    """Return the mechanism of a case file with changes."""
    return sd.read_case(ROOT / case[0], case[1:]).mechanism


def run_of(mechanism, options, paths):
    begin = Start(mechanism, options.start)
    return forward(plan(mechanism), options, [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in paths])


@cache
def differences(case, until, path, step):
    """Return differences of the state, the instants of events and the largest values, by path, divided by its scale."""
    mechanism = mechanism_of(case)
    options = sd.Options(until, "concentric", 2, 1e-12, 1e-12, "dop853", events="located")
    parameter, totals = parameter_of(mechanism, path, 1.0), list[np.ndarray]()
    for place, weight in WEIGHTS.items():
        for sign in (1.0, -1.0):
            moved = changed(mechanism, path, parameter.value + sign * place * step * parameter.scale)
            driver, _, _ = make_driver(plan(moved), options)
            advance(driver, options.until)
            parts = [sign * weight / step * part for part in (driver.state.y, driver.log["time"], driver.peak["largest"])]
            totals = [total + part for total, part in zip(totals, parts, strict=True)] if totals else parts
    return totals


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_bars_that_bend(method):
    """Cross-check: three contacts of a lift table by the stiffness of a bar, a mass and the drive.

    Vibrations of bars are computed a hundred times less accurately than other motions, which the differences show.
    """
    mechanism = mechanism_of(LIFT_TABLE)
    options = sd.Options(0.01, "concentric", 2, 1e-11, 1e-11, method, events="located")
    paths = ["unit 1/bar 1/beam.bending_stiffness", "body.unit 2/bar 1.mass", "drive.unit 1/bar 1.end"]
    run = run_of(mechanism, options, paths)
    assert len(run.log) == 6
    for k, path in enumerate(paths):
        state, time, largest = differences(LIFT_TABLE, 0.01, path, 4e-3)
        assert run.log[:, 0, k] == pytest.approx(time, abs=2e-7 * np.max(np.abs(run.driver.log["time"])))
        assert run.state[:, k] == pytest.approx(state, abs=2e-6 * np.max(np.abs(run.driver.state.y)))
        assert run.peak[:, 0, k] == pytest.approx(largest, abs=2e-5 * np.max(np.abs(run.driver.peak["largest"])))


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_damping_that_is_zero(method):
    """Limit: the state of a lift table by the damping of a bar is that of a nearly undamped bar, not zero."""
    mechanism = mechanism_of(LIFT_TABLE)
    options, path = sd.Options(5e-4, "concentric", 2, 1e-11, 1e-11, method, events="located"), "unit 1/bar 1/beam.damping"
    little = 1e-12  # [s]
    undamped, damped = (run_of(changed(mechanism, path, value), options, [path]).state[:, 0] for value in (0.0, little))
    assert np.max(np.abs(damped)) > 0.0
    assert undamped == pytest.approx(damped / little, abs=1e-4 * np.max(np.abs(damped / little)))


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("form", ["short", "finite"])
def test_oil_film(form, method):
    """Cross-check: a shaft that sinks into its film; a short film depends on the product of viscosity and radius alone."""
    case = "validation/bearing/case.toml", f"bearing.lubrication.bearing={form}"
    mechanism = mechanism_of(case)
    options = sd.Options(0.05, "concentric", 2, 1e-12, 1e-12, method)
    names = ("clearance", "bearing_length", "lubrication.viscosity", "journal_radius")
    run = run_of(mechanism, options, [*(f"joint.bearing.{name}" for name in names), "drive.shaft.speed"])
    if form == "short":
        assert run.state[:, 3] == pytest.approx(run.state[:, 2], abs=1e-8 * np.max(np.abs(run.state[:, 2])))
    state, _, largest = differences(case, 0.05, "joint.bearing.clearance", 1e-3)
    assert run.state[:, 0] == pytest.approx(state, abs=1e-7 * np.max(np.abs(state)))
    assert run.peak[:, 0, 0] == pytest.approx(largest, abs=1e-7 * np.max(np.abs(largest)))


def test_mass_next_to_a_straight_bar():
    """Second formulation: angles that are zero up to round-off do not hide the derivative by the mass of a slider."""
    crank = sd.slider_crank(crank=0.05, rod=0.3, rod_mass=0.0942, rod_inertia=7.065e-4, slider_mass=0.5, gravity=0.0)
    bent = sd.with_bending(crank.driven(speed=30.0), "rod", bending_stiffness=11.2, axial_stiffness=8.4e6, modes=1)
    options = {"until": 2e-3, "rtol": 1e-10, "atol": 1e-10}
    found = sd.gradient(bent, of=["drive_work"], by=["slider.mass"], **options)

    def slope(step):
        runs = [sd.simulate(bent.replace("slider.mass", 0.5 + change), samples=2, **options) for change in (step, -step)]
        return float(runs[0]["drive_work"][-1] - runs[1]["drive_work"][-1]) / (2.0 * step)

    assert float(found["derivative"].squeeze()) == pytest.approx((4.0 * slope(2e-3) - slope(4e-3)) / 3.0, rel=1e-6)
