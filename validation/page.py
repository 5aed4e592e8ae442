"""Tables of the validation page."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.measure import table

from validation.case import Case, Check, Model, Printed, Scan, best, installed, scan
from validation.curves import draw

__all__ = ["checks_table", "codes_table", "models_table", "parts", "published_table", "stamp", "summary_row", "whole"]


def checks_table(checks: Sequence[Check]) -> str:
    """Return the table of every quantity and its reference; the kind of reference is a column if there are several."""
    mixed = len({check.kind for check in checks}) > 1
    rows = [
        [
            check.quantity,
            *([check.kind] if mixed else []),
            f"{check.reference:.12g}",
            f"{check.found:.12g}",
            f"{check.error:.1e}",
            f"{_bound(check.allowed)}{'' if check.met else ': missed'}",
        ]
        for check in checks
    ]
    return table(["quantity", *(["reference by"] if mixed else []), "reference", "scissordyn", "error", "allowed"], rows)


def _bound(allowed: float) -> str:
    """Return an allowed error with its significant digits: 1e-09, 1.5e-02."""
    text = f"{allowed:.0e}"
    return text if math.isclose(float(text), allowed, rel_tol=1e-9) or not allowed else f"{allowed:.1e}"


def published_table(results: Sequence[Printed]) -> str:
    """Return the table of published results with ours and the answer."""
    rows = [
        [one.quantity, f"{one.printed:.6g}", f"{one.found:.6g}", f"{one.difference:+.1%}", f"{one.answer} ({one.within:.0%})"]
        for one in results
    ]
    return table(["printed result", "printed", "scissordyn", "difference", "answer (agrees within)"], rows)


def models_table(models: Sequence[Model]) -> tuple[str, int]:
    """Return the table of models of other codes against exact solutions, and how many exceed the allowed error."""
    rows, missed = [], 0
    for model in models:
        verdict = ""
        if not installed(model.package):
            found = "not installed"
        else:
            try:
                error = model.measure()
                found = f"{error:.1e}"
            except Exception as failure:  # another code's failure is a result
                print(f"  {model.name}: {type(failure).__name__}: {str(failure)[:100]}")
                error, found = math.inf, "fails"
            if not error <= model.allowed:
                verdict = ": missed"
                missed += 1
        rows.append([model.name, model.solution, found, f"{_bound(model.allowed)}{verdict}"])
    return table(["model", "exact solution; settings", "error", "allowed"], rows), missed


def codes_table(case: Case, picture: Path | None = None) -> str:
    """Return the fastest setting of each code that reaches the goal, the scan, and a picture of it if `picture` is given."""
    assert case.codes is not None
    scans = [scan(code) for code in case.codes()]
    fastest = min((took for one in scans for _, miss, took in one.points if miss <= case.goal), default=math.nan)
    head = f"Error: {case.error}; goal: {case.goal:g}:\n\n"
    made = table(
        ["code", "setting", "value", "error", "time [ms]", "ratio"], [_code_row(one, case.goal, fastest) for one in scans]
    )
    shown = ""
    if picture is not None:
        curves = [(one.code.name, [(miss, took) for _, miss, took in one.points]) for one in scans]
        draw(curves, case.goal, case.error, picture)
        shown = f"\n![Error over time of all codes and settings]({picture.name})\n"
    listed = "\n".join(_listed(one) for one in scans)
    return f"{head}{made}{shown}\n{listed}\n"


def _code_row(scanned: Scan, goal: float, fastest: float) -> list[str]:
    """Return one code's row of the table."""
    code = scanned.code
    if not scanned.points:
        return [code.name, code.meaning, "-", "not installed", "-", "-"]
    setting, error, seconds = best(scanned, goal)
    if math.isinf(error):
        return [code.name, code.meaning, "-", "fails", "-", "-"]
    met = error <= goal
    verdict, ratio = ("", f"{seconds / fastest:.1f}") if met else (" (goal missed)", "-")
    return [code.name, code.meaning, f"{setting:g}", f"{error:.1e}{verdict}", f"{1e3 * seconds:.3g}", ratio]


def _listed(scanned: Scan) -> str:
    """Return one code's settings as a list item."""
    if not scanned.points:
        return f"* {scanned.code.name}: not installed."
    points = (
        f"{at:g}: {'fails' if math.isinf(miss) else f'{miss:.1e}, {1e3 * took:.3g} ms'}" for at, miss, took in scanned.points
    )
    return f"* {scanned.code.name}, {scanned.code.meaning}: " + "; ".join(points) + "."


