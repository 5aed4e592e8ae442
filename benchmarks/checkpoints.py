"""Checkpoints: size of the file, and processor time to write it and to take it up."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.casefile.configuration import write_configuration
from scissordyn.plan.plan import plan
from scissordyn.run.advance.checkpoint import Checkpoint, open_checkpoint
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver

EXAMPLES = Path(__file__).parent.parent / "examples"
NAMED = ("paper", "mast", "long", "self_deploying")


def measure(quick: bool = False) -> str:
    """One row for each example, in the middle of its run."""
    repeats, rows = (3 if quick else 15), []
    for name in NAMED:
        case = sd.read_case(EXAMPLES / f"{name}.toml", ["run.trust=false"])
        driver, _, _ = make_driver(plan(case.mechanism), case.run)
        driver.sample_at(np.linspace(0.0, case.run.until, case.run.samples))
        advance(driver, 0.5 * case.run.until)
        with tempfile.TemporaryDirectory() as folder:
            text = write_configuration(case.mechanism, case.run)
            checkpoint = Checkpoint(Path(folder) / "run.checkpoint")
            keeper = open_checkpoint(checkpoint, driver.plan, text)
            written, read = [], []
            for _ in range(repeats + 1):
                began = time.process_time()
                keeper.write("run", driver, 0.0)
                done = time.process_time()
                open_checkpoint(checkpoint, driver.plan, text).take_up("run", driver)
                written.append(done - began)
                read.append(time.process_time() - done)
            size = Path(checkpoint.path).stat().st_size
        rows.append((name, f"{size / 1e3:.0f}", f"{1e3 * median(written[1:]):.0f}", f"{1e3 * median(read[1:]):.0f}"))
    said = (
        f"In the middle of the run of each example; medians of {repeats}, processor time. The test with twenty real kills is "
        "`pytest -m slow tests/run/test_checkpoint.py`.\n"
    )
    return f"{said}\n{table(('example', 'file [kB]', 'write [ms]', 'take up [ms]'), rows)}"


if __name__ == "__main__":
    command("checkpoints", measure)
