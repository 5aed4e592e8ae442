"""The page of claims: its commands exist, and its figures are those of the pages that they write."""

import re
from pathlib import Path

from validation import catalogue

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TITLES = {case.name: case.title for case in catalogue.CASES}
PAGE = (DOCS / "claims.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|\n").split(" | ")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and line.count(" | ") == 4 and not line.startswith("| claim")
][1:]


def test_claims_have_a_check_a_command_a_figure_and_a_date() -> None:
    """Contract: no cell of the table is empty."""
    assert len(ROWS) > 20
    for row in ROWS:
        assert len(row) == 5, row
        assert all(row), row


def test_commands_of_claims_exist() -> None:
    """Contract: tests, validation cases, benchmarks and programs that the page names are there."""
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


def test_figures_of_claims_are_those_of_the_validation() -> None:
    """Cross-check: each error in the row of a validation case is one of the table of its section, in one or two digits."""
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


def test_missed_goals_are_listed() -> None:
    """Cross-check: each measured page of the package's own goals that has a goal marked as missed is named on the page."""
    pages = {
        path.name
        for path in (DOCS / "decisions" / "measured").glob("*.md")
        if re.search(r"\bmissed\b", path.read_text(encoding="utf-8"))
    }
    for name in pages:
        assert f"decisions/measured/{name}" in PAGE.partition("Goals that are missed")[2], name
