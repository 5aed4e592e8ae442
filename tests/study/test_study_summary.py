"""What a study says: numbers in the units in which the user reads them, in the terminal as in the report."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from scissordyn.cli.study import show_answers
from scissordyn.plot.study import response_curves
from scissordyn.study.answer.page import agreement, best_points, varied_numbers
from scissordyn.study.answer.trend import morris_indices, sensitivities
from scissordyn.study.answer.verdict import by_point
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import Design, Factor
from scissordyn.study.ask.distribution import Interval, Levels, LogNormal, Normal, Uniform, Variation
from scissordyn.study.ask.requirement import Goal, Optimisation, Requirement
from study.test_answer import made_up, result_of
from study.test_answer import study as two_factors

CLEARANCE = Factor("A.clearance", Interval(1e-4, 5e-4, 5), "mm", 1e-3)


def study(**changes: Any) -> Study:
    """The clearance of the paper's array on a grid, the peak force required, two members."""
    bound = Requirement("peak_force", "<", 60e3, text="peak_force < 60 kN")
    fields = {"factors": (CLEARANCE,), "design": Design(), "measures": ("peak_force",), "members": 2, "requirements": (bound,)}
    return two_factors(**(fields | changes))


def results(described: Study, peak: np.ndarray, warnings: str = "") -> xr.Dataset:
    """Results with given peaks [N], each for both members."""
    return made_up(described, np.repeat(peak, described.members), warnings=warnings)


@pytest.mark.parametrize(
    ("variation", "said"),
    [
        (Interval(1e-4, 5e-4), "interval: 0.1 to 0.5 mm"),
        (Interval(1e-4, 5e-4, logarithmic=True), "interval: 0.1 to 0.5 mm, logarithmic"),
        (Levels((1e-4, 2e-4)), "0.1, 0.2 mm"),
        (Levels(tuple(np.arange(1, 9) * 1e-4)), "0.1, 0.2, 0.3, 0.4, 0.5, 0.6, ... 0.8 mm"),
        (Uniform(1e-4, 5e-4), "uniform: 0.1 to 0.5 mm"),
        (Normal(3e-4, 5e-5), "normal: 0.3 ± 0.05 mm"),
        (Normal(3e-4, 5e-5, 2e-4, 4e-4), "normal: 0.3 ± 0.05 mm, truncated to 0.2 to 0.4 mm"),
        (LogNormal(3e-4, 0.1), "lognormal: median 0.3 mm, deviation 0.1 of the logarithm"),
    ],
)
@pytest.mark.parametrize("unit", [("mm", 1e-3), ("", 1.0)])
def test_ranges_have_units(variation: Variation, said: str, unit: tuple[str, float]) -> None:
    """Contract: in the unit of the user, or with an engineering prefix."""
    described = study(factors=(Factor("A.clearance", variation, *unit),))
    found = xr.Dataset({"A.clearance": ("case", np.zeros(1), {"units": "m"})})
    assert varied_numbers(described, found).rows == [("A.clearance", "chosen", said)]


def test_terminal_and_report_have_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Identity: the same numbers with the same prefixes, and warnings with the number of their cases and a command."""
    described = study()
    found = results(described, np.array([20e3, 30e3, 40e3, 50e3, 84.07e3]), "limit 5\nother")
    result = result_of(described, found)
    show_answers(result)
    shown = " ".join(capsys.readouterr().out.split())
    page = result.report(tmp_path / "r.html", figures=tmp_path / "figures").read_text(encoding="utf-8")
    for text in (
        "peak_force 20.00 40.00 84.07 kN 0.0%",
        "requirement peak_force < 60 kN; value 84.07 kN; margin -40.1%; numbers A.clearance = 0.5 mm scissordyn study replay",
        "cases 10; warning limit 5 scissordyn study replay",
    ):
        assert text in shown
    for text in (
        "<td>20.00</td><td>40.00</td><td>84.07</td><td>kN</td>",
        "<td>84.07 kN</td><td>-40.1%</td><td>A.clearance = 0.5 mm</td><td><code>scissordyn study replay a.db 8</code></td>",
        "<td>10</td><td>limit 5</td><td><code>scissordyn study replay a.db 0</code></td>",
        "<td>interval: 0.1 to 0.5 mm</td>",
        "width=device-width",
        '<div class="scroll"><img alt="Response curves" style="min-width:',
        "The points of the design &#39;grid&#39; are no sample. Failed cases are left out.",
    ):
        assert text in page
    (picture,) = (tmp_path / "figures").iterdir()
    assert picture.name == "response_curves.png"
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_fronts_and_effects_have_units() -> None:
    """Closed form: the best of five points; the effect of a linear function is its slope."""
    best = dataclasses.replace(study(), design=Design("adaptive", 5), optimisation=Optimisation((Goal("peak_force"),)))
    points = np.linspace(1e-4, 5e-4, 5)[:, None]
    found = results(dataclasses.replace(best, design=Design("grid")), np.array([50e3, 40e3, 30e3, 45e3, 84e3]))
    part = best_points(best, found.assign({"A.clearance": found["A.clearance"].copy(data=np.repeat(points, 2))}), 5)
    assert part.head == ("point", "A.clearance [mm]", "minimise peak_force [kN]")
    assert part.rows == [("2", "0.3000", "30.000")]
    steps = np.array([[0.0], [2.0 / 3.0]] * 8)
    effects = morris_indices(steps, 3e3 * steps[:, 0], ["A.clearance"])
    effects.attrs["units"] = "N"
    (table,) = sensitivities({"peak_force": effects})
    assert table.head[1:] == ("mean effect [kN]", "deviation [kN]")
    assert float(table.rows[0][1].split()[0]) == pytest.approx(3.0 / 0.99, rel=1e-2)


def test_agreement_is_counted() -> None:
    """Contract: one point of five is not called none."""
    described = study()
    found = results(described, np.full(5, 30e3))
    assert "at all points" in str(agreement(described, by_point(described, found)))
    found["peak_force"][3] = 30.1e3
    assert "at 1 of 5 points (20.0%)" in str(agreement(described, by_point(described, found)))
    assert "at none of them" in str(agreement(described, by_point(described, found)))


def test_no_median_of_a_few_points() -> None:
    """Contract: points of a single factor are joined; a dozen of two factors have two medians, not twelve."""
    described = study()
    (one,) = response_curves(by_point(described, results(described, np.linspace(20e3, 84e3, 5))))
    assert next(line.get_label() for line in one.lines if line.get_linestyle() == "-").startswith("_")
    points = by_point(described, results(described, np.linspace(20e3, 84e3, 5)))
    twelve = xr.concat([points, points, points.isel(point=[0, 1])], "point")
    twelve = twelve.assign(other=("point", np.random.default_rng(1).random(12), {"role": "factor", "units": "1"}))
    for axes in response_curves(twelve):
        (median,) = (line for line in axes.lines if line.get_label() == "median")
        assert median.get_xdata().size == 2
