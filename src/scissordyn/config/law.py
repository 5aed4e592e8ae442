"""Laws, materials and oils in a case file: a name, or a table of parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from scissordyn.config.code import AbsentPart, code_of
from scissordyn.config.table import Context, Reader, Shape, build, plain_table, read_as, reader, with_key
from scissordyn.errors import InputError, did_you_mean
from scissordyn.laws import catalogue
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.material import Material
from scissordyn.laws.oil import OILS, Oil, oil_of
from scissordyn.model.lubrication import Lubrication

USER_FILE = "a class or function in a file as my_laws.py:soft"

USUAL = {"stiffness": "liu", "damping": "flores", "friction": "none"}
"""A law of each kind, to be suggested: the default of a clearance joint."""


def read_law(given: Any, kind: str, context: Context, **shorthand: Any) -> Any:
    """A law from the value in a case file."""
    laws = catalogue.BY_KIND[kind]
    sample = f'{kind} = "{USUAL[kind]}"'
    parameters = dict(given) if isinstance(given, Mapping) else {"law": given}
    name = parameters.pop("law", None)
    if not isinstance(name, str):
        raise InputError(f"no name of a {kind} law", ", ".join(laws) + f", or {USER_FILE}", sample)
    twice = sorted(parameters.keys() & shorthand.keys())
    if twice:
        raise InputError(f"{twice[0]} given twice, for the joint and for its {kind} law", "one of them")
    parameters.update(shorthand)
    code = code_of(context)
    law: Any = code.element(kind, name, parameters) if code.names(name) else laws.get(name)
    if isinstance(law, AbsentPart):
        return law
    if law is None:
        near = get_close_matches(name, laws, n=1, cutoff=0.5)
        raise InputError(
            f"unknown {kind} law '{name}'{did_you_mean(name, laws)}",
            ", ".join(laws) + f", or {USER_FILE}",
            f'{kind} = "{near[0]}"' if near else sample,
        )
    declared = {field.name for field in dataclasses.fields(law)}
    for key in shorthand:
        if key not in declared:
            raise InputError(f"{key} given for the joint, but {kind} law '{name}' has none", f"leave out {key}, or another law")
    return build(law, parameters, {})


def named_tables(key: str, classes: Mapping[str, type]) -> Shape:
    """The name of one of several classes, or a table of its parameters; one in a file, whose keys are not known."""
    in_file = {"type": "string", "pattern": r"\.py:"}
    tables = [with_key(key, {"const": name}, plain_table(kind)) for name, kind in classes.items()]
    further = {"type": "object", "properties": {key: in_file}, "required": [key]}
    return {"anyOf": [{"enum": list(classes)}, in_file, *tables, further]}


def _law_reader(kind: str) -> Reader:
    def read(given: Any, context: Context) -> Any:
        """A law, of damping with the restitution coefficient of the table if there is one."""
        restitution = context.get("values", {}).get("restitution") if kind == "damping" else None
        return read_law(given, kind, context, **({} if restitution is None else {"restitution": restitution}))

    return Reader(read, lambda: named_tables("law", catalogue.BY_KIND[kind]))


def table_or_name(kind: type, names: Iterable[str] | None) -> Shape:
    """A name, one of those that are known unless any text is, or a table whose own name may be left out."""
    text = {"type": "string"} if names is None else {"enum": list(names)}
    return {"anyOf": [text, with_key("name", {"type": "string"}, plain_table(kind), required=False)]}


@reader(lambda: table_or_name(Material, catalogue.MATERIALS))
def _read_material(given: Any, context: Context) -> Material:
    if isinstance(given, Mapping):
        material: Material = build(Material, {"name": "custom", **given}, context)
        return material
    materials = catalogue.MATERIALS
    if not isinstance(given, str) or given not in materials:
        raise InputError(
            f"unknown material{did_you_mean(str(given), materials)}",
            ", ".join(materials) + ", or a table of youngs_modulus, poisson_ratio and density",
        )
    named: Material = materials[given]
    return named


@reader(lambda: table_or_name(Oil, None))
def _read_oil(given: Any, context: Context) -> Oil:
    if isinstance(given, Mapping):
        oil: Oil = build(Oil, {"name": "custom", **given}, context)
        return oil
    if not isinstance(given, str):
        raise InputError(f"{given!r} as an oil", ", ".join(OILS) + ", or a table of viscosity_40, viscosity_100 and density")
    return oil_of(given)


@reader(lambda: {"anyOf": [{"type": "string"}, plain_table(Lubrication)]})
def _read_lubrication(given: Any, context: Context) -> Lubrication:
    """An oil, or a table."""
    film: Lubrication = build(Lubrication, {"oil": given} if isinstance(given, str) else given, context)
    return film


for _slot, _kind in ((Elastic, "stiffness"), (Damping, "damping"), (Friction, "friction")):
    read_as(_slot, _law_reader(_kind))
read_as(Material, _read_material)
read_as(Oil, _read_oil)
read_as(Lubrication, _read_lubrication)
