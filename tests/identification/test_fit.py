"""Numbers from curves whose truth is known: made by equations that are not the package's, with noise."""

import json
import math

import numpy as np
import pytest
from pendula import DOUBLE, PENDULUM, double, pendulum
from scipy.special import stdtrit

import scissordyn as sd
import scissordyn.identification.problem as problem_module
from scissordyn.casefile.configuration import read_configuration
from scissordyn.identification.jacobian import jacobian
from scissordyn.identification.problem import Problem, free_parameter, motion
from scissordyn.identification.start import prepare_segments

NOISE = 2e-3  # [rad] standard deviation of the errors that are added to a record


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "arm.toml"
    path.write_text(PENDULUM)
    return sd.read_case(path)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "both.toml"
    path.write_text(DOUBLE)
    return sd.read_case(path)


def record(seed=1, *, until=3.0, count=61, noise=NOISE, start=0.0, **truth):
    times = np.linspace(0.0, until, count)
    angles = pendulum(times, angle=-0.6, **truth)[:, :1]
    angles = angles + noise * np.random.default_rng(seed).standard_normal(angles.shape)
    return sd.Measured(times + start, ("angle of arm",), angles, ("rad",))


@pytest.fixture(scope="module")
def found(arm):
    return sd.fit(arm, record(inertia=0.0009, damping=0.0012), ["arm.inertia", "pivot.damping", "arm.angle"])


def assert_true(result, truth):
    """Check that fitted values are within four standard errors of the true values."""
    for name, value in truth.items():
        one = result.sel(parameter=name)
        assert abs(float(one["value"]) - value) < 4.0 * float(one["standard_error"])


def test_numbers_are_those_that_made_the_data(found):
    """Cross-check by a second formulation: numbers within four standard errors, which are below 2 %."""
    assert_true(found, {"arm.inertia": 0.0009, "pivot.damping": 0.0012, "arm.angle": -0.6})
    assert np.all(found["standard_error"].values < 0.02 * np.abs([0.0009, 0.0012, -0.6]))
    assert np.all((found["low"] < found["value"]) & (found["value"] < found["high"]))


def test_weights_are_the_noise(found):
    """Closed form: the estimated standard deviation is that of the noise, to its own error of 1/sqrt(2 n)."""
    assert abs(float(found["deviation"][0]) / NOISE - 1.0) < 4.0 / math.sqrt(2 * 61)


def test_fit_can_be_run_again(found):
    """Contract: the mechanism of the result has the fitted numbers, and shows the fitted curve."""
    made = read_configuration(found)
    run = motion(made.build_mechanism(), made.options, found["time"].values)
    assert np.allclose(run["angle"].values[:, 0], found["fitted"].values[:, 0], rtol=0.0, atol=1e-9)


def test_prediction_from_the_start_of_the_case(found):
    """Identity: without segments the fitted mechanism predicts its own record by the fitted curve."""
    made = read_configuration(found)
    held = sd.prediction(made.build_mechanism(), made.options, [record(inertia=0.0009, damping=0.0012)])
    np.testing.assert_allclose(held["predicted"], found["fitted"], rtol=0.0, atol=1e-9)
    assert held["counted"].values.all()


def test_standard_errors_are_those_of_the_linear_theory(arm, found):
    """Cross-check: covariance of s^2 (J'J)^-1 with J by differences of the second formulation, blocks left out of account."""
    times = np.linspace(0.0, 3.0, 61)
    best = dict(zip(("inertia", "damping", "angle"), found["value"].values.tolist(), strict=True))
    columns = []
    for name, value in best.items():
        step = 1e-4 * abs(value)
        ends = [pendulum(times, **{**best, name: value + sense * step})[:, 0] for sense in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    matrix, residual = np.column_stack(columns), found["residual"].values[:, 0]
    plain = np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)) * (residual @ residual) / (61 - 3))
    ratio = found["standard_error"].values / plain
    assert np.all(ratio > 1.0 - 1e-3)
    assert np.all(ratio < 2.0)


def test_numbers_that_cannot_be_told_apart_are_named(arm):
    """Contract: a free oscillation depends on m, I and d by their ratios only, at a given centre."""
    said = sd.fit(arm, record(), ["arm.mass", "arm.inertia", "pivot.damping"], segment=math.inf)
    (line,) = (each for each in json.loads(said.attrs["warnings"]) if "cannot be distinguished" in each)
    assert "'arm.mass'" in line
    assert "'arm.inertia'" in line
    assert np.isinf(said["standard_error"].values).all()


