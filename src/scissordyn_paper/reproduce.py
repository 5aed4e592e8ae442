"""Reproduce the paper: compute its runs, answer the checks, draw its figures and write the report."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn.file.output_file import write_file
from scissordyn.run.engine import Engine
from scissordyn_paper import controlled, periodic
from scissordyn_paper.cache import Jobs, Progress, fetch_all
from scissordyn_paper.cases import DEFAULT, PaperCase, contact_starts, every_case
from scissordyn_paper.figures import FIGURES, FURTHER, figure_of
from scissordyn_paper.judge import findings
from scissordyn_paper.measures import measure
from scissordyn_paper.page import save_picture
from scissordyn_paper.report import as_csv, as_json, page
from scissordyn_paper.results import BEST, Results
from scissordyn_paper.runs import compute, fetch_runs
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import Settled, Verdict, answer

_FIGURE = "figure-{:02d}"  # Format of the file name of a figure of the paper; {} is the number of the figure


@dataclass(frozen=True)
class Reproduction:
    """Result of the reproduction of the paper."""

    verdicts: tuple[Verdict, ...]  # Verdicts of the default choice
    report: Path  # The HTML report


def reproduce(folder: str | os.PathLike[str], *, engine: Engine = None, progress: Progress | None = None) -> Reproduction:
    """Compute all runs, check the paper's statements, draw its figures, and write the report."""
    target = _made(folder)
    results = _results(target, engine, progress)
    answers = verdicts(results.runs, {case: periodic.regularity_of(run) for case, run in results.settled.items()})
    for case in (*results.runs, *results.settled):
        _write(target / "cases" / f"{_file(case)}.toml", case.toml)
    pictures = _drawn(results, target / "figures", progress)
    _write(target / "verdicts.json", as_json(answers))
    _write(target / "verdicts.csv", as_csv(answers))
    report = _write(target / "report.html", page(answers, results, pictures, findings(BEST)))
    return Reproduction(answers, report)


def draw_figure(
    number: int,
    folder: str | os.PathLike[str],
    *,
    engine: Engine = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Draw one figure of the paper from stored runs; compute missing runs first."""
    figure = figure_of(number)
    target = _made(folder)
    needed = [*figure.cases, *(case.ideal for case in figure.cases)]
    runs = fetch_runs(needed, target / "runs", engine=engine, progress=progress)
    return save_picture(figure.draw(runs), target / "figures", _FIGURE.format(number))


def verdicts(runs: Mapping[PaperCase, xr.Dataset], settled: Settled | None = None) -> tuple[Verdict, ...]:
    """Return the answers to all checks of the paper's statements, from the runs of the default choice."""
    measured = {case: measure(run, runs[case.ideal]) for case, run in runs.items() if case.clearance is not None}
    return tuple(answer(check, DEFAULT, measured, settled) for check in CHECKS)


def _results(target: Path, engine: Engine, progress: Progress | None) -> Results:
    """Return the runs and the diagram of the report from the folder `target`; compute missing ones first."""
    runs, settled, controlled_runs = fetch_all(
        Jobs((*every_case(DEFAULT), *contact_starts(DEFAULT)), compute, target / "runs"),
        Jobs(periodic.LONGEST_FIRST, periodic.examine, target / "periodic", "motions under the periodic drive"),
        Jobs(controlled.LONGEST_FIRST, controlled.compute, target / "control", "controlled runs"),
        engine=engine,
        progress=progress,
    )
    return Results(
        runs=runs,
        settled={case: settled[case] for case in periodic.ALL_CASES},
        controlled={run: controlled_runs[run] for run in controlled.CONTROLLED_RUNS},
        diagram=periodic.fetch_diagram(target / "bifurcation.nc", engine=engine, progress=progress),
    )


def _drawn(results: Results, folder: Path, progress: Progress | None) -> dict[int | str, list[Path]]:
    """Draw all figures; return their files by number or name."""
    draw: dict[int | str, Callable[[], Figure]] = {
        **{number: partial(figure.draw, results.runs) for number, figure in FIGURES.items()},
        **{name: partial(figure.draw, results) for name, figure in FURTHER.items()},
    }
    pictures: dict[int | str, list[Path]] = {}
    for name, drawn in draw.items():
        pictures[name] = save_picture(drawn(), folder, _FIGURE.format(name) if isinstance(name, int) else name)
        if progress is not None:
            progress("figures", len(pictures), len(draw))
    return pictures


def _file(case: PaperCase) -> str:
    """Return the file name of a case without ending, with "periodic" if it has the periodic drive."""
    return f"periodic_{case.name}" if case.choice == periodic.PERIODIC else case.name


def _made(folder: str | os.PathLike[str]) -> Path:
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder '{target}': {error.strerror}", "a folder that can be written", "-o paper"
        ) from None
    return target


def _write(path: Path, text: str) -> Path:
    """Write a text file completely or not at all."""
    _made(path.parent)
    return write_file(path, text.encode(), sample="-o paper")
