"""Designs and distributions: points that depend on their number only, and quantile functions compared with scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import scissordyn as sd
from scissordyn.model.options import Options
from scissordyn.studies.ask.description import Study, to_plain
from scissordyn.studies.ask.design import DESIGNS, Design, Factor, Sampling, design_size, design_values, uniform_numbers
from scissordyn.studies.ask.distribution import (
    Empirical,
    Interval,
    Levels,
    LogNormal,
    Normal,
    Uniform,
    Variation,
    from_plain,
)
from studies.test_study import arm

TWO: tuple[Variation, ...] = (Interval(1.0, 3.0, 3), Levels((5.0, 7.0)))
BASE = np.array([2.5, 6.0])


@pytest.mark.parametrize("kind", [kind for kind in DESIGNS if kind not in ("adaptive", "zip")])
def test_point_depends_on_its_number_only(kind: str) -> None:
    """Contract: any selection of points, in any order, has the values of the whole design."""
    design = Design(kind, 8, seed=3)
    size = design_size(design, TWO)
    whole = design_values(design, TWO, BASE, np.arange(size))
    assert whole.shape == (size, 2)
    for chosen in (np.array([size - 1]), np.arange(1, size, 2), np.array([0, 2, 3])):
        np.testing.assert_array_equal(design_values(design, TWO, BASE, chosen), whole[chosen])


@pytest.mark.parametrize("kind", ["random", "sobol", "saltelli"])
def test_larger_designs_keep_their_first_points(kind: str) -> None:
    """Contract: the first points of a larger design are those of the smaller one."""
    small, large = Design(kind, 16, seed=1), Design(kind, 64, seed=1)
    at = np.arange(design_size(small, TWO))
    np.testing.assert_array_equal(design_values(small, TWO, BASE, at), design_values(large, TWO, BASE, at))


@pytest.mark.parametrize(
    ("kind", "variations", "points"),
    [
        ("grid", TWO, [[1, 5], [1, 7], [2, 5], [2, 7], [3, 5], [3, 7]]),
        ("zip", (Levels((1.0, 2.0)), Levels((5.0, 7.0))), [[1, 5], [2, 7]]),
        ("one-at-a-time", TWO, [[2.5, 6], [1, 6], [2, 6], [3, 6], [2.5, 5], [2.5, 7]]),
    ],
)
def test_points_at_levels(kind: str, variations: tuple[Variation, ...], points: list[list[float]]) -> None:
    """Closed form: every combination, the last factor fastest; paired lists; the mechanism, then each level alone."""
    size = design_size(Design(kind), variations)
    assert design_values(Design(kind), variations, BASE, np.arange(size)).tolist() == points


def test_latin_hypercube_and_sobol_fill_every_stratum() -> None:
    """Contract: of 16 points one is in each sixteenth of every factor."""
    pair = (Uniform(0.0, 1.0), Uniform(0.0, 1.0))
    for kind in ("latin-hypercube", "sobol"):
        found = design_values(Design(kind, 16), pair, BASE, np.arange(16))
        for k in range(2):
            assert sorted((found[:, k] * 16).astype(int).tolist()) == list(range(16)), kind


def test_saltelli_is_the_order_of_salib(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cross-check: the sample of SALib from the same Sobol sequence."""
    from SALib.sample import sobol
    from scipy.stats import qmc

    sequence = qmc.Sobol(6, seed=5).random(16)  # SALib scrambles by this keyword, which gives other numbers than rng
    monkeypatch.setattr("scissordyn.studies.ask.design.sobol_numbers", lambda seed, dimensions, at: sequence[at])

    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.0, 1.0]] * 3}
    theirs = sobol.sample(problem, 16, calc_second_order=False, seed=5)
    ours = design_values(Design("saltelli", 16, seed=5), (Uniform(0.0, 1.0),) * 3, np.zeros(3), np.arange(16 * 5))
    np.testing.assert_array_equal(ours, theirs)


def test_random_numbers_by_place() -> None:
    """Contract: streams and seeds differ, and the mean of many is 1/2 within five standard errors."""
    at = np.arange(20_000)
    one = uniform_numbers(1, 0, 3, at)
    assert not np.any(one == uniform_numbers(1, 1, 3, at))
    assert not np.any(one == uniform_numbers(2, 0, 3, at))
    assert np.all(np.abs(one.mean(axis=0) - 0.5) < 5.0 / np.sqrt(12 * at.size))
    np.testing.assert_array_equal(uniform_numbers(1, 0, 3, np.array([7, 19_999, 3])), one[[7, 19_999, 3]])


