"""Laws, controllers, materials and oils in a case file: a name, or a table of parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import partial
from typing import Any

from scissordyn.config.code import AbsentPart, code_of
from scissordyn.config.table import Context, Reader, Shape, build, plain_table, read_as, reader, toml, with_key
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.laws.catalogue import BY_KIND, MATERIALS
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.material import Material
from scissordyn.laws.oil import OILS, Oil, oil_of
from scissordyn.model.lubrication import Lubrication
from scissordyn.plugin.element import SLOTS

USUAL = {"stiffness": "liu", "damping": "flores", "friction": "none"}
"""A law of each kind, to be suggested: the default of a clearance joint."""

CONTROLLER: dict[str, Any] = {"name": "pid", "proportional": "2e4 N m/rad", "derivative": "1500 N m s/rad"}
"""A controller as an example."""


def _read_element(slot: str, given: Any, context: Context) -> Any:
    """A law or a controller; of damping with the restitution coefficient of the table around it, if there is one."""
    key, classes, file, sample = (
        ("name", CONTROLLERS, "my_control.py:steer", f"controller = {toml(CONTROLLER)}")
        if slot == "controller"
        else ("law", BY_KIND[slot], "my_laws.py:soft", f'{slot} = "{USUAL[slot]}"')
    )
    title, allowed = SLOTS[slot].slot.title, ", ".join(classes) + f", or a class or function in a file as {file}"
    parameters = dict(given) if isinstance(given, Mapping) else {key: given}
    name = parameters.pop(key, None)
    if not isinstance(name, str):
        raise InputError(f"no name of a {title}", allowed, sample)
    restitution = context.get("values", {}).get("restitution") if slot == "damping" else None
    if restitution is not None:
        if "restitution" in parameters:
            raise InputError(f"restitution given twice, for the joint and for its {title}", "one of them")
        parameters["restitution"] = restitution
    code = code_of(context)
    kind: Any = code.element(slot, name, parameters) if code.names(name) else classes.get(name)
    if isinstance(kind, AbsentPart):
        return kind
    if kind is None:
        near = get_close_matches(name, classes, n=1, cutoff=0.5) if slot != "controller" else []
        type_this = f'{slot} = "{near[0]}"' if near else sample
        raise InputError(f"unknown {title} '{name}'{did_you_mean(name, classes)}", allowed, type_this)
    if restitution is not None and "restitution" not in {field.name for field in dataclasses.fields(kind)}:
        what = f"restitution given for the joint, but {title} '{name}' has none"
        raise InputError(what, "leave out restitution, or another law")
    return build(kind, parameters, context)


def _named_tables(key: str, classes: Mapping[str, type]) -> Shape:
    """The name of one of several classes, or a table of its parameters; one in a file, whose keys are not known."""
    in_file = {"type": "string", "pattern": r"\.py:"}
    tables = [with_key(key, {"const": name}, plain_table(kind)) for name, kind in classes.items()]
    further = {"type": "object", "properties": {key: in_file}, "required": [key]}
    return {"anyOf": [{"enum": list(classes)}, in_file, *tables, further]}


def _table_or_name(kind: type, names: Iterable[str] | None) -> Shape:
    """A name, one of those that are known unless any text is, or a table whose own name may be left out."""
    text = {"type": "string"} if names is None else {"enum": list(names)}
    return {"anyOf": [text, with_key("name", {"type": "string"}, plain_table(kind), required=False)]}


@reader(lambda: _table_or_name(Material, MATERIALS))
def _read_material(given: Any, context: Context) -> Any:
    if isinstance(given, Mapping):
        return build(Material, {"name": "custom", **given}, context)
    if not isinstance(given, str) or given not in MATERIALS:
        allowed = ", ".join(MATERIALS) + ", or a table of youngs_modulus, poisson_ratio and density"
        raise InputError(f"unknown material{did_you_mean(str(given), MATERIALS)}", allowed)
    return MATERIALS[given]


@reader(lambda: _table_or_name(Oil, None))
def _read_oil(given: Any, context: Context) -> Any:
    if isinstance(given, Mapping):
        return build(Oil, {"name": "custom", **given}, context)
    if not isinstance(given, str):
        raise InputError(f"{given!r} as an oil", ", ".join(OILS) + ", or a table of viscosity_40, viscosity_100 and density")
    return oil_of(given)


@reader(lambda: {"anyOf": [{"type": "string"}, plain_table(Lubrication)]})
def _read_lubrication(given: Any, context: Context) -> Any:
    return build(Lubrication, {"oil": given} if isinstance(given, str) else given, context)


for _slot, _kind in ((Elastic, "stiffness"), (Damping, "damping"), (Friction, "friction")):
    read_as(_slot, Reader(partial(_read_element, _kind), partial(_named_tables, "law", BY_KIND[_kind])))
read_as(Controller, Reader(partial(_read_element, "controller"), partial(_named_tables, "name", CONTROLLERS)))
read_as(Material, _read_material)
read_as(Oil, _read_oil)
read_as(Lubrication, _read_lubrication)
