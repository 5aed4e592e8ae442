"""Runs and mechanisms for other programs, by the ending of the file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import xarray as xr

from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.export import export as export_table
from scissordyn.file.output_file import check_target, write_file
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.options import Options

FORCES = (".csv", ".json", ".inp")  # Endings of files of pin forces
MECHANISMS = (".dxf", ".csv", ".xml", ".fmu")  # Endings of files that a mechanism is written into


def check_ending(path: str | os.PathLike[str], allowed: tuple[str, ...], what: str, sample: str) -> str:
    """The ending of a file name."""
    ending = Path(path).suffix.lower()
    if ending not in allowed:
        raise InputError(
            f"{what} as '{path}'{did_you_mean(ending, allowed)}", "a name that ends in " + ", ".join(allowed), sample
        )
    return ending


def export(
    what: Any,
    path: str | os.PathLike[str],
    *,
    contacts: bool = False,
    forces: bool = False,
    envelope: bool = False,
    mechanism: Mechanism | None = None,
    run: Options | None = None,
    section: str = "",
    material: str = "steel",
    pin_radius: float | None = None,
    width: float | None = None,
    sources_only: bool = False,
) -> Path:
    """Write a run or a mechanism for another program, whole or not at all.

    Parameters
    ----------
    what : Dataset, Mechanism or Case
        A run: ends the name in .csv or .parquet, a table over time; in .mat, a structure `run` with every array. A mechanism:
        in .dxf, its bars with their holes; in .csv, a cut list; in .xml, the ideal mechanism in MJCF; in .fmu, a unit of FMI
        3.0.
    path : path
    contacts : bool
        Of a run: whether a table has one row for each contact in place of each instant.
    forces : bool
        Of a run: the forces of the pins on each bar, as .csv or .json, or as .inp for CalculiX and FreeCAD's FEM.
    envelope : bool
        With `forces` as .csv: their extremes in place of their course over time.
    mechanism : Mechanism, optional
        That was run; read from the run if not given, as far as that needs no code of the user.
    run : Options, optional
        Of an FMU; those of the case, or the defaults for 50 ms, if not given.
    section, material : str
        Of beams in an .inp, as "20x30 mm" and "steel".
    pin_radius, width : float, optional
        Of bars in a DXF and a cut list: of the pins of ideal joints, and of the outline [m].
    sources_only : bool
        Of an FMU: C source without a library.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the ending is another one, the file cannot be written or holds something else, or the content does not exist.
    """
    target = Path(path)
    if isinstance(what, xr.Dataset):
        if not (forces or envelope):
            return export_table(what, target, contacts=contacts)
        ending = check_ending(target, FORCES, "forces", "forces.csv")
        check_target(target, sample=f"forces{ending}")
        content = _forces(what, mechanism, ending, envelope=envelope, section=section, material=material)
    else:
        described = getattr(what, "mechanism", what)
        if not isinstance(described, Mechanism):
            raise InputError(f"export of a {type(what).__name__}", "a run, a mechanism or a case", "export(run, 'table.csv')")
        ending = check_ending(target, MECHANISMS, "a mechanism", "bars.dxf")
        check_target(target, sample=f"mechanism{ending}")
        options = run or getattr(what, "run", None) or Options(until=0.05)
        content = _mechanism(
            described, ending, target.stem, options, pin_radius=pin_radius, width=width, sources_only=sources_only
        )
    return write_file(target, content, sample=f"-o {target.name}")


def _forces(run: xr.Dataset, mechanism: Mechanism | None, ending: str, *, envelope: bool, section: str, material: str) -> bytes:
    from scissordyn.exchange import forces as of_pins
    from scissordyn.exchange.beams import beam_file
    from scissordyn.run.configuration import read_configuration

    described = read_configuration(run).build_mechanism([]) if mechanism is None else mechanism
    forces = of_pins.pin_forces(run, described)
    if ending == ".csv":
        return of_pins.to_csv(of_pins.envelope(forces) if envelope else of_pins.force_table(forces))
    if ending == ".json":
        return of_pins.force_json(forces)
    if not section:
        raise InputError("beams without a section", "width x depth of a rectangle", "--section '20x30 mm'")
    return beam_file(forces, run, described, section=section, material=material)


def _mechanism(
    mechanism: Mechanism,
    ending: str,
    name: str,
    run: Options,
    *,
    pin_radius: float | None,
    width: float | None,
    sources_only: bool,
) -> bytes:
    if ending == ".fmu":
        from scissordyn.exchange.fmu.pack import fmu

        return fmu(mechanism, run, name=name, sources_only=sources_only)
    if ending == ".xml":
        from scissordyn.exchange.mjcf_text import mjcf

        return mjcf(mechanism).text.encode()
    from scissordyn.exchange.cut import cut_list, drawing

    if ending == ".csv":
        return cut_list(mechanism, pin_radius=pin_radius)
    return drawing(mechanism, pin_radius=pin_radius, width=width).encode()
