"""Variables of a Dataset whose arrays are computed when they are first read."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from scissordyn.record.results import Variable

DATA = "_data"  # slot of xarray's variables that holds the array


class DatasetVariable(xr.Variable):
    """Variable of a Dataset; the array, of known shape and type, is computed when it is first read."""

    __slots__ = ("_array", "_source")

    _array: Any
    _source: Variable | None  # result from which the array is copied, or None once it has been

    @classmethod
    def of(cls, variable: Variable) -> xr.Variable:
        """Return a variable that copies its array from a result when it is read.

        Other deferred results of the run read the result itself, which the user must not change.
        """
        if DATA not in getattr(xr.Variable, "__slots__", ()):  # an xarray that stores arrays in another way
            return xr.Variable(variable.dims, variable.values, variable.attrs, fastpath=True)
        made = cls.__new__(cls)
        made._dims, made._attrs, made._encoding = variable.dims, dict(variable.attrs), None
        made._source = variable
        return made

    @property
    def _data(self) -> Any:
        source = self._source
        if source is not None:
            self._array = np.array(source.values)
            self._source = None
        return self._array

    @_data.setter
    def _data(self, data: Any) -> None:
        self._array, self._source = data, None

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        source = self._source
        return self._array.shape if source is None else source.shape

    @property
    def dtype(self) -> Any:
        """Type of the array's elements."""
        source = self._source
        return self._array.dtype if source is None else source.dtype

    def __reduce__(self) -> tuple[Any, ...]:
        return xr.Variable, (self._dims, self._data, self._attrs, self._encoding, True)
