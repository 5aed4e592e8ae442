"""The variables of a run as plain arrays: a command that only shows a run makes no Dataset and does not import xarray."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


class Variable(NamedTuple):
    """An array with the names of its dimensions, and with unit and long name as its attributes."""

    dims: tuple[str, ...]
    values: np.ndarray
    attrs: dict[str, str]


Variables = dict[str, Variable]


def described(dims: str | tuple[str, ...], values: np.ndarray, units: str, long_name: str) -> Variable:
    return Variable((dims,) if isinstance(dims, str) else dims, values, {"units": units, "long_name": long_name})


def located(name: str, dim: str, peaks: np.ndarray, units: str, text: str) -> Variables:
    """Return the largest values of a quantity, rows of `PEAK` of the loop, and their instants."""
    return {
        name: described(dim, peaks["largest"], units, f"largest {text}"),
        f"{name}_time": described(dim, peaks["largest_time"], "s", f"when it is largest: {text}"),
    }


def labels(dim: str, texts: Sequence[str], long_name: str = "") -> Variable:
    """Return texts along a dimension, by default its names."""
    return Variable((dim,), np.array(texts, dtype=str), {"long_name": long_name or dim.replace("_", " ")})


class Run(Protocol):
    """Interface that results and a Dataset share; a summary of a run needs nothing else."""

    @property
    def attrs(self) -> dict[Any, Any]: ...
    @property
    def variables(self) -> Mapping[Any, Any]: ...
    @property
    def sizes(self) -> Mapping[Any, int]: ...
    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: object, /) -> bool: ...


def along(variable: Any, *dims: str) -> np.ndarray:
    """Return the values of a variable or of a DataArray, with its dimensions in this order."""
    order: np.ndarray = np.transpose(variable.values, [variable.dims.index(dim) for dim in dims])
    return order


class Results:
    """The variables and attributes of a run, in the words of a Dataset."""

    def __init__(self, variables: Variables, attrs: dict[str, Any]) -> None:
        self.variables, self.attrs = variables, attrs
        self.make_finer: Callable[[], Results] | None = None

    @cached_property
    def finer(self) -> Results:
        """The same run with the instants of its contacts among its samples, for curves, if it has recorded them."""
        if self.make_finer is None:
            return self
        return Results(self.make_finer().variables, self.attrs)

    def __getitem__(self, name: str, /) -> Variable:
        return self.variables[name]

    def __contains__(self, name: object, /) -> bool:
        return name in self.variables

    @property
    def sizes(self) -> dict[str, int]:
        return {dim: size for part in self.variables.values() for dim, size in zip(part.dims, part.values.shape, strict=True)}

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the Dataset, with the versions of the programs that made it."""
        return {**self.attrs, "versions": _versions()}

    def dataset(self) -> xr.Dataset:
        """Return the Dataset of variables that fit together, without the checks of its slow constructor."""
        import xarray as xr  # takes longer to import than most runs

        import scissordyn.record.accessor  # noqa: F401  registers run.scissordyn

        variables = {name: xr.Variable(*part, fastpath=True) for name, part in self.variables.items()}
        labels = {name: variable for name, variable in variables.items() if variable.dims == (name,)}
        indexes: dict[Any, xr.Index] = {
            name: _index_of_names(name, tuple(variable.values.tolist()))
            if variable.dtype.kind == "U"
            else xr.indexes.PandasIndex(variable.values, name)
            for name, variable in labels.items()
        }
        coordinates = {name: index.create_variables({name: labels[name]})[name] for name, index in indexes.items()}
        direct = getattr(xr.Dataset, "_construct_direct", None)
        if direct is None:
            return xr.Dataset(variables, attrs=self.attributes)
        dataset: xr.Dataset = direct(
            {**variables, **coordinates}, set(coordinates), dims=self.sizes, attrs=self.attributes, indexes=indexes
        )
        return dataset


@cache
def _versions() -> str:
    import platform
    from importlib.metadata import version  # a tenth of the start of a command

    packages = ("scissordyn", "numpy", "scipy")
    return json.dumps({"python": platform.python_version(), **{name: version(name) for name in packages}})


@lru_cache(256)
def _index_of_names(dim: str, names: tuple[str, ...]) -> xr.Index:
    """Return the index of a dimension of names, shared by runs of the same mechanism because pandas is slow for texts."""
    import xarray as xr

    return xr.indexes.PandasIndex(np.array(names, dtype=str), dim)
