"""``scissordyn paper``: reproduce the paper's figures and compare its statements."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.output import check_folder
from scissordyn.cli.status import DONE, INTERRUPTED
from scissordyn.cli.where import MOST_THREADS, Where
from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn_paper.open_answers import Change
    from scissordyn_paper.verdict import Verdict

MOST_WORKERS = 16
"""More processes would wait for the longest motions, of which there are ten, and each takes some hundred megabytes."""


def paper(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the report, the runs and the pictures.")] = Path(
        "paper"
    ),
    figure: Annotated[int | None, typer.Option(help="Draw only this figure of the paper.")] = None,
    beyond: Annotated[
        bool, typer.Option("--beyond", help="Only what the paper leaves open: bars that bend and oil in the joint.")
    ] = False,
    threads: Annotated[
        int | None, typer.Option(help="Threads of this process in place of other processes.", min=1, max=MOST_THREADS)
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help=f"Processes on this machine; one per processor if not given, {MOST_WORKERS} at most.", min=1),
    ] = None,
) -> int:
    """Reproduce the paper's figures and compare its statements with measured numbers."""
    check_folder(output, "-o paper")
    if beyond and figure is not None:
        raise InputError(f"--beyond with --figure {figure}", "one of them", "--beyond")
    kept = f"what is done is in {output}, and the same command goes on from it"
    from scissordyn_paper.open_answers import answer_open_question
    from scissordyn_paper.reproduce import draw_figure, reproduce

    try:
        where = _where(threads, workers, figure)
        with where.engine() as engine, _bars() as progress:
            if beyond:
                answers = answer_open_question(output, engine=engine, progress=progress)
            elif figure is None:
                result = reproduce(output, engine=engine, progress=progress)
            else:
                written = draw_figure(figure, output, engine=engine, progress=progress)
    except KeyboardInterrupt:
        print(f"scissordyn: interrupted; {kept}", file=sys.stderr)
        return INTERRUPTED
    if beyond:
        _show_changes(answers.changes)
        print(f"Report: {answers.report}")
        return DONE
    if figure is not None:
        for path in written:
            print(path)
        return DONE
    _show(result.verdicts)
    print(f"Report: {result.report}")
    return DONE


def _where(threads: int | None, workers: int | None, figure: int | None) -> Where:
    """Processes unless threads are asked for: what a run has beside its loop is Python, which threads do one at a time."""
    from scissordyn.run.engine import processors

    several = min(processors(), MOST_WORKERS)
    if threads is None and workers is None and figure is None and several > 1:
        return Where(workers=several)
    return Where(threads, workers)  # the few runs of a figure are done before processes are started


def _show(verdicts: tuple[Verdict, ...]) -> None:
    """Print the answers as a table."""
    from rich import box
    from rich.table import Table

    from scissordyn.cli.show import console

    to = console()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("")
    table.add_column("answer", no_wrap=True)
    table.add_column("statement of the paper, and measured values")
    for verdict in verdicts:
        said, found = verdict.clause.says, verdict.finding.words
        table.add_row(verdict.clause.key, verdict.answer, f"{said}\n{found[:1].upper()}{found[1:]}.")
        if verdict.periodic is not None:
            table.add_row("", verdict.periodic.answer, f"Under a periodic drive: {verdict.periodic.words}.")
    to.print(table)
    agreeing = sum(verdict.finding.holds for verdict in verdicts)
    to.print(f"{agreeing} of {len(verdicts)} clauses agree.", markup=False)
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    holding = sum(found.holds for found in periodic)
    to.print(f"Of the {len(periodic)} that can be evaluated under a periodic drive, {holding} agree there.", markup=False)


def _show_changes(changes: tuple[Change, ...]) -> None:
    """Print what each change of bars and joint does, a line each."""
    from scissordyn.cli.show import console
    from scissordyn_paper.open_question import COMPARED, MANOEUVRES

    to = console()
    for manoeuvre, title in MANOEUVRES.items():
        to.print(f"{title[:1].upper()}{title[1:]}, over rigid bars and a dry joint:", markup=False)
        for one in changes:
            if one.manoeuvre == manoeuvre:
                to.print(f"  {one.what} reduces the {COMPARED[one.measure]}? {one.answer}: {one.words}", markup=False)


@contextmanager
def _bars() -> Iterator[Callable[[str, int, int], None] | None]:
    """A function that updates one bar per kind of work on stderr; None without a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def move(what: str, done: int, of: int) -> None:
            if what not in tasks:
                tasks[what] = bars.add_task(what, total=of)
            bars.update(tasks[what], completed=done)

        yield move
