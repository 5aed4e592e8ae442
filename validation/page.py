"""Tables of the validation page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime

from benchmarks.measure import table

from validation.case import Case, Check, Printed, best, scan

__all__ = ["checks_table", "codes_table", "published_table", "summary_row", "whole"]


def checks_table(checks: Sequence[Check]) -> str:
    """Every quantity against its reference."""
    rows = [
        [
            check.quantity,
            check.kind,
            f"{check.reference:.12g}",
            f"{check.found:.12g}",
            f"{check.error:.1e}",
            f"{check.allowed:.0e}{'' if check.met else ': missed'}",
        ]
        for check in checks
    ]
    return table(["quantity", "reference by", "reference", "scissordyn", "error", "allowed"], rows)


def published_table(results: Sequence[Printed]) -> str:
    """Every printed result with ours and the answer."""
    rows = [
        [one.quantity, f"{one.printed:.6g}", f"{one.found:.6g}", f"{one.difference:+.1%}", f"{one.answer} ({one.within:.0%})"]
        for one in results
    ]
    return table(["printed result", "printed", "scissordyn", "difference", "answer (agrees within)"], rows)


def codes_table(case: Case) -> str:
    """The fastest setting of each code that reaches the goal, and the scan that found it."""
    assert case.codes is not None
    rows, scans = [], []
    for code in case.codes():
        scanned = scan(code)
        setting, error, seconds = best(scanned, case.goal)
        if math.isinf(error):
            rows.append([code.name, code.meaning, "-", "fails", "-"])
        else:
            verdict = "" if error <= case.goal else " (goal missed)"
            rows.append([code.name, code.meaning, f"{setting:g}", f"{error:.1e}{verdict}", f"{1e3 * seconds:.3g}"])
        points = [
            f"{at:g}: {'fails' if math.isinf(miss) else f'{miss:.1e}, {1e3 * took:.3g} ms'}"
            for at, miss, took in scanned.points
        ]
        scans.append(f"* {code.name}, {code.meaning}: " + "; ".join(points) + ".")
    head = (
        f"Error: {case.error}; goal: {case.goal:g}.\n"
        "The fastest setting that reaches the goal, or else the most accurate one:\n\n"
    )
    made = table(["code", "setting", "value", "error", "time [ms]"], rows)
    return head + made + "\nThe scan, as setting: error, time.\n\n" + "\n".join(scans) + "\n"


def summary_row(case: Case, checks: Sequence[Check]) -> list[str]:
    """One row of the summary."""
    kinds = ", ".join(dict.fromkeys(check.kind for check in checks))
    met = sum(check.met for check in checks)
    worst = max(checks, key=lambda check: check.error / check.allowed if check.allowed else float(not check.met))
    return [case.title, kinds, f"{met} of {len(checks)}", f"{worst.error:.1e} ({worst.quantity})"]


def whole(rows: Sequence[Sequence[str]], sections: Sequence[str], machine: str) -> str:
    """The page."""
    date = datetime.now(UTC).date().isoformat()
    return (
        "# Validation\n\n"
        "Written by `python -m validation --write` (`make validate`). Each case is a folder of `validation/` with its case\n"
        "file, its parameters and their source, and its reference: a closed form or a second formulation that uses no\n"
        "equation of the package. The checks are also tests (`tests/validation/test_truth.py`); allowed errors are set by\n"
        "the accuracy of the reference. Times are the shortest of several runs on one machine, without compilation; if its\n"
        "load below exceeds the number of its cores, they are several times those of an idle machine and compare roughly\n"
        "only.\n\n"
        f"{date}; {machine}\n\n"
        + table(["case", "reference by", "checks met", "error nearest to what is allowed"], rows)
        + "\n"
        + OTHERS
        + "\n"
        + "\n".join(sections)
    )


OTHERS = """Other codes: scipy, numbalsoda 0.3 and Exudyn 1.13 install with pip and take part where they have a model of
the case. Chrono and Siconos do not (tried on 2026-11-22): neither has a distribution for pip; `pychrono` and
`projectchrono` on PyPI are other packages.

Published computations are compared where a source gives parameters and results as numbers: problems A01 to A03, the
mass on the belt, and the slider-crank with a clearance guide, whose record of 200 ms by Siconos differs from ours (below).

Experiments are not compared. Searched on 2026-11-22, in stored copies of web pages, documentation and public repositories,
for: slider-crank or four-bar linkage with a clearance joint, experiment, test rig, measured acceleration, contact force, data
set. Found were abstracts and first pages: Kolani et al. 2023 (doi:10.4236/ojapps.2023.1311158, slider-crank with two clearance
joints, seven of nine modes of motion seen), a multi-link press with three clearance joints
(doi:10.1177/16878140211012541), a slider-crank with one or two adjustable joints (J. Comput. Nonlinear Dyn. 15(8), 081001).
None of what could be read gives the masses, inertias, surfaces and laws that a simulation needs together with measured figures
as numbers; no repository with measured data was found. Missing are the full texts.
"""
