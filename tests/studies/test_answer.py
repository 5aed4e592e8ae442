"""Answers of studies: fractions, disagreement, indices, risk and optimisers by known results, and pages printed as PDF."""

import dataclasses
import re
import shutil
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats

import scissordyn as sd
from scissordyn.file.pdf import BROWSERS, print_pdf
from scissordyn.model.parameter_path import number
from scissordyn.plot.study import feasibility_map, pareto_front, requirement_bars, response_curves, sensitivity_bars
from scissordyn.studies.answer.page import numbers_text
from scissordyn.studies.answer.report import export, table
from scissordyn.studies.answer.trend import morris_indices, sensitivity, sobol_indices
from scissordyn.studies.answer.verdict import by_point, feasible_fraction, worst_cases
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Design, Factor, Sampling, design_values
from scissordyn.studies.ask.requirement import Goal, Optimisation, Requirement, risk_value
from scissordyn.studies.compute.execute import execute
from scissordyn.studies.compute.optimise import candidates, nondominated, optimise, proposer
from scissordyn.studies.compute.store import COMPLETE, FAILED, Store
from scissordyn.studies.compute.table import column
from scissordyn.studies.result import StudyResult
from studies.test_study import arm


def study(**changes):
    """Return a study of clearance and speed with a requirement on the peak force."""
    fields = {
        "mechanism": arm(),
        "options": sd.Options(0.005),
        "factors": (Factor("A.clearance", sd.Interval(1e-4, 5e-4)), Factor("drive.speed", sd.Interval(10.0, 20.0))),
        "design": Design("random", 8),
        "measures": ("peak_force", "contact_count"),
        "requirements": (Requirement("peak_force", "<", 500.0, text="peak_force < 500 N"),),
    }
    return Study(**(fields | changes))


