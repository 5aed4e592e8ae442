"""Conclusions of a study: trends, recommendation and next steps for responses with known laws, in the reader's units."""

import dataclasses
import json
import math
import shlex

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import scissordyn as sd
from scissordyn.cli.study import show_answers
from scissordyn.plot.study import response_curves
from scissordyn.studies.answer.conclusion import agreement, conclude, needs, point_table, trend_table
from scissordyn.studies.answer.page import best_points, response_ranges, varied_numbers
from scissordyn.studies.answer.surface import between_points
from scissordyn.studies.answer.trend import fit_trends, morris_indices, rank_parameters, rankings, sensitivities, trends
from scissordyn.studies.answer.verdict import by_point, feasible_fraction, least_margins, recommended, worst_cases
from scissordyn.studies.ask.description import OwnMeasure
from scissordyn.studies.ask.design import Design, Factor, Sampling
from scissordyn.studies.ask.distribution import from_scipy
from scissordyn.studies.ask.requirement import Goal, Optimisation, Requirement
from scissordyn.studies.compute.store import FAILED
from scissordyn.warning import warning
from studies.test_answer import made_up, result_of, study

FORCE = Requirement("peak_force", "<", 500.0, text="peak_force < 500 N")  # Requirement on the peak force


def test_exponents_are_recovered():
    """Closed form: 3e5 c^1.02 v^-0.5 without noise; the value that meets a bound is the inverse."""
    rng = np.random.default_rng(1)
    x = np.stack([rng.uniform(1e-5, 4e-4, 20), rng.uniform(10.0, 20.0, 20)], axis=1)
    law = fit_trends(x, 3e5 * x[:, 0] ** 1.02 * x[:, 1] ** -0.5, np.arange(20), ("c", "v"))[0]
    assert law.form == "power"
    np.testing.assert_allclose(law.slopes, [1.02, -0.5], atol=1e-10)
    assert (law.r2, law.predicted, law.error) == pytest.approx((1.0, 1.0, 0.0), abs=1e-9)
    needed_value = (500.0 / 3e5 * 15.0**0.5) ** (1.0 / 1.02)
    assert law.inverse("c", 500.0, {"v": 15.0}) == pytest.approx(needed_value, rel=1e-9)
    assert law.value({"c": needed_value, "v": 15.0}) == pytest.approx(500.0, rel=1e-9)


def test_line_with_an_offset():
    """Closed form: 4 + 3 x predicts better than a power law, and no x > 0 gives 2."""
    x = np.linspace(0.1, 3.0, 12)[:, None]
    line = fit_trends(x, 4.0 + 3.0 * x[:, 0], np.arange(12), ("x",))[0]
    assert line.form == "linear"
    assert (line.constant, float(line.slopes[0])) == pytest.approx((4.0, 3.0))
    assert line.inverse("x", 2.0, {}) == pytest.approx(-2.0 / 3.0)


def test_intervals_of_exponents_cover():
    """Closed form: in 400 samples of a law with noise, about 95 % of the intervals contain the exponent."""
    rng, hits = np.random.default_rng(2), 0
    for _ in range(400):
        x = np.stack([rng.uniform(1.0, 8.0, 24), rng.uniform(1.0, 5.0, 24)], axis=1)
        values = 7.0 * x[:, 0] ** 1.5 * np.exp(0.2 * rng.standard_normal(24))
        law = next(one for one in fit_trends(x, values, np.arange(24), ("a", "b")) if one.form == "power")
        hits += bool(abs(law.slopes[0] - 1.5) < law.intervals[0])
    assert 0.92 * 400 <= hits <= 0.98 * 400


