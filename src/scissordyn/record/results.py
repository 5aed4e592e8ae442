"""Variables of a run as plain arrays, for commands that show a run without importing xarray."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from scissordyn.record.deferred import Attributes, DeferredArray
from scissordyn.record.variable import Variable

Variables = dict[str, Variable]


def described(dims: str | tuple[str, ...], values: np.ndarray | DeferredArray, units: str, long_name: str) -> Variable:
    return Variable((dims,) if isinstance(dims, str) else dims, values, {"units": units, "long_name": long_name})


def located(name: str, dim: str, peaks: np.ndarray, units: str, text: str) -> Variables:
    """Return two variables along a dimension: the largest values of a quantity, from `peaks`, and their instants."""
    return {
        name: described(dim, peaks["largest"], units, f"largest {text}"),
        f"{name}_time": described(dim, peaks["largest_time"], "s", f"when it is largest: {text}"),
    }


def labels(dim: str, texts: Sequence[str], long_name: str = "") -> Variable:
    """Return a variable of texts along a dimension; without a long name they are the labels of the dimension."""
    return Variable((dim,), np.array(texts, dtype=str), {"long_name": long_name or dim.replace("_", " ")})


class Run(Protocol):
    """Interface of a run that summaries, warnings and pictures need; `Results` and a Dataset both have it."""

    @property
    def attrs(self) -> dict[Any, Any]: ...
    @property
    def variables(self) -> Mapping[Any, Any]: ...
    @property
    def sizes(self) -> Mapping[Any, int]: ...
    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: object, /) -> bool: ...
    def isel(self, places: Any, /) -> Any: ...


def along(variable: Any, *dims: str) -> np.ndarray:
    """Return the values of a variable or a DataArray with its dimensions in the given order."""
    order: np.ndarray = np.transpose(variable.values, [variable.dims.index(dim) for dim in dims])
    return order


def values_at(run: Run, name: str, *dims: str, **labels: str | Sequence[str]) -> np.ndarray:
    """Return the values of a variable at labels of some dimensions, with its other dimensions in the given order.

    A dimension with one label is dropped; a dimension with a list of labels stays.
    """
    variable = run.variables[name]
    values, left = variable.values, list(variable.dims)
    for dim, wanted in labels.items():
        place = {label: k for k, label in enumerate(run.variables[dim].values.tolist())}
        chosen = place[wanted] if isinstance(wanted, str) else [place[label] for label in wanted]
        values = np.take(values, chosen, axis=left.index(dim))
        if isinstance(wanted, str):
            left.remove(dim)
    return np.transpose(values, [left.index(dim) for dim in dims])


class Curve(NamedTuple):
    """Quantity over time."""

    time: np.ndarray  # (samples,) [s]
    values: np.ndarray  # (samples,)
    units: str


def curve_of(run: Run, name: str, **labels: str) -> Curve:
    """Return a variable over time, at one label of each other dimension."""
    variable = run.variables[name]
    return Curve(run.variables["time"].values, values_at(run, name, "time", **labels), str(variable.attrs.get("units", "1")))


class Results:
    """Variables and attributes of a run, with the interface of a Dataset."""

    def __init__(self, variables: Variables, attrs: dict[str, Any]) -> None:
        self.variables = variables
        self.attrs = attrs.with_values() if isinstance(attrs, Attributes) else Attributes(attrs)
        self.make_finer: Callable[[], Results] | None = None

    @cached_property
    def finer(self) -> Results:
        """The same run with additional samples at the instants of contacts, for smooth curves, if these were recorded."""
        if self.make_finer is None:
            return self
        return Results(self.make_finer().variables, self.attrs)

    def __getitem__(self, name: str, /) -> Variable:
        return self.variables[name]

    def __contains__(self, name: object, /) -> bool:
        return name in self.variables

    def isel(self, places: Mapping[str, np.ndarray], /) -> Results:
        """Return the run at some places along dimensions."""
        variables = dict(self.variables)
        for name, part in self.variables.items():
            for dim in places.keys() & set(part.dims):
                values = np.take(variables[name].values, places[dim], axis=part.dims.index(dim))
                variables[name] = Variable(part.dims, values, part.attrs)
        return Results(variables, self.attrs)

    @property
    def sizes(self) -> dict[str, int]:
        sizes: dict[str, int] = {}
        for part in self.variables.values():
            sizes.update(zip(part.dims, part.shape, strict=True))
        return sizes

    @property
    def attributes(self) -> Attributes:
        """Attributes of the Dataset, including the versions of the package and its libraries."""
        return self.attrs.with_values(versions=_versions())


@cache
def _versions() -> str:
    import platform
    from importlib.metadata import version  # imported here because the import is a tenth of the start of a command

    packages = ("scissordyn", "numpy", "scipy")
    return json.dumps({"python": platform.python_version(), **{name: version(name) for name in packages}})
