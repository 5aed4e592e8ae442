"""Description and parameters of a plug-in, for `scissordyn laws` and `scissordyn controllers`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

NARROW = 90
"""On narrower terminals what is allowed stands in the column of what a parameter means."""


def print_text(described: type, to: Console) -> None:
    """Print the docstring of a plug-in: its formulas in characters, its paragraphs as wide as the terminal."""
    import inspect
    import re

    from scissordyn.cli.formula import plain_formula

    # its markup is for sphinx
    text = re.sub(r":math:`([^`]*)`", lambda found: plain_formula(found[1]), inspect.getdoc(described) or "")
    for block in re.split(r"\n\s*\n", text):
        lines = " ".join(line.strip() for line in block.splitlines())
        formula = lines.startswith(".. math::") or block.startswith("    ")
        said = plain_formula(lines.removeprefix(".. math::")) if formula else re.sub(r"``?|:[a-z]+:(?=`)", "", lines)
        if said:
            for line in said.split("\n"):
                to.print(f"    {line}" if formula else line, markup=False)


def print_parameters(described: type, to: Console) -> list[str]:
    """Print the parameters of a plug-in; returns a sample of each in the form of a case file."""
    from rich import box
    from rich.table import Table

    from scissordyn.config.table import table_of

    keys = table_of(described)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("parameter", no_wrap=True)  # names and values are copied from here
    table.add_column("default", no_wrap=True)
    narrow = to.width < NARROW
    for title in ("meaning",) if narrow else ("allowed", "meaning"):
        table.add_column(title, overflow="fold")
    for name, key in keys.declared_keys().items():
        quantity = key.quantity
        allowed = quantity.allowed.removeprefix("a finite number").strip() if quantity else "true or false"
        if quantity is None and isinstance(key.default, str):
            allowed = "text"
        default = "" if key.required or key.default is None else key.sample
        meaning = key.help
        table.add_row(name, default, *((f"{meaning}; {allowed}".strip("; "),) if narrow else (allowed, meaning)))
    if keys.declared_keys():
        to.print(table)
    return [f"{name} = {key.sample}" for name, key in keys.declared_keys().items()]
