"""Dataset of a run, whose arrays are computed when they are first read."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, cast

import numpy as np
import pandas as pd
import xarray as xr

import scissordyn.record.accessor  # noqa: F401  registers run.scissordyn
from scissordyn.record.results import Results, Run
from scissordyn.record.variable import Variable

STORES_DATA = "_data" in getattr(xr.Variable, "__slots__", ())  # True if xarray's variables store arrays in the slot `_data`


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
        if not STORES_DATA:
            return xr.Variable(variable.dims, variable.values, variable.attrs, fastpath=True)
        copy = cls.__new__(cls)
        copy._dims, copy._attrs, copy._encoding = variable.dims, dict(variable.attrs), None
        copy._source = variable
        return copy

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
        source = self._source
        return self._array.shape if source is None else source.shape

    @property
    def dtype(self) -> Any:
        """Type of the array's elements."""
        source = self._source
        return self._array.dtype if source is None else source.dtype

    def __reduce__(self) -> tuple[Any, ...]:
        return xr.Variable, (self._dims, self._data, self._attrs, self._encoding, True)


def as_dataset(results: Run) -> xr.Dataset:
    """Return a run as a Dataset, without xarray's slow checks of the variables."""
    if not isinstance(results, Results):
        return cast("xr.Dataset", results)
    variables, indexes, coordinates = dict[str, xr.Variable](), dict[Any, xr.Index](), dict[str, xr.Variable]()
    for name, part in results.variables.items():
        if part.dims != (name,):
            variables[name] = DatasetVariable.of(part)
            continue
        if part.dtype.kind == "U":
            indexes[name], named = _index_of_names(name, tuple(part.values.tolist()))
            coordinates[name] = named.copy(deep=False)
            coordinates[name].attrs = part.attrs
        else:
            indexes[name] = xr.indexes.PandasIndex(pd.Index(part.values), name)
            label = xr.Variable(part.dims, part.values, part.attrs, fastpath=True)
            coordinates[name] = indexes[name].create_variables({name: label})[name]
        variables[name] = coordinates[name]
    direct = getattr(xr.Dataset, "_construct_direct", None)
    if direct is None:
        return xr.Dataset(variables, attrs=results.attributes)
    dataset: xr.Dataset = direct(variables, set(coordinates), dims=results.sizes, attrs=results.attributes, indexes=indexes)
    return dataset


@lru_cache(256)
def _index_of_names(dim: str, names: tuple[str, ...]) -> tuple[xr.Index, xr.Variable]:
    """Return index and coordinate of a dimension with names; runs of a mechanism share them, as pandas is slow for texts."""
    texts: Any = np.array(names, dtype=str)
    try:
        index = xr.indexes.PandasIndex(pd.Index(texts), dim)
    except UnicodeEncodeError:  # half a surrogate, which a damaged file may have
        index = xr.indexes.PandasIndex(pd.Index(names, dtype=object), dim)
    return index, index.create_variables({dim: xr.Variable((dim,), texts)})[dim]
