"""The one language for which number of a mechanism is meant: ``A.clearance``, ``drive.speed``, ``servo.controller.limit``.

An address names a part and a field of it, and goes on into what the field holds. The kind before the name tells parts of the
same name apart (``joint.A.clearance``, ``body.slider.mass``), a pattern takes several at once (``joint.all.clearance``). The
fields of a joint or guide are those of its clearance; those of a drive, of its motion.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.pattern import matching
from scissordyn.units import Quantity, quantities

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism

__all__ = ["KINDS", "Place", "changed", "changed_all", "find", "number"]

DRIVE = "drive"

INSIDE = {"joints": "clearance", "guides": "clearance", "drives": "motion"}
"""The field of a part whose fields an address goes on with."""

KINDS = {"joint": "joints", "clearance": "joints", "guide": "guides", "body": "bodies", "weld": "welds", DRIVE: "drives"}
"""Fields of a mechanism by the kind in front of a name; rods, latches and components go by their sections."""

SAMPLE = "'A.clearance', 'drive.speed', 'body.slider.mass', 'servo.controller.limit', 'gravity'"


@dataclass(frozen=True)
class Place:
    """Where an address leads.

    Parameters
    ----------
    field : str
        Field of the mechanism.
    index : int or None
        Which of its entries; None for the field itself.
    path : tuple of str
        Fields from there on.
    value
        What is there now.
    quantity : Quantity or None
        Its unit, bounds and meaning, if it is declared.
    """

    field: str
    index: int | None
    path: tuple[str, ...]
    value: Any
    quantity: Quantity | None


def find(mechanism: Mechanism, address: str) -> list[Place]:
    """All places that an address means.

    Parameters
    ----------
    mechanism : Mechanism
    address : str

    Returns
    -------
    list of Place
        One, or several for a pattern.

    Raises
    ------
    InputError
        If there is no such part or field; names what there is.
    """
    own, whole = {field.name for field in dataclasses.fields(mechanism)}, cast(Any, mechanism)
    if address in own:
        return [Place(address, None, (), getattr(mechanism, address), quantities(whole.__class__).get(address))]
    found = list(_parts(mechanism, address))
    if not found:
        name = address.rsplit(".", 1)[0] if "." in address else address
        known = list(dict.fromkeys(each for each, _, _, kind in _named(mechanism) if kind != DRIVE))
        known += [DRIVE] * bool(mechanism.drives) + list(quantities(whole.__class__))
        first, _, rest = name.partition(".")
        near = [f"{kind}.{rest}" for kind in _kinds(mechanism) if rest and did_you_mean(first, [kind])]
        raise InputError(
            f"no part '{name}' for '{address}'{did_you_mean(name, [*known, *near])}",
            "one of " + ", ".join(known),
            f"an address such as {SAMPLE}",
        )
    return [_place(mechanism, field, index, path, address) for field, index, path in found]


def number(mechanism: Mechanism, address: str) -> Place:
    """The first place of an address, which is to be a number with a unit.

    Parameters
    ----------
    mechanism : Mechanism
    address : str

    Returns
    -------
    Place

    Raises
    ------
    InputError
        If there is no number with a unit.
    """
    first = find(mechanism, address)[0]
    if first.quantity is None or isinstance(first.value, bool) or not isinstance(first.value, int | float):
        owner = _owner(mechanism, first)
        declared = quantities(owner.__class__) if dataclasses.is_dataclass(owner) else {}
        raise InputError(f"'{address}' is not a number with a unit", ", ".join(declared) or f"an address such as {SAMPLE}")
    return first


def changed(mechanism: Mechanism, address: str, value: Any) -> Mechanism:
    """The same mechanism with another value at an address; at all its places, for a pattern.

    Parameters
    ----------
    mechanism : Mechanism
    address : str
    value
        In SI.

    Returns
    -------
    Mechanism
    """
    return changed_all(mechanism, {address: value})


def changed_all(
    mechanism: Mechanism, changes: Mapping[str, Any], places: Mapping[str, Sequence[Place]] | None = None
) -> Mechanism:
    """The same mechanism with other values at some addresses.

    Parameters
    ----------
    mechanism : Mechanism
    changes : mapping of str to value
        In SI, by address.
    places : mapping of str to sequence of Place, optional
        What `find` has found for the addresses.

    Returns
    -------
    Mechanism
    """
    new: dict[str, Any] = {}
    numbers = True
    for address, value in changes.items():
        for place in find(mechanism, address) if places is None else places[address]:
            numbers = numbers and place.quantity is not None and place.index is not None
            if place.index is None:
                new[place.field] = value
                continue
            parts = list(new.get(place.field, getattr(mechanism, place.field)))
            parts[place.index] = _inside(parts[place.index], place.path, value)
            new[place.field] = tuple(parts)
    # numbers are checked by the part that they belong to; what parts refer to stays as it is
    return mechanism.with_parts(new, check=not numbers)


def _named(mechanism: Mechanism) -> Iterator[tuple[str, str, int, str]]:
    """Name, field, index and kind of every part."""
    for kind, field in KINDS.items():
        if kind != "clearance":
            for index, part in enumerate(getattr(mechanism, field)):
                yield part.body if kind == DRIVE else part.name, field, index, kind
    for field in ("components", "rods", "latches"):
        for index, part in enumerate(getattr(mechanism, field)):
            yield part.name, field, index, part.declaration.section


def _kinds(mechanism: Mechanism) -> dict[str, None]:
    """The words that may stand in front of the name of a part."""
    return dict.fromkeys([*KINDS, *(kind for *_, kind in _named(mechanism))])


def _parts(mechanism: Mechanism, address: str) -> Iterator[tuple[str, int, tuple[str, ...]]]:
    """Field, index and path of each part that an address can mean."""
    parts = list(_named(mechanism))
    kind, _, rest = address.partition(".")
    if kind == DRIVE and rest:
        yield from _driven(mechanism, rest)
        return
    if rest and kind in _kinds(mechanism) and kind not in {name for name, *_ in parts}:
        chosen = [part for part in parts if part[3] == kind or KINDS.get(kind) == part[1]]
        words = rest.split(".")
        for cut in range(len(words) - 1, 0, -1):
            pattern, path = ".".join(words[:cut]), tuple(words[cut:])
            names = [name for name, *_ in chosen]
            exact = pattern in names
            if exact or cut == 1:
                wanted = set(matching(kind, pattern, names))
                of_clearance = KINDS.get(kind) == "joints" and not exact
                for name, field, index, _ in chosen:
                    if name in wanted and not (of_clearance and mechanism.joints[index].clearance is None):
                        yield field, index, path
                return
    # a joint and its guide, or a body and its drive, may share a name: those with fields to go on with come first
    candidates = [(name, field, index) for name, field, index, _ in parts if address.startswith(f"{name}.")]
    if candidates:
        longest = max(len(name) for name, _, _ in candidates)
        path = tuple(address[longest + 1 :].split("."))
        here = [(field, index) for name, field, index in candidates if len(name) == longest and field != "drives"]
        fitting = [(field, index) for field, index in here if _has(mechanism, field, index, path[0])]
        for field, index in (fitting or here)[:1]:
            yield field, index, path


def _driven(mechanism: Mechanism, rest: str) -> Iterator[tuple[str, int, tuple[str, ...]]]:
    """The drive that 'BODY.FIELD', or 'FIELD' of the only or default one, means."""
    bodies = [drive.body for drive in mechanism.drives]
    for index, body in enumerate(bodies):
        if rest.startswith(f"{body}."):
            yield "drives", index, tuple(rest[len(body) + 1 :].split("."))
            return
    default = bodies[0] if len(bodies) == 1 else mechanism.input_body
    if default in bodies:
        yield "drives", bodies.index(default), tuple(rest.split("."))
        return
    raise InputError(
        f"'{DRIVE}.{rest}': {'several drives' if bodies else 'no drive'}",
        ", ".join(f"{DRIVE}.{body}.{rest}" for body in bodies) or "a mechanism that is driven()",
    )


def _has(mechanism: Mechanism, field: str, index: int, name: str) -> bool:
    part = getattr(mechanism, field)[index]
    inner = getattr(part, INSIDE[field], None) if field in INSIDE else part
    return dataclasses.is_dataclass(inner) and name in {each.name for each in dataclasses.fields(inner)}


def _place(mechanism: Mechanism, field: str, index: int, path: tuple[str, ...], address: str) -> Place:
    part = getattr(mechanism, field)[index]
    inside = INSIDE.get(field)
    if inside is not None:
        path = (inside, *path)
        if getattr(part, inside) is None:
            raise InputError(f"'{address}': '{part.name}' is ideal", "a joint or guide with clearance")
    owner, value = None, part
    for name in path:
        owner, value = value, _field(value, name, address)
    declared = quantities(owner.__class__) if dataclasses.is_dataclass(owner) else {}
    return Place(field, index, path, value, declared.get(path[-1]))


def _owner(mechanism: Mechanism, place: Place) -> Any:
    owner: Any = mechanism if place.index is None else getattr(mechanism, place.field)[place.index]
    for name in place.path[:-1]:
        owner = getattr(owner, name)
    return owner


def _field(owner: Any, name: str, address: str) -> Any:
    names = [field.name for field in dataclasses.fields(owner)] if dataclasses.is_dataclass(owner) else []
    if name not in names:
        kind = type(owner).__name__
        raise InputError(f"'{address}': no field '{name}' in {kind}{did_you_mean(name, names)}", ", ".join(names) or "no field")
    return getattr(owner, name)


def _inside(described: Any, path: tuple[str, ...], value: Any) -> Any:
    name, *rest = path
    inner = _inside(getattr(described, name), tuple(rest), value) if rest else value
    return dataclasses.replace(described, **{name: inner})
