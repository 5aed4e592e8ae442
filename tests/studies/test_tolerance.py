"""Tolerances, fits of ISO 286-1 and further distributions: texts, tables of the standard, closed forms and whole studies."""

import numpy as np
import pytest
from scipy import stats

import scissordyn as sd
from scissordyn.config.study import BaseCase, make_study, read_study
from scissordyn.config.variation import read_deviation, read_variation
from scissordyn.model.parameter_path import number, single
from scissordyn.studies.answer.page import varied_numbers
from scissordyn.studies.answer.verdict import by_point
from scissordyn.studies.ask.distribution import PROBABILITY_MAX, PROBABILITY_MIN, Distribution, from_scipy
from scissordyn.studies.ask.iso_286 import DEVIATIONS, DIAMETERS, GRADES, read_fit
from scissordyn.studies.compute.table import column
from studies.test_study import UNTIL, arm

LENGTH = sd.Quantity("m", minimum=0.0)  # Quantity of a clearance
# Limits of the clearance of H7/g6 in its standard deviations; both tolerances have a ratio of 5 to 3
NORMAL_LIMIT = 3.0 * (5.0 + 3.0) / np.hypot(5.0, 3.0)
NUMBER = sd.Quantity("1", minimum=0.0, maximum=1.0)  # Quantity of a restitution coefficient


@pytest.mark.parametrize(
    ("fit", "diameter", "hole", "shaft"),
    [
        ("H7/g6", 10.0, (0, 15), (-14, -5)),
        ("H8/f7", 25.0, (0, 33), (-41, -20)),
        ("H7/h6", 50.0, (0, 25), (-16, 0)),
        ("H9/e8", 3.0, (0, 25), (-28, -14)),
        ("H11/h11", 3.001, (0, 75), (-75, 0)),
        ("H5/g5", 500.0, (0, 27), (-47, -20)),
    ],
)
def test_limits_of_known_fits(fit, diameter, hole, shaft):
    """Published numbers: limit deviations [um] of the standard's tables; a diameter at the end of a range belongs to it.

    The ends of what is drawn are quantiles of the smallest and largest probability, p and 1 - p': the sum of two uniform
    deviations of widths a and b is sqrt(2 p a b) and sqrt(2 p' a b) from its limits there.
    """
    found = read_fit(fit, diameter * 1e-3)
    np.testing.assert_allclose(np.array([found.hole, found.pin]) * 1e6, [hole, shaft], atol=1e-9)
    area = 2.0 * (hole[1] - hole[0]) * (shaft[1] - shaft[0])
    ends = np.sqrt(area * PROBABILITY_MIN) - shaft[1], hole[1] - shaft[0] - np.sqrt(area * (1.0 - PROBABILITY_MAX))
    np.testing.assert_allclose(found.clearance().ends, 0.5e-6 * np.array(ends), rtol=1e-14, atol=1e-20)


def test_tables_are_the_formula_of_the_standard_rounded():
    """Cross-check: 7, 10, 16, ... 100 tolerance units, and 2.5 to 11 D^0.34..0.41, within the rounding of the tables."""
    low, high = np.array(DIAMETERS[:-1]), np.array(DIAMETERS[1:])
    middle = np.sqrt(low * high)
    rounding = np.where(low < 3, 0.16, 0.08)  # the standard rounds up, most of all for the smallest diameters
    unit = 0.45 * np.cbrt(middle) + 0.001 * middle
    for grade, units in {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100}.items():
        assert np.all(np.abs(np.array(GRADES[grade]) - units * unit) <= np.maximum(0.75, rounding * units * unit)), grade
    for shaft, factor, power in (("e", 11.0, 0.41), ("f", 5.5, 0.41), ("g", 2.5, 0.34)):
        assert np.all(
            np.abs(np.array(DEVIATIONS[shaft]) - factor * middle**power) <= np.maximum(1.1, 0.05 * factor * middle**power)
        )


