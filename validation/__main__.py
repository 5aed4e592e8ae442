"""Run the cases: ``python -m validation [--quick] [--write] [NAME ...]``.

``python -m validation engines`` compares other engines.
"""

from __future__ import annotations

import argparse
import sys

from benchmarks.measure import machine

from validation.case import HERE, Case
from validation.catalogue import CASES
from validation.page import checks_table, codes_table, models_table, parts, published_table, stamp, summary_row, whole

PAGE = HERE.parent / "docs" / "validation.md"


def main() -> int:
    """Print the results, and write them if wanted; return 1 if a check fails."""
    if sys.argv[1:2] == ["engines"]:
        from validation.engines.compare import main as compare

        return compare(sys.argv[2:])
    parser = argparse.ArgumentParser(description="Run the validation cases.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases; all if left out")
    parser.add_argument("--quick", action="store_true", help="the checks only, without the comparison of codes")
    parser.add_argument("--write", action="store_true", help="write docs/validation.md; with NAMEs, their sections of it")
    given = parser.parse_args()
    known = {case.name: case for case in CASES}
    unknown = [name for name in given.names if name not in known]
    if unknown or (given.write and given.quick):
        parser.error(f"unknown: {', '.join(unknown)}; expected {', '.join(known)}" if unknown else "--write takes no --quick")
    rows, sections = parts(PAGE.read_text(encoding="utf-8"))
    missed = 0
    for case in [known[name] for name in given.names] or CASES:
        section, row, failed = _one(case, given.quick, given.write)
        print(section, flush=True)
        rows[case.title], sections[_heading(case)] = row, section
        missed += failed
        if given.write:
            there = [case for case in CASES if case.title in rows and _heading(case) in sections]
            text = whole([rows[case.title] for case in there], [sections[_heading(case)] for case in there])
            PAGE.write_text(text, encoding="utf-8")
    print(f"{len(given.names or CASES)} cases, {missed} checks not met")
    return 1 if missed else 0


def _text(case: Case) -> str:
    return (HERE / case.name / "README.md").read_text(encoding="utf-8").strip()


def _heading(case: Case) -> str:
    return _text(case).partition("\n")[0].lstrip("# ")


def _one(case: Case, quick: bool, write: bool) -> tuple[str, list[str], int]:
    checks = case.checks()
    body = _text(case).partition("\n")[2]
    section = f"## {_heading(case)}\n{body}\n\n{checks_table(checks)}"
    if case.published is not None:
        section += f"\n{published_table(case.published())}"
    missed = sum(not check.met for check in checks)
    if case.models is not None and not quick:
        models, wrong = models_table(case.models())
        section += f"\n{models}"
        missed += wrong
    if case.codes is not None and not quick:
        section += "\n" + codes_table(case, PAGE.with_name(f"validation-{case.name}.png") if write else None)
    for note in case.notes:
        section += f"\n{note}\n"
    section += f"\n{stamp(machine())}"
    return section, summary_row(case, checks), missed


if __name__ == "__main__":
    sys.exit(main())