def test_what_was_measured_otherwise_settles_it(arm):
    """Limit: with the mass known to 1 % the inertia is known to about 1 %."""
    free = {"arm.mass": "norm(loc=0.15, scale=0.0015) kg", "arm.inertia": None, "pivot.damping": None}
    said = sd.fit(arm, record(), free, segment=math.inf)
    share = said["standard_error"].values / said["value"].values
    assert 0.005 < share[0] < 0.02
    assert 0.005 < share[1] < 0.2


def test_a_start_far_below_the_truth(arm):
    """Contract: a parameter that grows to ten thousand times its start is known as well as from a start nearby."""
    data, free = record(inertia=0.0009, damping=0.0012), ["pivot.damping", "arm.inertia", "arm.angle"]
    far = sd.fit(sd.Case(arm.mechanism.replace("pivot.damping", 1.2e-7), arm.run), data, free)
    near = sd.fit(arm, data, free)
    np.testing.assert_allclose(far["value"], near["value"], rtol=1e-5)
    np.testing.assert_allclose(far["standard_error"], near["standard_error"], rtol=1e-2)
    assert json.loads(far.attrs["warnings"]) == []


def test_weights_of_few_values(arm):
    """Closed form: each variance is a sum of squares by its degrees of freedom, which add up to values less parameters.

    The intervals have those of one column, which are fewer than the sum, 10 - 3. A warning gives them.
    """
    times = np.linspace(0.3, 2.0, 5)
    noise = np.array([2e-3, 2e-2]) * np.random.default_rng(2).standard_normal((5, 2))
    values = pendulum(times, angle=-0.6, inertia=0.0009, damping=0.0012) + noise
    few = sd.Measured(times, ("angle of arm", "angular_velocity of arm"), values, ("rad", "rad/s"))
    one = sd.fit(arm, few, ["arm.inertia", "pivot.damping", "arm.angle"])
    degrees = np.sum(one["residual"].values ** 2, axis=0) / one["deviation"].values ** 2
    assert degrees.sum() == pytest.approx(10 - 3, rel=0.1)
    width = (one["high"] - one["value"]).values / one["standard_error"].values
    assert width == pytest.approx(stdtrit(degrees.min(), 0.975), rel=0.05)
    assert f"has {degrees.min():.1f} degrees of freedom: the intervals may be too narrow" in one.attrs["warnings"]


def test_segments_start_where_their_data_say(arm):
    """Cross-check: three segments, each with a start of its own, give the same numbers; the record begins at 60 s."""
    said = sd.fit(arm, record(inertia=0.0009, damping=0.0012, start=60.0), ["arm.inertia", "pivot.damping"], segment=1.0)
    assert said["segment"].values.max() == 2
    assert_true(said, {"arm.inertia": 0.0009, "pivot.damping": 0.0012})


def test_small_jumps_make_segments_one_motion(arm):
    """Limit: with jumps of 1e-6 of the motion each segment ends where the next one starts."""
    said = sd.fit(arm, record(until=1.0, count=31), ["arm.inertia"], segment=0.5, jump=1e-6)
    whole = sd.fit(arm, record(until=1.0, count=31), ["arm.inertia"], segment=math.inf)
    assert np.max(np.abs(said["fitted"].values - whole["fitted"].values)) < 1e-4
    assert float(said["value"][0]) == pytest.approx(float(whole["value"][0]), rel=1e-3)


def test_turns_of_measured_angles_count(arm):
    """Contract: an angle that is larger by whole turns is the same."""
    first = record()
    turned = sd.Measured(first.time, first.headings, first.values + 4.0 * math.pi, first.units)
    one, other = (sd.fit(arm, each, ["arm.inertia"], segment=math.inf) for each in (first, turned))
    apart = abs(float(one["value"][0]) - float(other["value"][0]))
    assert apart < 1e-3 * float(one["standard_error"][0])  # the search ends at a relative change of 1e-8 of chi^2
    assert np.max(np.abs(other["residual"].values)) < 5.0 * NOISE


def test_derivatives_are_those_of_the_whole_problem(arm):
    """Cross-check: the derivatives by blocks are those by differences of all residuals."""
    records = [record()]
    segments, columns, options = prepare_segments(arm.mechanism, arm.run, records, segment=1.0)
    free = [free_parameter(arm.mechanism, name) for name in ("arm.inertia", "pivot.damping")]
    problem = Problem(arm.mechanism, options, free, segments, columns, np.array([NOISE]))
    unknowns = problem.start()
    matrix = jacobian(problem, unknowns, accurate=True)
    for column in range(problem.unknowns):
        step = np.zeros(problem.unknowns)
        step[column] = 3e-5
        whole = (problem.residuals(unknowns + step) - problem.residuals(unknowns - step)) / 6e-5
        assert np.max(np.abs(matrix[:, column] - whole)) < 1e-5 * np.max(np.abs(whole))