def test_clearance_is_half_of_the_difference_of_the_diameters():
    """Cross-check: quantiles of the trapezoid are those of a million uniform holes and shafts."""
    fit, rng = read_fit("H7/g6", 10e-3), np.random.default_rng(1)
    drawn = 0.5 * (rng.uniform(*fit.hole, 1_000_000) - rng.uniform(*fit.pin, 1_000_000))
    u = np.linspace(0.01, 0.99, 33)
    np.testing.assert_allclose(fit.clearance().quantile(u), np.quantile(drawn, u), rtol=3e-3)
    low, high = fit.clearance().ends
    normal = fit.clearance("norm")
    assert normal.ends == pytest.approx((low, high))
    assert float(normal.quantile(np.array([0.5]))[0]) == pytest.approx(0.5 * (low + high))
    assert dict(normal.arguments)["scale"] == pytest.approx(0.5 * np.hypot(15e-6, 9e-6) / 6.0)


@pytest.mark.parametrize("shape", ["", ", norm"])
def test_fit_without_least_clearance(shape):
    """Contract: a clearance may have the fit H7/h6, whose least clearance is 0; its mean is a quarter of both tolerances."""
    quantity = number(arm(), "A.clearance").quantity
    read = read_variation(f"H7/h6 at 20 mm{shape}", quantity, parameter="A.clearance")
    assert all(map(quantity.admits, read.ends))
    assert float(read.quantile(np.array([0.5]))[0]) == pytest.approx(0.25 * (21e-6 + 13e-6), rel=1e-6)
    study = sd.study(arm(), {"A.clearance": f"H7/h6 at 20 mm{shape}"}, until=UNTIL, points=2, design="sobol")
    assert study.counts["complete"] == 2


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("0.3 mm +- 0.02 mm", stats.uniform(0.28e-3, 0.04e-3)),
        ("0.3 ± 0.02 mm", stats.uniform(0.28e-3, 0.04e-3)),
        ("0.3 mm +/- 20 um", stats.uniform(0.28e-3, 0.04e-3)),
        ("0.3 mm +- 20 %", stats.uniform(0.24e-3, 0.12e-3)),
        ("0.3 mm +- 0.03 mm, norm", stats.truncnorm(-3.0, 3.0, 0.3e-3, 0.01e-3)),
        ("0.3 mm +- 10 %, triang", stats.triang(0.5, 0.27e-3, 0.06e-3)),
        ("triang(c=0.25, loc=0.1, scale=0.4) mm", stats.triang(0.25, 0.1e-3, 0.4e-3)),
        ("beta(a=2, b=5, loc=0.1, scale=0.2) mm", stats.beta(2.0, 5.0, 0.1e-3, 0.2e-3)),
        ("weibull_min(c=2) mm", stats.weibull_min(2.0, 0.0, 1e-3)),
        ("weibull_min(scale=0.1, loc=0.05, c=2) mm", stats.weibull_min(2.0, 0.05e-3, 0.1e-3)),
        ("lognorm(s=0.3, scale=0.2) mm", stats.lognorm(0.3, 0.0, 0.2e-3)),
        ("norm(loc=-1e3, scale=2e2) um", stats.norm(-1e-3, 0.2e-3)),
        ("H7/g6 at 10 mm", stats.trapezoid(0.375, 0.625, 2.5e-6, 12e-6)),
        ("H7/g6 at 1 cm, norm", stats.truncnorm(-NORMAL_LIMIT, NORMAL_LIMIT, 8.5e-6, 6e-6 / NORMAL_LIMIT)),
    ],
)
def test_texts_of_tolerances(text, found):
    """Contract: nominal values, tolerances, fits and distributions, in SI."""
    read, expected = read_variation(text, LENGTH, parameter="A.clearance"), from_scipy(found)
    assert isinstance(read, Distribution)
    assert read.name == expected.name
    assert dict(read.arguments) == pytest.approx(dict(expected.arguments), rel=1e-9)