@pytest.mark.parametrize(
    ("ours", "theirs", "within"),
    [
        (Uniform(2.0, 5.0), stats.uniform(2.0, 3.0), 1e-12),
        (Normal(1.0, 0.2), stats.norm(1.0, 0.2), 1e-12),
        (Normal(1.0, 0.2, 0.9, 1.5), stats.truncnorm(-0.5, 2.5, 1.0, 0.2), 1e-12),
        (LogNormal(3.0, 0.4), stats.lognorm(0.4, scale=3.0), 1e-12),
        (Interval(1.0, 100.0, logarithmic=True), stats.loguniform(1.0, 100.0), 1e-12),
        (sd.Triangular(1.0, 2.0, 5.0), stats.triang(0.25, 1.0, 4.0), 1e-9),
        (sd.Triangular(1.0, 1.0, 5.0), stats.triang(0.0, 1.0, 4.0), 1e-9),
        (sd.Trapezoid(1.0, 2.0, 4.0, 5.0), stats.trapezoid(0.25, 0.75, 1.0, 4.0), 1e-9),
        (sd.Beta(2.0, 5.0, 1.0, 3.0), stats.beta(2.0, 5.0, 1.0, 2.0), 1e-9),
        (sd.Weibull(1.7, 0.3, 0.1), stats.weibull_min(1.7, 0.1, 0.3), 1e-9),
    ],
)
def test_quantiles(ours: Variation, theirs: stats.rv_continuous, within: float) -> None:
    """Cross-check: scipy's quantile functions and ends; finite at all probabilities; converted to JSON and back."""
    u = np.array([*np.linspace(0.0, 0.999, 50)[1:], 0.0001, 0.1, 0.5, 0.9, 0.9999])
    np.testing.assert_allclose(ours.quantile(u), theirs.ppf(u), rtol=within)
    assert np.all(np.isfinite(ours.quantile(np.array([0.0, 1.0 - 2**-53]))))
    assert ours.ends == pytest.approx(theirs.support())
    assert from_plain(to_plain(ours)) == ours


def test_quantiles_of_a_table() -> None:
    """Closed form: linear between the sorted values."""
    table = Empirical((3.0, 1.0, 2.0))
    np.testing.assert_allclose(table.quantile(np.array([0.0, 0.25, 0.5, 1.0])), [1.0, 1.5, 2.0, 3.0])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Interval(2.0, 1.0), "from 2 to 1 is empty"),
        (lambda: Interval(0.0, 1.0, logarithmic=True), "logarithmic range from 0"),
        (lambda: Levels(()), "empty list"),
        (lambda: Normal(1.0, 0.0), "standard deviation of 0"),
        (lambda: Normal(0.0, 1.0, 50.0, 60.0), "without probability"),
        (lambda: Design("sobel", 4), "did you mean 'sobol'"),
        (lambda: Design("sobol"), "points = 0"),
        (lambda: Design("morris", 2), "at least 8"),
        (lambda: Design("saltelli", 2), "at least 8"),
        (lambda: design_size(Design("zip"), TWO), "lists of 2 and 3 values"),
    ],
)
def test_bad_designs(make: object, says: str) -> None:
    """Contract: wrong designs and distributions are refused."""
    with pytest.raises(sd.InputError, match=says):
        make()  # type: ignore[operator]


@pytest.mark.parametrize("kind", ["sobol", "saltelli", "random", "grid"])
def test_chosen_and_uncertain_numbers_of_sobol_sequences_are_independent(kind: str) -> None:
    """Contract: chosen and uncertain factors are independent: each pair of quarters occurs equally often."""
    levels = Levels(tuple(np.linspace(0.1e-3, 0.4e-3, 256).tolist())) if kind == "grid" else Interval(0.1e-3, 0.4e-3)
    study = Study(
        arm(),
        Options(until=0.01),
        (Factor("A.clearance", levels),),
        Design(kind, 0 if kind == "grid" else 256, 1),
        uncertain=(Factor("A.damping.restitution", Uniform(0.5, 0.9)),),
        sampling=Sampling(common=False),
    )
    numbers = study.numbers(np.arange(study.cases))
    places = [np.argsort(np.argsort(values)) * 4 // study.cases for values in numbers.values()]
    cells = np.histogram2d(*places, bins=4)[0]
    expected = study.cases / 16
    assert np.sum((cells - expected) ** 2 / expected) < 30.0  # 9 +- 4 of independent ones, 768 of equal ones
