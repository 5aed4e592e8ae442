"""A mechanism from whatever another program gave: a link or a file, by what it is; and from a table of points.

The table says where points are, which bars they are on, and what holds them.
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from scissordyn.components.place import Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.exchange.drawing import LINEAR_DENSITY, UNITS, Block, Drawing, Imported, assembled, plain_name, uniform
from scissordyn.units import checked

TABLES = (".csv", ".tsv")

ENDINGS = (".dxf", ".xml", ".mjcf", ".urdf", *TABLES)

LARGEST = 50_000_000  # Size of a file [bytes] beyond which it is not read

COLUMNS = "name", "x", "y", "bars", "support"

SAMPLE = "name,x,y,bars,support"

BLOCK_MASS = 0.1  # Of a block that slides with a point [kg]


def read_drawing(
    source: str | Path, *, unit: str = "", linear_density: float = LINEAR_DENSITY, tolerance: float | None = None
) -> Imported:
    """The mechanism of a link of PMKS+, a drawing in DXF, a model in MJCF or URDF, or a table of points.

    Parameters
    ----------
    source : str or path
        A link, or a file that ends in .dxf, .xml, .mjcf, .urdf, .csv or .tsv; a file with any other ending holds a link.
    unit : str
        Of a DXF that names none, see `read_dxf`; of a table of points, metres if not given.
    linear_density : float
        Mass per length of what has no mass in the drawing [kg/m].
    tolerance : float, optional
        Of a DXF, see `read_dxf` [m].

    Returns
    -------
    Imported

    Raises
    ------
    InputError
        If it cannot be read, or is no mechanism.
    """
    if isinstance(source, str) and ("://" in source or "?" in source):
        from scissordyn.exchange.pmks import read_pmks

        _no_unit(unit, "a link of PMKS+")
        return read_pmks(source, linear_density=linear_density)
    path = Path(source)
    ending = path.suffix.lower()
    if ending in (".xlsx", ".xls"):
        raise InputError(
            f"'{path}' is a workbook", "its sheet of points saved as .csv: docs/import.md", "scissordyn import points.csv"
        )
    text = _text(path)
    if ending in TABLES:
        return read_points(text, unit=unit or "m", linear_density=linear_density)
    if ending == ".dxf":
        from scissordyn.exchange.dxf import read_dxf

        return read_dxf(text, unit=unit, linear_density=linear_density, tolerance=tolerance)
    if tolerance is not None:
        raise InputError(f"tolerance = {tolerance:g} m for '{path}'", "a tolerance for a DXF only; this one names its joints")
    if ending in ENDINGS:
        from scissordyn.exchange.mjcf import read_mjcf

        _no_unit(unit, "a model of MuJoCo")
        return read_mjcf(text)
    if "?" not in text.strip() or "\n" in text.strip():
        raise InputError(
            f"'{path}' is no drawing", "a file that ends in " + ", ".join(ENDINGS) + ", or one with a link of PMKS+"
        )
    return read_drawing(text.strip(), unit=unit, linear_density=linear_density)


def _no_unit(unit: str, what: str) -> None:
    if unit:
        raise InputError(f"unit '{unit}' for {what}", "a unit for a DXF only; this one has its own")


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(f"'{path}' has {path.stat().st_size} bytes", f"at most {LARGEST}")
        return path.read_text(encoding="utf-8", errors="surrogateescape")
    except OSError as error:
        raise InputError(
            f"cannot read '{path}': {error.strerror or error}", "a file or a link", "scissordyn import linkage.dxf"
        ) from None


@checked
def read_points(text: str, *, unit: str = "m", linear_density: float = LINEAR_DENSITY) -> Imported:
    """The mechanism of a table of points.

    Parameters
    ----------
    text : str
        A table whose first line names its columns: `name`, `x`, `y`; `bars`, the names of the bars that a point is on, with
        blanks between them; `support`, empty, "fixed", or "slide" with an angle in degrees, along which a block with that point
        slides. Columns are separated by commas, semicolons or tabs.
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
    lines = text.lstrip("\ufeff").splitlines()
    head = lines[0] if lines else ""
    delimiter = next((letter for letter in "\t;," if letter in head), ",")
    rows = list(csv.DictReader(io.StringIO("\n".join(lines)), delimiter=delimiter, skipinitialspace=True))
    missing = [name for name in COLUMNS[:4] if name not in map(str.strip, head.split(delimiter))]
    if missing:
        raise InputError(f"a table of points without the column '{missing[0]}'", ", ".join(COLUMNS), SAMPLE)
    pins: dict[str, Point] = {}
    bars: dict[str, list[str]] = {}
    fixed, slides = [], dict[str, float]()
    for number, row in enumerate(rows, 2):
        cells = {str(key).strip(): (value or "").strip() for key, value in row.items() if key}
        name = plain_name(cells["name"], ())
        if name in pins:
            raise InputError(f"point '{name}' given twice (line {number})", "each point once")
        pins[name] = UNITS[unit] * _number(cells["x"], "x", number), UNITS[unit] * _number(cells["y"], "y", number)
        for bar in cells["bars"].split():
            bars.setdefault(plain_name(bar, ()), []).append(name)
        kind, _, angle = cells.get("support", "").partition(" ")
        if kind == "fixed":
            fixed.append(name)
        elif kind == "slide":
            slides[name] = math.radians(_number(angle or "0", "the angle of a slide", number))
        elif kind:
            raise InputError(
                f"support '{kind}' of point '{name}' (line {number})", "fixed, slide ANGLE, or nothing", "slide 90"
            )
    for bar, points in bars.items():
        if len(points) < 2:
            raise InputError(f"bar '{bar}' has one point only, '{points[0]}'", "two points or more of each bar")
    taken = {*pins, *bars}
    blocks = [Block(plain_name(f"block {name}", taken), name, angle, BLOCK_MASS) for name, angle in slides.items()]
    drawing = Drawing(
        pins,
        tuple(fixed),
        tuple(uniform(bar, tuple(points), pins, linear_density) for bar, points in bars.items()),
        tuple(blocks),
    )
    notes = [
        f"bars have {linear_density:g} kg/m, as the table gives no masses",
        "no gravity and no drive: add [drive] to the case",
    ]
    if blocks:
        notes.append(f"blocks that slide have {BLOCK_MASS:g} kg each")
    return Imported(assembled(drawing), tuple(notes))


def _number(text: str, what: str, line: int) -> float:
    """A number of the table; a comma may stand for its point."""
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{what} = '{text}' (line {line})", "a number")
    return value
