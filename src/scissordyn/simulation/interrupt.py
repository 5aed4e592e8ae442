"""Ctrl-C inside a part of a larger computation."""

from __future__ import annotations

import xarray as xr

__all__ = ["pass_on"]


def pass_on(part: xr.Dataset) -> xr.Dataset:
    """Raise `KeyboardInterrupt` again if a run was interrupted that is only a part of what was asked for.

    A run that is interrupted returns what it has. Where that is of no use by itself, the whole computation has to end.

    Parameters
    ----------
    part : Dataset

    Returns
    -------
    Dataset
        The same.
    """
    if part.attrs["status"] == "interrupted":
        raise KeyboardInterrupt
    return part
