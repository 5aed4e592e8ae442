"""``scissordyn zoo``: named mechanisms with their sources and the numbers that a right program gives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.status import DONE, UNFINISHED
from scissordyn.errors import InputError, command

if TYPE_CHECKING:
    from rich.console import Console

    from scissordyn.collection.entry import Entry


def zoo(
    name: Annotated[str, typer.Argument(help="Show this one.", show_default=False)] = "",
    case: Annotated[bool, typer.Option("--case", help="Print its case file.")] = False,
    copy: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Copy its case file, as case.toml.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Run it, or all, and compare the numbers; status 3 if one differs.")
    ] = False,
) -> int:
    """List the named mechanisms, or show one: what it is, its source, its numbers, its case file."""
    from scissordyn.cli.show import console
    from scissordyn.collection.catalogue import zoo as known
    from scissordyn.file.output_file import check_target, write_file

    to = console()
    if not name:
        if check and not case and copy is None:
            return max(_check(entry, to) for entry in known.values())
        if case or copy is not None:
            raise InputError("no name", ", ".join(known), "scissordyn zoo peaucellier --case")
        _list(to)
        return 0
    entry = known[name]
    if copy is not None:
        sample = "-o case.toml"
        content = entry.case_file.read_bytes()
        if copy.exists() and copy.read_bytes() != content:
            raise InputError(f"'{copy}' exists and is another file", "a file that is not there", sample)
        check_target(copy, sample=sample, beginning=content)
        to.print(str(write_file(copy, content, sample=sample)), markup=False)
    if case:
        print(entry.text, end="")
    if check:
        return _check(entry, to)
    if not case and copy is None:
        _show(entry, to)
    return 0


def _list(to: Console) -> None:
    from rich import box
    from rich.table import Table

    from scissordyn.collection.catalogue import zoo

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("name", no_wrap=True)
    table.add_column("what it is")
    table.add_column("kind")
    for entry in zoo.values():
        table.add_row(entry.name, entry.title, entry.kind)
    to.print(table)
    for problem in zoo.problems:
        to.print(f"Warning: {problem}.", markup=False)
    to.print("Show one: scissordyn zoo peaucellier; its case file: scissordyn zoo peaucellier --case > case.toml", markup=False)


def _show(entry: Entry, to: Console) -> None:
    from rich import box
    from rich.table import Table

    to.print(entry.title, style="bold", markup=False)
    to.print(entry.about, markup=False)
    for reference in entry.references:
        to.print(f"Source: {reference.text}", markup=False)
    to.print(f"Case file: {entry.case_file}", markup=False, soft_wrap=True)
    to.print(f"Licence of the files: {entry.licence}", markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("number", "value", "tolerance", "from"):
        table.add_column(column, justify="right" if column in ("value", "tolerance") else "left", overflow="fold")
    for number in entry.numbers:
        joints = "" if number.ideal else ", with clearance"
        table.add_row(number.what + joints, number.value, number.tolerance, f"{number.origin}: {number.reason}")
    to.print(table)
    to.print(f"Compare a run with them: {command('scissordyn', 'zoo', entry.name, '--check')}", markup=False)


def _check(entry: Entry, to: Console) -> int:
    from rich import box
    from rich.table import Table

    from scissordyn.units import short

    found = entry.check()
    to.print(entry.title, style="bold", markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("number", "expected", "found", "difference", "allowed", ""):
        table.add_column(column, justify="left" if column in ("number", "") else "right", overflow="fold")
    for one in found:
        row = (one.expected, one.found, one.difference, one.tolerance)
        table.add_row(one.number.what, *(short(value, one.unit) for value in row), "met" if one.met else "differs")
    to.print(table)
    return DONE if all(one.met for one in found) else UNFINISHED
