"""Prescribed angles from a file of two columns, or from two rows of numbers in the case file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scissordyn.config.quantity import read_numbers, unit_factor
from scissordyn.config.table import located
from scissordyn.errors import InputError
from scissordyn.model.drive import TableMotion

__all__ = ["read_motion"]

HEADER = re.compile(r"\s*#?\s*time\s*\[(?P<time>[^]]+)\]\s*[,;\s]\s*angle\s*\[(?P<angle>[^]]+)\]\s*")
SAMPLE = 'table = { time = "0 10 20 30 40 50 ms", angle = "30 31 34 39 46 55 deg" }'


def read_motion(given: Any, folder: Path) -> TableMotion:
    """An angle given at instants.

    Parameters
    ----------
    given : str or mapping
        Name of a text file whose first line is ``time [ms], angle [deg]`` and whose other lines are two numbers;
        or the keys `time` and `angle`, each text of numbers with one unit at its end.
    folder : Path
        Folder that a relative file name starts from.

    Returns
    -------
    TableMotion
    """
    if isinstance(given, str):
        return _from_file(folder / given)
    if not isinstance(given, Mapping) or set(given) != {"time", "angle"}:
        raise InputError("not a table of time and angle", "a file name, or the keys time and angle", SAMPLE)
    return TableMotion(read_numbers(given["time"], "s"), read_numbers(given["angle"], "rad"))


def _from_file(path: Path) -> TableMotion:
    try:
        header, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        raise InputError(f"cannot read '{path}': {reason}", "a text file with two columns") from None
    units = HEADER.fullmatch(header)
    if units is None:
        raise InputError(
            f"'{path}' begins with {header[:40]!r}", "a first line that names both columns", "time [ms], angle [deg]"
        )
    rows = []
    for number, line in enumerate(lines, start=2):
        entries = re.split(r"[,;\s]+", line.strip())
        if entries == [""]:
            continue
        try:
            time, angle = map(float, entries)
        except ValueError:
            raise InputError(f"'{path}' line {number} is {line[:40]!r}", "two numbers in each line", "10, 35.5") from None
        rows.append((time, angle))
    with located(f"'{path}' line 1"):
        scale = unit_factor(units["time"], "s"), unit_factor(units["angle"], "rad")
    return TableMotion(tuple(time * scale[0] for time, _ in rows), tuple(angle * scale[1] for _, angle in rows))