def test_cross_validation_finds_no_trend_in_noise():
    """Closed form: noise is predicted worse than by its mean; samples of a point are left out together."""
    rng = np.random.default_rng(3)
    x = np.repeat(rng.uniform(1.0, 2.0, (15, 3)), 4, axis=0)
    values = np.repeat(rng.uniform(1.0, 2.0, 15), 4)  # the same in all samples: a fit by rows would seem to predict it
    for groups in (np.arange(60) // 4, np.arange(60)):  # the same point in several cases is one point too
        assert all(not one.clear and one.points == 15 for one in fit_trends(x, values, groups, ("a", "b", "c")))


def test_too_few_points_have_no_trend():
    """Contract: three points, constants and failed cases are not fitted."""
    x = np.array([[1.0], [2.0], [3.0]])
    assert fit_trends(x, x[:, 0], np.arange(3), ("x",)) == ()
    x = np.linspace(1.0, 2.0, 9)[:, None]
    assert fit_trends(x, np.ones(9), np.arange(9), ("x",)) == ()
    assert fit_trends(x, np.full(9, np.nan), np.arange(9), ("x",)) == ()


def proportional(bound, points=24):
    """Return a study and results with a peak force of 4e6 N/m times the clearance, 400 to 2000 N, for any speed."""
    described = study(
        factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4), "mm", 1e-3), Factor("drive.speed", sd.Interval(10.0, 20.0))),
        design=Design("sobol", points, 1),
        requirements=(dataclasses.replace(FORCE, bound=bound),),
    )
    found = made_up(described, 4e6 * described.numbers(np.arange(points))["A.clearance"])
    return described, found


def test_range_of_an_extrapolated_trend():
    """Contract: a range of thousands is written without powers of ten."""
    described, found = proportional(100.0)
    varied = dataclasses.replace(described, factors=(dataclasses.replace(described.factors[0], unit="nm", scale=1e-9),))
    (need,) = needs(varied, found, trends(varied, found), {"A.clearance": 1e-4})
    assert "extrapolated from 1" in need.text
    assert "e+" not in need.text


def test_conclusion_of_an_infeasible_study():
    """Closed form: 100 N needs 25 um, below the range; the nearest point is that of the smallest clearance."""
    described, found = proportional(100.0)
    one = recommended(described, found)
    assert one is not None
    least = float(found["A.clearance"].min())
    assert one.numbers["A.clearance"] == least
    assert (one.feasible, one.binding) == (False, FORCE.label)
    assert one.margins[0].margin == pytest.approx(1.0 - 4e6 * least / 100.0)
    (need,) = needs(described, found, trends(described, found), one.numbers)
    assert (need.parameter, need.beyond) == ("A.clearance", True)
    assert need.value == pytest.approx(25e-6, rel=1e-6)
    assert need.text.startswith("A.clearance at most 0.025 mm, extrapolated from 0.1")
    said = conclude(result_of(described, found), "a.db")
    assert str(said.sentences[0]).startswith(
        "No point meets all requirements (0 of 24): 0.0% of the range (95 % interval 0.0% to"
    )
    assert str(said.sentences[1]).startswith(f"Point {one.point} is nearest to the requirements")
    requirement, _ = said.requirements.rows
    assert requirement[-1] == need.text
    plain = json.loads(json.dumps(said.to_plain(), allow_nan=False))
    assert plain[0]["numbers"]["tried"] == 24
    (by_trend,) = (fact for fact in plain if fact["kind"] == "trend")
    assert by_trend["numbers"]["slopes"]["A.clearance"] == pytest.approx(1.0)
    (row,) = said.trends.rows
    assert row[:3] == ("peak_force", "power law", "1.00 ± 0.00")
    assert float(row[3].split(" ± ")[0]) == pytest.approx(0.0, abs=1e-9)
    moved = shlex.split(said.next[0][1])
    low, high = moved[moved.index("--vary") + 1].removeprefix("A.clearance=").removesuffix(" mm").split("..")
    assert float(low) < 25e-3 < float(high) == pytest.approx(1e3 * least, rel=1e-3)
    assert said.next[1][1] == "scissordyn study refine a.db --goal 'minimise peak_force' -o next.db"


@pytest.mark.parametrize("bound", [100.0, 500.0, 1000.0, 1e4])
def test_smallest_margin(bound):
    """Closed form: the margin is 1 - F/bound at the smallest clearance, for met and missed bounds."""
    described, found = proportional(bound)
    (row, _) = conclude(result_of(described, found), "a.db").requirements.rows
    margin = 1.0 - 4e6 * float(found["A.clearance"].min()) / bound
    assert (row[0], row[2]) == (dataclasses.replace(FORCE, bound=bound).label, f"{margin:+.1%}")
    one = recommended(described, found)
    assert one is not None
    assert one.binding == (FORCE.label if bound < 2000.0 else "")  # all cases have less than 2000 N