def made_up(described, peak, status=None, warnings=""):
    """Return results of a study with given peaks."""
    cases = np.arange(described.cases)
    variables = {}
    for address, values in described.numbers(cases).items():
        unit = getattr(number(described.mechanism, address).quantity, "unit", "1")
        variables[column(address)] = ("case", values, {"role": "factor", "units": unit, "address": address})
    variables["peak_force"] = (("case", "joint"), peak[:, None], {"units": "N", "role": "measure"})
    variables["contact_count"] = (("case", "joint"), np.ones((cases.size, 1)), {"units": "1", "role": "measure"})
    variables["status"] = ("case", np.full(cases.size, COMPLETE) if status is None else status)
    variables |= {name: ("case", np.full(cases.size, text, object)) for name, text in (("cause", ""), ("warnings", warnings))}
    point, rest = np.divmod(cases, described.per_point)
    places = {"point": point, "sample": rest // described.members, "member": rest % described.members}
    return xr.Dataset(variables, {"joint": ["A"], **{name: ("case", place) for name, place in places.items()}})


def result_of(described, results, store="a.db"):
    """Return a study with given results."""
    result = StudyResult(described, Store(store))
    result.dataset = results  # as it is read from a store
    return result


def test_feasible_fraction_and_interval():
    """Cross-check: 30 of 40 points, with the interval of scipy's exact binomial test."""
    described = study(design=Design("random", 40))
    peak = np.where(np.arange(40) < 30, 400.0, 600.0)
    one, both = feasible_fraction(described, made_up(described, peak))
    interval = stats.binomtest(30, 40).proportion_ci(0.95, method="exact")
    np.testing.assert_allclose((one.fraction, one.low, one.high), (0.75, interval.low, interval.high), rtol=1e-12)
    assert (both.fraction, both.trials) == (0.75, 40)
    failed = np.where(np.arange(40) < 10, FAILED, COMPLETE)
    assert feasible_fraction(described, made_up(described, peak, failed))[0].fraction == pytest.approx(20 / 30)
    grid = dataclasses.replace(described, design=Design("grid"))
    assert np.isnan(feasible_fraction(grid, made_up(grid, np.full(100, 400.0)))[0].low)


def test_members_that_disagree_are_marked():
    """Closed form: point 0 agrees, point 1 differs and is undecided, point 2 differs on one side of the bound."""
    described = study(design=Design("random", 3), members=2)
    points = by_point(described, made_up(described, np.array([400.0, 400.0, 400.0, 600.0, 300.0, 400.0])))
    assert points["disagrees"].values.tolist() == [False, True, True]
    assert points["undecided"].values.tolist() == [False, True, False]
    assert points["met"].values.tolist() == [1.0, 0.5, 1.0]
    assert points["spread peak_force"].values.tolist() == pytest.approx([0.0, 1 / 3, 0.25])
    assert points["worst peak_force"].values.tolist() == [400.0, 600.0, 400.0]


def test_worst_cases_and_causes():
    """Closed form: one case per point, the farthest beyond the bound first; causes that differ by numbers are one."""
    described = study(design=Design("random", 3), members=2)
    worst = worst_cases(described, made_up(described, np.array([900.0, 800.0, 400.0, 700.0, 100.0, 200.0])), 2)
    assert [(one.case, one.value) for one in worst] == [(0, 900.0), (3, 700.0)]
    assert worst[0].margin == pytest.approx(-0.8)
    # where nothing is chosen, one case of each sample
    drawn = (Factor("A.clearance", sd.Interval(1e-4, 5e-4)),)
    described = study(factors=(), design=Design(), uncertain=drawn, sampling=Sampling(3, "random"), members=2)
    worst = worst_cases(described, made_up(described, np.array([900.0, 800.0, 400.0, 700.0, 100.0, 200.0])), 5)
    assert [(case.case, case.value) for case in worst] == [(0, 900.0), (3, 700.0), (5, 200.0)]
    found = made_up(described, np.full(6, np.nan), np.array([FAILED] * 6))
    found["cause"].values[:] = ["stopped at t = 0.1 s", "stopped at t = 2.53e-05 s", "other"] * 2
    assert {cause: len(cases) for cause, cases in result_of(described, found).causes.items()} == {
        "stopped at t = 0.1 s": 4,
        "other": 2,
    }


def ishigami(points):
    """Return Ishigami's function sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1 of points in [-pi, pi]^3."""
    x = points
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_indices():
    """Return the first-order and total indices of Ishigami's function in closed form (Ishigami and Homma 1990)."""
    a, b, pi = 7.0, 0.1, np.pi
    v1, v2, v13 = 0.5 * (1.0 + b * pi**4 / 5.0) ** 2, a**2 / 8.0, b**2 * pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = v1 + v2 + v13
    return np.array([v1, v2, 0.0]) / whole, np.array([v1 + v13, v2, v13]) / whole


def test_sobol_indices_of_ishigami():
    """Closed form: indices within the bootstrap intervals, and equal to SALib's for the same samples."""
    from SALib.analyze import sobol

    sides = (sd.Interval(-np.pi, np.pi),) * 3
    base = 2048
    points = design_values(Design("saltelli", base, seed=4), sides, np.zeros(3), np.arange(base * 5))
    values = ishigami(points)
    found = sobol_indices(values, ["x1", "x2", "x3"])
    xr.testing.assert_identical(found, sobol_indices(values, ["x1", "x2", "x3"]))  # with the intervals
    first, total = ishigami_indices()
    assert np.all(np.abs(found["first"].values - first) < found["first_interval"].values)
    assert np.all(np.abs(found["total"].values - total) < found["total_interval"].values)
    problem = {"num_vars": 3, "names": ["x1", "x2", "x3"], "bounds": [[-np.pi, np.pi]] * 3}
    theirs = sobol.analyze(problem, values, calc_second_order=False, seed=1)
    np.testing.assert_allclose(found["first"].values, theirs["S1"], rtol=1e-12)
    np.testing.assert_allclose(found["total"].values, theirs["ST"], rtol=1e-12)
    design = Design("saltelli", 8)
    peak = np.random.default_rng(2).random(32)
    indices, left_out = sensitivity(study(design=design), made_up(study(design=design), peak))
    assert list(left_out) == ["contact_count"]  # the same at all points
    for key in ("first", "total"):
        np.testing.assert_array_equal(indices["peak_force"][key], sobol_indices(peak, ["A.clearance", "drive.speed"])[key])
    values[7] = np.nan  # a case that failed costs its base point
    assert sobol_indices(values, ["x1", "x2", "x3"]).attrs["left_out"] == 1
    with pytest.raises(sd.InputError, match="3 complete base points"):
        sobol_indices(values[-15:], ["x1", "x2", "x3"])


def test_morris_effects_of_a_linear_function():
    """Closed form: the effects are the slopes, without deviation."""
    design = Design("morris", 12)
    sides = (sd.Interval(0.0, 1.0),) * 2
    points = design_values(design, sides, np.zeros(2), np.arange(36))
    found = morris_indices(points, 3.0 * points[:, 0] - 5.0 * points[:, 1], ["a", "b"])
    np.testing.assert_allclose(found["effect"].values, [3.0, 5.0], rtol=1e-9)
    np.testing.assert_allclose(found["deviation"].values, 0.0, atol=1e-9)


def test_risk_of_known_distributions():
    """Closed form: mean, quantile and CVaR of a uniform and a normal distribution from 10^5 equally probable values."""
    u = (np.arange(100_000) + 0.5) / 100_000
    for values, quantile, cvar in (
        (u, 0.95, 0.975),
        (stats.norm.ppf(u), stats.norm.ppf(0.95), stats.norm.pdf(stats.norm.ppf(0.95)) / 0.05),
    ):
        assert risk_value(values[None], "mean")[0] == pytest.approx(np.mean(values))
        assert risk_value(values[None], "quantile 95 %")[0] == pytest.approx(quantile, rel=1e-4)
        assert risk_value(values[None], "cvar 95 %")[0] == pytest.approx(cvar, rel=2e-4)
    ten = np.arange(1.0, 11.0)[None]
    assert risk_value(ten, "cvar 90 %")[0] == pytest.approx(10.0)
    assert risk_value(ten, "cvar 85 %")[0] == pytest.approx((10.0 + 0.5 * 9.0) / 1.5)
    assert risk_value(ten, "worst")[0] == 10.0
    with pytest.raises(sd.InputError, match="risk 'median'"):
        risk_value(ten, "median")


def rosenbrock(u):
    """Return Rosenbrock's function with its minimum of 0 at (0.3, 0.6, 0.45)."""
    x = 1.0 + 4.0 * (u - np.array([0.3, 0.6, 0.45]))
    return np.asarray(np.sum(100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2, axis=1))


@pytest.mark.parametrize(
    ("value", "missing", "numbers", "population", "generations", "least", "within"),
    [
        (rosenbrock, 0.0, 3, 12, 250, 0.0, 1e-10),
        (lambda u: u.sum(axis=1), 0.04, 2, 10, 150, 0.4, 1e-3),
        (lambda u: (u[:, 0] - 0.8) ** 2, 0.0, 1, 0, 40, 0.0, 1e-6),
    ],
    ids=["rosenbrock", "required product", "one number"],
)
def test_cma_finds_known_optima(value, missing, numbers, population, generations, least, within):
    """Published number: optima of Rosenbrock's function, of a sum with a required product, and of one variable."""
    method = proposer(Optimisation((Goal("peak_force"),), population=population, seed=1), numbers)
    best = np.inf
    for _ in range(generations):
        u = method.ask()
        assert u.shape[1] == numbers
        values, violation = value(u), np.maximum(missing - u.prod(axis=1), 0.0)
        best = min(best, float(np.min(values[violation <= 0.0], initial=np.inf)))
        method.tell(values[:, None], violation)
    assert least <= best < least + within


def test_nsga_finds_the_front_of_zdt1():
    """Published front: f2 = 1 - sqrt(f1) (Zitzler, Deb and Thiele 2000), within 0.02 over its whole length."""
    method = proposer(Optimisation((Goal("peak_force"), Goal("steps")), population=60, seed=1), 6)
    goals = np.empty((0, 2))
    for _ in range(120):
        u = method.ask()
        g = 1.0 + 9.0 * u[:, 1:].mean(axis=1)
        new = np.stack([u[:, 0], g * (1.0 - np.sqrt(u[:, 0] / g))], axis=1)
        goals = np.concatenate([goals, new])
        method.tell(new, np.zeros(len(new)))
    front = goals[nondominated(goals)]
    assert np.max(front[:, 1] - (1.0 - np.sqrt(front[:, 0]))) < 0.02
    assert front[:, 0].min() < 0.01
    assert front[:, 0].max() > 0.99


def test_nondominated_against_every_pair():
    """Cross-check: nondominated points by comparison of every pair."""
    goals = np.round(np.random.default_rng(3).random((80, 3)), 1)
    expected = [not any(np.all(other <= one) and np.any(other < one) for other in goals) for one in goals]
    assert nondominated(goals).tolist() == expected


def test_optimisation_is_continued_from_its_store(tmp_path):
    """Contract: stopped after two generations and continued, it has the points and results of an undisturbed one."""
    plan = Optimisation((Goal("peak_force"),), risk="worst", population=4, generations=4, seed=5)
    described = study(optimisation=plan, design=plan.design(1, 2), requirements=(Requirement("contact_count", "<=", 4.0),))
    whole = optimise(described, tmp_path / "whole.db", block=3)
    short = dataclasses.replace(described, optimisation=dataclasses.replace(plan, generations=2))
    optimise(short, tmp_path / "a.db", block=3)
    store = optimise(described, tmp_path / "a.db")
    xr.testing.assert_equal(store.results(), whole.results())
    assert store.times()["cases"].sum() == 16
    found = candidates(dataclasses.replace(described, design=store.design()), store.results())
    meets = found.points["violation"].values <= 0.0
    assert float(found.points["minimise peak_force"][found.best]) == found.points["minimise peak_force"].values[meets].min()
    other = dataclasses.replace(described, optimisation=dataclasses.replace(plan, seed=6))
    with pytest.raises(sd.InputError, match="holds points that the method does not propose"):
        optimise(other, tmp_path / "a.db")


def test_tables_reports_and_replays(tmp_path, monkeypatch):
    """Contract: tables hold the results, a replayed case has the stored peak, and a report has every picture."""
    import pandas as pd

    described = study(design=Design("grid"), factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4, 3)), *study().factors[1:]))
    described = dataclasses.replace(described, members=2)
    results = execute(described, tmp_path / "a.db").results()
    rows = table(results)
    assert rows["A.peak_force [N]"].to_numpy().tolist() == results["peak_force"].values[:, 0].tolist()
    assert set(rows["status"]) == {"complete"}
    pd.testing.assert_frame_equal(pd.read_parquet(export(results, tmp_path / "a.parquet")), rows)
    read = pd.read_csv(export(results, tmp_path / "a.csv"), index_col="case", keep_default_na=False)
    np.testing.assert_allclose(read["A.peak_force [N]"], rows["A.peak_force [N]"], rtol=1e-15)
    with xr.open_dataset(export(results, tmp_path / "a.nc"), engine="h5netcdf") as saved:
        np.testing.assert_array_equal(saved["peak_force"].values, results["peak_force"].values)
    found = sd.open_study(tmp_path / "a.db")
    run = found.replay(4)
    assert int(found.dataset["member"][4]) == 0
    assert float(run["peak_force"].max()) == float(results["peak_force"][4, 0])
    text = found.report(tmp_path / "r.html").read_text()
    for title in (
        "Where the requirements are met",
        "Map: largest force that a joint transmits",
        "Response curves",
        "scissordyn study replay a.db",
    ):
        assert title in text
    with pytest.raises(sd.InputError, match=r"ends in \.html or \.pdf"):
        found.report(tmp_path / "r.txt")
    monkeypatch.setattr("scissordyn.studies.answer.report.print_pdf", lambda page: b"%PDF-1.4" + page)
    assert b"Response curves" in found.report(tmp_path / "r.pdf").read_bytes()
    hostile = result_of(described, results, "<script>alert(1)").report(tmp_path / "r.pdf").read_bytes()  # replaces the file
    assert b"<script" not in hostile
    assert b"&lt;script&gt;alert(1)" in hostile
    (tmp_path / "own.pdf").write_text("mine")
    with pytest.raises(sd.InputError, match="exists and is not a report"):
        found.report(tmp_path / "own.pdf")
    with pytest.raises(sd.InputError, match=r"ends in \.csv"):
        export(results, tmp_path / "a.xls")
    assert export(results, tmp_path / "a.csv") == tmp_path / "a.csv"  # in the place of the same table
    for name in ("notes.csv", "notes.parquet"):
        (tmp_path / name).write_text("mine\n")
        with pytest.raises(sd.InputError, match="is not overwritten"):
            export(results, tmp_path / name)
        assert (tmp_path / name).read_text() == "mine\n"


