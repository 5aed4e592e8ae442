"""Runs on disk: NetCDF, written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import xarray as xr

from scissordyn.errors import InputError

__all__ = ["load", "save"]


def save(run: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a run to a NetCDF file, whole or not at all.

    Parameters
    ----------
    run : Dataset
    path : path

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
        os.close(handle)
        try:
            run.to_netcdf(name, engine="h5netcdf")
            Path(name).chmod(0o666 & ~_umask())
            Path(name).replace(target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(
            f"cannot write '{target}': {error.strerror or error}",
            "a file name in a folder that exists and can be written",
            "-o run.nc",
        ) from None
    return target


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a run from a NetCDF file into memory.

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
        with xr.open_dataset(path, engine="h5netcdf") as stored:
            run = stored.load()
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"cannot read '{path}' as a run: {reason}", "a NetCDF file that scissordyn wrote whole") from None
    if "configuration" not in run.attrs:
        raise InputError(f"'{path}' is not a run of scissordyn", "a NetCDF file that scissordyn wrote")
    return run


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