def test_a_requirement_that_all_cases_meet_does_not_bind():
    """Contract: a requirement without a violation is not binding, however small its margin is next to those that are."""
    described, found = proportional(1000.0)
    wide = Requirement("peak_force", "<", 2100.0, text="peak_force < 2.1 kN")
    near = Requirement("contact_count", "<", 3.1, text="contact_count < 3.1")
    described = dataclasses.replace(described, measures=("peak_force", "contact_count"))
    described = dataclasses.replace(described, requirements=(*described.requirements, wide, near))
    count = ("case", np.full(24, 3.0), {"role": "measure", "units": "1"})
    one = recommended(described, found.assign(contact_count=count))
    assert one is not None
    assert one.margins[0].requirement == near.label
    assert one.binding == FORCE.label


def test_margins_of_a_bound_of_zero_are_fractions_of_the_largest_value():
    """Closed form: the margin of a force above 0 N is the force over the largest one, in whatever unit it is stored."""
    described, found = proportional(1000.0)
    positive = Requirement("peak_force", ">", 0.0, text="peak_force > 0 N")
    described = dataclasses.replace(described, requirements=(positive,))
    one = recommended(described, found)
    assert one is not None
    assert one.margins[0].margin == pytest.approx(1.0)  # the point with the largest force is recommended
    force = found["peak_force"].values.max(axis=1)
    assert least_margins(described, found) == pytest.approx(force / force.max())


def test_yes_or_no_responses_have_no_trend():
    """Contract: a response of 0 or 1 has no trend; its requirement is shown with the function's description."""
    described, _ = proportional(1000.0)
    held = Requirement("holds", ">", 0.5, text="holds > 0.5")
    described = dataclasses.replace(described, requirements=(held,), own_measures=(OwnMeasure("holds", float),))
    found = made_up(described, 4e6 * described.numbers(np.arange(24))["A.clearance"])
    yes = (np.arange(24) % 3 == 0).astype(float)
    found = found.assign(holds=("case", yes, {"units": "1", "role": "measure", "long_name": "the slider stays"}))
    assert "holds" not in trends(described, found)
    said = conclude(result_of(described, found), "a.db")
    assert said.requirements.head[:2] == ("requirement", "meaning")
    assert said.requirements.rows[0][:2] == ("holds > 0.5", "the slider stays")


def test_cases_that_never_settle_are_failures():
    """Closed form: above 0.3 mm nothing settles; there is no trend of the others, and the worst case is an unsettled one."""
    described, found = proportional(1000.0)
    clearance = found["A.clearance"].values
    settled = Requirement("settling_time", "<", 2.0, text="settling_time < 2 s")
    measures = ("settling_time", "end_track_deviation")
    described = dataclasses.replace(described, measures=measures, requirements=(settled,))
    about = {"role": "measure", "units": "s"}
    times = np.where(clearance > 3e-4, np.inf, 1.0 + 1e3 * clearance)[:, None]
    off = (2.0 * clearance)[:, None]
    found = found.assign(settling_time=(("case", "track"), times, about))
    found = found.assign(end_track_deviation=(("case", "track"), off, about | {"units": "m"})).assign_coords(track=["tip"])
    never = int(np.isinf(times).sum())
    assert feasible_fraction(described, found)[-1].fraction == 1.0 - never / 24
    worst = worst_cases(described, found)[0]
    assert clearance[worst.case] > 3e-4
    assert worst.text.startswith("not settled: off by ")
    assert worst.text.endswith(" mm at the end")
    assert float(worst.text.split()[4]) == pytest.approx(2e3 * clearance[worst.case], rel=1e-3)
    said = conclude(result_of(described, found), "a.db")
    assert "needs, by its trend" not in said.requirements.head
    points = by_point(described, found)
    assert np.isinf(points["settling_time"].values).sum() == never
    assert between_points(described, points, "settling_time") is None
    rows = {row[0]: row for row in response_ranges(described, found, points).rows}
    assert rows["settling_time"][3] == "none"
    assert rows["settling_time"][-1] == str(never)


def test_ranges_are_of_cases_and_not_of_means_over_samples():
    """Closed form: ends and median of samples of 100 to 432 N at one point; the median is the mean of the middle two."""
    described = study(factors=(), uncertain=(Factor("A.clearance", sd.Interval(1e-4, 5e-4)),), sampling=Sampling(12, "random"))
    peak = np.linspace(100.0, 432.0, 12)
    found = made_up(described, peak)
    row = response_ranges(described, found, by_point(described, found)).rows[0]
    assert [float(cell) for cell in row[1:4]] == pytest.approx([100.0, np.median(peak), 432.0], rel=1e-3)


