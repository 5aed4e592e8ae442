"""``scissordyn laws``: the catalogue."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["laws"]


def laws(
    name: Annotated[str | None, typer.Argument(help="One law or material.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the law, or all laws on one impact, into this file.")] = None,
) -> int:
    """List the laws and materials, or show one with its parameters."""
    from scissordyn.cli.output import check_file
    from scissordyn.cli.show import console
    from scissordyn.config.law import KINDS
    from scissordyn.laws.catalogue import MATERIALS

    if plot is not None:
        check_file(plot, Path(), "--plot law.png")
    found = [(kind, known[name]) for kind, known in KINDS.items() if name is not None and name in known]
    if name is not None and not found and name not in MATERIALS:
        known = [*dict.fromkeys(law for kind in KINDS.values() for law in kind), *MATERIALS]
        raise InputError(f"unknown law or material '{name}'{did_you_mean(name, known)}", ", ".join(known), "scissordyn laws")
    to = console()
    if name is None:
        _list(to)
    for kind, law in found:
        _describe(kind, law, to)
    if name in MATERIALS:
        material = MATERIALS[name]
        to.print(
            f"{name}, a material: E = {material.youngs_modulus / 1e9:g} GPa, nu = {material.poisson_ratio:g}, "
            f"rho = {material.density:g} kg/m^3. Source: {material.source}",
            markup=False,
        )
    return 0


def _list(to: Console) -> None:
    from rich import box
    from rich.table import Table

    from scissordyn.config.law import KINDS
    from scissordyn.config.table import table_of
    from scissordyn.laws.catalogue import MATERIALS

    for kind, known in KINDS.items():
        table = Table("name", "parameters", "source", box=box.SIMPLE_HEAD, pad_edge=False, title=kind, title_justify="left")
        for name, law in known.items():
            table.add_row(name, ", ".join(table_of(law).model_fields), law.source)
        to.print(table)
    table = Table("name", box=box.SIMPLE_HEAD, pad_edge=False, title="material", title_justify="left")
    for column in ("E [GPa]", "nu", "rho [kg/m^3]"):
        table.add_column(column.replace("[", r"\["), justify="right")
    table.add_column("source")
    for name, material in MATERIALS.items():
        numbers = (material.youngs_modulus / 1e9, material.poisson_ratio, material.density)
        table.add_row(name, *(f"{number:g}" for number in numbers), material.source)
    to.print(table)
    to.print("scissordyn laws NAME shows one with its parameters.", markup=False)


def _describe(kind: str, law: type, to: Console) -> None:
    import inspect
    import re

    from rich import box
    from rich.table import Table

    from scissordyn.config.table import key_help, key_sample, quantity_of, table_of

    to.print(f"{law.name}, a law of {kind}", style="bold", markup=False)  # type: ignore[attr-defined]
    # the docstring is written for sphinx; here the formula stands as LaTeX below its sentence
    to.print(re.sub(r"^\.\. math::\s*", "", inspect.getdoc(law) or "", flags=re.MULTILINE), markup=False)
    to.print(f"Source: {law.source}", markup=False)  # type: ignore[attr-defined]
    keys = table_of(law)
    table = Table("parameter", "default", "allowed", "meaning", box=box.SIMPLE_HEAD, pad_edge=False)
    for key, field in keys.model_fields.items():
        quantity = quantity_of(keys, key)
        allowed = quantity.allowed.removeprefix("a finite number").strip() if quantity else ""
        default = "" if field.is_required() or field.default is None else key_sample(keys, key)
        table.add_row(key, default, allowed.replace("[", r"\["), key_help(keys, key))
    if keys.model_fields:
        to.print(table)
    example = f'{kind} = {{ law = "{law.name}" }}' if keys.model_fields else f'{kind} = "{law.name}"'  # type: ignore[attr-defined]
    to.print(f"In a case file: {example}", markup=False)
