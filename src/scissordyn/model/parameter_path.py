"""Parameter paths such as ``A.clearance``, ``drive.speed``, ``servo.controller.limit``, and name patterns of parts.

A parameter path names a part, a field of it, and fields inside that field. A kind before the name distinguishes
parts of the same name (``joint.A.clearance``, ``body.slider.mass``). A pattern selects several parts
(``joint.all.clearance``). The fields of a joint or guide are those of its clearance, the fields of a drive those of its motion.
Points have the fields ``x`` and ``y``, ``points`` of a body its point names (``crank.centre.x``, ``crank.points.end.x``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import combinations
from typing import Any, TypeVar

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.parts import Parts
from scissordyn.model.walk import Declared, Route, at, declared, is_described, replaced
from scissordyn.model.walk import Place as Place
from scissordyn.units import Quantity, quantities

AnyParts = TypeVar("AnyParts", bound=Parts)

GROUPS = {
    "all": ("*",),
    "pivots": ("*/pivot",),
    "ends": ("*/upper", "*/lower", "*/left", "*/right"),
}
"""Name patterns of the groups of joints in an array: all joints, pivots inside the units, joints between units."""


def matching(what: str, patterns: str | Iterable[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the names that match a name, group or pattern, or several of them; raise `InputError` if one matches nothing."""
    matched: set[str] = set()
    for pattern in (patterns,) if isinstance(patterns, str) else tuple(patterns):
        if not isinstance(pattern, str):
            raise InputError(f"{what} {pattern!r} is not a name or a pattern", "a text", f"'{names[0]}'" if names else "'all'")
        shapes = (pattern,) if pattern in names else GROUPS.get(pattern, (pattern,))
        matches = {name for name in names if name == pattern}
        matches = matches or {name for name in names if any(fnmatchcase(name, shape) for shape in shapes)}
        if not matches:
            names_and_groups = (*names, *GROUPS)
            if all(part.strip() in names_and_groups for part in pattern.split(",")):
                expected = f"one name or pattern; in a case file one table for each {what}"
                raise InputError(f"{what} '{pattern}': several names in one text", expected)
            raise InputError(
                f"unknown {what} '{pattern}'{did_you_mean(pattern, names_and_groups)}",
                "one of " + (", ".join(names) or "none") + "; or " + ", ".join(GROUPS) + "; or a pattern such as 'unit 1/*'",
            )
        matched |= matches
    if not matched:
        raise InputError(f"no {what} given", "one or more names or patterns")
    return tuple(name for name in names if name in matched)


DRIVE = "drive"  # First word of the parameter path of a drive

INNER_FIELDS = {"joints": "clearance", "guides": "clearance", "drives": "motion", "coordinate_drives": "motion"}
"""Field of a part whose own fields a parameter path can name without it, as ``A.restitution``; by field of `Mechanism`."""

# Field of the mechanism for each kind that may precede a name; kinds of rods, latches and components are section names
FIELD_OF_KIND = {
    "joint": "joints",
    "clearance": "joints",
    "guide": "guides",
    "body": "bodies",
    "weld": "welds",
    DRIVE: "drives",
}
FIELD_OF_KIND |= {"coupling": "couplings", "coordinate_drive": "coordinate_drives"}


LAW_OF_FIELD = {"restitution": "damping"}  # Kind of the law whose field a parameter path can name without the law, by the field
AXES = ("x", "y")  # Words for the coordinates of a point in a parameter path

# Examples in error messages: a parameter of a study that varies in each joint, and parameter paths
EACH_EXAMPLE = '"clearance.all.clearance" = { values = "0.3 mm +- 20 %", each = true }'

# Correct parameter paths, which error texts show
PATH_EXAMPLES = "'A.clearance', 'drive.speed', 'body.slider.mass', 'servo.controller.limit', 'gravity'"