def test_meaningless_extrapolations_are_left_out():
    """Closed form: bounds met at 250 km or 0.25 um are described without these values."""
    for bound, words in ((1e12, "any A.clearance"), (1.0, "no A.clearance")):
        described, found = proportional(bound)
        assert conclude(result_of(described, found), "a.db").requirements.rows[0][-1] == words


def test_joints_are_ranked_from_any_sampling():
    """Closed form: of 19 factors in 16 samples the effective one is first and beyond chance; in noise 5 % have any."""
    rng = np.random.default_rng(5)
    numbers = rng.random((16, 19))
    known, order, first, chance = rank_parameters(numbers, np.where(numbers[:, 7] > 0.9, np.inf, numbers[:, 7]))
    assert order[0] == 7
    assert known[7] == pytest.approx(1.0, abs=0.05)
    assert first[7] > 0.9
    assert np.all(np.abs(known[order[1:]]) < known[7])
    # independent: Student's t of a correlation at the level of one among 19
    t = chance[0] * math.sqrt(14.0 / (1.0 - chance[0] ** 2))
    assert 2.0 * stats.t.sf(t, 14) == pytest.approx(1.0 - 0.95 ** (1.0 / 19.0), rel=1e-9)
    beyond = 0
    for _ in range(400):
        x, y = stats.rankdata(rng.random((16, 19)), axis=0), np.arange(16.0)
        beyond += bool(np.max(np.abs(np.corrcoef(x.T, y)[-1, :-1])) > chance[0])
    assert 0.02 * 400 <= beyond <= 0.09 * 400
    masses = ("body.slider.mass", "body.unit 1/bar 1.mass", "body.unit 1/bar 2.mass")
    uncertain = tuple(Factor(name, sd.Interval(0.1, 0.9)) for name in ("gravity", *masses))
    described = study(
        uncertain=uncertain, sampling=Sampling(1, "random", common=False), design=Design("random", 8), measures=("peak_force",)
    )
    found = made_up(described, described.numbers(np.arange(8))["A.clearance"])
    table = rankings(described, found, trends(described, found))[0]
    assert table.rows[0][:2] == ("A.clearance", "+1.00")
    assert "8 samples of 6 parameters" in table.notes[0]


def test_numbers_of_an_unclear_trend_are_ranked():
    """Contract: factors are rank_parameters only if the trend does not predict points left out."""
    described = study(design=Design("random", 20), measures=("peak_force",))
    numbers = described.numbers(np.arange(20))["A.clearance"]
    noise = np.random.default_rng(3).lognormal(size=20)
    for values, tables in ((1.0 + 0.0 * numbers + noise, 1), (numbers, 0)):
        found = made_up(described, values)
        assert [trend.clear for trend, *_ in trends(described, found).values()] == [not tables]
        assert len(rankings(described, found, trends(described, found))) == tables


def test_conclusion_of_a_feasible_study():
    """Closed form: the bound is met below 0.25 mm, which is within the data."""
    described, found = proportional(1000.0)
    clearance = found["A.clearance"].values
    said = conclude(result_of(described, found), "a.db")
    low = clearance < 0.25e-3
    text = f"{low.sum()} of 24 points meet all requirements: {low.mean():.1%} of the range"
    assert str(said.sentences[0]).startswith(text)
    assert str(said.sentences[1]).startswith("Point ")
    assert said.point.head == ("parameter", "value", "tried", "all requirements met")
    least, most, met = (f"{1e3 * end:.4g}" for end in (clearance.min(), clearance.max(), clearance[low].max()))
    assert said.point.rows[0] == ("A.clearance", f"{least} mm", f"{least} to {most} mm", f"{least} to {met} mm")
    assert said.requirements.rows[0][-1] == "A.clearance at most 0.25 mm"
    assert "--uncertain" in said.next[0][1]
    assert trend_table(trends(described, found)).rows[0][:3] == ("peak_force", "power law", "1.00 ± 0.00")