@pytest.mark.parametrize(
    ("before", "now"),
    [
        ("norm(0.1, 0.02) mm", "norm(loc=0.1, scale=0.02) mm"),
        ("beta(2, 5, 0.1, 0.3) mm", "beta(a=2, b=5, loc=0.1, scale=0.3) mm"),
        ("weibull_min(2, 0.05) mm", "weibull_min(c=2, loc=0.05) mm"),
    ],
)
def test_arguments_need_their_names(before, now):
    """Contract: arguments without names are refused, and the error has the same distribution with them."""
    with pytest.raises(sd.InputError, match="arguments without names") as error:
        read_variation(before, LENGTH, parameter="A.clearance")
    assert error.value.example == f"'{now}'"
    read_variation(now, LENGTH, parameter="A.clearance")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("+- 20 %", "a tolerance without a nominal value"),
        ("0.3 mm +- 0.02 mm, gauss", "'gauss' after a tolerance"),
        ("0.3 mm +- 0 mm", "a tolerance of 0 mm"),
        ("0.3 mm +- -1 mm", "a tolerance of -1 mm"),
        ("0.3 +- 0.02", "missing unit"),
        ("0.3 mm +- x", "'x' is not a number"),
        ("0.3 mm +- 1 N", "wrong dimension"),
        ("K7/g6 at 10 mm", "hole 'K'"),
        ("H7/p6 at 10 mm", "shaft 'p'"),
        ("H4/g6 at 10 mm", "tolerance grade 4"),
        ("H7/g6 at 600 mm", "a fit at 600 mm"),
        ("H7/g6 at 0.5 mm", "a fit at 0.5 mm"),
        ("H7/g6 at 10", "missing unit of the diameter"),
        ("H7/g6 at 10 mm, beta", "'beta' after a fit"),
        ("triang(c=2, loc=0.2, scale=0.4) mm", "triang(c=2, loc=0.0002, scale=0.0004) is not a distribution"),
        ("weibull_min(scale=2) mm", "weibull_min with loc, scale"),
        ("norm(mean=0.1, scale=0.02) mm", "norm with loc, scale, mean"),
        ("norm(loc=0.1 mm, scale=0.02) mm", "'0.1 mm' has a unit"),
        ("norm(loc=0.1, scale=0.02)", "missing unit"),
        ("gauss(loc=0.1, scale=0.02) mm", "distribution 'gauss'"),
        ("normal(0.1, 0.02) mm", "distribution 'normal' (did you mean 'norm'?)"),
        ("0.3 mm +- 0.02 mm, normal", "'normal' after a tolerance (did you mean 'norm'?)"),
    ],
)
def test_wrong_texts(text, what):
    """Contract: the error has the wrong text and what is allowed."""
    with pytest.raises(sd.InputError) as error:
        read_variation(text, LENGTH, parameter="A.clearance")
    assert what in str(error.value)
    assert "\n" not in str(error.value)
    assert error.value.expected


def test_deviations_from_a_chosen_value():
    """Contract: a deviation is a fraction or a value with a unit; that of a pure number has none."""
    assert read_deviation("+- 20 %", LENGTH) == (Distribution("uniform", {"loc": -0.2, "scale": 0.4}), True)
    assert read_deviation("± 0.02 mm, norm", LENGTH)[0] == from_scipy(stats.truncnorm(-3.0, 3.0, 0.0, 0.02e-3 / 3.0))
    assert read_deviation("+- 0.05", NUMBER) == (Distribution("uniform", {"loc": -0.05, "scale": 0.1}), False)
    with pytest.raises(sd.InputError, match="missing unit"):
        read_deviation("+- 0.02", LENGTH, parameter="A.clearance")
    with pytest.raises(sd.InputError, match="pure number"):
        read_deviation("+- 0.02 mm", NUMBER, parameter="A.damping.restitution")


def test_chosen_and_uncertain_factor(tmp_path):
    """Contract: the store has the chosen value and the deviation, the mechanism their product."""
    asked = {
        "until": UNTIL,
        "uncertain": {"A.clearance": "+- 10 %"},
        "samples": 3,
        "requirements": {"peak_force": 60e3},
        "store": tmp_path / "tolerance.db",
    }
    found = sd.study(arm(), {"A.clearance": "0.1, 0.2 mm"}, **asked)
    results = found.dataset
    np.testing.assert_allclose(results["A.clearance"], np.repeat([0.1e-3, 0.2e-3], 3))
    deviations = results["A.clearance deviation"].values
    assert np.abs(deviations).max() <= 0.1
    assert np.unique(deviations).size == 3
    np.testing.assert_array_equal(deviations[:3], deviations[3:])  # common random numbers
    for case in range(6):
        expected = results["A.clearance"].values[case] * (1.0 + deviations[case])
        assert found.mechanism(case).joint("A").clearance.clearance == expected
    alone = sd.simulate_many(arm(), {"A.clearance": results["A.clearance"].values * (1.0 + deviations)}, until=UNTIL)
    np.testing.assert_array_equal(results["peak_force"].values, alone["peak_force"].values)
    assert by_point(found.study, results)["A.clearance"].values.tolist() == pytest.approx([0.1e-3, 0.2e-3])
    rows = {row[0]: row[2] for row in varied_numbers(found.study, results).rows}
    assert rows == {"A.clearance": "0.1, 0.2 mm", "A.clearance deviation": "uniform(loc=-10, scale=20) %"}
    assert sd.open_study(tmp_path / "tolerance.db").study.uncertain == found.study.uncertain
    again = sd.study(arm(), {"A.clearance": "0.1, 0.2 mm"}, **asked, compute=False)
    assert again.counts["complete"] == 6