def find(mechanism: Parts, parameter: str) -> list[Place]:
    """Return the places that a parameter path selects."""
    try:
        return _find(mechanism, parameter)
    except InputError:
        if "each" not in parameter.split(".")[1:]:
            raise
        allowed = "'all' as the name, and each = true next to the values of a study, for values that vary independently"
        raise InputError(f"'{parameter}': 'each' is not a name", allowed, EACH_EXAMPLE) from None


def _find(mechanism: Parts, parameter: str) -> list[Place]:
    field = declared(type(mechanism)).get(parameter)
    if field is not None:
        return [Place((parameter,), getattr(mechanism, parameter), field.quantity)]
    routes = list(_parts(mechanism, parameter))
    if not routes:
        kind, _, rest = parameter.partition(".")
        if kind in FIELD_OF_KIND and rest and "." not in rest:
            what = f"'{parameter}': the name of the {kind} is missing"
            raise InputError(what, f"{kind}.NAME.{rest}, or {kind}.all.{rest}", f"{kind}.all.{rest}")
        name = parameter.rsplit(".", 1)[0] if "." in parameter else parameter
        names = list(dict.fromkeys(part for part, _, _, kind in _named(mechanism) if kind != DRIVE))
        names += [DRIVE] * bool(mechanism.drives)
        if parameter in names:
            what = f"'{parameter}' names a part, not a parameter"
            raise InputError(what, f"{parameter}.PARAMETER", f"a parameter path such as {PATH_EXAMPLES}")
        names += list(_numbers(mechanism))
        first, _, rest = name.partition(".")
        near = [f"{kind}.{rest}" for kind in _kinds(mechanism) if rest and did_you_mean(first, [kind])]
        raise InputError(
            f"no part '{name}' for '{parameter}'{did_you_mean(name, [*names, *near])}",
            "one of " + ", ".join(names),
            f"a parameter path such as {PATH_EXAMPLES}",
        )
    return [_place(mechanism, path, parameter) for path in routes]


def number(mechanism: Parts, parameter: str) -> Place:
    """Return the first place of a parameter path, which must be a number with a unit."""
    first = find(mechanism, parameter)[0]
    if first.value is None:
        raise _not_given(parameter)
    if first.quantity is None or isinstance(first.value, bool) or not isinstance(first.value, int | float):
        fields = _numbers(at(mechanism, first.path[:-1]))
        raise InputError(
            f"'{parameter}' is not a number with a unit", ", ".join(fields) or f"a parameter path such as {PATH_EXAMPLES}"
        )
    _check_independent(first, parameter)
    return first


def single(mechanism: Parts, parameter: str) -> list[str]:
    """Return one parameter path for each place that a parameter path selects."""
    places = find(mechanism, parameter)
    if len(places) == 1:
        return [parameter]
    kind, parameters = parameter.partition(".")[0], []
    for place in places:
        field, index, *rest = place.path
        part = getattr(mechanism, str(field))[index]
        path = rest[1:] if str(field) in INNER_FIELDS else rest
        words = (AXES[step] if isinstance(step, int) else step for step in path)
        parameters.append(".".join([kind, part.name, *words]))
    return parameters


def every_number(mechanism: Parts) -> list[str]:
    """Return the parameter paths of all real numbers of a mechanism that can change alone."""
    kinds = {kind: field for kind, field in FIELD_OF_KIND.items() if kind != "clearance"}
    paths = [name for name, field in declared(type(mechanism)).items() if _is_free(getattr(mechanism, name), field.quantity)]
    for name, field, index, kind in _named(mechanism):
        part = getattr(mechanism, field)[index]
        inside = getattr(part, INNER_FIELDS[field]) if field in INNER_FIELDS else part
        if inside is not None:
            before = f"{kind}.{name}" if kind in kinds else name
            paths += [f"{before}.{path}" for path in _paths(inside, None)]
    return [path for path in dict.fromkeys(paths) if _selects_one_place(mechanism, path)]


def _is_free(value: Any, quantity: Quantity | None) -> bool:
    return quantity is not None and isinstance(value, float) and not quantity.tied


