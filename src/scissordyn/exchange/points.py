"""Build a mechanism from a table of points with their bars and supports."""

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
    mechanism_of_drawing,
    plain_name,
    shortest_tree,
    uniform,
    with_printable_notes,
)
from scissordyn.exchange.source import POINTS_MAX, listed
from scissordyn.model.body import check_place
from scissordyn.units import checked

COLUMNS = "name", "x", "y", "bars", "support"  # Names of the columns of a table of points; "support" may be absent

HEADING_EXAMPLE = "name,x,y,bars,support"  # Correct first line of a table of points, which error texts show


# Pattern of a sliding support in a table of points: "slide", or "slide 30 deg"
SLIDE_TEXT = re.compile(r"slide(?:\s+(\S*?)\s*(deg|degrees?|°|rad)?)?")

# Pattern of the first line of tables saved by Excel, which declares the separator
SEPARATOR = re.compile(r"\A(?:sep=(.)\s*\n)")


@checked
def read_points(text: str, *, unit: str = "m", linear_density: float = LINEAR_DENSITY, block_mass: float = 0.1) -> Imported:
    """Return the mechanism of a table of points.

    Parameters
    ----------
    text : str
        Table whose first line names its columns, separated by commas, semicolons or tabs. `name`, `x`, `y`: a point and its
        coordinates. `bars`: the names of the bars through the point, separated by blanks or commas. `support`: empty,
        "fixed", or "slide" with the angle of the line on which the point slides (in degrees, or with "rad").
    unit : {"m", "mm", "cm", "dm", "um", "in", "ft"}
        Unit of the coordinates.
    linear_density : float
        Mass per length of the bars [kg/m].
    block_mass : float
        Mass of a sliding block [kg].

    Raises
    ------
    InputError
        If a column or a number is missing, or a bar has only one point.
    """
    if unit not in UNITS:
        raise InputError(f"unknown unit '{unit}'{did_you_mean(unit, UNITS)} of a table", ", ".join(UNITS), "--unit mm")
    notes: list[str] = []
    table = _Table(_rows(text), UNITS[unit], notes)
    taken = {*table.pins, *table.bars}
    blocks = [Block(plain_name(f"block {name}", taken), name, angle, block_mass) for name, angle in table.slides.items()]
    bars = tuple(uniform(bar, tuple(points), table.pins, linear_density) for bar, points in table.bars.items())
    notes += _bent(bars, table.pins)
    notes += [
        f"bars have {linear_density:g} kg/m, as the table gives no masses",
        "no gravity and no drive: add [drive] to the case",
    ]
    if blocks:
        notes.append(f"blocks that slide have {block_mass:g} kg each")
    if not table.fixed and not blocks:
        notes.append("nothing is grounded: write 'fixed' in the column 'support' of each fixed point")
    return with_printable_notes(mechanism_of_drawing(Drawing(table.pins, tuple(table.fixed), bars, tuple(blocks))), notes)


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Return the rows that are not empty with their line numbers; the first row names the columns."""
    text = text.lstrip("\ufeff")
    separator = SEPARATOR.match(text)
    heading = next((line for line in text[separator.end() if separator else 0 :].splitlines() if line.strip()), "")
    delimiter = separator[1] if separator else next((letter for letter in "\t;," if letter in heading), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    rows = []
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells) and not (separator and reader.line_num == 1):
                rows.append((reader.line_num, cells))
            if len(rows) > POINTS_MAX + 1:
                raise InputError(f"the table has more than {POINTS_MAX} points", "fewer points", HEADING_EXAMPLE)
    except csv.Error as error:
        raise InputError(f"line {reader.line_num} of the table: {error}", "a table of points", HEADING_EXAMPLE) from None
    return rows


class _Table:
    """Points, bars and supports in the rows of a table; adds a note for each part that is left out."""

    def __init__(self, rows: list[tuple[int, list[str]]], factor: float, notes: list[str]) -> None:
        self.factor, self.notes = factor, notes
        self.pins: dict[str, Point] = {}
        self.bars: dict[str, list[str]] = {}
        self.fixed: list[str] = []
        self.slides: dict[str, float] = {}
        self.spelt: dict[str, str] = {}  # Name in the table, by name in the case
        head = [cell.casefold() for cell in rows[0][1]] if rows else []
        for name in COLUMNS:
            if head.count(name) > 1:
                raise InputError(
                    f"the table of points has {head.count(name)} columns '{name}'", "each column once", HEADING_EXAMPLE
                )
            if name not in head and name != "support":
                raise InputError(f"the table of points has no column '{name}'", ", ".join(COLUMNS), HEADING_EXAMPLE)
        self._name_unused(rows[0][1], rows[1:])
        lines = {}
        for line, cells in rows[1:]:
            if any(cells[len(head) :]):
                raise InputError(
                    f"line {line} of the table has {len(cells)} cells for {len(head)} columns",
                    "a decimal point, or semicolons between the columns",
                    HEADING_EXAMPLE,
                )
            row = dict.fromkeys(COLUMNS, "") | dict(zip(head, cells, strict=False))
            lines[self._add(row, line)] = line
        for bar, points in self.bars.items():
            if len(points) < 2:
                raise InputError(f"bar '{bar}' has only one point, '{points[0]}'", "two points or more of each bar")
        self._leave_out_single(lines)
        self._name_coincident()

    def _add(self, row: Mapping[str, str], line: int) -> str:
        """Add the point of a row; return its name."""
        if not row["name"]:
            raise InputError(f"line {line}: the point has no name", "a name for each point")
        name = self._plain(row["name"], line)
        if name in self.pins:
            raise InputError(f"point '{name}' is given twice (line {line})", "each point once")
        self.pins[name] = self.factor * _number(row["x"], "x", line), self.factor * _number(row["y"], "y", line)
        check_place(f"point '{name}' (line {line}) in m", self.pins[name])
        for bar in dict.fromkeys(re.split(r"[\s,;]+", row["bars"])):
            if bar:
                self.bars.setdefault(self._plain(bar, line), []).append(name)
        support = row["support"].casefold()
        slide = SLIDE_TEXT.fullmatch(support)
        if support == "fixed":
            self.fixed.append(name)
        elif slide:
            angle = _number(slide[1] or "0", "the angle of a slide", line)
            self.slides[name] = angle if slide[2] == "rad" else math.radians(angle)
        elif support:
            raise InputError(
                f"unknown support '{row['support']}' of point '{name}' (line {line})",
                "fixed, slide ANGLE, or nothing",
                "slide 90",
            )
        return name

    def _plain(self, name: str, line: int) -> str:
        """Return a name that a case file can refer to; raise `InputError` if two names become equal."""
        plain = plain_name(name, ())
        if plain != name and plain not in self.spelt:
            self.notes.append(f"'{name}' (line {line}) is called '{plain}' in the case")
        if self.spelt.setdefault(plain, name) != name:
            raise InputError(f"'{name}' (line {line}) and '{self.spelt[plain]}' both become '{plain}'", "different names")
        return plain

    def _name_unused(self, head: list[str], rows: list[tuple[int, list[str]]]) -> None:
        """Add a note for each unused column, with the numbers of the lines in which it has values."""
        for k, name in enumerate(head):
            if name.casefold() in COLUMNS:
                continue
            lines = [line for line, cells in rows if k < len(cells) and cells[k]]
            if name or lines:
                values = f"it has values in line {listed(map(str, lines))}" if lines else "it is empty"
                self.notes.append(f"column '{name or k + 1}' left out: {values}")

    def _leave_out_single(self, lines: Mapping[str, int]) -> None:
        """Remove the points that are on no bar, and add a note for each."""
        on_bars = {point for points in self.bars.values() for point in points}
        for name in [name for name in self.pins if name not in on_bars]:
            del self.pins[name]
            self.slides.pop(name, None)
            self.fixed = [point for point in self.fixed if point != name]
            self.notes.append(f"point '{name}' (line {lines[name]}) left out: it is on no bar")
        if not self.pins:
            raise InputError("the table of points has no bars", "the names of its bars for each point", HEADING_EXAMPLE)

    def _name_coincident(self) -> None:
        """Add a note for points with equal coordinates, because they are not joined."""
        same = defaultdict[Point, list[str]](list)
        for name, place in self.pins.items():
            same[place].append(name)
        self.notes += [
            f"points {', '.join(names)} have the same place and are not joined: bars that share a point share a pin"
            for names in same.values()
            if len(names) > 1
        ]


def _bent(bars: tuple[DrawnBar, ...], pins: Mapping[str, Point]) -> list[str]:
    """Return a note for each bar whose points are not on one line."""
    bend_tol = 1e-6  # a bar is bent if its rods are longer than the diagonal of its points' box by more than this fraction
    notes = []
    for bar in bars:
        if len(bar.pins) == 2:
            continue
        rods = shortest_tree(bar.pins, pins)
        x, y = zip(*(pins[pin] for pin in bar.pins), strict=True)
        span = math.hypot(max(x) - min(x), max(y) - min(y))  # connected lines between the points are at least this long
        if sum(math.dist(pins[a], pins[b]) for a, b in rods) > (1.0 + bend_tol) * span:
            names = listed(f"{a}-{b}" for a, b in rods)
            notes.append(f"the points of bar '{bar.name}' are not on one line: its mass is that of rods {names}")
    return notes


def _number(text: str, what: str, line: int) -> float:
    """Return a number of the table; a decimal comma and the minus sign U+2212 are accepted."""
    try:
        value = float(text.replace(",", ".").replace("\u2212", "-"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{what} = '{text}' (line {line})", "a number")
    return value
