"""Designs and distributions: points that depend on their number only, and quantile functions compared with scipy."""

import json
import re

import numpy as np
import pytest
from scipy import special, stats

import scissordyn as sd
from scissordyn.studies.ask.description import Study, to_plain
from scissordyn.studies.ask.design import (
    DESIGNS,
    SAMPLED,
    Design,
    Factor,
    Sampling,
    design_size,
    design_values,
    uniform_numbers,
)
from scissordyn.studies.ask.distribution import Distribution, from_plain, from_scipy
from studies.test_study import arm

TWO = (sd.Interval(1.0, 3.0, 3), sd.Levels((5.0, 7.0)))  # Variations of two factors
BASE = np.array([2.5, 6.0])  # Values of the factors in the base case


@pytest.mark.parametrize("kind", [kind for kind in DESIGNS if kind not in ("adaptive", "zip")])
def test_point_depends_on_its_number_only(kind):
    """Contract: any selection of points, in any order, has the values of the whole design."""
    design = Design(kind, 8 if kind in SAMPLED else 0, seed=3)
    size = design_size(design, TWO)
    whole = design_values(design, TWO, BASE, np.arange(size))
    assert whole.shape == (size, 2)
    for chosen in (np.array([size - 1]), np.arange(1, size, 2), np.array([0, 2, 3])):
        np.testing.assert_array_equal(design_values(design, TWO, BASE, chosen), whole[chosen])


@pytest.mark.parametrize("kind", ["random", "sobol", "saltelli"])
def test_larger_designs_keep_their_first_points(kind):
    """Contract: the first points of a larger design are those of the smaller one."""
    small, large = Design(kind, 16, seed=1), Design(kind, 64, seed=1)
    at = np.arange(design_size(small, TWO))
    np.testing.assert_array_equal(design_values(small, TWO, BASE, at), design_values(large, TWO, BASE, at))


@pytest.mark.parametrize(
    ("kind", "variations", "points"),
    [
        ("grid", TWO, [[1, 5], [1, 7], [2, 5], [2, 7], [3, 5], [3, 7]]),
        ("zip", (sd.Levels((1.0, 2.0)), sd.Levels((5.0, 7.0))), [[1, 5], [2, 7]]),
        ("one-at-a-time", TWO, [[2.5, 6], [1, 6], [2, 6], [3, 6], [2.5, 5], [2.5, 7]]),
    ],
)
def test_points_at_levels(kind, variations, points):
    """Closed form: every combination, the last factor fastest; paired lists; the mechanism, then each level alone."""
    size = design_size(Design(kind), variations)
    assert design_values(Design(kind), variations, BASE, np.arange(size)).tolist() == points


def test_latin_hypercube_and_sobol_fill_every_stratum():
    """Contract: of 16 points one is in each sixteenth of every factor."""
    pair = (sd.Interval(0.0, 1.0), sd.Interval(0.0, 1.0))
    for kind in ("latin-hypercube", "sobol"):
        found = design_values(Design(kind, 16), pair, BASE, np.arange(16))
        for k in range(2):
            assert sorted((found[:, k] * 16).astype(int).tolist()) == list(range(16)), kind


def test_saltelli_is_the_order_of_salib(monkeypatch):
    """Cross-check: the sample of SALib from the same Sobol sequence."""
    from SALib.sample import sobol
    from scipy.stats import qmc

    sequence = qmc.Sobol(6, seed=5).random(16)  # SALib scrambles by this keyword, which gives other numbers than rng
    monkeypatch.setattr("scissordyn.studies.ask.design.sobol_numbers", lambda seed, dimensions, at: sequence[at])

    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.0, 1.0]] * 3}
    theirs = sobol.sample(problem, 16, calc_second_order=False, seed=5)
    ours = design_values(Design("saltelli", 16, seed=5), (sd.Interval(0.0, 1.0),) * 3, np.zeros(3), np.arange(16 * 5))
    np.testing.assert_array_equal(ours, theirs)


def test_random_numbers_by_place():
    """Contract: streams and seeds differ, and the mean of many is 1/2 within five standard errors."""
    at = np.arange(20_000)
    one = uniform_numbers(1, 0, 3, at)
    assert not np.any(one == uniform_numbers(1, 1, 3, at))
    assert not np.any(one == uniform_numbers(2, 0, 3, at))
    assert np.all(np.abs(one.mean(axis=0) - 0.5) < 5.0 / np.sqrt(12 * at.size))
    np.testing.assert_array_equal(uniform_numbers(1, 0, 3, np.array([7, 19_999, 3])), one[[7, 19_999, 3]])


