"""Compare compliant and hard contact over the range of the panel's study.

``python -m validation.two_samples STORE [--write]`` takes a quarter of an hour of processor time. STORE is the folder of the
runs; an interrupted comparison continues.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from benchmarks.measure import DECISIONS, machine, table
from scipy.stats import ks_2samp, wilcoxon

from scissordyn.config.study import read_study, study_of
from scissordyn.studies.result import StudyResult, computed
from validation.case import HERE
from validation.two_samples.tests import energy_test

STUDY = HERE.parent / "examples" / "studies" / "solar_array_screened.toml"
PAIRS, POINTS = 128, 256  # Points with compliant runs, and all points; points with hard contact only are the other sample

NUMBERS = {
    "deviation of the tip [mm]": ("tip.peak_track_deviation [m]", 1e3),
    "torque of the servo [N m]": ("servo.peak_component_force [N m]", 1.0),
}
"""Columns of a study's table with their factors."""

CONTACTS = "contacts of the joint with the most"  # Name of a compared value: number of contacts of the joint with most contacts


def values_of(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the compared values of each case; NaN for cases that failed."""
    found = {name: factor * runs[column] for name, (column, factor) in NUMBERS.items()}
    counts = [name for name in runs.columns if name.partition(" [")[0].endswith("contact_count")]
    found[CONTACTS] = runs[counts].max(axis=1)
    every = pd.DataFrame(found)
    every[(runs["status"] != "complete").to_numpy()] = np.nan
    return every


def compared(compliant: pd.DataFrame, hard: pd.DataFrame) -> tuple[list[tuple[str, ...]], tuple[float, float], tuple[int, int]]:
    """Return rows of all values, energy distance and p, and the sizes of both samples.

    Parameters
    ----------
    compliant : DataFrame
        Values of the first points.
    hard : DataFrame
        Values of all points.
    """
    paired, other = hard.iloc[: len(compliant)], hard.iloc[len(compliant) :].dropna()
    both = (compliant.notna().all(axis=1) & paired.notna().all(axis=1)).to_numpy()
    compliant, paired = compliant[both], paired[both]
    rows = []
    for name in compliant:
        one, same, rest = (each[name].to_numpy() for each in (compliant, paired, other))
        apart = ks_2samp(one, rest)
        change = same - one
        cells = (
            one.mean(),
            rest.mean(),
            apart.statistic,
            apart.pvalue,
            change.mean(),
            change.std(ddof=1),
            wilcoxon(change).pvalue,
        )
        rows.append((str(name), *(f"{cell:.3g}" for cell in cells)))
    joint = energy_test(*(each[list(NUMBERS)].to_numpy() for each in (compliant, other)))
    return rows, joint, (len(compliant), len(other))


def page(result: StudyResult) -> str:
    """Return the text of the page with the results."""
    assert result.verified is not None
    compliant, hard = (values_of(each.table) for each in (result.verified, result))
    rows, (distance, p), sizes = compared(compliant, hard)
    failed = sum(result.verified.counts[name] for name in result.verified.counts if name != "complete")
    head = (
        "",
        "mean, compliant",
        "mean, hard",
        "KS distance",
        "KS p",
        "mean change of pairs",
        "deviation of it",
        "signed-rank p",
    )
    return f"""# two_samples

Written by `python -m validation.two_samples STORE --write`.

The range of [solar_array_screened.toml](../../../examples/studies/solar_array_screened.toml): {sizes[0]} points with
compliant contact ({failed} of {len(compliant)} runs stopped and are left out) against {sizes[1]} other points with hard contact
at 0.2 ms; a change of pairs is of hard contact at the points of the compliant runs.

{table(head, rows)}
Energy distance of tip and torque together: {distance:.3g}, p = {p:.2f} by 999 permutations.

{machine()}
"""


def main() -> None:
    """Compute missing runs, print the result, and write it if wanted."""
    parser = argparse.ArgumentParser(prog="python -m validation.two_samples", description=str(__doc__).partition("\n")[0])
    parser.add_argument("store", type=Path)
    parser.add_argument("--pairs", type=int, default=PAIRS)
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    if not 8 <= given.pairs < given.points:
        parser.error("pairs are at least 8 and fewer than points")
    study = study_of(read_study(STUDY))
    assert study.accurate is not None
    study = replace(
        study, design=replace(study.design, points=given.points), accurate=replace(study.accurate, points=given.pairs)
    )
    text = page(computed(study, given.store, engine=given.threads))
    print(text)
    if given.write:
        (DECISIONS / "measured" / "two_samples.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
