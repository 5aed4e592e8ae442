"""Every law and material by name: one entry for each law in the files of the folders.

A law has no other place than its file.
"""

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

ELASTIC: Mapping[str, type[Elastic]] = elements_in(elastic)  # Elastic parts of the normal force, by name
DAMPING: Mapping[str, type[Damping]] = elements_in(damping)  # Damping parts of the normal force, by name
FRICTION: Mapping[str, type[Friction]] = elements_in(friction)  # Friction laws, by name

BY_KIND: Mapping[str, Mapping[str, type[Any]]] = MappingProxyType(
    {"stiffness": ELASTIC, "damping": DAMPING, "friction": FRICTION}
)
"""The three kinds, by their names in a clearance."""


def law(kind: str, name: str) -> type[Any]:
    """The law of a kind and a name.

    Parameters
    ----------
    kind : {"stiffness", "damping", "friction"}
    name : str
        Of the package's, or ``"file.py:NAME"`` for one of your own; the file is executed.

    Returns
    -------
    type
        A frozen dataclass; call it with its parameters.

    Raises
    ------
    InputError
        If there is none; names the nearest.
    """
    if kind not in BY_KIND:
        raise InputError(f"no kind of law '{kind}'{did_you_mean(kind, BY_KIND)}", ", ".join(BY_KIND), "'stiffness'")
    return element_named(kind, f"{kind} law", name, BY_KIND[kind])


def kind_in(reference: str) -> str:
    """What the law that ``"file.py:NAME"`` names is for: a key of `BY_KIND`; the file is executed."""
    law_class, name = class_in("law", reference, Path.cwd())
    slot = getattr(law_class, "slot", None)
    if not isinstance(slot, Slot) or slot.name not in BY_KIND:
        raise InputError(f"'{name}' is no law", "a class or a function under sd.element", '@sd.element(slot="friction", ...)')
    return slot.name
