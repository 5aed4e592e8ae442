"""NetCDF files: how they are opened for reading, and the content of one of plain arrays."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np
from h5netcdf.core import File


class NetcdfFile(File):
    """A file that is read."""

    _writable = False
    """As of the parent, which asks for it also when it is closed after a beginning that failed."""

    _closed = True
    """As of the parent, until it has something to close: a signal may come before."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path, "r", decode_vlen_strings=True)  # type: ignore[no-untyped-call]


def netcdf(
    sizes: Mapping[str, int],
    variables: Mapping[str, tuple[tuple[str, ...], np.ndarray, Mapping[str, str]]],
    attributes: Mapping[str, Any],
) -> memoryview:
    """The file that xarray writes of the same variables: dimensions, values and attributes of each.

    Texts have any length, what is true or false is a small number with a mark, and numbers that are missing are NaN.
    """
    content = io.BytesIO()
    with File(content, "w") as file:  # type: ignore[no-untyped-call]
        file.dimensions = dict(sizes)
        for name, (dims, values, about) in variables.items():
            kind, further, missing, dtype = values.dtype.kind, dict(about), None, values.dtype
            if kind == "f":
                missing = np.array(np.nan, dtype)
            elif kind == "b":
                values, dtype, further["dtype"] = values.astype(np.int8), np.dtype(np.int8), "bool"
            elif kind == "U":
                values = np.array([text_of(text) for text in values.ravel().tolist()], object).reshape(values.shape)
                dtype = h5py.string_dtype()  # type: ignore[attr-defined]
            stored = file.create_variable(name, dims, dtype, fillvalue=missing)
            for key, value in further.items():
                stored.attrs[key] = value
            stored[...] = values
        for key, value in attributes.items():
            file.attrs[key] = text_of(value) if isinstance(value, str) else np.atleast_1d(value)
    return content.getbuffer()


def text_of(value: Any) -> Any:
    """A text such that NetCDF can hold it."""
    if not isinstance(value, str):
        return value
    return value.replace("\0", "\\x00").encode("utf-8", "backslashreplace").decode("utf-8")