def test_pictures_of_a_study():
    """Contract: cells of the map, marks of disagreeing members, the bound, bars and the front."""
    described = study(design=Design("grid"), members=2, factors=study().factors)
    peak = np.repeat(np.linspace(300.0, 700.0, 100), 2)
    peak[1] = 400.0
    points = by_point(described, made_up(described, peak))
    (one,) = feasibility_map(points, colour="peak_force", limit=500.0)
    mesh = one.collections[0]
    assert mesh.get_array().shape == (10, 10)
    assert not one.get_title(loc="left")
    twice = xr.concat([points, points], "point", data_vars="minimal", coords="minimal", compat="override")
    (of_two,) = feasibility_map(twice, colour="peak_force")
    assert of_two.get_title(loc="left").startswith("each field: mean of 2 points")
    marks = [line for line in one.lines if line.get_label() == "members disagree"]
    assert marks[0].get_xdata().size == 1
    curves = response_curves(points, limits={"peak_force": 500.0})
    assert len(curves) == 4  # a measure without a requirement is an answer too
    assert any(line.get_label() == "required" for line in curves[0].lines)
    sides = (sd.Interval(-np.pi, np.pi),) * 3
    values = ishigami(design_values(Design("saltelli", 64), sides, np.zeros(3), np.arange(320)))
    bars = sensitivity_bars({"y": sobol_indices(values, ["x1", "x2", "x3"])})
    assert len(bars[0].patches) == 6
    tried = xr.Dataset(
        {
            "minimise a": ("point", [1.0, 2.0, 3.0], {"units": "N"}),
            "maximise b": ("point", [1.0, 2.0, 1.5], {"units": "N"}),
            "violation": ("point", [0.0, 0.0, 0.0]),
            "front": ("point", [True, True, False]),
        }
    )
    (axes,) = pareto_front(tried, ("minimise a", "maximise b"))
    front = next(line for line in axes.lines if line.get_label() == "Pareto front")
    assert front.get_ydata().tolist() == [1.0, 2.0]
    confirmed = pd.DataFrame(
        {
            "minimise a": [1.0, 2.0, 3.0],
            "maximise b": [1.0, 2.0, 1.5],
            "accurate minimise a": [1.1, 2.2, np.nan],
            "accurate maximise b": [0.9, 1.8, np.nan],
            "accurate violation": [0.0, 0.1, np.inf],
        }
    )
    (axes,) = pareto_front(tried, ("minimise a", "maximise b"), confirmed=confirmed)
    marks = {str(line.get_label()): line.get_xydata().tolist() for line in axes.lines}
    assert marks["accurate run meets them"] == [[1.1, 0.9]]
    assert marks["accurate run does not meet them"] == [[2.2, 1.8]]
    assert [[1.0, 1.0], [1.1, 0.9]] in [line.get_xydata().tolist() for line in axes.lines]
    assert {text.get_text() for text in axes.figure.legends[0].get_texts()} >= {"Pareto front of cheap runs", *list(marks)[-2:]}
    with pytest.raises(sd.InputError, match="the study has 1 factor"):
        feasibility_map(points.drop_vars("drive.speed"))