@pytest.mark.parametrize(
    ("theirs", "closed"),
    [
        (stats.uniform(2.0, 3.0), lambda u: 2.0 + 3.0 * u),
        (stats.norm(1.0, scale=0.2), lambda u: 1.0 + 0.2 * special.ndtri(u)),
        (stats.lognorm(0.4, scale=3.0), lambda u: 3.0 * np.exp(0.4 * special.ndtri(u))),
        (stats.truncnorm(-0.5, 2.5, 1.0, 0.2), None),
        (stats.triang(0.0, 1.0, 4.0), lambda u: 5.0 - 4.0 * np.sqrt(1.0 - u)),
        (stats.trapezoid(0.25, 0.75, 1.0, 4.0), None),
        (stats.beta(2.0, 5.0, 1.0, 2.0), lambda u: 1.0 + 2.0 * special.betaincinv(2.0, 5.0, u)),
        (stats.weibull_min(1.7, 0.1, 0.3), lambda u: 0.1 + 0.3 * (-np.log1p(-u)) ** (1.0 / 1.7)),
    ],
)
def test_quantiles(theirs, closed):
    """Closed form: quantiles; the ends are those of the support, finite at all probabilities; converted to JSON and back."""
    ours, u = from_scipy(theirs), np.array([*np.linspace(0.0, 0.999, 50)[1:], 0.0001, 0.1, 0.5, 0.9, 0.9999])
    np.testing.assert_allclose(theirs.cdf(ours.quantile(u)), u, rtol=1e-9)
    if closed is not None:
        np.testing.assert_allclose(ours.quantile(u), closed(u), rtol=1e-9)
    assert np.all(np.isfinite(ours.quantile(np.array([0.0, 1.0 - 2**-53]))))
    np.testing.assert_allclose(theirs.cdf(ours.ends), [0.0, 1.0], atol=1e-12)
    assert theirs.support()[0] <= ours.ends[0] < ours.ends[1] <= theirs.support()[1]
    assert from_plain(json.loads(json.dumps(to_plain(ours)))) == ours


def test_ends_of_an_open_support_are_not_reached():
    """Limit: a lognormal number is positive at every probability, so that it may be a length."""
    low, high = from_scipy(stats.lognorm(0.3, scale=1e-4)).ends
    assert low > 0.0
    assert high == np.inf


def test_levels_in_the_logarithm():
    """Cross-check: scipy's loguniform."""
    u = np.linspace(0.0, 0.999, 50)
    ours = sd.Interval(1.0, 100.0, logarithmic=True)
    np.testing.assert_allclose(ours.quantile(u), stats.loguniform(1.0, 100.0).ppf(u), rtol=1e-12)


def test_quantiles_of_a_table():
    """Closed form: linear between the sorted values."""
    table = sd.Empirical((3.0, 1.0, 2.0))
    np.testing.assert_allclose(table.quantile(np.array([0.0, 0.25, 0.5, 1.0])), [1.0, 1.5, 2.0, 3.0])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: sd.Interval(2.0, 1.0), "from 2 to 1 is empty"),
        (lambda: sd.Interval(0.0, 1.0, logarithmic=True), "logarithmic range from 0"),
        (lambda: sd.Levels(()), "empty list"),
        (lambda: Distribution("norm", {"loc": 1.0, "scale": 0.0}), "norm(loc=1, scale=0) is not a distribution"),
        (lambda: Distribution("beta", {"a": -1.0, "b": 2.0}), "is not a distribution"),
        (lambda: Distribution("beta", {"a": 1.0}), "expected beta(a, b, loc, scale)"),
        (lambda: Distribution("norm", {"loc": float("nan")}), "norm of nan, 1; expected finite numbers"),
        (lambda: Distribution("gauss", {}), "distribution 'gauss'"),
        (lambda: Distribution("poisson", {"mu": 1.0}), "distribution 'poisson'"),
        (lambda: Design("sobel", 4), "did you mean 'sobol'"),
        (lambda: Design("sobol"), "points = 0"),
        (lambda: Design("grid", 4), "points = 4 of a grid design"),
        (lambda: Design("morris", 2), "at least 8"),
        (lambda: Design("saltelli", 2), "at least 8"),
        (lambda: design_size(Design("zip"), TWO), "lists of 2 and 3 values"),
    ],
)
def test_bad_designs(make, says):
    """Contract: wrong designs and distributions are refused."""
    with pytest.raises(sd.InputError, match=re.escape(says)):
        make()


@pytest.mark.parametrize("kind", ["sobol", "saltelli", "random", "grid"])
def test_chosen_and_uncertain_numbers_of_sobol_sequences_are_independent(kind):
    """Contract: chosen and uncertain factors are independent: each pair of quarters occurs equally often."""
    levels = sd.Levels(tuple(np.linspace(0.1e-3, 0.4e-3, 256).tolist())) if kind == "grid" else sd.Interval(0.1e-3, 0.4e-3)
    study = Study(
        arm(),
        sd.Options(until=0.01),
        (Factor("A.clearance", levels),),
        Design(kind, 0 if kind == "grid" else 256, 1),
        uncertain=(Factor("A.damping.restitution", sd.Interval(0.5, 0.9)),),
        sampling=Sampling(common=False),
    )
    numbers = study.numbers(np.arange(study.cases))
    places = [np.argsort(np.argsort(values)) * 4 // study.cases for values in numbers.values()]
    cells = np.histogram2d(*places, bins=4)[0]
    expected = study.cases / 16
    assert np.sum((cells - expected) ** 2 / expected) < 30.0  # 9 +- 4 of independent ones, 768 of equal ones
