"""Texts that say what a number varies over: ranges, levels, distributions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scissordyn.config.quantity import LEADING_NUMBER, read_quantity, unit_factor
from scissordyn.config.text import read_text
from scissordyn.errors import InputError, did_you_mean
from scissordyn.study.distribution import Empirical, Interval, Levels, LogNormal, Normal, Uniform, Variation
from scissordyn.units import Quantity

__all__ = ["FORMS", "VARY", "number_and_unit", "read_variation", "unit_of"]

VARY = "--vary A.clearance='0.05..0.4 mm'"

FORMS = "'0.05..0.4 mm', '0.05..0.4 mm, 20 values, log', '50, 100, 200 N m', 'normal(0.1, 0.02)', 'uniform(1, 2) mm'"

DISTRIBUTIONS = {"uniform": 2, "normal": 2, "truncated": 4, "lognormal": 2, "table": 1}
"""Their numbers of parameters."""

CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*(.*)", re.DOTALL)
LONGEST = 18
"""Digits of a number of values; Python reads no more than 4300."""

OPTION = re.compile(r"(\d+)\s+values|(log)")


def unit_of(text: str) -> str:
    """The unit in which the user writes a variation."""
    called = CALL.fullmatch(text)
    if called:
        return called[3].strip()
    last = text.split("..", 1)[1].split(",")[0] if ".." in text else text.split(",")[-1]
    return number_and_unit(last)[1]


def read_variation(text: str, quantity: Quantity, *, address: str = "", folder: Path | None = None) -> Variation:
    """What a number varies over.

    Parameters
    ----------
    text : str
        ``"0.05..0.4 mm"`` (a range; ``", 20 values"`` and ``", log"`` may follow), ``"50, 100, 200 N m"`` (levels), or a
        distribution with its unit behind: ``uniform(a, b)``, ``normal(mean, deviation)``, ``truncated(mean, deviation, low,
        high)``, ``lognormal(median, deviation of the logarithm)``, ``table(file.csv)``.
    quantity : Quantity
        Unit and bounds of the number.
    address : str
        Of the number, for messages.
    folder : Path, optional
        Where the name of a table's file starts.

    Returns
    -------
    Variation

    Raises
    ------
    InputError
        If it is none of that.
    """
    try:
        return _variation(text, quantity, folder or Path())
    except InputError as error:
        sample = error.type_this or VARY
        raise InputError(f"'{address}' over '{text}': {error.what}", error.allowed or FORMS, sample) from None


def _variation(text: str, quantity: Quantity, folder: Path) -> Variation:
    called = CALL.fullmatch(text)
    if called:
        return _distribution(called[1], called[2], called[3], quantity, folder)
    if ".." in text:
        low, rest = text.split("..", 1)
        last, *options = (part.strip() for part in rest.split(","))
        chosen: dict[str, Any] = {}
        for option in options:
            found = OPTION.fullmatch(option)
            if found is None:
                raise InputError(f"'{option}'", "a number of values, log", "'0.05..0.4 mm, 20 values, log'")
            if len(found[1] or "") > LONGEST:
                raise InputError(f"a number of values of {len(found[1])} digits", "a few values", "'0.05..0.4 mm, 20 values'")
            chosen |= {"count": int(found[1])} if found[1] else {"logarithmic": True}
        value, unit = number_and_unit(last)
        ends = _si(low, unit, quantity), _si(value, unit, quantity)
        if ends[0] >= ends[1]:
            turned = f"'{value}..{low.strip()} {unit}'" if ends[0] > ends[1] else f"'{value} {unit}' for one value"
            raise InputError("the range is empty", "a smaller number, then a larger one", turned)
        return Interval(*ends, **chosen)
    *others, last = text.split(",")
    value, unit = number_and_unit(last)
    return Levels(tuple(_si(each, unit, quantity) for each in (*others, value)))


def number_and_unit(text: str) -> tuple[str, str]:
    """The number that a text begins with, and the unit behind it."""
    found = LEADING_NUMBER.fullmatch(text)
    if found is None:
        raise InputError(f"'{text.strip()}' is no number", FORMS)
    return found[1], found[2].strip()


def _si(text: str, unit: str, quantity: Quantity) -> float:
    """A number with its unit, within the bounds of its quantity."""
    value, own_unit = number_and_unit(text)
    unit = own_unit or unit
    if quantity.unit == "1":
        if unit:
            raise InputError(f"unit '{unit}' of a pure number", quantity.allowed)
        return float(read_quantity(float(value), quantity))
    return float(read_quantity(f"{value} {unit}".strip(), quantity))


def _distribution(name: str, inside: str, unit: str, quantity: Quantity, folder: Path) -> Variation:
    if name not in DISTRIBUTIONS:
        raise InputError(f"distribution '{name}'{did_you_mean(name, DISTRIBUTIONS)}", ", ".join(DISTRIBUTIONS))
    if name == "table":
        return Empirical(tuple(_si(repr(value), unit, quantity) for value in _column(folder / inside.strip())))
    parts = [part for part in inside.split(",") if part.strip()]
    if len(parts) != DISTRIBUTIONS[name]:
        raise InputError(f"{len(parts)} numbers of a {name} distribution", f"{DISTRIBUTIONS[name]} numbers")
    if name == "lognormal":
        return LogNormal(_si(parts[0], unit, quantity), _plain(parts[1]))
    if name == "uniform":
        return Uniform(_si(parts[0], unit, quantity), _si(parts[1], unit, quantity))
    factor = (
        _si(parts[0], unit, quantity) / float(number_and_unit(parts[0])[0]) if float(number_and_unit(parts[0])[0]) else math.nan
    )
    scale = factor if math.isfinite(factor) else (1.0 if quantity.unit == "1" else unit_factor(unit, quantity.unit))
    ends = (_si(parts[2], unit, quantity), _si(parts[3], unit, quantity)) if name == "truncated" else ()
    return Normal(_si(parts[0], unit, quantity), _plain(parts[1]) * scale, *ends)


def _plain(text: str) -> float:
    value, unit = number_and_unit(text)
    if unit:
        raise InputError(f"'{text.strip()}' with a unit", "a plain number; the unit follows the bracket")
    return float(value)


def _column(path: Path) -> Sequence[float]:
    """The numbers of a file, one in each line; a heading may come first."""
    lines = [line.split(",")[0].strip() for line in read_text(path, "a file with one number in each line").splitlines()]
    lines = [line for line in lines if line]
    if lines and LEADING_NUMBER.fullmatch(lines[0]) is None:
        lines = lines[1:]
    try:
        return [float(line) for line in lines]
    except ValueError as error:
        raise InputError(f"'{path}': {error}", "one number in each line") from None