def test_labels_of_bars_are_whole():
    """Contract: a long label is wrapped without truncation, and labels do not overlap."""
    long = " ".join(["displacement"] * 12)
    (axes,) = requirement_bars([long, "short", long], np.array([0.1, 0.2, 1.0]), np.full((3, 2), np.nan))
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    labels = axes.get_yticklabels()
    assert labels[0].get_text().replace("\n", " ") == long
    boxes = [label.get_window_extent() for label in labels]
    assert all(above.y0 >= below.y1 for above, below in pairwise(boxes))
    assert min(box.x0 for box in boxes) >= 0.0


def test_counts_have_whole_ticks():
    """Contract: axes of counts have integer ticks; units typed by the user are printed as others."""
    counts = np.array([3.0, 18.0, 7.0, 11.0])
    about = {"role": "factor", "units": "N m", "shown_unit": "N m", "shown_scale": 1.0}
    points = xr.Dataset({"limit": ("point", np.arange(4.0), about), "disagrees": ("point", np.zeros(4, bool))})
    points["contact_count"] = ("point", counts, {"role": "response", "units": "1"})
    (axes,) = response_curves(points)
    assert all(float(tick).is_integer() for tick in axes.get_yticks())
    assert axes.get_xlabel() == "limit [N·m]"


def test_warnings_are_counted_by_their_text():
    """Closed form: warnings that differ by numbers are one; a case may have several."""

    def warned(texts):
        return result_of(study(), xr.Dataset({"warnings": ("case", texts)})).warnings

    said = ["joint 'A': 3 of 4 start at 1.5e-3 m/s\nlimit 5", "", "joint 'A': 11 of 40 start at 2 m/s", "limit -5.5"]
    assert warned(said) == {"joint 'A': 3 of 4 start at 1.5e-3 m/s": [0, 2], "limit 5": [0, 3]}
    twice = ["joint '1' is loose\njoint '2' is loose", "joint '1' is loose"]
    assert warned(twice) == {"joint '1' is loose": [0, 1]}


