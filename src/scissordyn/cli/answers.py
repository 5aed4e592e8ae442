"""What a study says, in the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr
from rich import box
from rich.table import Table as RichTable
from rich.text import Text

from scissordyn.cli.show import console
from scissordyn.errors import command, printable

if TYPE_CHECKING:
    from scissordyn.study.description import Study
    from scissordyn.study.summary import Table

__all__ = ["show_answers", "show_causes", "show_damage", "show_warnings"]

ROWS = 12
"""Points of a front or of a table that are shown."""


def show_answers(study: Study, results: xr.Dataset, address: str) -> None:
    """Print counts, fractions, sensitivity, the best points and the worst cases.

    Parameters
    ----------
    study : Study
    results : Dataset
        From `Store.results`.
    address : str
        Of the store.
    """
    from scissordyn.study.answer import by_point, counts
    from scissordyn.study.indices import sensitivity
    from scissordyn.study.summary import agreement, best_points, requirement_fractions, response_ranges, sensitivities

    complete, failed, pending = counts(results)
    print(f"{complete} cases complete, {failed} failed, {pending} pending; {study.points} points")
    show_damage(results, address)
    points = by_point(study, results)
    if study.requirements:
        _show(requirement_fractions(study, results))
    _show(response_ranges(study, points))
    if said := agreement(study, points):
        console().print(said, markup=False)
    indices, left_out = sensitivity(study, results)
    for table in sensitivities(indices):
        _show(table)
    for name, why in left_out.items():
        print(f"No indices of {name}: {printable(why)}")
    best = best_points(study, results, ROWS)
    if best is not None:
        print(best.title)
        _show(best)
    _worst(study, results, address)
    show_causes(results, address)
    show_warnings(results, address)


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


def _worst(study: Study, results: xr.Dataset, address: str) -> None:
    from scissordyn.study.answer import replay_command, worst_cases
    from scissordyn.study.summary import worst_value

    for one in worst_cases(study, results, 3):
        what, place = ("Worst", "beyond") if one.margin < 0.0 else ("Nearest", "from")
        print(f"{what} for {one.requirement}: {worst_value(one)} ({abs(one.margin):.1%} {place} the bound)")
        print(f"  {replay_command(address, one.case)}")


def show_warnings(results: xr.Dataset, address: str) -> None:
    """Print the warnings, each with the number of its cases and a command that shows one.

    Parameters
    ----------
    results : Dataset
    address : str
        Of the store.
    """
    from scissordyn.study.answer import replay_command, warned

    for text, cases in list(warned(results).items())[:ROWS]:
        print(f"Warning in {len(cases)} {'case' if len(cases) == 1 else 'cases'}, as in: {printable(text)}")
        print(f"  {replay_command(address, cases[0])}")


def show_damage(results: xr.Dataset, address: str) -> None:
    """Name the blocks that were written and are not whole, and the command that computes them anew.

    Parameters
    ----------
    results : Dataset
    address : str
        Of the store.
    """
    if "damage" in results.attrs:
        print(results.attrs["damage"])
        print(f"  To compute them anew: {command('scissordyn', 'study', 'resume', address)}")


def show_causes(results: xr.Dataset, address: str) -> None:
    """Print the failed cases by cause, each with a command that shows one.

    Parameters
    ----------
    results : Dataset
    address : str
        Of the store.
    """
    from scissordyn.study.answer import causes, replay_command

    for cause, cases in list(causes(results).items())[:ROWS]:
        print(f"{len(cases)} failed: {printable(cause)}")
        print(f"  {replay_command(address, cases[0])}")
