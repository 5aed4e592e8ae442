"""Runs on disk: NetCDF, written whole or not at all, of Datasets or of results from which none has been made."""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.casefile.configuration import ATTRIBUTE, TITLE
from scissordyn.errors import InputError
from scissordyn.file.output_file import TITLE_START, check_name, check_target, regular_size, write_file
from scissordyn.record.results import Results, Run
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr

OTHER_FILES = {".toml": "read_case", ".db": "open_study"}  # Functions that read files which are not runs


@checked
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
    return _write_run(run, path, lambda: _netcdf(_writable(run)), replace_broken=replace_broken)


@checked
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
        If there is no such file, it is not a whole run, or its content does not match its checksum.

    Warns
    -----
    UserWarning
        If the file has no checksum: another program or an earlier version wrote it, and damage is not noticed.
    """
    import xarray as xr  # a run that is only shown loads neither this nor HDF5

    import scissordyn.record.accessor  # noqa: F401  registers run.scissordyn
    from scissordyn.file.checksum import verify_checksum
    from scissordyn.file.netcdf import NetcdfFile

    try:
        if regular_size(path) is None:
            raise ValueError("it is not a regular file")
        has_checksum = verify_checksum(path)  # before HDF5 sees the file
        with NetcdfFile(path) as file, xr.open_dataset(xr.backends.H5NetCDFStore(file)) as stored:
            run = stored.load()
    except Exception as error:  # libraries raise whatever they like at a file that is not whole
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        other = OTHER_FILES.get(Path(path).suffix, "")
        example = f"sd.{other}({str(path)!r})" if other else ""
        raise InputError(
            f"cannot read '{path}' as a run: {reason}", "a NetCDF file that scissordyn wrote whole", example
        ) from None
    if not str(run.attrs.get("title", "")).startswith(TITLE_START):
        raise InputError(f"'{path}' is not a run of scissordyn", "a NetCDF file that scissordyn wrote")
    if not has_checksum:
        warnings.warn(f"'{path}' has no checksum: damage to it is not noticed; sd.save() writes it with one", stacklevel=3)
    return run


def _netcdf(run: xr.Dataset) -> memoryview:
    """Return the content of the NetCDF file of a Dataset."""
    from xarray.backends import H5NetCDFStore

    from scissordyn.file.netcdf import chunk_options, write_content

    encoding = {}
    for name, variable in run.variables.items():
        options = chunk_options(variable.values)
        encoding[name] = {"chunksizes": options.pop("chunks"), **options} if options else {}
    return write_content(lambda file: run.dump_to_store(H5NetCDFStore(file), encoding=encoding))


def _writable(run: xr.Dataset) -> xr.Dataset:
    """Return the run with texts that NetCDF can hold and the title of this package."""
    import xarray as xr

    from scissordyn.file.netcdf import storable_text

    attributes = {name: storable_text(value) for name, value in run.attrs.items()}
    attributes.setdefault("title", TITLE_START)
    changed: dict[Any, xr.Variable] = {}
    for name, variable in run.variables.items():
        if variable.dtype.kind in "OU":
            texts = variable.values.ravel().tolist()
            sound = [storable_text(value) for value in texts]
            if sound != texts:
                values = np.array(sound, dtype=object).reshape(variable.shape)
                changed[name] = xr.Variable(variable.dims, values, variable.attrs)
    coordinates = {name: changed.pop(name) for name in list(changed) if name in run.coords}
    return run.assign(changed).assign_coords(coordinates).assign_attrs(attributes)


def write_results(results: Results, path: str | os.PathLike[str]) -> Path:
    """Write results to the file that `store.save` makes of their Dataset."""
    from scissordyn.file.netcdf import netcdf

    variables = {name: (variable.dims, variable.values, variable.attrs) for name, variable in results.variables.items()}
    return _write_run(results, path, lambda: netcdf(results.sizes, variables, results.attributes))


def _write_run(
    run: Run, path: str | os.PathLike[str], content: Callable[[], bytes | memoryview], *, replace_broken: bool = False
) -> Path:
    """Write the content of a file, also where Ctrl-C comes meanwhile; a warning says if it cannot be run again."""
    lost = _without_file(run)
    if lost:
        kind, _, name = lost[0].partition(" ")
        how = "give the function as" if kind == "function" else "import the class from there or give it as"
        warnings.warn(
            f"the saved run cannot be run again from '{path}': its {kind} '{name}' is in no file; put it in one and {how} "
            f"'mine.py:{name.rpartition('.')[2]}'",
            stacklevel=4,
        )
    try:
        return _write(path, content, replace_broken)
    except KeyboardInterrupt:
        _write(path, content, replace_broken)
        raise


def _write(path: str | os.PathLike[str], content: Callable[[], bytes | memoryview], replace_broken: bool) -> Path:
    check_target(path, replace_broken=replace_broken)
    check_name(path)
    # into memory first: when a disk is full the HDF5 library leaves a file that crashes the process as it is closed
    return write_file(path, content())


def _without_file(run: Run) -> list[str]:
    """Return the functions and classes of a run that are in no file; none for data that are not a run of this version."""
    title, text = run.attrs.get("title"), run.attrs.get(ATTRIBUTE)
    if not (isinstance(title, str) and title == TITLE and isinstance(text, str)):
        return []
    try:
        code = tomllib.loads(text).get("code", {})
        return [name for name in code if name.startswith(("class ", "function "))] if isinstance(code, dict) else []
    except (ValueError, RecursionError):
        return []