def test_conclusion_with_many_factors():
    """Limit: with eight factors the table of trends has a row for each."""
    bars = [f"body.unit {unit}/bar {bar}.mass" for unit in (1, 2) for bar in (1, 2)]
    numbers = [*bars, "body.slider.mass", "drive.speed", "gravity", "A.clearance"]
    described = study(
        factors=tuple(Factor(name, sd.Interval(1e-4, 5e-4)) for name in numbers),
        uncertain=(),
        sampling=Sampling(1),
        design=Design("sobol", 64, 1),
    )
    values = described.numbers(np.arange(64))
    found = made_up(described, 4e6 * values["A.clearance"])
    one = recommended(described, found)
    assert one is not None
    assert [row[0] for row in point_table(described, by_point(described, found), one).rows] == numbers
    table = trend_table(trends(described, found))
    assert table.head == ("response", "peak_force")
    assert [row[0] for row in table.rows] == ["form", *numbers, "R2", "error at points left out"]


def test_probability_of_the_recommended_point():
    """Cross-check: point 1 meets the bound in 7 of 8 samples, with scipy's interval; a failed case meets nothing."""
    drawn = Factor("A.damping.restitution", sd.Interval(0.5, 0.9))
    described = study(
        factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4)),),
        design=Design("random", 3),
        uncertain=(drawn,),
        sampling=Sampling(8),
    )
    peak = np.array([400.0] * 6 + [600.0] * 2 + [450.0] * 7 + [600.0] + [900.0] * 8)
    one = recommended(described, made_up(described, peak))
    assert one is not None
    interval = stats.binomtest(7, 8).proportion_ci(0.95, method="exact")
    assert (one.point, one.probability, one.samples) == (1, 7 / 8, 8)
    assert (one.low, one.high) == pytest.approx((interval.low, interval.high), rel=1e-12)
    status = np.ones(24, int)
    status[8:11] = FAILED
    again = recommended(described, made_up(described, peak, status))
    assert again is not None
    assert (again.point, again.probability) == (0, 6 / 8)
    all_failed = made_up(described, np.full(24, np.nan), np.full(24, FAILED))
    assert recommended(described, all_failed) is None
    assert conclude(result_of(described, all_failed), "a.db").sentences == (warning("undecided"),)


def test_order_of_a_report(tmp_path):
    """Contract: sentences, requirements, trends and commands come first; paths are those of the store's name alone."""
    described, found = proportional(100.0)
    far = result_of(described, found, str(tmp_path / "far" / "a.db"))
    page = far.report(tmp_path / "r.html").read_text(encoding="utf-8")
    order = [
        "No point meets all requirements",
        "is nearest to the requirements",
        "<h2>Requirements</h2>",
        "Trends of the responses",
        "Next steps",
        "24 points (sobol)",
    ]
    places = [page.index(text) for text in order]
    assert places == sorted(places)
    assert "<th>parameters</th>" in page
    assert str(tmp_path) not in page
    assert "scissordyn study refine a.db" in page
    assert "in the folder that has a.db" in page


CLEARANCE = Factor("A.clearance", sd.Interval(1e-4, 5e-4, 5), "mm", 1e-3)  # Factor with five clearances


def of_two_members(**changes):
    """Return a study of the clearance on a grid with two members and a requirement on the peak force."""
    bound = Requirement("peak_force", "<", 60e3, text="peak_force < 60 kN")
    fields = {"factors": (CLEARANCE,), "design": Design(), "measures": ("peak_force",), "members": 2, "requirements": (bound,)}
    return study(**(fields | changes))


def with_peaks(described, peak, warnings=""):
    """Return results with given peaks [N], the same for all members."""
    return made_up(described, np.repeat(peak, described.members), warnings=warnings)


@pytest.mark.parametrize(
    ("variation", "said"),
    [
        (sd.Interval(1e-4, 5e-4), "0.1 to 0.5 mm"),
        (sd.Interval(1e-4, 5e-4, logarithmic=True), "0.1 to 0.5 mm, log"),
        (sd.Levels((1e-4, 2e-4)), "0.1, 0.2 mm"),
        (sd.Levels(tuple(np.arange(1, 9) * 1e-4)), "0.1, 0.2, 0.3, 0.4, 0.5, 0.6, ... 0.8 mm"),
        (from_scipy(stats.norm(3e-4, 5e-5)), "norm(loc=0.3, scale=0.05) mm"),
        (from_scipy(stats.lognorm(0.1, scale=3e-4)), "lognorm(s=0.1, loc=0, scale=0.3) mm"),
    ],
)
@pytest.mark.parametrize("unit", [("mm", 1e-3), ("", 1.0)])
def test_ranges_have_units(variation, said, unit):
    """Contract: ranges are in the user's unit, or with an engineering prefix."""
    described = of_two_members(factors=(Factor("A.clearance", variation, *unit),))
    found = xr.Dataset({"A.clearance": ("case", np.zeros(1), {"units": "m"})})
    assert varied_numbers(described, found).rows == [("A.clearance", "chosen", said)]