def _paths(owner: Any, quantity: Quantity | None) -> Iterator[str]:
    """Yield the paths of the real numbers below a description, a point or a mapping of points."""
    if _is_free(owner, quantity):
        yield ""
        return
    inner: Iterable[tuple[str, Any, Quantity | None]] = ()
    if is_described(owner):
        inner = ((name, getattr(owner, name), field.quantity) for name, field in _fields(owner).items())
    elif quantity is not None and isinstance(owner, Mapping):
        inner = ((str(name), value, quantity) for name, value in owner.items())
    elif quantity is not None and isinstance(owner, tuple) and len(owner) == len(AXES):
        inner = ((axis, value, quantity) for axis, value in zip(AXES, owner, strict=True))
    for name, value, quantity_inside in inner:
        yield from (f"{name}.{path}".rstrip(".") for path in _paths(value, quantity_inside))


def _selects_one_place(mechanism: Parts, path: str) -> bool:
    try:
        return len(find(mechanism, path)) == 1
    except InputError:
        return False


def changed(mechanism: AnyParts, parameter: str, value: Any) -> AnyParts:
    """Return the mechanism with a new value at each place that a parameter path selects."""
    return changed_all(mechanism, {parameter: value})


def changed_all(
    mechanism: AnyParts, changes: Mapping[str, Any], places: Mapping[str, Sequence[Place]] | None = None
) -> AnyParts:
    """Return the mechanism with new values at several parameter paths."""
    new: dict[str, Any] = {}
    numbers = True
    for parameter, value in changes.items():
        for place in find(mechanism, parameter) if places is None else places[parameter]:
            _check_independent(place, parameter)
            field, *path = place.path
            numbers = numbers and place.quantity is not None and bool(path)
            new[str(field)] = replaced(new.get(str(field), getattr(mechanism, str(field))), path, value)
    # numbers are checked by their part; names are unchanged
    return mechanism.with_parts(new, check=not numbers)


def check_distinct(mechanism: Parts, paths: Iterable[str], *, disjoint: bool = False) -> None:
    """Raise `InputError` if all values of one path are those of a later path; with `disjoint`, if two paths share a value."""
    routes = {path: {place.path for place in find(mechanism, path)} for path in paths}
    for (path, values), (other, other_values) in combinations(routes.items(), 2):
        if values <= other_values or (disjoint and values & other_values):
            raise InputError(f"'{path}' and '{other}' change the same value", "different parameters, each once")


def _check_independent(place: Place, parameter: str) -> None:
    """Raise `InputError` for a value that must equal values of other parts."""
    if place.quantity is not None and place.quantity.tied:
        raise InputError(f"'{parameter}' cannot change alone", place.quantity.tied)


def _named(mechanism: Parts) -> Iterator[tuple[str, str, int, str]]:
    """Yield name, field, index and kind of every part."""
    for kind, field in FIELD_OF_KIND.items():
        if kind != "clearance":
            for index, part in enumerate(getattr(mechanism, field)):
                yield part.body if kind == DRIVE else part.name, field, index, kind
    for field in ("components", "rods", "latches"):
        for index, part in enumerate(getattr(mechanism, field)):
            yield part.name, field, index, part.declaration.section


def _kinds(mechanism: Parts) -> dict[str, None]:
    """Return the kinds ("joint", "body", ...) that may precede the name of a part in a parameter path of a mechanism."""
    return dict.fromkeys([*FIELD_OF_KIND, *(kind for *_, kind in _named(mechanism))])


