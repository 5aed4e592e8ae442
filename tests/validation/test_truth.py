"""The validation cases: every check of every case, and what their pages have to say."""

import re
from pathlib import Path

import pytest
from validation.case import HERE, Case, case_file
from validation.catalogue import CASES
from validation.page import checks_table, parts, summary_row, whole

from scissordyn.config.file import read_case

PAGE = HERE.parent / "docs" / "validation.md"


def name(case: Case) -> str:
    """For the names of tests."""
    return case.name


@pytest.mark.parametrize("case", [pytest.param(case, marks=() if case.quick else pytest.mark.slow) for case in CASES], ids=name)
def test_checks(case: Case) -> None:
    """Closed forms, second formulations, published numbers, as each check says; allowed errors are those of the references."""
    checks = case.checks()
    assert checks
    assert not [f"{check.quantity}: {check.error:.1e} > {check.allowed:.0e}" for check in checks if not check.met]


@pytest.mark.parametrize("case", CASES, ids=name)
def test_page_of_a_case(case: Case) -> None:
    """Contract: each case has a case file that can be read, and a page with what it is, source and reference."""
    folder = HERE / case.name
    assert read_case(case_file(case.name)).mechanism.bodies
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert "*Source:*" in text
    assert re.search(r"\*References?:\*", text)


def test_every_folder_is_in_the_catalogue() -> None:
    """Contract: no case is left out of the page."""
    assert {case.name for case in CASES} == {path.parent.name for path in Path(HERE).glob("*/case.py")}


def test_written_page_has_every_case() -> None:
    """Contract: docs/validation.md was written by the present catalogue, and nothing in it was missed."""
    text = PAGE.read_text(encoding="utf-8")
    for case in CASES:
        assert f"| {case.title} " in text
    assert "missed |" not in text.replace("goal missed", "")


def test_a_missed_check_shows() -> None:
    """Contract: a wrong value is not met, and the page says so."""
    from validation.case import Check

    wrong = Check("x [m]", 1.0, 1.1, 1e-3, "closed form")
    counted = Check("number", 3.0, 3.0, 0.0, "closed form")
    assert not wrong.met
    assert summary_row(CASES[0], [counted])[2] == "1 of 1"
    assert "missed" in checks_table([wrong])
    assert summary_row(CASES[0], [wrong])[2] == "0 of 1"
    assert "Validation" in whole([], [])


def test_a_written_page_is_taken_apart_again() -> None:
    """Contract: rows and sections of the page are found by their titles, so that one case can be written anew."""
    text = PAGE.read_text(encoding="utf-8")
    rows, sections = parts(text)
    assert list(rows) == [case.title for case in CASES]
    assert len(sections) == len(CASES)
    assert all("*Run:* 20" in section for section in sections.values())
    assert whole(list(rows.values()), list(sections.values())) == text


@pytest.mark.slow
def test_the_record_of_siconos_differs() -> None:
    """Published number with its source: what validation/guide/README.md says of the record, in its figures."""
    from validation.guide.case import published

    answers = [(one.answer, round(one.difference, 2)) for one in published()[1:]]
    assert answers == [("agrees", -0.02), ("agrees", -0.01), ("differs", -0.04), ("differs", -0.03), ("differs", -0.06)]


def test_codes_are_drawn_with_their_scans(tmp_path: Path) -> None:
    """Contract: a scan becomes table, list and picture; a setting at which a code fails is in the list only."""
    from validation.case import Code
    from validation.page import codes_table

    def failing(setting: float) -> tuple[float, float]:
        if setting > 1e-3:
            raise RuntimeError("diverges")
        return setting, 1e-3

    codes = [Code("good", lambda setting: (setting, 1e-3 / setting), (1e-2, 1e-4)), Code("failing", failing, (1e-2, 1e-4))]
    made = Case("made", "Made up", list, error="error [m]", goal=1e-3, codes=lambda: codes)
    text = codes_table(made, tmp_path / "curves.png")
    assert "![Error over time of all codes and settings](curves.png)" in text
    assert "* failing, tolerance: 0.01: fails; 0.0001: 1.0e-04, 1 ms." in text
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
