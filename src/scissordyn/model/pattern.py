"""Patterns that name several joints or bodies at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from scissordyn.errors import InputError, did_you_mean

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
