"""Files of measured curves: a heading that names quantities and units, and one row of numbers for each instant."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from scissordyn.analysis.measured import Measured
from scissordyn.config.quantity import unit_factor
from scissordyn.config.text import read_text
from scissordyn.errors import InputError, did_you_mean

SAMPLE = "time [s], angle of crank [deg]"
HEADING = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*")
GAP = 10.0  # A step of so many usual ones is a gap


def read_measured(path: Path, known: Mapping[str, str]) -> Measured:
    """A file of measured curves."""
    lines = [
        (number, line)
        for number, line in enumerate(read_text(path, f"a table that begins with {SAMPLE}").splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 3:
        raise InputError(f"'{path}' has {max(0, len(lines) - 1)} rows", "a heading and at least two rows of numbers", SAMPLE)
    rows = list(csv.reader([line for _, line in lines], skipinitialspace=True))
    headings, units, factors = _heading(rows[0], path, known)
    values = np.array([_numbers(row, len(rows[0]), path, number) for (number, _), row in zip(lines[1:], rows[1:], strict=True)])
    values *= np.array(factors)
    _check_steps(values[:, 0], [number for number, _ in lines[1:]], path)
    return Measured(values[:, 0], headings, values[:, 1:], units, str(path))


def _heading(cells: list[str], path: Path, known: Mapping[str, str]) -> tuple[tuple[str, ...], tuple[str, ...], list[float]]:
    """Headings, SI units and factors to them, the factor of the time first."""
    headings, units, factors = list[str](), list[str](), list[float]()
    for place, cell in enumerate(cells):
        match = HEADING.fullmatch(cell)
        assert match is not None, "it fits anything"
        name, unit = match["name"], match["unit"] or "1"
        if (place == 0) != (name == "time"):
            raise InputError(f"'{path}': column {place + 1} is '{cell.strip()}'", "the time in the first column alone", SAMPLE)
        if place and name not in known:
            raise InputError(
                f"'{path}': no quantity '{name}'{did_you_mean(name, known)}",
                "columns of a run of this case, as 'scissordyn export' writes them",
            )
        if name in headings:
            raise InputError(f"'{path}': '{name}' twice", "each quantity once")
        target = known[name] if place else "s"
        try:
            factors.append(1.0 if unit == target else unit_factor(unit, target))
        except InputError as error:
            raise InputError(
                f"'{path}': unit of '{name}': {error.what}", f"a unit of [{target}]", f"{name} [{target}]"
            ) from None
        if place:
            headings.append(name)
            units.append(target)
    if not headings:
        raise InputError(f"'{path}' has no column but the time", "at least one measured quantity", SAMPLE)
    return tuple(headings), tuple(units), factors


def _numbers(row: list[str], count: int, path: Path, line: int) -> list[float]:
    if len(row) != count or not all(cell.strip() for cell in row):
        empty = f"{len(row)} numbers" if len(row) != count else "an empty cell"
        raise InputError(
            f"'{path}' line {line}: {empty}, a gap in the data",
            f"{count} numbers in each line; a file for each unbroken record",
        )
    try:
        numbers = [float(cell) for cell in row]
    except ValueError as error:
        raise InputError(f"'{path}' line {line}: {error}", "numbers with a decimal point") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"'{path}' line {line}: a value that is not finite, a gap in the data", "finite numbers")
    return numbers


def _check_steps(time: np.ndarray, lines: list[int], path: Path) -> None:
    steps = np.diff(time)
    if np.any(steps <= 0.0):
        k = int(np.argmax(steps <= 0.0))
        ends = f"from {time[k]:.9g} s to {time[k + 1]:.9g} s"
        raise InputError(f"'{path}' line {lines[k + 1]}: the time runs backwards, {ends}", "increasing instants")
    usual = float(np.median(steps))
    if np.max(steps) > GAP * usual:
        k = int(np.argmax(steps))
        raise InputError(
            f"'{path}' line {lines[k + 1]}: a gap of {steps[k]:.4g} s in the time, after {time[k]:.9g} s",
            f"steps of at most {GAP:g} times the usual one, {usual:.4g} s; a file for each unbroken record",
        )
