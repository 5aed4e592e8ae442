"""Results on disk as NetCDF, written whole or not at all; `store` does the same of Datasets, and needs xarray."""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path

from scissordyn.file.output_file import check_name, check_target, write_file
from scissordyn.run.configuration import ATTRIBUTE, TITLE
from scissordyn.run.results import Results, Run


def write_results(results: Results, path: str | os.PathLike[str]) -> Path:
    """Write results to the file that `store.save` makes of their Dataset."""
    from scissordyn.file.netcdf import netcdf  # a run that is only shown does not load HDF5

    variables = {name: (variable.dims, variable.values, variable.attrs) for name, variable in results.variables.items()}
    return write_run(results, path, lambda: netcdf(results.sizes, variables, results.attributes))


def write_run(
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
            stacklevel=3,
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
    """Functions and classes of a run that are in no file; none of data that are no run of this version."""
    title, text = run.attrs.get("title"), run.attrs.get(ATTRIBUTE)
    if not (isinstance(title, str) and title == TITLE and isinstance(text, str)):
        return []
    try:
        code = tomllib.loads(text).get("code", {})
        return [name for name in code if name.startswith(("class ", "function "))] if isinstance(code, dict) else []
    except (ValueError, RecursionError):
        return []
