"""``scissordyn paper``: reproduce the paper's figures and compare its statements."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.cli.option import THREADS_MAX, EngineOptions
from scissordyn.cli.output import DONE, INTERRUPTED, PROGRESS_TEXT, bars, check_folder, print_table, say
from scissordyn.cli.parameter import Option
from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn_paper.open_answers import OpenAnswers
    from scissordyn_paper.parameter_sets_page import ParameterSetAnswers
    from scissordyn_paper.reproduce import Reproduction

WORKERS_MAX = 16
"""Largest number of processes that recompute a paper.

More would wait for the ten longest motions, and each takes some hundred megabytes.
"""


def paper(
    output: Annotated[Path, Option("-o", "--output", help="Folder of the report, the runs and the pictures.")] = Path("paper"),
    figure: Annotated[int | None, Option(help="Draw only this figure of the paper.")] = None,
    beyond: Annotated[
        bool, Option("--beyond", help="Only what the paper leaves open: bars that bend and oil in the joint.")
    ] = False,
    parameter_sets: Annotated[
        bool,
        Option("--parameter-sets", help="Draw what the paper leaves open, and count the checks that agree."),
    ] = False,
    number: Annotated[int, Option(help="Number of parameter sets of --parameter-sets.", min=1, max=1_000_000)] = 20_000,
    threads: Annotated[
        int | None, Option(help="Threads of this process, instead of several processes.", min=1, max=THREADS_MAX)
    ] = None,
    workers: Annotated[
        int | None,
        Option(
            help=f"Processes on this machine; one per processor if not given, {WORKERS_MAX} at most.", min=1, max=THREADS_MAX
        ),
    ] = None,
) -> int:
    check_folder(output, "-o paper")
    parts = {"--beyond": beyond, "--parameter-sets": parameter_sets, "--figure": figure is not None}
    chosen = [name for name, is_given in parts.items() if is_given]
    if len(chosen) > 1:
        raise InputError(f"{' and '.join(chosen)} together", "one of these options", chosen[0])
    from scissordyn_paper.open_answers import answer_open_question
    from scissordyn_paper.parameter_sets_page import answer_parameter_sets
    from scissordyn_paper.reproduce import draw_figure, reproduce

    answers: Any
    show: Callable[[Any], None] | None
    try:
        columns = (PROGRESS_TEXT, "BarColumn", "MofNCompleteColumn", "TimeRemainingColumn")
        with _engine_options(threads, workers, figure).engine() as engine, bars(*columns) as update:
            progress = None if update is None else lambda name, done, total: update(name, completed=done, total=total)
            options: dict[str, Any] = {"engine": engine, "progress": progress}
            if beyond:
                answers, show = answer_open_question(output, **options), _show_changes
            elif parameter_sets:
                answers, show = answer_parameter_sets(output, number, **options), _show_parameter_sets
            elif figure is None:
                answers, show = reproduce(output, **options), _show
            else:
                answers, show = draw_figure(figure, output, **options), None
    except KeyboardInterrupt:
        again = f"completed runs are in {output}; the same command continues from there"
        print(f"scissordyn: interrupted; {again}", file=sys.stderr)
        return INTERRUPTED
    if show is None:
        print(*answers, sep="\n")
    else:
        show(answers)
        print(f"Report: {answers.report}")
    return DONE


def _engine_options(threads: int | None, workers: int | None, figure: int | None) -> EngineOptions:
    """Return options of the engine: threads or processes as requested, by default processes, which run in parallel."""
    from scissordyn.processor import processors

    several = min(processors(), WORKERS_MAX)
    if threads is None and workers is None and figure is None and several > 1:
        return EngineOptions(workers=several)
    return EngineOptions(threads, workers)  # the few runs of a figure are done before processes are started


def _show(reproduction: Reproduction) -> None:
    """Print the answers as a table."""
    verdicts, rows = reproduction.verdicts, []
    for verdict in verdicts:
        words = verdict.finding.words
        rows.append((verdict.check.key, verdict.answer, f"{verdict.check.says}\n{words[:1].upper()}{words[1:]}."))
        if verdict.periodic is not None:
            rows.append(("", verdict.periodic.answer, f"Under a periodic drive: {verdict.periodic.words}."))
    print_table({"": "text", "answer": "name", "statement of the paper, and measured values": "text"}, rows)
    agreeing = sum(verdict.finding.holds for verdict in verdicts)
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    holding = sum(answer.holds for answer in periodic)
    say(
        f"{agreeing} of {len(verdicts)} checks agree.",
        f"Of the {len(periodic)} that can be evaluated under a periodic drive, {holding} agree there.",
    )


def _show_changes(answers: OpenAnswers) -> None:
    """Print a line on the effect of each change of bars and joint."""
    from scissordyn_paper.open_question import COMPARED, MANOEUVRES

    for manoeuvre, title in MANOEUVRES.items():
        say(f"{title[:1].upper()}{title[1:]}, over rigid bars and a dry joint:")
        for change in answers.changes:
            if change.manoeuvre == manoeuvre:
                say(f"  {change.what} reduces the {COMPARED[change.measure]}? {change.answer}: {change.words}")


def _show_parameter_sets(answers: ParameterSetAnswers) -> None:
    """Print how many checks agree for the best parameter set, and its values."""
    from scissordyn_paper.parameter_sets import NEIGHBOURS, choice_at

    judged, leading = answers.judged, answers.leading
    say(
        f"{judged.agreeing_count.size} parameter sets, {judged.seconds.sum():.0f} s of one processor. For the best one "
        f"{leading.agreeing_count[0]:.2f} of {judged.agreeing.shape[1]} checks agree, averaged over {NEIGHBOURS} neighbours: "
        f"{choice_at(leading.points[0]).words}."
    )
