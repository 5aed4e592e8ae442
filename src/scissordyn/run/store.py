"""Runs on disk: NetCDF, written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import scissordyn.run.accessor  # noqa: F401  registers run.scissordyn
from scissordyn.errors import InputError
from scissordyn.file.netcdf import NetcdfFile, text_of
from scissordyn.file.output_file import OURS, regular_size
from scissordyn.run.write import write_run

OTHER_FILES = {".toml": "read_case", ".db": "open_study"}
"""What reads files that are no runs."""


def save(run: xr.Dataset, path: str | os.PathLike[str], *, replace_broken: bool = False) -> Path:
    r"""Write a run to a NetCDF file, whole or not at all.

    A file that is there is replaced if scissordyn wrote it. Ctrl-C does not lose the run: it counts once the file is whole.
    Characters that NetCDF cannot hold, as a NUL in a name, are written as their code, "\x00".

    Parameters
    ----------
    run : Dataset
    path : path
    replace_broken : bool
        Whether to replace also an HDF5 file that cannot be read, as one that was cut off.

    Returns
    -------
    Path

    Warns
    -----
    UserWarning
        If the run holds a function or class that is in no file, so that it cannot be run again from the saved one.

    Raises
    ------
    InputError
        If the file cannot be written, or holds something else.
    """
    return write_run(run, path, lambda: _writable(run).to_netcdf(engine="h5netcdf"), replace_broken=replace_broken)


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a run from a NetCDF file into memory. Nothing in it is executed.

    Parameters
    ----------
    path : path

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        If there is no such file, or it is not a whole run.
    """
    try:
        if regular_size(path) is None:
            raise ValueError("it is not a regular file")
        with NetcdfFile(path) as file, xr.open_dataset(xr.backends.H5NetCDFStore(file)) as stored:
            run = stored.load()
    except Exception as error:  # libraries raise whatever they like at a file that is not whole
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        other = OTHER_FILES.get(Path(path).suffix, "")
        example = f"sd.{other}({str(path)!r})" if other else ""
        raise InputError(
            f"cannot read '{path}' as a run: {reason}", "a NetCDF file that scissordyn wrote whole", example
        ) from None
    if not str(run.attrs.get("title", "")).startswith(OURS):
        raise InputError(f"'{path}' is not a run of scissordyn", "a NetCDF file that scissordyn wrote")
    return run


def _writable(run: xr.Dataset) -> xr.Dataset:
    """The same with every text such that NetCDF can hold it, and with a title that says whose it is."""
    attributes = {name: text_of(value) for name, value in run.attrs.items()}
    attributes.setdefault("title", OURS)
    changed: dict[Any, xr.Variable] = {}
    for name, variable in run.variables.items():
        if variable.dtype.kind in "OU":
            texts = variable.values.ravel().tolist()
            sound = [text_of(value) for value in texts]
            if sound != texts:
                values = np.array(sound, dtype=object).reshape(variable.shape)
                changed[name] = xr.Variable(variable.dims, values, variable.attrs)
    coordinates = {name: changed.pop(name) for name in list(changed) if name in run.coords}
    return run.assign(changed).assign_coords(coordinates).assign_attrs(attributes)
