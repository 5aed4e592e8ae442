"""Fits of runs with contacts: exact derivatives beside differences, and a record whose parameters are known."""

import dataclasses
import json

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.identification.exact import exact_jacobian
from scissordyn.identification.fit import fit_parameters
from scissordyn.identification.jacobian import jacobian
from scissordyn.identification.problem import Problem, columns_of, curves, free_parameter, motion
from scissordyn.identification.start import prepare_segments
from scissordyn.model.parameter_path import changed_all

# Parameter values of the mechanism that is measured, in SI units
TRUTH = {"hole.clearance": 1e-3, "hole.restitution": 0.7, "body.ball.velocity.x": 0.3, "body.ball.velocity.y": 0.1}
# Parameter values at which the fit starts, in SI units
GUESS = {"hole.clearance": 1.3e-3, "hole.restitution": 0.56, "body.ball.velocity.x": 0.24, "body.ball.velocity.y": 0.13}

OPTIONS = sd.Options(0.03, "as-placed", 2, 1e-11, 1e-11, "dop853", events="located")  # Options of the runs of a fit


def bouncing():
    """Return a ball that bounces in a hole three times."""
    ball = sd.Body("ball", 1.0, 1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(0.3, 0.1))
    gap = sd.Clearance(1e-3, journal_radius=0.01, damping=sd.Flores(0.7), friction=sd.NoFriction(), reference="onset")
    joint = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=gap)
    return sd.Mechanism(bodies=(ball,), joints=(joint,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)


def record():
    """Return the position of the ball."""
    mechanism, times = bouncing(), np.linspace(0.0, 0.03, 200)
    columns = columns_of(mechanism, OPTIONS)
    names = ("position of ball, x", "position of ball, y")
    run = motion(mechanism, OPTIONS, times)
    assert run.sizes["contact"] == 3
    return sd.Measured(times, names, curves(run, [columns[name] for name in names]), ("m", "m"))


def test_derivatives_of_residuals():
    """Cross-check: exact derivatives against central differences of runs, which err next to the instants of contacts."""
    mechanism = changed_all(bouncing(), GUESS)
    free = [free_parameter(mechanism, path) for path in GUESS]
    segments, columns, options = prepare_segments(mechanism, OPTIONS, [record()], segment=None)
    problem = Problem(mechanism, options, free, segments, columns, np.ones(2))
    exact = exact_jacobian(problem, problem.start())
    assert problem.runs == 1
    problem.derivatives = "differences"
    apart = np.abs(exact - jacobian(problem, problem.start(), accurate=True)) / np.max(np.abs(exact))
    assert np.max(apart) < 2e-4
    assert np.mean(apart < 1e-7) > 0.98


def test_parameters_of_a_record():
    """Cross-check: the parameters that made a record, from thirty percent beside them, in at most twenty runs."""
    mechanism = changed_all(bouncing(), GUESS)
    free = [free_parameter(mechanism, path) for path in GUESS]
    found = fit_parameters(mechanism, OPTIONS, [record()], free, deviations=dict.fromkeys(record().headings, 1e-5))
    assert found["value"].values == pytest.approx(list(TRUTH.values()), rel=1e-6)
    statistics = json.loads(found.attrs["statistics"])
    assert statistics["derivatives"] == "exact"
    assert statistics["runs"] <= 20


@pytest.mark.parametrize("free", [["ball.inertia"], ["ball.inertia", "ball.velocity.x"]])
def test_a_parameter_without_effect(free):
    """Contract: it keeps its value, to 1 % of round-off in the derivatives by the others, and is not determined."""
    found = sd.fit(sd.Case(bouncing(), OPTIONS), record(), free, deviations=dict.fromkeys(record().headings, 1e-5))
    assert found["value"].values == pytest.approx([1e-3, 0.3][: len(free)], rel=1e-6)
    assert np.isinf(found["standard_error"].values).tolist() == [True, False][: len(free)]
    assert "'ball.inertia' cannot be determined" in found.attrs["warnings"]


def test_differences_are_used_with_a_reason():
    """Contract: a run with steps of a fixed size."""
    mechanism = bouncing()
    free = [free_parameter(mechanism, "body.ball.velocity.x")]
    options = dataclasses.replace(OPTIONS, step=1e-5)
    found = fit_parameters(mechanism, options, [record()], free, deviations=dict.fromkeys(record().headings, 1e-5), most=3)
    assert json.loads(found.attrs["statistics"])["derivatives"] == "differences"
    assert any("steps of a fixed size have no derivatives" in warning for warning in json.loads(found.attrs["warnings"]))


def test_starts_of_a_record_with_impacts():
    """Contract: a search from far away ends at a local minimum and says so; the best of 64 starts leads to the truth."""
    column, times = columns_of(bouncing(), OPTIONS)["acceleration of ball, x"], np.linspace(0.0, 0.03, 400)
    noise = np.random.default_rng(1).normal(0.0, 0.5, (400, 1))
    measured = curves(motion(bouncing(), OPTIONS, times), [column]) + noise
    data, path = sd.Measured(times, ("acceleration of ball, x",), measured, ("m/s^2",)), "hole.damping.restitution"
    far = sd.Case(bouncing().replace(path, 0.95), OPTIONS)
    stuck, found = (sd.fit(far, data, {path: (0.3, 0.98)}, starts=starts) for starts in (1, 64))
    assert abs(stuck["value"].item() - 0.7) > 0.1
    assert "local minimum" in stuck.attrs["warnings"]
    assert found["low"].item() < 0.7 < found["high"].item() < 0.701
    assert found.attrs["warnings"] == "[]"
    assert json.loads(found.attrs["statistics"])["runs"] > 64
    with pytest.raises(sd.InputError, match=f"'{path}' has no range"):
        sd.fit(far, data, [path], starts=2)