def _parts(mechanism: Parts, parameter: str) -> Iterator[Route]:
    """Yield the route to each part that a parameter path names, extended by the field names at the end of the path."""
    parts = list(_named(mechanism))
    kind, _, rest = parameter.partition(".")
    if kind == DRIVE and rest:
        yield from _driven(mechanism, rest)
        return
    if rest and kind in _kinds(mechanism) and kind not in {name for name, *_ in parts}:
        chosen = [part for part in parts if part[3] == kind or FIELD_OF_KIND.get(kind) == part[1]]
        words = rest.split(".")
        for cut in range(len(words) - 1, 0, -1):
            pattern, path = ".".join(words[:cut]), tuple(words[cut:])
            names = [name for name, *_ in chosen]
            exact = pattern in names
            if exact or cut == 1:
                matched = set(matching(kind, pattern, names))
                of_clearance = FIELD_OF_KIND.get(kind) == "joints" and not exact
                for name, field, index, _ in chosen:
                    if name in matched and not (of_clearance and mechanism.joints[index].clearance is None):
                        yield field, index, *path
                return
    # parts of different kinds may share a name: prefer those that have the next field
    candidates = [(name, field, index) for name, field, index, _ in parts if parameter.startswith(f"{name}.")]
    if candidates:
        longest = max(len(name) for name, _, _ in candidates)
        path = tuple(parameter[longest + 1 :].split("."))
        here = [(field, index) for name, field, index in candidates if len(name) == longest and field != "drives"]
        fitting = [(field, index) for field, index in here if _has(mechanism, field, index, path[0])]
        for field, index in (fitting or here)[:1]:
            yield field, index, *path


def _driven(mechanism: Parts, rest: str) -> Iterator[Route]:
    """Yield the route of the drive 'BODY.FIELD', or of 'FIELD' for the only or default drive."""
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
        ", ".join(f"{DRIVE}.{body}.{rest}" for body in bodies) or "a mechanism with a drive",
        "" if bodies else '[drive] with speed = "60 rpm" in the case file',
    )


def _has(mechanism: Parts, field: str, index: int, name: str) -> bool:
    part = getattr(mechanism, field)[index]
    return LAW_OF_FIELD.get(name, name) in _fields(getattr(part, INNER_FIELDS[field], None) if field in INNER_FIELDS else part)


def _place(mechanism: Parts, path: Route, parameter: str) -> Place:
    """Return the place at the end of a route; raise `InputError` if a field does not exist or is None."""
    inside = INNER_FIELDS.get(str(path[0]))
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
        if word in LAW_OF_FIELD and word not in _fields(owner) and LAW_OF_FIELD[str(word)] in _fields(owner):
            walked = (*walked, LAW_OF_FIELD[str(word)])
            owner = at(mechanism, walked)
        step, quantity = _step(owner, str(word), quantity, parameter)
        walked = (*walked, step)
    return Place(walked, at(mechanism, walked), quantity)


def _not_given(parameter: str) -> InputError:
    """Return the error for a parameter without a value in the mechanism."""
    return InputError(f"'{parameter}' has no value in this mechanism", "a value in the mechanism to start from")


def _step(owner: Any, word: str, quantity: Quantity | None, parameter: str) -> tuple[str | int, Quantity | None]:
    """Return the field, key or index that a word of a parameter path selects, and its quantity."""
    if quantity is not None and isinstance(owner, Mapping | tuple):
        steps = tuple(owner) if isinstance(owner, Mapping) else AXES
        kind = "points" if isinstance(owner, Mapping) else "a point"
        step: str | int = word if isinstance(owner, Mapping) or word not in AXES else AXES.index(word)
        inner: Quantity | None = quantity
    else:
        fields = _fields(owner)
        steps, kind, step = tuple(fields), type(owner).__name__, word
        inner = fields[word].quantity if word in fields else None
    if word not in steps and not steps:
        raise InputError(f"'{parameter}': '{word}' follows a number or a text, which has no fields", f"a path without '{word}'")
    if word not in steps:
        raise InputError(
            f"'{parameter}': no field '{word}' in {kind}{did_you_mean(word, steps)}", ", ".join(steps) or "no field"
        )
    return step, inner


def _fields(owner: Any) -> Mapping[str, Declared]:
    """Return the declared fields of a description; empty for other values."""
    return declared(type(owner)) if is_described(owner) else {}


def _numbers(owner: Any) -> list[str]:
    """Return the names of fields that are numbers with a unit."""
    kind: Any = type(owner)
    return list(quantities(kind)) if is_described(owner) else []
