"""A million cases in the file of a study: its size, and the seconds to append rows and to read them."""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import scissordyn as sd
from benchmarks.measure import machine, paragraph, table, write_section
from scissordyn.model.options import Options
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Design, Factor
from scissordyn.studies.ask.distribution import Interval
from scissordyn.studies.compute.execute import simulated
from scissordyn.studies.compute.store import COMPLETE, Store

CASES, BLOCK = 1_000_000, 10_000

MEASURES = ("peak_force", "contact_count")


def measure(cases: int = CASES) -> str:
    """The section of the page; numbers are random, as nothing is simulated."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    factors = (Factor("A.clearance", Interval(0.05e-3, 0.7e-3)), Factor("drive.speed", Interval(sd.rpm(50), sd.rpm(180))))
    study = Study(arm, Options(1e-4), factors, Design("random", cases), MEASURES)
    chance = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "study.db")
        store.create(study, simulated(study, np.array([0])), BLOCK)
        began = time.perf_counter()
        with store.alone():
            for first in range(0, cases, BLOCK):
                size = min(BLOCK, cases - first)
                values = {name: chance.random(size) for name in (*study.factor_names, *MEASURES)}
                status, texts = np.full(size, COMPLETE, np.int8), [("", "")] * size
                store.write(np.arange(first, first + size), values, status, texts, (1.0, 1.0, size))
        appended = time.perf_counter() - began
        size = Path(store.path).stat().st_size
        began = time.perf_counter()
        results = store.results()
        read = time.perf_counter() - began
        assert results["status"].values.sum() == cases * COMPLETE
    rows = [[str(cases), f"{size / 1e6:.0f}", f"{size / cases:.0f}", f"{appended:.1f}", f"{read:.1f}"]]
    head = ("cases", "file [MB]", "bytes a case", "appended in [s]", "read and checked in [s]")
    about = paragraph(f"Two numbers that vary and two measures of one joint, in blocks of {BLOCK} cases, each a transaction.")
    return f"{about}\n\n{table(head, rows)}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="save the section in docs/decisions/measured/studies.md")
    parser.add_argument("--cases", type=int, default=CASES)
    given = parser.parse_args()
    text = f"{measure(given.cases)}\n{machine()}\n"
    print(text)
    if given.write:
        write_section("studies", "One file", "python -m benchmarks.study_file --write", text)
