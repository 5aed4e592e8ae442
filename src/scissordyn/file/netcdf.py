"""NetCDF files: read them, and write arrays with dimensions and attributes to them."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import h5py
import numpy as np
from h5netcdf.core import File, Variable
from h5py.h5i import get_name

from scissordyn.file.checksum import CHUNK_BYTES, checksum_line

HDF5_VERSIONS = ("v110", "v110")
"""Oldest and newest version of HDF5's file format; since 1.10 (2016) HDF5's own structures have checksums."""


class Hdf5File(h5py.File):  # type: ignore[misc, name-defined]
    """HDF5 file that opens each object once; h5netcdf opens the object of a variable by its name about 40 times."""

    def __init__(self, path: Any, mode: str, **options: Any) -> None:
        self._objects: dict[str, Any] = {}
        super().__init__(path, mode, **options)

    def __getitem__(self, name: Any) -> Any:
        if not isinstance(name, str):
            return super().__getitem__(name)
        item = self._objects.get(name)
        if item is None or get_name(item.id) is None:  # the object was deleted, and another one may have the same name
            item = self._objects[name] = super().__getitem__(name)
        return item

    def close(self) -> None:
        self._objects.clear()
        super().close()


class _ReadVariable(Variable):
    """Variable of a file that does not change, so that its shape is computed once; h5netcdf computes it six times."""

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the dimensions."""
        shape: tuple[int, ...] = super().shape
        return shape


class NetcdfFile(File):
    """NetCDF file opened for reading."""

    _variable_cls = _ReadVariable

    _writable = False
    """Same as in the parent class, which reads the attribute even when it closes a file that could not be opened."""

    _closed = True
    """True until the parent class has something to close; a signal may come earlier."""

    _hdf5: Hdf5File | None = None
    """None until the file is open; a signal may come earlier."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._hdf5 = Hdf5File(path, "r")
        super().__init__(self._hdf5, "r", decode_vlen_strings=True)  # type: ignore[no-untyped-call]

    def close(self) -> None:
        super().close()  # type: ignore[no-untyped-call]
        if self._hdf5 is not None:
            self._hdf5.close()


def netcdf(
    sizes: Mapping[str, int],
    variables: Mapping[str, tuple[tuple[str, ...], np.ndarray, Mapping[str, str]]],
    attributes: Mapping[str, Any],
) -> memoryview:
    """Return the content of a NetCDF file with some variables, equal to that which xarray would write.

    `variables` has dimensions, values and attributes by name. Texts may have any length, booleans are stored as 8-bit integers
    with an attribute, and missing numbers as NaN.
    """

    def write(file: File) -> None:
        file.dimensions = dict(sizes)
        for name, (dims, values, about) in variables.items():
            kind, further, missing, dtype = values.dtype.kind, dict(about), None, values.dtype
            if kind == "f":
                missing = np.array(np.nan, dtype)
            elif kind == "b":
                values, dtype, further["dtype"] = values.astype(np.int8), np.dtype(np.int8), "bool"
            elif kind == "U":
                values = np.array([storable_text(text) for text in values.ravel().tolist()], object).reshape(values.shape)
                dtype = h5py.string_dtype()  # type: ignore[attr-defined]
            options = {"fillvalue": missing, **chunk_options(values)}
            stored = file.create_variable(name, dims, dtype, **options)  # type: ignore[no-untyped-call]
            for key, value in further.items():
                stored.attrs[key] = value
            stored[...] = values
        for key, value in attributes.items():
            file.attrs[key] = storable_text(value) if isinstance(value, str) else np.atleast_1d(value)

    return write_content(write)


def chunk_options(values: np.ndarray) -> dict[str, Any]:
    """Return the options with which h5netcdf and xarray store an array in chunks with Fletcher-32 checksums.

    The options are empty for texts, because HDF5 stores characters outside the chunks, and for empty arrays and scalars.
    """
    if values.dtype.kind in "OUS" or not values.ndim or not values.size:
        return {}
    chunks = -(-values.nbytes // CHUNK_BYTES)
    shape = (-(-len(values) // chunks), *values.shape[1:])  # parts of equal size, so that the last chunk has few unused rows
    return {"fletcher32": True, "chunks": shape}


def write_content(write: Callable[[File], None]) -> memoryview:
    """Call a function that writes to an open NetCDF file in memory; return the content of the file with its checksum line."""
    content = io.BytesIO()
    with Hdf5File(content, "w", libver=HDF5_VERSIONS, track_order=True) as hdf5, File(hdf5, "w") as file:  # type: ignore[no-untyped-call]
        write(file)
    line = checksum_line(content.getbuffer())
    content.seek(0, io.SEEK_END)
    content.write(line)
    return content.getbuffer()


def storable_text(value: Any) -> Any:
    """Escape characters of a text that NetCDF cannot store; return other values unchanged."""
    if not isinstance(value, str):
        return value
    return value.replace("\0", "\\x00").encode("utf-8", "backslashreplace").decode("utf-8")
