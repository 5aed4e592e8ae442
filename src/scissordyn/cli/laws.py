"""``scissordyn laws``: the catalogue."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissordyn.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from rich.console import Console


def laws(
    name: Annotated[str | None, typer.Argument(help="One law or material, or a class of yours as FILE.py:CLASS.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the law, or all laws on one impact, into this file.")] = None,
) -> int:
    """List the laws and materials, or show one with its parameters."""
    from scissordyn.cli.show import console
    from scissordyn.laws.catalogue import BY_KIND, MATERIALS, kind_in

    own = name is not None and ".py:" in name
    kinds = [kind_in(str(name))] if own else [kind for kind, known in BY_KIND.items() if name in known]
    if name is not None and not kinds and name not in MATERIALS:
        names = [*dict.fromkeys(law for known in BY_KIND.values() for law in known), *MATERIALS]
        raise InputError(f"unknown law or material '{name}'{did_you_mean(name, names)}", ", ".join(names), "scissordyn laws")
    if plot is not None:
        _check_picture(plot, name, kinds)
    to = console()
    if name is None:
        _list(to)
    else:
        for kind in kinds:
            _describe(kind, name, to)
        if name in MATERIALS:
            material = MATERIALS[name]
            to.print(
                f"{name}, a material: E = {material.youngs_modulus / 1e9:g} GPa, nu = {material.poisson_ratio:g}, "
                f"rho = {material.density:g} kg/m^3. Source: {material.source}",
                markup=False,
            )
    if plot is not None:
        _draw(plot, name, kinds)
    return 0


def _check_picture(path: Path, name: str | None, kinds: list[str]) -> None:
    from scissordyn.cli.output import check_file
    from scissordyn.plot.file import check_format

    if name is not None and not kinds:
        raise InputError(f"a picture of the material '{name}'", "a law", "scissordyn laws flores --plot law.png")
    check_format(path.suffix.lower().removeprefix("."))
    check_file(path, Path(), "--plot law.png")


def _draw(path: Path, name: str | None, kinds: list[str]) -> None:
    from matplotlib.figure import Figure

    from scissordyn.laws.catalogue import law
    from scissordyn.plot.file import write
    from scissordyn.plot.law import draw_gallery, draw_law

    axes = draw_gallery() if name is None else draw_law(_drawn(law(kinds[0], name)))
    figure = axes[0].get_figure(root=True)
    assert isinstance(figure, Figure)
    write(figure, path)
    print(f"Drawn into {path}" + (f", as a law of {kinds[0]}" if len(kinds) > 1 else ""))


def _drawn(described: Any) -> Any:
    """A law with the defaults of its parameters."""
    needed = [field.name for field in dataclasses.fields(described) if field.default is field.default_factory]
    if needed:
        given = ", ".join(f"{name}=..." for name in needed)
        raise InputError(
            f"a picture of '{described.__name__}', whose {needed[0]} has no default",
            "a law with defaults, or a picture in Python",
            f"sd.plot.law({described.__name__}({given}))",
        )
    return described()


def _list(to: Console) -> None:
    from rich import box
    from rich.table import Table

    from scissordyn.laws.catalogue import BY_KIND, MATERIALS, facts
    from scissordyn.laws.oil import OILS

    for kind, known in BY_KIND.items():
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=kind, title_justify="left")
        table.add_column("name", no_wrap=True)
        table.add_column("what it is")
        table.add_column("source", overflow="fold")
        for name in known:
            law = facts(kind, name)
            table.add_row(name, law.summary, law.source)
        to.print(table)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title="material", title_justify="left")
    table.add_column("name", no_wrap=True)
    for column in ("E [GPa]", "nu", "rho [kg/m^3]"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("source", overflow="fold")
    for name, material in MATERIALS.items():
        numbers = (material.youngs_modulus / 1e9, material.poisson_ratio, material.density)
        table.add_row(name, *(f"{number:g}" for number in numbers), material.source)
    to.print(table)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title="oil", title_justify="left")
    table.add_column("name", no_wrap=True)
    for column in ("nu at 40 deg C [mm^2/s]", "at 100 deg C", "rho [kg/m^3]"):
        table.add_column(column, justify="right")
    table.add_column("source", overflow="fold")
    for name, oil in OILS.items():
        shown = (1e6 * oil.viscosity_40, 1e6 * oil.viscosity_100, oil.density)
        table.add_row(name, *(f"{number:g}" for number in shown), oil.source)
    to.print(table)
    to.print("scissordyn laws NAME shows one with its parameters.", markup=False)


def _describe(kind: str, name: str, to: Console) -> None:
    from scissordyn.cli.parameters import print_parameters, print_text
    from scissordyn.laws.catalogue import facts, law

    described: type = law(kind, name)
    known = facts(kind, name)
    to.print(f"{known.name}, a law of {kind}", style="bold", markup=False)
    print_text(described, to)
    notes = [f"Source: {known.source}"]
    if known.restitution_range is not None:
        notes.append("Made for restitution coefficients from {:g} to {:g}.".format(*known.restitution_range))
    if known.states:
        notes.append(f"Internal states: {', '.join(state.name for state in known.states)}.")
    if known.stiff:
        notes.append("Makes the equations of motion stiff.")
    if known.caveat:
        notes.append(f"Caveat: {known.caveat}")
    for note in notes:
        to.print(note, markup=False)
    chosen = "".join(f", {sample}" for sample in print_parameters(described, to)[:1])
    to.print(
        "In a case file: " + (f'{kind} = {{ law = "{known.name}"{chosen} }}' if chosen else f'{kind} = "{known.name}"'),
        markup=False,
    )
