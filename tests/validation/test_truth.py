"""Validation cases: every check of every case, their pages, records of other programs, and tests of two samples."""

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from validation.case import HERE, case_file
from validation.catalogue import CASES
from validation.page import checks_table, parts, summary_row, whole
from validation.records.case import by_its_scheme, woodpecker_apart
from validation.records.numbers import SLIDER_CRANK, WOODPECKER
from validation.two_samples.__main__ import CONTACTS, NUMBERS, compared, values_of
from validation.two_samples.tests import energy_distance, energy_test

import scissordyn as sd

PAGE = HERE.parent / "docs" / "validation.md"  # Page with the validation results


def name(case):
    """Return the name of a case as a test id."""
    return case.name


@pytest.mark.parametrize("case", [pytest.param(case, marks=() if case.quick else pytest.mark.slow) for case in CASES], ids=name)
def test_checks(case):
    """Cross-check: closed forms, second formulations and published numbers, within the errors of the references."""
    checks = case.checks()
    assert checks
    assert not [f"{check.quantity}: {check.error:.1e} > {check.allowed:.0e}" for check in checks if not check.met]


@pytest.mark.parametrize("case", CASES, ids=name)
def test_page_of_a_case(case):
    """Contract: each case has a case file that can be read, and a page with source and reference."""
    folder = HERE / case.name
    assert sd.read_case(case_file(case.name)).mechanism.bodies
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert "*Source:*" in text
    assert re.search(r"\*References?:\*", text)


def test_every_folder_is_in_the_catalogue():
    """Contract: the catalogue has every case."""
    assert {case.name for case in CASES} == {path.parent.name for path in Path(HERE).glob("*/case.py")}


def test_written_page_has_every_case():
    """Contract: docs/validation.md has every case of the catalogue, and no missed check."""
    text = PAGE.read_text(encoding="utf-8")
    for case in CASES:
        assert f"| {case.title} " in text
    assert "missed |" not in text.replace("goal missed", "")


def test_missed_check():
    """Contract: a wrong value is not met, and the page says so."""
    from validation.case import Check

    wrong = Check("x [m]", 1.0, 1.1, 1e-3, "closed form")
    counted = Check("number", 3.0, 3.0, 0.0, "closed form")
    assert not wrong.met
    assert summary_row(CASES[0], [counted])[2] == "1 of 1"
    assert "missed" in checks_table([wrong])
    assert summary_row(CASES[0], [wrong])[2] == "0 of 1"
    assert "Validation" in whole([], [])


def test_parts_of_the_page():
    """Contract: rows and sections of the page are found by their titles, so that one case can be replaced."""
    text = PAGE.read_text(encoding="utf-8")
    rows, sections = parts(text)
    assert list(rows) == [case.title for case in CASES]
    assert len(sections) == len(CASES)
    assert all("*Run:* 20" in section for section in sections.values())
    assert whole(list(rows.values()), list(sections.values())) == text


@pytest.mark.slow
def test_differences_of_a_record():
    """Published number: the differences of the record are those in validation/guide/README.md."""
    from validation.guide.case import published

    answers = [(one.answer, round(one.difference, 2)) for one in published()[1:]]
    assert answers == [("agrees", -0.02), ("agrees", -0.01), ("differs", -0.04), ("differs", -0.03), ("differs", -0.06)]


def test_record_of_the_slider_crank():
    """Published number: Siconos, slider-crank with direct projection, 30 ms with three clusters of impacts."""
    kept = by_its_scheme("slider-crank", 300)
    for at, turned, speed in SLIDER_CRANK[:2]:
        assert kept[at, 0] / (2.0 * math.pi) == pytest.approx(turned, rel=1e-13)
        assert kept[at, 3] == pytest.approx(speed, rel=1e-12)


def test_record_of_the_woodpecker():
    """Published number: Siconos, woodpecker, 10 ms of sliding along the pole."""
    kept = by_its_scheme("woodpecker", 500)
    at, *places = WOODPECKER[0]
    assert kept[at, :3] == pytest.approx(places, rel=1e-13)


def test_woodpecker_with_small_angles():
    """Second formulation: the record's scheme, over 30 ms of pecking, with a jamming and slipping sleeve."""
    height, sleeve, bird = woodpecker_apart(1500)
    assert height < 1e-6
    assert sleeve < 1e-4
    assert bird < 2e-5


def test_energy_distance_of_one_number():
    """Cross-check: half of its root is SciPy's distance of two distribution functions."""
    random = np.random.default_rng(2)
    one, other = random.normal(size=40), random.normal(0.5, 2.0, size=55)
    assert energy_distance(one[:, None], other[:, None]) == pytest.approx(stats.energy_distance(one, other) ** 2, rel=1e-12)


def test_p_of_equal_and_shifted_distributions():
    """Closed form: p of equal distributions is below .25 in a quarter of the cases; a shift by a deviation is found."""
    random = np.random.default_rng(3)
    below = 0
    for k in range(120):
        below += energy_test(random.normal(size=(20, 2)), random.normal(size=(25, 2)), permutations=39, seed=k)[1] <= 0.25
    assert 0.25 * 120 - 15 < below < 0.25 * 120 + 15
    shifted = random.normal(size=(60, 2)) + np.array([0.0, 1.0])
    assert energy_test(random.normal(size=(60, 2)), shifted)[1] == pytest.approx(0.001)


def test_stopped_runs_are_left_out_in_pairs():
    """Contract: a stopped compliant run is left out with its pair, a hard one alone."""
    random = np.random.default_rng(4)
    names = [*NUMBERS, CONTACTS]
    hard = pd.DataFrame(random.normal(20.0, 2.0, size=(40, 3)), columns=names)
    compliant = hard.iloc[:16] + 0.1 + 0.01 * random.normal(size=(16, 3))
    compliant.iloc[2] = np.nan
    hard.iloc[30] = np.nan
    rows, (_, p), sizes = compared(compliant, hard)
    assert sizes == (15, 23)
    assert [row[0] for row in rows] == names
    assert all(float(row[5]) == pytest.approx(-0.1, abs=0.02) for row in rows)
    assert all(float(row[7]) < 1e-3 for row in rows)
    assert p > 0.01


def test_numbers_of_a_table():
    """Identity: values in mm and N m, and the largest count of any joint; those of a stopped run are NaN."""
    table = pd.DataFrame({"status": ["complete", "failed"], **{column: [2e-3, 1.0] for column, _ in NUMBERS.values()}})
    table["O.contact_count [1]"], table["A.contact_count [1]"] = [3.0, 9.0], [5.0, 9.0]
    found = values_of(table)
    assert found.iloc[0].tolist() == [2.0, 2e-3, 5.0]
    assert found.iloc[1].isna().all()
