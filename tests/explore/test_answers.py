"""What the page says of a run beside its curves: cards, legend, lines of what is allowed, and the file of the curves."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.explore.answers import cards, differences
from scissordyn.explore.case import open_case
from scissordyn.explore.drag import assembled
from scissordyn.explore.figures import Chosen, curves_as_csv
from scissordyn.run.answer.summary import summary_of

from .browser import CASE

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


def held(limit: float, tolerance: float) -> xr.Dataset:
    """A slider-crank that a limited controller turns, with a tracked point that has a tolerance."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    servo = crank.controlled(sd.PID(proportional=200.0, derivative=2.0, limit=limit), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    return sd.simulate(
        dataclasses.replace(servo, tracks=(sd.Track("face", "slider", "centre", tolerance=tolerance),)), until=0.1, samples=201
    )


def test_cards_judge_by_what_is_allowed() -> None:
    """Identity: a limit that is reached and a tolerance that is left are missed, wider ones are met; values are the run's."""
    tight, wide = held(5.0, 1e-6), held(1e4, 1.0)
    for run, judged in ((tight, "missed"), (wide, "met")):
        found = {card["title"].split()[0]: card for card in cards(summary_of(run))}
        assert found["face"]["judged"] == found["torque"]["judged"] == judged
        assert found["largest"]["value"] == sd.units.short(float(run["peak_force"].max()), "N")


def test_allowed_values_are_drawn_where_curves_come_near() -> None:
    """Contract: the limit that is reached is a line, at the sides that are; one that is far off is none."""
    for run, near in ((held(5.0, 1e-6), True), (held(1e4, 1.0), False)):
        chosen = Chosen(run, summary_of(run), "", "slider")
        scales, (data,) = chosen.scaled([run])
        lines = chosen.levels(data, scales)
        limit = 5.0 * scales["torque"].factor
        assert set(lines["torque"]) == ({limit, -limit} if near else set())
        assert lines["track"] == ([1e-6 * scales["track"].factor] if near else [])


def test_file_of_curves_has_their_values() -> None:
    """Contract: each column of the file is a curve of the run at its samples, with its unit."""
    run = held(5.0, 1e-3)
    rows = list(csv.reader(curves_as_csv(run, summary_of(run), "slider pin", "slider").splitlines()))
    table = {head: np.array([float(row[k]) for row in rows[1:]]) for k, head in enumerate(rows[0])}
    at = np.searchsorted(table["time [s]"], run["time"].values)
    assert np.array_equal(table["time [s]"][at], run["time"].values)
    assert np.array_equal(table["torque of actuator of crank [N m]"][at], run["control_torque"].values[:, 0])
    assert np.array_equal(table["deviation of face [m]"][at], run["track_deviation"].values[:, 0])
    assert table["force at slider pin [N]"].max() == float(run["peak_force"].max())


def test_legend_names_the_numbers_that_differ(tmp_path: Path) -> None:
    """Contract: of two cases the changed numbers in both, and of equal ones that they are."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    case = open_case(path)
    other = case.changed({"clearance.0.clearance": "0.3 mm", "drive.speed": "100 rpm"})
    assert differences([case, other]) == [
        "drive speed 150 rpm, clearance A clearance 0.5 mm",
        "drive speed 100 rpm, clearance A clearance 0.3 mm",
    ]
    assert differences([case, case]) == ["the same numbers"] * 2


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_starred_angles_move_the_mechanism(path: Path) -> None:
    """Contract: an angle with a slider of its own changes where the mechanism starts; one that a drive overrides has none."""
    case = open_case(path)
    for field in case.fields:
        if field.starred and field.name == "angle":
            other = case.changed({field.key: f"{field.value[0] + 0.05!r} rad"})
            before, after = (assembled(each.mechanism)[0]["position"].values[0] for each in (case, other))
            assert np.abs(after - before).max() > 1e-3