def test_terminal_and_report_have_units(tmp_path, capsys):
    """Contract: terminal and report have the same values with the same units, and warnings with counts and commands."""
    described = of_two_members()
    found = with_peaks(described, np.array([20e3, 30e3, 40e3, 50e3, 84.07e3]), "limit 5\nother")
    result = result_of(described, found)
    show_answers(result)
    shown = " ".join(capsys.readouterr().out.split())
    page = result.report(tmp_path / "r.html", figures=tmp_path / "figures").read_text(encoding="utf-8")
    for text in (
        "peak_force 20.00 40.00 84.07 kN 0.0%",
        "peak_force < 60 kN; value 84.07 kN; margin -40.1%; parameters A.clearance = 0.5 mm scissordyn study replay",
        "cases 10; warning limit 5 scissordyn study replay",
    ):
        assert text in shown
    for text in (
        "<td>20.00</td><td>40.00</td><td>84.07</td><td>kN</td>",
        "<td>84.07 kN</td><td>-40.1%</td><td>A.clearance = 0.5 mm</td><td><code>scissordyn study replay a.db 8</code></td>",
        "<td>10</td><td>limit 5</td><td><code>scissordyn study replay a.db 0</code></td>",
        "<td>0.1 to 0.5 mm</td>",
        "width=device-width",
        '<div class="scroll"><img alt="Response curves" style="min-width:',
        "&#39;met by&#39; is the fraction of 5 points, without failed cases.",
    ):
        assert text in page
    (picture,) = (tmp_path / "figures").iterdir()
    assert picture.name == "response_curves.png"
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_fronts_and_effects_have_units():
    """Closed form: the best of five points; the effect of a linear function is its slope."""
    best = dataclasses.replace(of_two_members(), design=Design("adaptive", 5), optimisation=Optimisation((Goal("peak_force"),)))
    points = np.linspace(1e-4, 5e-4, 5)[:, None]
    found = with_peaks(dataclasses.replace(best, design=Design("grid")), np.array([50e3, 40e3, 30e3, 45e3, 84e3]))
    found = found.assign({"A.clearance": found["A.clearance"].copy(data=np.repeat(points, 2))})
    part = best_points(result_of(best, found), 5)
    assert part.head == ("point", "A.clearance [mm]", "minimise peak_force [kN]")
    assert part.rows == [("2", "0.300", "30.00")]
    steps = np.array([[0.0], [2.0 / 3.0]] * 8)
    effects = morris_indices(steps, 3e3 * steps[:, 0], ["A.clearance"])
    effects.attrs["units"] = "N"
    (table,) = sensitivities({"peak_force": effects})
    assert table.head[1:] == ("mean effect [kN]", "deviation [kN]")
    assert float(table.rows[0][1].split()[0]) == pytest.approx(3.0 / 0.99, rel=1e-2)


def test_agreement_is_counted():
    """Contract: the text gives the number of points at which members disagree."""
    described = of_two_members()
    found = with_peaks(described, np.full(5, 30e3))
    assert "at all points" in str(agreement(described, by_point(described, found)))
    found["peak_force"][3] = 30.1e3
    assert "at 1 of 5 points" in str(agreement(described, by_point(described, found)))
    assert "on the requirements at 0" in str(agreement(described, by_point(described, found)))


def test_medians_of_curves():
    """Contract: points of a single factor are joined; a dozen points of two factors have two medians."""
    described = of_two_members()
    (one,) = response_curves(by_point(described, with_peaks(described, np.linspace(20e3, 84e3, 5))))
    assert next(line.get_label() for line in one.lines if line.get_linestyle() == "-").startswith("_")
    points = by_point(described, with_peaks(described, np.linspace(20e3, 84e3, 5)))
    twelve = xr.concat([points, points, points.isel(point=[0, 1])], "point")
    twelve = twelve.assign(other=("point", np.random.default_rng(1).random(12), {"role": "factor", "units": "1"}))
    for axes in response_curves(twelve):
        (median,) = (line for line in axes.lines if line.get_label() == "median")
        assert median.get_xdata().size == 2
