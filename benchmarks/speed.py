"""Measure the paper's case over 50 ms at the default tolerance: parts of a run, and explicit and stiff methods."""

from __future__ import annotations

import scissordyn as sd
from benchmarks.cases import FRICTION, UNTIL, array, name_of
from benchmarks.measure import Measured, command, interleaved, table
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute

TARGET = {None: 10e-3, 0.01: 20e-3, 0.1: 20e-3}  # Target for a complete run [s]


def measure(quick: bool = False) -> str:
    """Return the tables of all comparisons."""
    return f"{_own(5 if quick else 21)}\n{_explicit_against_stiff(3 if quick else 9)}"


def _own(repeats: int) -> str:
    """Return the times of the integration alone, with set-up, and with the Dataset."""
    candidates: dict[str, Measured] = {}
    for kinetic in FRICTION:
        mechanism, name = array(kinetic), name_of(kinetic)
        candidates[f"{name} integration"] = lambda m=mechanism: float(compute(plan(m), Options(UNTIL)).statistics["seconds"])
        candidates[f"{name} compute"] = lambda m=mechanism: _ignore(compute(plan(m), Options(UNTIL)))
        candidates[f"{name} simulate"] = lambda m=mechanism: _ignore(sd.simulate(m, until=UNTIL))
    times = interleaved(candidates, repeats)
    rows = []
    for kinetic in FRICTION:
        name = name_of(kinetic)
        path = compute(plan(array(kinetic)), Options(UNTIL))
        if path.status != "complete":
            raise RuntimeError(f"{name}: {path.cause}")
        statistics = path.statistics
        parts = [times[f"{name} {what}"] for what in ("integration", "compute", "simulate")]
        verdict = "met" if parts[-1].median <= TARGET[kinetic] else "missed"
        rows.append(
            [
                name,
                str(statistics["method"]),
                str(statistics["steps"]),
                *(f"{1e3 * part.median:.1f} ({1e3 * part.least:.1f})" for part in parts),
                f"{1e3 * TARGET[kinetic]:.0f}: {verdict}",
            ]
        )
    head = ["case", "method", "steps", "integration [ms]", "with set-up [ms]", "with Dataset [ms]", "target [ms]"]
    text = (
        f"Median (least) of {repeats} runs, 50 ms simulated, tolerance 1e-8, 2001 samples; the target is for the Dataset.\n\n"
    )
    return text + table(head, rows)


def _ignore(result: object) -> None:
    """Return None, so that the call is timed from outside."""


def _explicit_against_stiff(repeats: int) -> str:
    rows = []
    for kinetic in (0.01, 0.03, 0.1):
        mechanism = array(kinetic)
        for tolerance in (1e-5, 1e-8):
            candidates: dict[str, Measured] = {}
            paths = {}
            for method in ("dop853", "rodas5p"):
                options = Options(UNTIL, rtol=tolerance, atol=tolerance, method=method)
                candidates[method] = lambda m=mechanism, o=options: float(compute(plan(m), o).statistics["seconds"])
                paths[method] = compute(plan(mechanism), options)
            times = interleaved(candidates, repeats)
            # time and steps of a failed run are not comparable
            whole = {method: path.status == "complete" for method, path in paths.items()}
            explicit, stiff = (times[method].median for method in candidates)
            steps = [int(path.statistics["steps"]) for path in paths.values()]
            rows.append(
                [
                    name_of(kinetic),
                    f"{tolerance:.0e}",
                    *(f"{1e3 * times[method].median:.1f}" if whole[method] else "failed" for method in candidates),
                    f"{explicit / stiff:.2f}" if all(whole.values()) else "",
                    *(str(count) if ok else "failed" for count, ok in zip(steps, whole.values(), strict=True)),
                    f"{steps[0] / steps[1]:.1f}" if all(whole.values()) else "",
                ]
            )
    head = ["case", "tolerance", "dop853 [ms]", "rodas5p [ms]", "ratio", "steps dop853", "steps rodas5p", "ratio"]
    return "Explicit against stiff methods in the same loop.\n\n" + table(head, rows)


if __name__ == "__main__":
    command("speed", measure)
