"""The paper's case, 50 ms at the default tolerance: times of scissordyn and scipy, and explicit against stiff methods."""

from __future__ import annotations

import scissordyn as sd
from benchmarks.cases import FRICTION, UNTIL, array, name_of
from benchmarks.measure import Measured, Times, command, interleaved, table
from benchmarks.plain import Plain
from scissordyn.simulation.options import Options
from scissordyn.simulation.trajectory import compute

TARGET = {None: 10e-3, 0.01: 20e-3, 0.1: 20e-3}
"""Target for a complete run [s]."""

TOLERANCE = 1e-8
PEERS = ("Radau", "LSODA", "DOP853")


def measure(quick: bool = False) -> str:
    """Tables of all comparisons."""
    own, page = _own(5 if quick else 21)
    return f"{page}\n{_against_scipy(own, quick)}\n{_explicit_against_stiff(3 if quick else 9)}"


def _own(repeats: int) -> tuple[dict[float | None, Times], str]:
    """Integration alone, with set-up, with Dataset."""
    candidates: dict[str, Measured] = {}
    for kinetic in FRICTION:
        mechanism, name = array(kinetic), name_of(kinetic)
        candidates[f"{name} integration"] = lambda m=mechanism: float(compute(m, Options(UNTIL)).statistics["seconds"])
        candidates[f"{name} compute"] = lambda m=mechanism: _ignore(compute(m, Options(UNTIL)))
        candidates[f"{name} simulate"] = lambda m=mechanism: _ignore(sd.simulate(m, until=UNTIL))
    times = interleaved(candidates, repeats)
    rows = []
    for kinetic in FRICTION:
        name = name_of(kinetic)
        path = compute(array(kinetic), Options(UNTIL))
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
    return {kinetic: times[f"{name_of(kinetic)} integration"] for kinetic in FRICTION}, text + table(head, rows)


def _ignore(result: object) -> None:
    """Time the call from outside."""


def _against_scipy(own: dict[float | None, Times], quick: bool) -> str:
    rows = []
    reference = {kinetic: sd.simulate(array(kinetic), until=UNTIL, rtol=1e-11, atol=1e-11) for kinetic in FRICTION}
    mine = {kinetic: sd.simulate(array(kinetic), until=UNTIL) for kinetic in FRICTION}
    for kinetic in FRICTION:
        starts = reference[kinetic]["contact_start"].values
        rows.append(
            [
                name_of(kinetic),
                "scissordyn",
                f"{own[kinetic].median:.4f}",
                "1",
                str(mine[kinetic].sizes["contact"]),
                f"{abs(float(mine[kinetic]['contact_start'][2]) - starts[2]):.0e}",
            ]
        )
        for method in PEERS:
            runs = [Plain(kinetic, method, TOLERANCE, UNTIL).run() for _ in range(1 if quick else 3)]
            seconds = sorted(run.seconds for run in runs)[len(runs) // 2]
            error = abs(runs[0].starts[2] - starts[2])
            ratio = f"{seconds / own[kinetic].median:.0f}"
            rows.append([name_of(kinetic), method, f"{seconds:.2f}", ratio, str(len(runs[0].starts)), f"{error:.0e}"])
    text = (
        "Against `scipy.integrate.solve_ivp` on minimal coordinates in plain Python, contacts as terminal events, same\n"
        "tolerance, steps of at most 0.05 ms, without which scipy misses contacts; integration alone. Error: of the start of\n"
        "the third contact, against scissordyn at 1e-11.\n\n"
    )
    return text + table(["case", "method", "time [s]", "ratio", "contacts", "error [s]"], rows)


def _explicit_against_stiff(repeats: int) -> str:
    rows = []
    for kinetic in (0.01, 0.03, 0.1):
        mechanism = array(kinetic)
        for tolerance in (1e-5, 1e-8):
            candidates: dict[str, Measured] = {}
            paths = {}
            for method in ("dop853", "rodas5p"):
                options = Options(UNTIL, rtol=tolerance, atol=tolerance, method=method)
                candidates[method] = lambda m=mechanism, o=options: float(compute(m, o).statistics["seconds"])
                paths[method] = compute(mechanism, options)
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
