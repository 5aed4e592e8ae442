"""``scissordyn controllers``: the catalogue."""

from __future__ import annotations

from typing import Annotated

import typer


def controllers(
    name: Annotated[str | None, typer.Argument(help="One controller, or a class of yours as FILE.py:CLASS.")] = None,
) -> int:
    """List the controllers, or show one with its parameters."""
    from rich import box
    from rich.table import Table

    from scissordyn.cli.parameters import print_parameters, print_text
    from scissordyn.cli.show import console
    from scissordyn.control.catalogue import CONTROLLERS, controller

    to = console()
    if name is not None:
        described: type = controller(name)
        to.print(f"{name}, a controller", style="bold", markup=False)
        print_text(described, to)
        to.print(f"Source: {vars(described)['source']}", markup=False)
        needed = [sample for sample in print_parameters(described, to) if sample][:2]
        inside = ", ".join([f'name = "{name}"', *needed])
        to.print(f"In a case file, below [control]: controller = {{ {inside} }}", markup=False)
        return 0
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("name", no_wrap=True)
    table.add_column("what it is")
    table.add_column("source", overflow="fold")
    for known, described in CONTROLLERS.items():
        table.add_row(known, (described.__doc__ or "").strip().splitlines()[0], vars(described)["source"])
    to.print(table)
    to.print("scissordyn controllers NAME shows one with its parameters.", markup=False)
    return 0