def test_double_pendulum_in_segments(both):
    """Cross-check by a second formulation (Lagrange, two angles): numbers of a chaotic motion, and a prediction."""
    times = np.linspace(0.0, 4.0, 161)
    state = double(times, (-0.2, 0.9, 0.0, 0.0), inertia=(0.0007, 0.0003), damping=(0.0008, 0.0002))
    noise = np.array([2e-3, 2e-3, 2e-2, 2e-2])
    values = state + noise * np.random.default_rng(5).standard_normal(state.shape)
    names = ("angle of arm", "angle of tip", "angular_velocity of arm", "angular_velocity of tip")
    whole = sd.Measured(times, names, values, ("rad", "rad", "rad/s", "rad/s"))
    parts = whole.segments(1.0)
    free = ["arm.inertia", "tip.inertia", "pivot.damping", "elbow.damping"]
    said = sd.fit(both, parts[:2], free, segment=math.inf, deviations=dict(zip(names, noise.tolist(), strict=True)))
    assert_true(said, dict(zip(free, (0.0007, 0.0003, 0.0008, 0.0002), strict=True)))
    assert np.all(np.abs(said["rms"].values / noise - 1.0) < 0.3)
    made = read_configuration(said)
    held = sd.prediction(made.build_mechanism(), made.options, parts[2:3], segment=math.inf, window=0.5)
    assert np.all(held["rms"].values < 0.1 * np.std(values, axis=0))


@pytest.mark.slow
def test_intervals_hold_the_truth(arm):
    """Limit: of 40 fits to data with white noise the intervals of 95 % hold the inertia in 35 or more (probability 0.998)."""
    held = 0
    for seed in range(40):
        one = sd.fit(arm, record(seed, inertia=0.0009), ["arm.inertia", "pivot.damping", "arm.angle"]).sel(
            parameter="arm.inertia"
        )
        held += int(float(one["low"]) < 0.0009 < float(one["high"]))
    assert held >= 35


def test_all_runs_are_counted(arm, monkeypatch):
    """Contract: the count of runs has those that estimate starts; the short one that lists the quantities is left out."""
    counted = []
    compute = problem_module.compute
    monkeypatch.setattr(problem_module, "compute", lambda *given, **named: counted.append(1) or compute(*given, **named))
    said = sd.fit(arm, record(until=1.0, count=31), ["arm.inertia"], segment=0.5)
    assert json.loads(said.attrs["statistics"])["runs"] == len(counted) - 1


def test_no_evaluation(arm):
    """Bad input: one line for a search without evaluations."""
    with pytest.raises(sd.InputError, match="most = 0; expected at least one evaluation"):
        sd.fit(arm, record(), ["arm.inertia"], most=0)


@pytest.mark.parametrize(
    ("free", "said"),
    [
        ({"arm.inertia": None, "body.arm.inertia": None}, "'arm.inertia' and 'body.arm.inertia' change the same value"),
        ({"arm.inertai": None}, "did you mean 'inertia'"),
        ({"arm.inertia": (1.0, 2.0)}, "outside its range"),
        ({"arm.angular_velocity": None}, "has no value in this mechanism"),
        ({"arm.inertia": "weibull(1, 2) kg m^2"}, "distribution"),
        ({}, "no free parameter"),
    ],
)
def test_free_numbers_that_cannot_be(arm, free, said):
    """Bad input: one line that says what is allowed."""
    with pytest.raises(sd.InputError, match=said):
        sd.fit(arm, record(), free)


def test_segments_of_a_driven_mechanism_are_refused(arm):
    """Bad input: a segment cannot start amid a prescribed motion."""
    with pytest.raises(sd.InputError, match="the drive of 'arm'"):
        sd.fit(arm.mechanism.driven(speed=1.0, body="arm"), record(), ["gravity"], segment=1.0)


def test_an_interval_ends_at_the_least_possible_value(arm):
    """Contract: the interval of a damping that is hardly larger than its error ends at zero, and a warning says so."""
    one = sd.fit(arm, record(inertia=0.0009, damping=0.0001, noise=0.2), ["pivot.damping"]).isel(parameter=0)
    value, low, high = (float(one[name]) for name in ("value", "low", "high"))
    assert 0.0 == low < value < high
    assert high > 2.0 * value
    said = "the interval of 'pivot.damping' ends at 0 N m s/rad, its least value: it is asymmetric"
    assert said in json.loads(one.attrs["warnings"])
