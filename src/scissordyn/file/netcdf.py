"""NetCDF files as they are opened, for reading only."""

from __future__ import annotations

import os

from h5netcdf.core import File


class NetcdfFile(File):
    """A file that is read."""

    _writable = False
    """As of the parent, which asks for it also when it is closed after a beginning that failed."""

    _closed = True
    """As of the parent, until it has something to close: a signal may come before."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path, "r", decode_vlen_strings=True)  # type: ignore[no-untyped-call]
