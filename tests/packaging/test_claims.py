"""Numbers of the pages: claims with their commands and figures, and numbers of the theory."""

import math
import re
from pathlib import Path

import pytest

from validation import catalogue

ROOT = Path(__file__).parents[2]  # Root folder of the repository
DOCS = ROOT / "docs"  # Folder of the documentation
TITLES = {case.name: case.title for case in catalogue.CASES}  # Titles of the validation cases by name
PAGE = (DOCS / "claims.md").read_text(encoding="utf-8")  # Text of the page with claims
# Cells of the rows of the table of claims
ROWS = [
    [cell.strip() for cell in line.strip("|\n").split(" | ")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and line.count(" | ") == 4 and not line.startswith("| claim")
][1:]


def test_claims_have_a_check_a_command_a_figure_and_a_date():
    """Contract: no cell of the table is empty."""
    assert len(ROWS) > 20
    for row in ROWS:
        assert len(row) == 5, row
        assert all(row), row


def test_commands_of_claims_exist():
    """Contract: tests, validation cases, benchmarks and programs named on the page exist."""
    for *_, command, _figure, _date in ROWS:
        for words in (text.split() for text in re.findall(r"`([^`]+)`", command)):
            match words:
                case ["pytest", *rest]:
                    paths = [word for word in rest if word.startswith("tests")]
                    assert paths
                    assert all((ROOT / path).exists() for path in paths), words
                case ["-m", "slow"]:
                    continue
                case ["tests/packaging/test_docs.py"]:
                    continue
                case ["python", "-m", "validation", *names]:
                    assert names
                    assert set(names) <= set(TITLES), words
                case ["python", "-m", "validation.measured" | "validation.records" as module, "COPY"]:
                    assert (ROOT / Path(*module.split(".")) / "__main__.py").exists()
                case ["python", "-m", module]:
                    assert module.startswith("benchmarks.")
                    assert (ROOT / Path(*module.split(".")).with_suffix(".py")).exists(), words
                case ["python", path]:
                    assert (ROOT / path).exists(), words
                case _:
                    assert words[:2] == ["scissordyn", "paper"], words


def test_figures_of_claims_are_those_of_the_validation():
    """Cross-check: each error in a claim of a validation case is in the table of its section, in one or two digits."""
    sections = {
        part.split("\n", 1)[0]: part for part in (DOCS / "validation.md").read_text(encoding="utf-8").split("\n## ")[1:]
    }
    checked = 0
    for *_, command, figure, _date in ROWS:
        found = re.search(r"python -m validation ([\w ]+)`", command)
        figures = re.findall(r"\d(?:\.\d)?e-\d+", figure)
        if found is None or not figures:
            continue
        tables = [line.split("|") for name in found[1].split() for line in sections[TITLES[name]].splitlines()]
        # quantity, perhaps what its reference is by, two numbers, error, allowed
        column = [row[-3].strip() for row in tables if len(row) in (7, 8)]
        errors = {f"{float(cell):.{digits}e}" for cell in column if "e-" in cell for digits in (0, 1)}
        for one in figures:
            digits = 1 if "." in one else 0
            assert f"{float(one):.{digits}e}" in errors, (command, one)
            checked += 1
    assert checked >= 6


def test_missed_goals_are_listed():
    """Cross-check: each measured page with a missed goal is named on the page of claims."""
    pages = {
        path.name
        for path in (DOCS / "decisions" / "measured").glob("*.md")
        if re.search(r"\bmissed\b", path.read_text(encoding="utf-8"))
    }
    for name in pages:
        assert f"decisions/measured/{name}" in PAGE.partition("Goals that are missed")[2], name


THEORY = DOCS / "theory"  # Folder of the theory pages

OMEGA = 150.0 * 2.0 * math.pi / 60.0  # [rad/s] speed of the paper's array, 150 rpm
POTENTIAL = (2 * 5.68 + 5.0) * 9.81 * 2.0 * math.cos(math.pi / 6.0)  # [N m] torque of the weight at 30 deg
INERTIAL = (OMEGA * 2.0) ** 2 * (2.0 * 5.68 - 2.5) * math.sin(math.pi / 3.0)  # [N m] torque of inertia at 30 deg and 150 rpm
SIGMA = (1.0 - 0.3**2) / 207e9  # [1/Pa] (1 - nu^2)/E of steel
MODULUS = 1.0 / (2.0 * SIGMA)  # [Pa] contact modulus E* of steel on steel

# Theory page, sentence with a blank, computed value, and the number that the page prints
NUMBERS = [
    ("reduction", "$\\omega$ = {} rad/s", OMEGA, "15.70796"),
    ("reduction", "$\\omega^2L^2$ = {} m²/s²", (OMEGA * 2.0) ** 2, "986.960"),
    ("reduction", "$mC_2 - m_s/2$ = {} kg", 5.68 * 2.0 - 2.5, "8.86"),
    ("reduction", "the first term is {}", INERTIAL, "7572.93"),
    ("reduction", "the second {}", POTENTIAL, "277.98"),
    ("reduction", "together {} N m", INERTIAL + POTENTIAL, "7850.91"),
    ("reduction", "$\\lambda = \\mathbf x\\cdot\\mathbf f/|\\mathbf x|^2$ = {}", 9.81 * 1.0 / 1.0**2, "9.81"),
    ("contact", "$\\sqrt{{2c/g}}$ = {} ms", 1e3 * math.sqrt(2.0 * 0.5e-3 / 9.81), "10.096"),
    ("contact", "$\\dot\\delta^{{(-)}} = \\sqrt{{2gc}}$ = {} mm/s", 1e3 * math.sqrt(2.0 * 9.81 * 0.5e-3), "99.05"),
    ("contact", "$v_t = \\omega_J R_J$ = {} mm/s", 1e3 * OMEGA * 10e-3, "157.1"),
    ("contact", "the level is 9.1 mm, $\\delta$ = {} mm", 9.0 - (20.2 / 2.0 - 1.0), "-0.1"),
    ("contact", "$E^*$ = {} GPa", 1e-9 * MODULUS, "113.7363"),
    ("contact", "$K$ = {}e10", 1e-10 * 4.0 / 3.0 * MODULUS * math.sqrt(10e-3 * 9.5e-3 / 0.5e-3), "6.61020"),
    ("contact", "with plus it would be {} times less", math.sqrt(19.5 / 0.5), "6.2"),
    (
        "contact",
        "= {}\\cdot10^{{5}}\\ \\text{{N/m}}",
        1e-5 * 0.5 * math.pi * MODULUS * 1e-5 * math.sqrt(1e-5 / (2.0 * 0.51e-3)),
        "1.7690",
    ),
    ("contact", "$v_d = \\sqrt{{2\\mathrm e}}\\cdot0.05/316$ = {} mm/s", 1e3 * math.sqrt(2.0 * math.e) * 0.05 / 316.0, "0.369"),
    ("contact", "the time constant is $0.05/10^5$ s = {} µs", 1e6 * 0.05 / (1e5 * 1.0), "0.5"),
    ("integration", "$0.9\\cdot0.1^{{-1/8}}$ = {} times", 0.9 * 0.1 ** (-1.0 / 8.0), "1.200"),
    ("integration", "it is {} times as long", 0.9 * 10.0 ** (-1.0 / 8.0), "0.675"),
    ("integration", "$\\tfrac12\\cdot0.25\\cdot(1 - 0.47044^2)$ = {} J", 0.5 * 0.5**2 * (1.0 - 0.47044**2), "0.09734"),
    ("../control", "give $S$ = {} rad/s", 1.0 / (1.0 - 0.5), "2"),
]


@pytest.mark.parametrize(("page", "text", "value", "printed"), NUMBERS, ids=lambda one: one if isinstance(one, str) else "")
def test_numbers_to_check_by_hand(page, text, value, printed):
    """Closed form: the printed number is that of the formula, to all digits shown."""
    digits = len(printed.partition(".")[2])
    assert f"{value:.{digits}f}" == printed
    assert text.format(printed) in (THEORY / f"{page}.md").read_text(encoding="utf-8")


def restitution(xi):
    """Return the restitution of (D1) for a damping factor, by bisection."""
    low, high = 0.0, min(1.0, 1.0 / xi)
    for _ in range(200):
        e = 0.5 * (low + high)
        excess = math.log1p(xi) - math.log1p(-xi * e) - xi * (1.0 + e) if xi * e < 1.0 else 1.0
        low, high = (e, high) if excess < 0.0 else (low, e)
    return low


@pytest.mark.parametrize(
    ("factor", "printed"), [(1.5 * 0.5, "0.66296"), (0.75 * (1.0 - 0.25), "0.72524"), (8.0 * 0.5 / (5.0 * 0.5), "0.47044")]
)
def test_returned_restitution(factor, printed):
    """Closed form: the restitution of (D1) at a nominal coefficient of 0.5."""
    assert f"{restitution(factor):.5f}" == printed
    assert printed in (THEORY / "contact.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("wanted", "printed"), [(0.9, "0.16648"), (0.5, "1.43275"), (0.1, "9.99816")])
def test_exact_damping_factor(wanted, printed):
    """Closed form: the printed factor gives the wanted restitution."""
    assert restitution(float(printed)) == pytest.approx(wanted, abs=2e-5)
    assert printed in (THEORY / "contact.md").read_text(encoding="utf-8")
