"""Bending bars and oil in the paper's case: case files, comparisons and the page."""

from dataclasses import replace

import pytest
import xarray as xr

import scissordyn as sd
from scissordyn_paper import open_answers
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.open_answers import changes
from scissordyn_paper.open_change import Change
from scissordyn_paper.open_question import BARS, COMPARED, MEASURES, OPEN_CASES, STIFFER, OpenCase, compute
from scissordyn_paper.runs import compute as compute_paper


def test_every_case_has_its_own_file(tmp_path):
    """Contract: names differ, the package reads each text, and bars and oil are in the mechanism."""
    assert len({case.name for case in OPEN_CASES}) == len(OPEN_CASES)
    for case in (OpenCase("deployment", "steel tube", 0.1), OpenCase(bars=next(iter(STIFFER))), OpenCase(bars="solid steel")):
        path = tmp_path / "case.toml"
        path.write_text(case.toml, encoding="utf-8")
        mechanism = sd.read_case(path).mechanism
        assert any(body.name == "unit 1/bar 1/1" for body in mechanism.bodies)
        assert (mechanism.joint("A").clearance.lubrication is not None) == (case.oil is not None)
        weight = sum(body.mass for body in mechanism.bodies)
        assert weight == pytest.approx(4 * 5.68 + 5.0, rel=0.01)


def test_rigid_dry_case_is_the_paper_run():
    """Contract: without bending bars and oil the largest force is that of the paper's run."""
    found, known = compute(OpenCase(clearance=0.4e-3)), compute_paper(PaperCase(0.4e-3), trust=False)
    assert float(found["peak_force"]) == float(known["peak_force"].max())
    assert float(found["contacts"]) == known.sizes["contact"]
    assert float(found["trusted_until"]) == pytest.approx(0.05)


def test_stiffer_bars_approach_rigid_ones():
    """Limit: with bars a hundred times as stiff the drive's work is ten times closer to that of rigid bars."""
    rigid, tube, stiff = (compute(OpenCase(bars=bars, member=1)) for bars in ("rigid", "steel tube", "100 times the tube"))
    work = [float(run["drive_work"]) for run in (rigid, tube, stiff)]
    assert abs(work[2] - work[0]) < 0.1 * abs(work[1] - work[0])
    assert float(tube["peak_force"]) < 0.5 * float(rigid["peak_force"])


def measured(**values):
    return xr.Dataset({name: values.get(name, 1.0) for name in MEASURES})


def test_changes_compare_equal_cases():
    """Closed form: ratios of cases with the same clearance and member; the answer counts those below one."""
    found = {}
    for size, contacts in ((0.2e-3, 10.0), (0.4e-3, 20.0)):
        for member in range(2):
            case = OpenCase("deployment", clearance=size, member=member)
            found[case] = measured(contacts=contacts)
            found[replace(case, oil=0.1)] = measured(contacts=0.5 * contacts if size < 0.3e-3 else 2.0 * contacts)
            found[replace(case, bars="steel tube")] = measured(contacts=contacts + 1.0)
    by_name = {(one.what, one.measure): one for one in changes(found)}
    assert by_name["oil of 100 mPa s", "contacts"].ratios == (0.5, 0.5, 2.0, 2.0)
    assert by_name["oil of 100 mPa s", "contacts"].answer == "depends"
    assert by_name["steel tube", "contacts"].answer == "no"
    assert by_name["oil of 100 mPa s", "contacts"].words == "1.25 (0.5 to 2), lower in 2 of 4"
    assert {one.measure for one in by_name.values()} == set(COMPARED)


def test_changes_of_negative_work():
    """Closed form: work of -3 J instead of -6 J is not lower and has no ratio; 2 J instead of 4 J is lower."""
    change = Change("stroke", "steel tube", "drive_work", ((-3.0, -6.0), (2.0, 4.0)))
    assert (change.ratios, change.lower, change.words) == ((0.5,), 0.5, "0.5 (0.5 to 0.5), lower in 1 of 2")


def test_page_of_the_open_question(tmp_path, monkeypatch):
    """Contract: page, table and pictures of a few runs; a second call reads the runs from their files."""
    few = tuple(OpenCase(bars=bars, oil=oil) for bars in ("rigid", "steel tube") for oil in (None, 0.1))
    monkeypatch.setattr(open_answers, "OPEN_CASES", few)
    monkeypatch.setattr(open_answers, "LONGEST_FIRST", few)
    monkeypatch.setattr(open_answers.figure, "BARS", {bars: BARS[bars] for bars in ("rigid", "steel tube")})
    monkeypatch.setattr(open_answers.figure, "OILS", (0.1,))
    result = open_answers.answer_open_question(tmp_path, engine=1)
    page = result.report.read_text(encoding="utf-8")
    assert all(one.words in page for one in result.changes)
    assert len((tmp_path / "beyond.csv").read_text().splitlines()) == 1 + len(few)
    assert (tmp_path / "figures" / "beyond-orbits.png").stat().st_size > 10_000
    monkeypatch.setattr(open_answers, "compute", None)
    monkeypatch.setattr(open_answers.figure, "draw_ratios", lambda _: None)
    monkeypatch.setattr(open_answers.figure, "draw_orbits", lambda _: None)
    monkeypatch.setattr(open_answers, "save_picture", lambda _, folder, name: list(folder.glob(f"{name}.*")))
    again = open_answers.answer_open_question(tmp_path, engine=1)
    assert again.changes == result.changes
    assert isinstance(result.changes[0], Change)
