"""Read a mechanism of another program from a link or a file."""

from __future__ import annotations

from pathlib import Path

from scissordyn.errors import InputError
from scissordyn.exchange.drawing import LINEAR_DENSITY, Imported
from scissordyn.exchange.source import decode, read_source
from scissordyn.units import checked

TABLE_ENDINGS = (".csv", ".tsv")  # File name endings of tables of points

# File name endings of all mechanism formats that can be imported
ENDINGS = (".dxf", ".xml", ".mjcf", ".urdf", ".sdf", ".linkage2", ".slvs", *TABLE_ENDINGS)


@checked
def read_drawing(
    source: str | Path,
    *,
    unit: str = "",
    linear_density: float = LINEAR_DENSITY,
    tolerance: float | None = None,
    thickness: float | None = None,
    density: float | None = None,
) -> Imported:
    """Return the mechanism of a PMKS+ link, a drawing, a robot model, a sketch, or a table of points.

    Parameters
    ----------
    source : str or path
        Link, or file that ends in .dxf, .xml, .mjcf, .urdf, .sdf, .linkage2, .slvs, .csv or .tsv. A file with any other
        ending holds a link.
    unit : str
        Length unit of a DXF without one (see `read_dxf`) or of a table of points (metres if not given).
    linear_density : float
        Mass per length of bars without mass [kg/m].
    tolerance : float, optional
        Largest distance of ends that form one pin in a DXF, see `read_dxf` [m].
    thickness, density : float, optional
        Thickness [m] and density [kg/m^3] of parts that a DXF draws by their outlines, see `read_dxf`.

    Raises
    ------
    InputError
        If the source cannot be read, or is not a mechanism.
    """
    if isinstance(source, str) and ("://" in source or "?" in source):
        from scissordyn.exchange.pmks import read_pmks

        _no_unit(unit, "a link of PMKS+")
        return read_pmks(source, linear_density=linear_density)
    path = Path(source)
    ending = path.suffix.lower()
    if ending in (".xlsx", ".xls", ".ods"):
        raise InputError(
            f"'{path}' is a workbook", "the sheet of points saved as .csv: docs/files.md", "scissordyn import points.csv"
        )
    text, notes = decode(read_source(path), ending)
    of_dxf = {"tolerance": tolerance, "thickness": thickness, "density": density}
    imported = _read(path, text, unit=unit, linear_density=linear_density, of_dxf=of_dxf)
    return imported._replace(notes=(*notes, *imported.notes))


def _read(path: Path, text: str, *, unit: str, linear_density: float, of_dxf: dict[str, float | None]) -> Imported:
    """Return the mechanism in the text of a file; the ending of the file determines the format.

    `of_dxf` holds the options that only a DXF has.
    """
    ending = path.suffix.lower()
    if ending == ".dxf":
        from scissordyn.exchange.dxf import read_dxf

        return read_dxf(text, unit=unit, linear_density=linear_density, **of_dxf)
    for name, value in of_dxf.items():
        if value is not None:
            raise InputError(f"{name} = {value:g} does not apply to '{path}'", f"a {name} for a DXF only")
    if ending in TABLE_ENDINGS:
        from scissordyn.exchange.points import read_points

        return read_points(text, unit=unit or "m", linear_density=linear_density)
    if ending == ".linkage2":
        from scissordyn.exchange.linkage2 import read_linkage2

        _no_unit(unit, "a file of Linkage")
        return read_linkage2(text, linear_density=linear_density)
    if ending == ".slvs":
        from scissordyn.exchange.slvs import read_slvs

        _no_unit(unit, "a sketch of SolveSpace")
        return read_slvs(text, linear_density=linear_density)
    if ending in ENDINGS:
        from scissordyn.exchange.mjcf import read_mjcf

        _no_unit(unit, "a model of MuJoCo")
        return read_mjcf(text, folder=path.parent)
    if "?" not in text.strip() or "\n" in text.strip():
        raise InputError(
            f"'{path}' is not a drawing", "a file that ends in " + ", ".join(ENDINGS) + ", or one with a link of PMKS+"
        )
    return read_drawing(text.strip(), unit=unit, linear_density=linear_density)


def _no_unit(unit: str, what: str) -> None:
    if unit:
        raise InputError(f"unit '{unit}' does not apply to {what}", "a unit for a DXF or a table only")
