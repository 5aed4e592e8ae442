"""Save and load runs as NetCDF files; files are written completely or not at all."""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.casefile.configuration import ATTRIBUTE, RUN_TITLE
from scissordyn.errors import InputError
from scissordyn.file.output_file import TITLE_START, check_name, check_target, regular_size, write_file
from scissordyn.record.results import Results, Run
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr

OTHER_FILES = {".toml": "read_case", ".db": "open_study"}  # Function that reads a file that is not a run, by file name ending


@checked
def save(run: xr.Dataset, path: str | os.PathLike[str], *, replace_broken: bool = False) -> Path:
    r"""Write a run to a NetCDF file, completely or not at all.

    An existing file is replaced if scissordyn wrote it. Ctrl-C takes effect after the file is complete, so the run is not lost.
    Characters that NetCDF cannot store are replaced by their code, for example a NUL in a name by "\x00".

    Parameters
    ----------
    run : Dataset
    path : path
    replace_broken : bool
        If True, also replace an HDF5 file that cannot be read, for example a truncated one.

    Returns
    -------
    Path

    Warns
    -----
    UserWarning
        If the run contains a function or class that is not defined in a file, so that the saved run cannot be run again.

    Raises
    ------
    InputError
        If the file cannot be written, or exists and is not a result of scissordyn.
    """
    return _write_run(run, path, lambda: _netcdf(_writable(run)), replace_broken=replace_broken)


@checked
def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a run from a NetCDF file into memory; no code in the file is executed.

    Parameters
    ----------
    path : path

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        If the file does not exist, is not a complete run, or does not match its checksum.

    Warns
    -----
    UserWarning
        If the file has no checksum, because another program or an earlier version wrote it: damage cannot be detected.
    """
    import xarray as xr  # imported here so that a run that is only shown loads neither xarray nor HDF5

    import scissordyn.record.accessor  # noqa: F401  registers run.scissordyn
    from scissordyn.file.checksum import verify_checksum
    from scissordyn.file.netcdf import NetcdfFile

    try:
        if regular_size(path) is None:
            raise ValueError("it is not a regular file")
        has_checksum = verify_checksum(path)  # before HDF5 opens the file
        with NetcdfFile(path) as file, xr.open_dataset(xr.backends.H5NetCDFStore(file)) as stored:
            run = stored.load()
    except Exception as error:  # libraries raise any exception for a damaged file
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        other = OTHER_FILES.get(Path(path).suffix, "")
        example = f"sd.{other}({str(path)!r})" if other else ""
        raise InputError(f"cannot read '{path}' as a run: {reason}", "a complete NetCDF file of scissordyn", example) from None
    if not str(run.attrs.get("title", "")).startswith(TITLE_START):
        raise InputError(f"'{path}' is not a run of scissordyn", "a NetCDF file that scissordyn wrote")
    if not has_checksum:
        warnings.warn(
            f"'{path}' has no checksum: damage cannot be detected; sd.save() writes a file with a checksum", stacklevel=3
        )
    return run


def _netcdf(run: xr.Dataset) -> memoryview:
    """Return the content of a NetCDF file with a Dataset."""
    from xarray.backends import H5NetCDFStore

    from scissordyn.file.netcdf import chunk_options, write_content

    encoding = {}
    for name, variable in run.variables.items():
        options = chunk_options(variable.values)
        encoding[name] = {"chunksizes": options.pop("chunks"), **options} if options else {}
    return write_content(lambda file: run.dump_to_store(H5NetCDFStore(file), encoding=encoding))


def _writable(run: xr.Dataset) -> xr.Dataset:
    """Return the run with the title of this package, and with texts that NetCDF can store."""
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
    """Write results to a NetCDF file, equal to that which `save` writes from their Dataset."""
    from scissordyn.file.netcdf import netcdf

    variables = {name: (variable.dims, variable.values, variable.attrs) for name, variable in results.variables.items()}
    return _write_run(results, path, lambda: netcdf(results.sizes, variables, results.attributes))


def _write_run(
    run: Run, path: str | os.PathLike[str], content: Callable[[], bytes | memoryview], *, replace_broken: bool = False
) -> Path:
    """Write a run to a file; Ctrl-C takes effect afterwards. Warn if the saved run cannot be run again."""
    lost = _without_file(run)
    if lost:
        kind, _, name = lost[0].partition(" ")
        how = "give the function as" if kind == "function" else "import the class from there or give it as"
        warnings.warn(
            f"the saved run '{path}' cannot be run again: its {kind} '{name}' is not defined in a file; define it in one "
            f"and {how} 'mine.py:{name.rpartition('.')[2]}'",
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
    # to memory first: on a full disk the HDF5 library leaves a file that crashes the process when it is closed
    return write_file(path, content())


def _without_file(run: Run) -> list[str]:
    """Return names of functions and classes of a run that no file defines; none for data that are not a run of this version."""
    title, text = run.attrs.get("title"), run.attrs.get(ATTRIBUTE)
    if not (isinstance(title, str) and title == RUN_TITLE and isinstance(text, str)):
        return []
    try:
        code = tomllib.loads(text).get("code", {})
        return [name for name in code if name.startswith(("class ", "function "))] if isinstance(code, dict) else []
    except (ValueError, RecursionError):
        return []
