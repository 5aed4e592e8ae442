"""Mechanisms from a table that says where points are, which bars they are on, and what holds them."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import defaultdict
from collections.abc import Mapping

from scissordyn.components.place import Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    UNITS,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    assembled,
    imported,
    plain_name,
    shortest_tree,
    uniform,
)
from scissordyn.model.body import check_place
from scissordyn.units import checked

COLUMNS = "name", "x", "y", "bars", "support"

SAMPLE = "name,x,y,bars,support"

POINTS_MAX = 10_000  # Rows of a table; a structure of this size takes minutes to simulate

BLOCK_MASS = 0.1  # Of a block that slides with a point [kg]

BEND_TOL = 1e-6  # A bar whose rods are longer than the box around its points is wide by more than this fraction is bent

SLIDE = re.compile(r"slide(?:\s+(\S*?)\s*(deg|degrees?|°|rad)?)?")

SEPARATOR = re.compile(r"\A(?:sep=(.)\s*\n)")  # The first line of a table that Excel writes so that it opens it again


@checked
def read_points(text: str, *, unit: str = "m", linear_density: float = LINEAR_DENSITY) -> Imported:
    """The mechanism of a table of points.

    Parameters
    ----------
    text : str
        A table whose first line names its columns: `name`, `x`, `y`; `bars`, the names of the bars that a point is on, with
        blanks or commas between them; `support`, empty, "fixed", or "slide" with an angle, in degrees unless it says "rad",
        along which a block with that point slides. Columns are separated by commas, semicolons or tabs.
    unit : {"m", "mm", "cm", "dm", "um", "in", "ft"}
        Of the coordinates.
    linear_density : float
        Mass per length of the bars [kg/m].

    Returns
    -------
    Imported

    Raises
    ------
    InputError
        If a column or a number is missing, or a bar has one point only.
    """
    if unit not in UNITS:
        raise InputError(f"unit '{unit}'{did_you_mean(unit, UNITS)} of a table", ", ".join(UNITS), "--unit mm")
    notes: list[str] = []
    table = _Table(_rows(text), UNITS[unit], notes)
    taken = {*table.pins, *table.bars}
    blocks = [Block(plain_name(f"block {name}", taken), name, angle, BLOCK_MASS) for name, angle in table.slides.items()]
    bars = tuple(uniform(bar, tuple(points), table.pins, linear_density) for bar, points in table.bars.items())
    notes += _bent(bars, table.pins)
    notes += [
        f"bars have {linear_density:g} kg/m, as the table gives no masses",
        "no gravity and no drive: add [drive] to the case",
    ]
    if blocks:
        notes.append(f"blocks that slide have {BLOCK_MASS:g} kg each")
    if not table.fixed and not blocks:
        notes.append("nothing is grounded: write 'fixed' in the column 'support' of each fixed point")
    return imported(assembled(Drawing(table.pins, tuple(table.fixed), bars, tuple(blocks))), notes)


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """The rows that are not empty, with their lines; the first one names the columns."""
    text = text.lstrip("\ufeff")
    given = SEPARATOR.match(text)
    head = next((line for line in text[given.end() if given else 0 :].splitlines() if line.strip()), "")
    delimiter = given[1] if given else next((letter for letter in "\t;," if letter in head), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    rows = []
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells) and not (given and reader.line_num == 1):
                rows.append((reader.line_num, cells))
            if len(rows) > POINTS_MAX + 1:
                raise InputError(f"a table of more than {POINTS_MAX} points", "fewer points", SAMPLE)
    except csv.Error as error:
        raise InputError(f"line {reader.line_num} of the table: {error}", "a table of points", SAMPLE) from None
    return rows


class _Table:
    """Points, bars and supports of a table; what is not used is added to the notes."""

    def __init__(self, rows: list[tuple[int, list[str]]], factor: float, notes: list[str]) -> None:
        self.factor, self.notes = factor, notes
        self.pins: dict[str, Point] = {}
        self.bars: dict[str, list[str]] = {}
        self.fixed: list[str] = []
        self.slides: dict[str, float] = {}
        self.spelt: dict[str, str] = {}  # What the table calls a name
        head = [cell.casefold() for cell in rows[0][1]] if rows else []
        for name in COLUMNS:
            if head.count(name) > 1:
                raise InputError(f"{head.count(name)} columns '{name}' in a table of points", "one", SAMPLE)
            if name not in head and name != "support":
                raise InputError(f"a table of points without the column '{name}'", ", ".join(COLUMNS), SAMPLE)
        self._name_unused(rows[0][1], rows[1:])
        lines = {}
        for line, cells in rows[1:]:
            if any(cells[len(head) :]):
                raise InputError(
                    f"line {line} of the table has {len(cells)} cells for {len(head)} columns",
                    "a decimal point, or semicolons between the columns",
                    SAMPLE,
                )
            row = dict.fromkeys(COLUMNS, "") | dict(zip(head, cells, strict=False))
            lines[self._add(row, line)] = line
        for bar, points in self.bars.items():
            if len(points) < 2:
                raise InputError(f"bar '{bar}' has one point only, '{points[0]}'", "two points or more of each bar")
        self._leave_out_single(lines)
        self._name_coincident()

    def _add(self, row: Mapping[str, str], line: int) -> str:
        """Add the point of a row; returns its name."""
        if not row["name"]:
            raise InputError(f"a point without a name (line {line})", "a name for each point")
        name = self._plain(row["name"], line)
        if name in self.pins:
            raise InputError(f"point '{name}' given twice (line {line})", "each point once")
        self.pins[name] = self.factor * _number(row["x"], "x", line), self.factor * _number(row["y"], "y", line)
        check_place(f"point '{name}' (line {line}) in m", self.pins[name])
        for bar in dict.fromkeys(re.split(r"[\s,;]+", row["bars"])):
            if bar:
                self.bars.setdefault(self._plain(bar, line), []).append(name)
        support = row["support"].casefold()
        slide = SLIDE.fullmatch(support)
        if support == "fixed":
            self.fixed.append(name)
        elif slide:
            angle = _number(slide[1] or "0", "the angle of a slide", line)
            self.slides[name] = angle if slide[2] == "rad" else math.radians(angle)
        elif support:
            raise InputError(
                f"support '{row['support']}' of point '{name}' (line {line})", "fixed, slide ANGLE, or nothing", "slide 90"
            )
        return name

    def _plain(self, name: str, line: int) -> str:
        """A name that a case file can address; two names that become the same one are an error."""
        plain = plain_name(name, ())
        if plain != name and plain not in self.spelt:
            self.notes.append(f"'{name}' (line {line}) is called '{plain}' in the case")
        if self.spelt.setdefault(plain, name) != name:
            raise InputError(f"'{name}' (line {line}) beside '{self.spelt[plain]}'", f"names that are not both '{plain}'")
        return plain

    def _name_unused(self, head: list[str], rows: list[tuple[int, list[str]]]) -> None:
        """Name the columns that are not used, with the lines in which they have values."""
        for k, name in enumerate(head):
            if name.casefold() in COLUMNS:
                continue
            lines = [line for line, cells in rows if k < len(cells) and cells[k]]
            if name or lines:
                shown = ", ".join(map(str, lines[:5])) + (f" and {len(lines) - 5} more" if len(lines) > 5 else "")
                values = f"it has values in line {shown}" if lines else "it is empty"
                self.notes.append(f"column '{name or k + 1}' left out: {values}")

    def _leave_out_single(self, lines: Mapping[str, int]) -> None:
        """Leave out the points that are on no bar."""
        on_bars = {point for points in self.bars.values() for point in points}
        for name in [name for name in self.pins if name not in on_bars]:
            del self.pins[name]
            self.slides.pop(name, None)
            self.fixed = [point for point in self.fixed if point != name]
            self.notes.append(f"point '{name}' (line {lines[name]}) left out: it is on no bar")
        if not self.pins:
            raise InputError("a table of points without bars", "the names of its bars for each point", SAMPLE)

    def _name_coincident(self) -> None:
        """Name the points that have the same place."""
        same = defaultdict[Point, list[str]](list)
        for name, place in self.pins.items():
            same[place].append(name)
        self.notes += [
            f"points {', '.join(names)} have the same place and are not joined: bars that share a point share a pin"
            for names in same.values()
            if len(names) > 1
        ]


def _bent(bars: tuple[DrawnBar, ...], pins: Mapping[str, Point]) -> list[str]:
    """A line for each bar whose points are not on one line."""
    notes = []
    for bar in bars:
        if len(bar.pins) == 2:
            continue
        rods = shortest_tree(bar.pins, pins)
        x, y = zip(*(pins[pin] for pin in bar.pins), strict=True)
        span = math.hypot(max(x) - min(x), max(y) - min(y))  # no connected lines between the points are shorter
        if sum(math.dist(pins[a], pins[b]) for a, b in rods) > (1.0 + BEND_TOL) * span:
            names = ", ".join(f"{a}-{b}" for a, b in rods[:5]) + (f" and {len(rods) - 5} more" if len(rods) > 5 else "")
            notes.append(f"the points of bar '{bar.name}' are not on one line: its mass is that of rods {names}")
    return notes


def _number(text: str, what: str, line: int) -> float:
    """A number of the table; a comma may stand for its point, and U+2212 for its minus."""
    try:
        value = float(text.replace(",", ".").replace("\u2212", "-"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{what} = '{text}' (line {line})", "a number")
    return value