def summary_row(case: Case, checks: Sequence[Check]) -> list[str]:
    """Return one row of the summary."""
    kinds = ", ".join(dict.fromkeys(check.kind for check in checks))
    met = sum(check.met for check in checks)
    worst = max(checks, key=lambda check: check.error / check.allowed if check.allowed else float(not check.met))
    return [
        case.title,
        kinds,
        f"{met} of {len(checks)}",
        f"{worst.error:.1e} ({worst.quantity})",
        datetime.now(UTC).date().isoformat(),
    ]


def stamp(machine: str) -> str:
    """Return date and machine of a case, the last line of its section."""
    return f"*Run:* {datetime.now(UTC).date().isoformat()}; {machine}\n"


def whole(rows: Sequence[Sequence[str]], sections: Sequence[str]) -> str:
    """Return the page."""
    return (
        "# Validation\n\n"
        "Written by `python -m validation --write` (`make validate`), or case by case by `python -m validation --write NAME`.\n"
        "Each case is a folder of `validation/` with its case file, its parameters and their source, and its reference: a\n"
        "closed form, a second formulation that uses no equation of the package, or a published result. The checks are also\n"
        "tests (`tests/validation/test_truth.py`); allowed errors are set by the accuracy of the reference. Times are the\n"
        "shortest of several runs on one machine, without compilation; if its load exceeds the number of its cores, they are\n"
        "several times those of an idle machine and compare roughly only.\n\n"
        + table(HEADINGS, rows)
        + "\n"
        + OTHERS
        + "\n"
        + "\n".join(sections)
    )


def parts(text: str) -> tuple[dict[str, list[str]], dict[str, str]]:
    """Return the rows of a written page's summary by title, and its sections by heading."""
    summary, *sections = re.split(r"^## ", text, flags=re.MULTILINE)
    rows = {}
    for line in summary.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == len(HEADINGS) and cells[0] != HEADINGS[0] and not set(cells[0]) <= {"-", ":"}:
            rows[cells[0]] = cells
    return rows, {one.partition("\n")[0]: f"## {one.rstrip()}\n" for one in sections}


HEADINGS = ("case", "reference by", "checks met", "error nearest to what is allowed", "run")

OTHERS = """Other codes: scipy, numbalsoda 0.3 (built by a Fortran compiler) and Exudyn 1.13 (its variant without range checks)
install with pip and take part where they have a model of the case; one that was not installed when a case was run is
called so. Chrono does not install with pip: `pychrono` and `projectchrono` on PyPI are other packages. Siconos 4.4.0
installs from Debian 12 by `apt-get install --no-install-recommends python3-siconos` (tried on 2026-11-30). Its records below
are of another release: commit b6c9bfd of its tutorials has the records of the development after 4.4.0, last changed on
2024-05-31. Those of its tag 4.4.0 differ: the crank ends at 3.054338 rad instead of 3.054328 rad. Each model of another code is
first compared
with an exact solution, alone, at tight settings, in a motion in which errors do not grow. A table of codes has the fastest
setting of each that reaches the goal, or else the most accurate one, with its ratio to the fastest of all; the list below it
has the whole scan, as setting: error, time.

Published computations are compared where a source gives parameters and results as numbers: problems A01 to A03, the
mass on the belt, the slider-crank with a clearance guide, the controlled four-bar linkage with three clearance joints, and the
woodpecker; the last three from the examples of Siconos. Also searched on 2026-11-22, in stored copies of public repositories:
Chrono (a joint
class with clearance; no results of it as numbers), Siconos's slider-crank of CAD bodies (contact of their surfaces in space),
cardillo (the same clearance guide, results as pictures only), Modelica, Assimulo and scipy_dae (the squeezing mechanism with
the same parameters), OpenSim's models of A01 to A05 (<https://github.com/RehabEngGroup/MBSbenchmarksInOpenSim>; results as
pictures, and times of 0.637 s for A01, 0.455 s for A02 with N = 2 and 0.384 s for A03 on an Intel Core i5-4570), and the
program of the benchmark library itself (no reference files in its repository).

Experiments are not compared. Searched on 2026-11-22, in stored copies of web pages, documentation and public repositories,
for: slider-crank or four-bar linkage with a clearance joint, experiment, test rig, measured acceleration, contact force, data
set. Found were abstracts and first pages: Kolani et al. 2023 (doi:10.4236/ojapps.2023.1311158, slider-crank with two clearance
joints, seven of nine modes of motion seen), a multi-link press with three clearance joints
(doi:10.1177/16878140211012541), a slider-crank with one or two adjustable joints (J. Comput. Nonlinear Dyn. 15(8), 081001), a
crank-rocker with clearance between coupler and rocker and worn surfaces, and a reciprocating mechanism with clearances under a
high-speed camera. None of what could be read gives the masses, inertias, surfaces and laws that a simulation needs together
with measured figures as numbers; no repository with measured data was found. Missing are the full texts.
"""
