"""Regular expressions of numbers with a unit, without look-ahead: editors read them with several engines."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache

from scissordyn.config.quantity import CELSIUS, PREFIXES, SMALL_PREFIXES, UNITS, unit_factor
from scissordyn.errors import InputError

WORD = 3  # Letters of the longest symbol

DIGITS = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
ZERO = r"-(?:0+\.?0*|\.0+)(?:[eE][+-]?[0-9]+)?"
NUMBER = rf"[+-]?{DIGITS}"
OPERATORS = r"[ ²³^*/·()0-9-]+"  # What stands between two units


def _names(definition: str) -> list[str]:
    first, *others = (part.strip() for part in definition.split("="))
    return [name.removesuffix("-") for name in (first, *others[1:]) if name != "_"]


@cache
def _units() -> tuple[str, ...]:
    """Names of all units, without prefixes, longest first."""
    names = {name for definition in UNITS for name in _names(definition)}
    return tuple(sorted(names, key=lambda name: (-len(name), name)))


@cache
def _any_unit() -> str:
    return f"(?:{_prefix()}{_either(_units())})"


def _prefixed(names: list[str]) -> str:
    """Units with their prefixes, but for what is the name of another unit: min is no thousandth of an inch."""
    alternatives = []
    for name in names:
        taken = {other.removesuffix(name) for other in _units() if other.endswith(name) and other != name}
        alternatives.append(f"{_prefix(frozenset(taken))}{_either([name])}")
    return "|".join(alternatives)


def _either(names: Iterable[str]) -> str:
    """One of some names; words, and not symbols, may be in the plural: ms are milliseconds."""
    return f"(?:{'|'.join(re.escape(name) + ('s?' if len(name) > WORD else '') for name in names)})"


@cache
def _prefix(without: frozenset[str] = frozenset()) -> str:
    prefixes = {name for definition in (*PREFIXES, *SMALL_PREFIXES) for name in _names(definition)} - without
    return f"(?:{'|'.join(sorted(prefixes, key=lambda name: (-len(name), name)))})?"


@cache
def _unit_pattern(unit: str) -> str:
    """Units of one dimension: single ones by name, composed ones by the names that they are composed of."""
    single = []
    for name in _units():
        try:
            unit_factor(name, unit)
        except InputError:
            continue
        single.append(name)
    unit_name = _any_unit()
    composed = [
        rf"{unit_name}(?:{OPERATORS}{unit_name})+[)0-9²³^*-]*",
        rf"{unit_name} *(?:\^|\*\*) *-?[0-9]+",
        rf"{unit_name}[²³]",
        rf"1 */ *{unit_name}[)0-9²³^*-]*",
    ]
    if single:
        composed.insert(0, _prefixed(single))
    if unit == "K":
        composed += [re.escape(name) for name in CELSIUS]
    return f"(?:{'|'.join(composed)})"


_NAMES: dict[str, str] = {}


def _named(pattern: str, name: str) -> str:
    _NAMES[pattern] = name
    return pattern


def _slug(unit: str) -> str:
    return unit.replace("/", "_per_").replace("^", "").replace(" ", "_").replace("(", "").replace(")", "")


def name_of(pattern: str) -> str:
    """A name for a pattern of this module; empty for another."""
    return _NAMES.get(pattern, "")


def quantity_pattern(unit: str, *, negative: bool = True) -> str:
    name = f"number_{_slug(unit)}" + ("" if negative else "_not_negative")
    number = NUMBER if negative else rf"(?:\+?{DIGITS}|{ZERO})"
    return _named(rf"^\s*{number}\s*,?\s*{_unit_pattern(unit)}\s*$", name)


def numbers_pattern(unit: str, count: int | None = None) -> str:
    """Numbers and one unit behind the last."""
    more = "*" if count is None else f"{{{count - 1}}}"
    name = f"{'numbers' if count is None else f'{count}_numbers'}_{_slug(unit)}"
    return _named(rf"^\s*{NUMBER}(?:(?:\s*,\s*|\s+){NUMBER}){more}\s*,?\s*{_unit_pattern(unit)}\s*$", name)
