"""Measure how often intervals of cheap and accurate runs contain the truth: ``python -m benchmarks.screening [FOLDER]``.

Forty independent studies compute the largest contact force of the paper's array until 3 ms over clearance and speed. Each
has 64 cheap runs at a tolerance of 1e-3 and 16 accurate ones. The truth is the mean of 2048 accurate runs of a Sobol design:
the mean of random ones would be as uncertain as the intervals are wide.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import scissordyn as sd
from scissordyn.studies.answer.fidelity import Corrected, estimates

STUDIES, SCREENED, VERIFIED, TRUE = 40, 64, 16, 2**11
BOUND = 40e3
RANGES = {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": "100..200 rpm"}


def runs_of(folder: Path, name: str, design: str, points: int, **options: Any) -> sd.StudyResult:
    """Return the runs of all studies, or of the truth."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    return sd.study(
        arm,
        RANGES,
        until=0.003,
        design=design,
        points=points,
        seed=1,
        requirements={"peak_force": BOUND},
        store=folder / f"{name}.db",
        **options,
    )


def repeated(runs: sd.StudyResult) -> list[list[Corrected]]:
    """Return the estimates of each study."""
    assert runs.verified is not None
    cheap, accurate = runs.dataset.load(), runs.verified.dataset.load()
    found = []
    for k in range(STUDIES):
        here = slice(k * SCREENED, (k + 1) * SCREENED)
        found.append(estimates(runs.study, cheap.isel(case=here), accurate.isel(case=here).isel(case=slice(VERIFIED))))
    return found


def print_coverage(found: list[list[Corrected]], force: np.ndarray) -> None:
    """Print how often intervals contain the truth, and how wide they are."""
    for kind, truth in {"fraction": np.mean(force < BOUND), "mean": np.mean(force)}.items():
        each = [next(one.estimate for one in study if one.kind == kind) for study in found]
        held = sum(one.low <= truth <= one.high for one in each)
        width, saved = (float(np.median([getattr(one, what) for one in each])) for what in ("width", "saved"))
        print(f"{kind} {truth:.6g}, held by {held} of {len(each)}, median width {width:.4g}, runs saved {saved:.3g}")


def main() -> None:
    """Make the runs, in the folder if one is given, and compare."""
    with tempfile.TemporaryDirectory() as made:
        folder, size = Path(sys.argv[1] if len(sys.argv) > 1 else made), STUDIES * SCREENED
        runs = runs_of(folder, "screening", "random", size, verify=size, screen={"rtol": 1e-3, "atol": 1e-3})
        force = runs_of(folder, "truth", "sobol", TRUE).dataset["peak_force"].values.max(axis=1)
        print_coverage(repeated(runs), force)


if __name__ == "__main__":
    main()
