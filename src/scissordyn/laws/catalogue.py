"""List every law and material by name; each law is defined only in its own file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.errors import InputError, did_you_mean
from scissordyn.laws import damping, elastic, friction
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.material import MATERIALS as MATERIALS
from scissordyn.plugin.element import Slot, element_named, elements_in
from scissordyn.plugin.user_file import class_in
from scissordyn.units import checked

ELASTIC: Mapping[str, type[Elastic]] = elements_in(elastic)  # Laws of the elastic part of the normal force, by name
DAMPING: Mapping[str, type[Damping]] = elements_in(damping)  # Laws of the damping part of the normal force, by name
FRICTION: Mapping[str, type[Friction]] = elements_in(friction)  # Friction laws, by name

BY_KIND: Mapping[str, Mapping[str, type[Any]]] = MappingProxyType(
    {"stiffness": ELASTIC, "damping": DAMPING, "friction": FRICTION}
)
"""Laws of the three kinds, by their names in a clearance."""


@checked
def law(kind: str, name: str) -> type[Any]:
    """Return the law class of a given kind and name.

    Parameters
    ----------
    kind : {"stiffness", "damping", "friction"}
    name : str
        Name in the catalogue, or ``"file.py:NAME"`` for a user-defined law; the file is executed.

    Returns
    -------
    type
        Frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If no such law exists; the message suggests the nearest name.
    """
    if kind not in BY_KIND:
        raise InputError(f"unknown kind of law '{kind}'{did_you_mean(kind, BY_KIND)}", ", ".join(BY_KIND), "'stiffness'")
    return element_named(kind, f"{kind} law", name, BY_KIND[kind])


def kind_in(reference: str) -> str:
    """Return the kind of the law that ``"file.py:NAME"`` names, a key of `BY_KIND`; the file is executed."""
    law_class, name = class_in("law", reference, Path.cwd())
    slot = getattr(law_class, "slot", None)
    if not isinstance(slot, Slot) or slot.name not in BY_KIND:
        raise InputError(
            f"'{name}' is not a law", "a class or a function decorated with sd.element", '@sd.element(slot="friction", ...)'
        )
    return slot.name