def two_joints():
    """Return the paper's array with clearance at two joints."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.2e-3)).with_clearance("unit 1/pivot", sd.Clearance(0.3e-3))


def described(vary, uncertain):
    """Return a study of two joints from texts, without computing it."""
    from scissordyn.config.study import StudyText
    from scissordyn.studies.ask.design import Sampling

    text = StudyText(case="case", vary=vary, uncertain=uncertain, sampling=Sampling(4))
    return make_study(BaseCase(two_joints().driven(speed=10.0), sd.Options(UNTIL)), text)


def test_each_joint_has_its_own_tolerance():
    """Contract: with `each` the joints of a pattern are drawn independently; without it they have the same value."""
    joints = single(two_joints(), "clearance.all.clearance")
    assert joints == ["clearance.A.clearance", "clearance.unit 1/pivot.clearance"]
    apart = described({"drive.speed": "10, 20 rad/s"}, {"clearance.all.clearance": "0.3 mm +- 20 %, each"})
    assert [one.path for one in apart.uncertain] == joints
    drawn = apart.numbers(np.arange(8))
    assert not np.any(drawn[joints[0]] == drawn[joints[1]])
    about = described({"clearance.all.clearance": "0.1..0.4 mm"}, {"clearance.all.clearance": "+- 20 %, each"})
    numbers = about.numbers(np.arange(8))
    applied = about.applied(numbers)
    assert sorted(applied) == joints
    for name in joints:
        np.testing.assert_array_equal(applied[name], numbers["clearance.all.clearance"] * (1.0 + numbers[f"{name} deviation"]))
    together = described({"clearance.all.clearance": "0.1..0.4 mm"}, {"clearance.all.clearance": "+- 0.01 mm"})
    assert list(together.applied(together.numbers(np.arange(4)))) == ["clearance.all.clearance"]


def test_deviations_that_fit_nothing_are_refused():
    """Contract: a deviation needs a chosen value, and may not leave the bounds."""
    with pytest.raises(sd.InputError, match="deviates from a value that is not chosen"):
        described({"drive.speed": "10, 20 rad/s"}, {"A.clearance": "+- 20 %"})
    with pytest.raises(sd.InputError, match=r"'A.clearance' can be -"):
        described({"A.clearance": "0.1..0.4 mm"}, {"A.clearance": "+- 0.2 mm"})


def test_each_in_a_study_file(tmp_path):
    """Contract: `each = true` in a table is the word in a text."""
    file = tmp_path / "study.toml"
    file.write_text('case = "case.toml"\n[uncertain]\n"clearance.all.clearance" = { values = "0.3 mm +- 20 %", each = true }\n')
    assert read_study(file).uncertain == {"clearance.all.clearance": "0.3 mm +- 20 %, each"}
    file.write_text('case = "case.toml"\n[uncertain]\n"clearance.all.clearance" = { values = "0.3 mm +- 20 %", each = 1 }\n')
    with pytest.raises(sd.InputError, match="each = true or false"):
        read_study(file)


def test_study_with_tolerances_of_each_joint(tmp_path):
    """Identity: each case has the clearances drawn for its joints."""
    found = sd.study(
        two_joints().driven(speed=sd.rpm(150)),
        {"clearance.all.clearance": "0.1, 0.2 mm"},
        until=UNTIL,
        uncertain={"clearance.all.clearance": "+- 10 %, each"},
        samples=2,
        requirements={"peak_force": 60e3},
        store=tmp_path / "each.db",
    )
    assert found.counts["complete"] == 4
    for case in range(4):
        mechanism = found.mechanism(case)
        for name in ("A", "unit 1/pivot"):
            by = float(found.dataset[column(f"clearance.{name}.clearance deviation")][case])
            chosen = float(found.dataset["clearance.all.clearance"][case])
            assert mechanism.joint(name).clearance.clearance == chosen * (1.0 + by)
