"""What a study says, in the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table as RichTable
from rich.text import Text

from scissordyn.cli.show import console
from scissordyn.errors import command, printable

if TYPE_CHECKING:
    from scissordyn.study.answer.summary import Table
    from scissordyn.study.result import StudyResult

ROWS = 12
"""Points of a front or of a table that are shown."""


def show_answers(result: StudyResult) -> None:
    """Print counts, what the study says, fractions, sensitivity, the best points and the worst cases."""
    from scissordyn.study.answer.indices import sensitivity
    from scissordyn.study.answer.ranking import rankings
    from scissordyn.study.answer.summary import agreement, best_points, requirement_fractions, response_ranges, sensitivities

    study, results = result.study, result.dataset
    print(f"{', '.join(f'{n} {name}' for name, n in result.counts.items())}; {study.points} points".replace(" ", " cases ", 1))
    show_damage(result)
    _fidelity(result)
    _conclusion(result)
    if study.requirements:
        _show(requirement_fractions(study, results))
    _show(response_ranges(study, result.dataset, result.points))
    if said := agreement(study, result.points):
        _line(str(said))
    indices, left_out = sensitivity(study, results)
    for table in sensitivities(indices):
        _show(table)
    for table in rankings(study, results):
        _show(table)
    for name, why in left_out.items():
        print(f"No indices of {name}: {printable(why)}")
    best = best_points(study, results, ROWS)
    if best is not None:
        print(best.title)
        _show(best)
    _worst(result)
    show_causes(result)
    show_warnings(result)


def _fidelity(result: StudyResult) -> None:
    """What cheap and accurate runs say together."""
    from scissordyn.study.answer.fidelity import fidelity_text

    if (verified := result.verified) is None:
        return
    sentences, table, cost = fidelity_text(result.study, result.dataset, verified.dataset, (result.store, verified.store))
    for fact in sentences:
        _line(str(fact))
    print(table.title)
    _show(table)
    print(cost)


def _conclusion(result: StudyResult) -> None:
    """Whether and where the requirements are met, what the responses go with, and what to do next."""
    said = result.conclusion
    for fact in said.verdict:
        _line(str(fact))
    if said.margins is not None:
        _show(said.margins)
    for fact in said.trends:
        _line(str(fact))
    for why, what in said.next:
        print(f"{why}:\n  {what}")


def _line(text: str) -> None:
    console().print(printable(text), markup=False, highlight=False)


def _show(table: Table) -> None:
    shown = RichTable(box=box.SIMPLE)
    for head in table.head:
        shown.add_column(_cell(head))
    for row in table.rows:
        shown.add_row(*map(_cell, row))
    console().print(shown)
    for note in table.notes:
        print(note)


def _cell(text: str) -> Text:
    """As it is: to the library, brackets would be instructions."""
    return Text(printable(text))


def _worst(result: StudyResult) -> None:
    from scissordyn.study.answer.conclusion import numbers_text

    for one in result.worst(3) if result.study.requirements else ():
        what, place = ("Worst", "beyond") if one.margin < 0.0 else ("Nearest", "from")
        bound = f" ({abs(one.margin):.1%} {place} the bound)" if math.isfinite(one.margin) else ""
        _with_command(
            result,
            f"{what} for {one.requirement}: {one.text}{bound} at {numbers_text(result.study, result.dataset, one.numbers)}",
            one.case,
        )


def show_warnings(result: StudyResult) -> None:
    """Print the warnings, each with the number of its cases and a command that shows one."""
    for text, cases in list(result.warnings.items())[:ROWS]:
        many = "case" if len(cases) == 1 else "cases"
        _with_command(result, f"Warning in {len(cases)} {many}, as in: {printable(text)}", cases[0])


def show_causes(result: StudyResult) -> None:
    """Print the failed cases by cause, each with a command that shows one."""
    for cause, cases in list(result.causes.items())[:ROWS]:
        _with_command(result, f"{len(cases)} failed: {printable(cause)}", cases[0])


def _with_command(result: StudyResult, text: str, case: int) -> None:
    from scissordyn.study.answer.verdict import replay_command

    print(text)
    print(f"  {replay_command(result.store.address, case)}")


def show_damage(result: StudyResult) -> None:
    """Name the blocks that were written and are not whole, and the command that computes them anew."""
    if result.damage:
        print(result.damage)
        print(f"  To compute them anew: {command('scissordyn', 'study', 'resume', result.store.address)}")