def test_curves_of_the_most_important_factors():
    """Limit: of 18 factors five have curves, those with an effect among them; the title gives both numbers."""
    chance = np.random.default_rng(4)
    numbers = {f"number {k}": ("point", chance.random(40), {"role": "factor", "units": "1"}) for k in range(18)}
    response = 3.0 * numbers["number 7"][1] - 2.0 * numbers["number 16"][1]
    points = xr.Dataset(
        {
            **numbers,
            "peak_force": ("point", response, {"role": "response", "units": "N"}),
            "disagrees": ("point", np.zeros(40, bool)),
        }
    )
    drawn = response_curves(points)
    labels = [axes.get_xlabel() for axes in drawn]
    assert len(drawn) == 5
    assert {"number 7", "number 16"} <= set(labels)
    assert drawn[0].get_title(loc="left").startswith("5 of 18 factors")
    figure = drawn[0].get_figure(root=True)
    assert figure is not None
    assert figure.get_figwidth() < 15.0


def test_extreme_values_of_a_worst_case():
    """Limit: of 19 values of a case the report has six, the one farthest from its mean among them."""
    chance = np.random.default_rng(5)
    names = [f"joint {k}.clearance" for k in range(19)]
    values = chance.random((40, 19))
    values[3, 11] = 30.0
    results = xr.Dataset({column(name): ("case", values[:, k], {"units": "1"}) for k, name in enumerate(names)})
    described = SimpleNamespace(varied=())
    text = numbers_text(described, results, dict(zip(names, values[3], strict=True)))
    assert "joint 11.clearance = 30" in text
    assert text.count("=") == 6
    assert text.endswith("and 13 nearer to their means")


