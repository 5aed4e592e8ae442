"""Which parts are meant, by patterns of names, and which numbers: ``A.clearance``, ``drive.speed``, ``servo.controller.limit``.

A parameter path names a part and a field of it, and goes on into what the field holds. The kind before the name tells parts
of the same name apart (``joint.A.clearance``, ``body.slider.mass``), a pattern takes several at once
(``joint.all.clearance``). The fields of a joint or guide are those of its clearance; those of a drive, of its motion. Places
go on with ``x`` and ``y``, the points of a body with their names (``crank.centre.x``, ``crank.points.end.x``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.walk import Declared, Route, at, declared, is_described, replaced
from scissordyn.model.walk import Place as Place
from scissordyn.units import Quantity, quantities

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism


GROUPS = {
    "all": ("*",),
    "pivots": ("*/pivot",),
    "ends": ("*/upper", "*/lower", "*/left", "*/right"),
}
"""Group names of the joints of arrays: all, those inside the units, those between units."""


def matching(what: str, patterns: str | Iterable[str], names: Sequence[str]) -> tuple[str, ...]:
    wanted: set[str] = set()
    for pattern in (patterns,) if isinstance(patterns, str) else tuple(patterns):
        if not isinstance(pattern, str):
            raise InputError(f"{what} {pattern!r}", "text: a name or a pattern")
        shapes = (pattern,) if pattern in names else GROUPS.get(pattern, (pattern,))
        matches = {name for name in names if name == pattern}
        matches = matches or {name for name in names if any(fnmatchcase(name, shape) for shape in shapes)}
        if not matches:
            names_and_groups = (*names, *GROUPS)
            raise InputError(
                f"{what} '{pattern}'{did_you_mean(pattern, names_and_groups)}",
                "one of " + (", ".join(names) or "none") + "; or " + ", ".join(GROUPS) + "; or a pattern such as 'unit 1/*'",
            )
        wanted |= matches
    if not wanted:
        raise InputError(f"no {what} named", "one or more names or patterns")
    return tuple(name for name in names if name in wanted)


DRIVE = "drive"

INSIDE = {"joints": "clearance", "guides": "clearance", "drives": "motion", "coordinate_drives": "motion"}
"""The field of a part whose fields a parameter path goes on with."""

KINDS = {"joint": "joints", "clearance": "joints", "guide": "guides", "body": "bodies", "weld": "welds", DRIVE: "drives"}
KINDS |= {"coupling": "couplings", "coordinate_drive": "coordinate_drives"}
"""Fields of a mechanism by the kind in front of a name; rods, latches and components go by their sections."""

OF_LAWS = {"restitution": "damping"}  # Keys that a case file has beside a law's name, by the law that they belong to
AXES = ("x", "y")  # The two numbers of a place

EACH_SAMPLE = '"clearance.all.clearance" = { values = "0.3 mm +- 20 %", each = true }'

SAMPLE = "'A.clearance', 'drive.speed', 'body.slider.mass', 'servo.controller.limit', 'gravity'"


def find(mechanism: Mechanism, parameter: str) -> list[Place]:
    """The places that a parameter path means."""
    try:
        return _find(mechanism, parameter)
    except InputError:
        if "each" not in parameter.split(".")[1:]:
            raise
        allowed = "all as the name, and each = true beside the values, in a study, for places that vary independently"
        raise InputError(f"'{parameter}': each is no name", allowed, EACH_SAMPLE) from None


def _find(mechanism: Mechanism, parameter: str) -> list[Place]:
    field = declared(type(mechanism)).get(parameter)
    if field is not None:
        return [Place((parameter,), getattr(mechanism, parameter), field.quantity)]
    routes = list(_parts(mechanism, parameter))
    if not routes:
        kind, _, rest = parameter.partition(".")
        if kind in KINDS and rest and "." not in rest:
            what = f"'{parameter}': which {kind} is not said"
            raise InputError(what, f"{kind}.NAME.{rest}, or {kind}.all.{rest}", f"{kind}.all.{rest}")
        name = parameter.rsplit(".", 1)[0] if "." in parameter else parameter
        names = list(dict.fromkeys(part for part, _, _, kind in _named(mechanism) if kind != DRIVE))
        names += [DRIVE] * bool(mechanism.drives) + list(_numbers(mechanism))
        first, _, rest = name.partition(".")
        near = [f"{kind}.{rest}" for kind in _kinds(mechanism) if rest and did_you_mean(first, [kind])]
        raise InputError(
            f"no part '{name}' for '{parameter}'{did_you_mean(name, [*names, *near])}",
            "one of " + ", ".join(names),
            f"a parameter path such as {SAMPLE}",
        )
    return [_place(mechanism, path, parameter) for path in routes]


def number(mechanism: Mechanism, parameter: str) -> Place:
    """The first place of a parameter path, which is to be a number with a unit."""
    first = find(mechanism, parameter)[0]
    if first.value is None:
        raise _not_given(parameter)
    if first.quantity is None or isinstance(first.value, bool) or not isinstance(first.value, int | float):
        fields = _numbers(at(mechanism, first.path[:-1]))
        raise InputError(
            f"'{parameter}' is not a number with a unit", ", ".join(fields) or f"a parameter path such as {SAMPLE}"
        )
    _free(first, parameter)
    return first


def single(mechanism: Mechanism, parameter: str) -> list[str]:
    """A parameter path for each of the places that a parameter path means."""
    places = find(mechanism, parameter)
    if len(places) == 1:
        return [parameter]
    kind, parameters = parameter.partition(".")[0], []
    for place in places:
        field, index, *rest = place.path
        part = getattr(mechanism, str(field))[index]
        path = rest[1:] if str(field) in INSIDE else rest
        words = (AXES[step] if isinstance(step, int) else step for step in path)
        parameters.append(".".join([kind, part.name, *words]))
    return parameters


def changed(mechanism: Mechanism, parameter: str, value: Any) -> Mechanism:
    """The same mechanism with another value at a parameter path; at all its places, for a pattern."""
    return changed_all(mechanism, {parameter: value})


def changed_all(
    mechanism: Mechanism, changes: Mapping[str, Any], places: Mapping[str, Sequence[Place]] | None = None
) -> Mechanism:
    """The same mechanism with other values at some parameter paths."""
    new: dict[str, Any] = {}
    numbers = True
    for parameter, value in changes.items():
        for place in find(mechanism, parameter) if places is None else places[parameter]:
            _free(place, parameter)
            field, *path = place.path
            numbers = numbers and place.quantity is not None and bool(path)
            new[str(field)] = replaced(new.get(str(field), getattr(mechanism, str(field))), path, value)
    # numbers are checked by the part that they belong to; what parts refer to stays as it is
    return mechanism.with_parts(new, check=not numbers)


def _free(place: Place, parameter: str) -> None:
    """Refuse a number that stands in other places, too."""
    if place.quantity is not None and place.quantity.tied:
        raise InputError(f"'{parameter}' changed alone", place.quantity.tied)


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


def _parts(mechanism: Mechanism, parameter: str) -> Iterator[Route]:
    """The path to each part that a parameter path can mean, and on from there."""
    parts = list(_named(mechanism))
    kind, _, rest = parameter.partition(".")
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
                        yield field, index, *path
                return
    # a joint and its guide, or a body and its drive, may share a name: those with fields to go on with come first
    candidates = [(name, field, index) for name, field, index, _ in parts if parameter.startswith(f"{name}.")]
    if candidates:
        longest = max(len(name) for name, _, _ in candidates)
        path = tuple(parameter[longest + 1 :].split("."))
        here = [(field, index) for name, field, index in candidates if len(name) == longest and field != "drives"]
        fitting = [(field, index) for field, index in here if _has(mechanism, field, index, path[0])]
        for field, index in (fitting or here)[:1]:
            yield field, index, *path


def _driven(mechanism: Mechanism, rest: str) -> Iterator[Route]:
    """The drive that 'BODY.FIELD', or 'FIELD' of the only or default one, means."""
    bodies = [drive.body for drive in mechanism.drives]
    for index, body in enumerate(bodies):
        if rest.startswith(f"{body}."):
            yield "drives", index, *rest[len(body) + 1 :].split(".")
            return
    default = bodies[0] if len(bodies) == 1 else mechanism.input_body
    if default in bodies:
        yield "drives", bodies.index(default), *rest.split(".")
        return
    raise InputError(
        f"'{DRIVE}.{rest}': {'several drives' if bodies else 'no drive'}",
        ", ".join(f"{DRIVE}.{body}.{rest}" for body in bodies) or "a mechanism that is driven()",
    )


def _has(mechanism: Mechanism, field: str, index: int, name: str) -> bool:
    part = getattr(mechanism, field)[index]
    return OF_LAWS.get(name, name) in _fields(getattr(part, INSIDE[field], None) if field in INSIDE else part)


def _place(mechanism: Mechanism, path: Route, parameter: str) -> Place:
    inside = INSIDE.get(str(path[0]))
    if inside is not None:
        part = at(mechanism, path[:2])
        path = (*path[:2], inside, *path[2:])
        if getattr(part, inside) is None:
            raise InputError(f"'{parameter}': '{part.name}' is ideal", "a joint or guide with clearance")
    walked, quantity = path[:2], None
    for word in path[2:]:
        owner = at(mechanism, walked)
        if owner is None:
            raise _not_given(parameter)
        if word in OF_LAWS and word not in _fields(owner) and OF_LAWS[str(word)] in _fields(owner):
            walked = (*walked, OF_LAWS[str(word)])
            owner = at(mechanism, walked)
        step, quantity = _step(owner, str(word), quantity, parameter)
        walked = (*walked, step)
    return Place(walked, at(mechanism, walked), quantity)


def _not_given(parameter: str) -> InputError:
    return InputError(f"'{parameter}', of which the mechanism gives no value", "a value in the mechanism to start from")


def _step(owner: Any, word: str, quantity: Quantity | None, parameter: str) -> tuple[str | int, Quantity | None]:
    """The field, key or index that a word of a parameter path means, and its quantity."""
    if quantity is not None and isinstance(owner, Mapping | tuple):
        steps = tuple(owner) if isinstance(owner, Mapping) else AXES
        kind = "points" if isinstance(owner, Mapping) else "a place"
        step: str | int = word if isinstance(owner, Mapping) or word not in AXES else AXES.index(word)
        inner: Quantity | None = quantity
    else:
        fields = _fields(owner)
        steps, kind, step = tuple(fields), type(owner).__name__, word
        inner = fields[word].quantity if word in fields else None
    if word not in steps and not steps:
        raise InputError(f"'{parameter}': nothing is called '{word}' inside a number or a text", "a path that ends before it")
    if word not in steps:
        raise InputError(
            f"'{parameter}': no field '{word}' in {kind}{did_you_mean(word, steps)}", ", ".join(steps) or "no field"
        )
    return step, inner


def _fields(owner: Any) -> Mapping[str, Declared]:
    return declared(type(owner)) if is_described(owner) else {}


def _numbers(owner: Any) -> list[str]:
    """Fields that are numbers with a unit."""
    kind: Any = type(owner)
    return list(quantities(kind)) if is_described(owner) else []