# HTML report with two pages
PAGE = b"<!doctype html><html><title>Study</title><h1>first</h1><h1 style='break-before: page'>second</h1></html>"


def browser(folder, monkeypatch, line):
    """Replace the browser by a shell script."""
    path = folder / BROWSERS[0]
    path.write_text(f"#!/bin/sh\n{line}\n", encoding="utf-8")
    path.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(path) if name == BROWSERS[0] else None)


@pytest.mark.skipif(not any(map(shutil.which, BROWSERS)), reason="no browser that prints")
def test_printed_page():
    """Contract: the PDF has all pages."""
    found = print_pdf(PAGE)
    assert found.startswith(b"%PDF-")
    assert found.rstrip().endswith(b"%%EOF")
    assert len(re.findall(rb"/Type\s*/Page\b", found)) == 2


def test_pdf_without_a_browser(monkeypatch):
    """Contract: the error says what to type."""
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(sd.InputError, match=r"-o report\.html"):
        print_pdf(PAGE)


def test_failing_browser(tmp_path, monkeypatch):
    """Contract: it is an error if the browser writes nothing, or no PDF."""
    browser(tmp_path, monkeypatch, "exit 3")
    with pytest.raises(sd.ScissordynError, match="did not print"):
        print_pdf(PAGE)
    browser(tmp_path, monkeypatch, 'for a in "$@"; do case $a in --print-to-pdf=*) echo no > "${a#*=}";; esac; done')
    with pytest.raises(sd.ScissordynError, match="is not a PDF"):
        print_pdf(PAGE)
