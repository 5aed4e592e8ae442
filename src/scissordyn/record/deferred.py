"""Results that are computed when they are first read: arrays, and attributes of a run."""

from __future__ import annotations

import threading
from collections.abc import Callable, ItemsView, Iterator, Mapping, ValuesView
from typing import Any, Generic, TypeVar

import numpy as np

Value = TypeVar("Value")


class Deferred(Generic[Value]):
    """Value that a function computes when it is first needed.

    Deferred values of one run write to the same scratch arrays of its system: they share a lock.
    """

    def __init__(self, compute: Callable[[], Value], lock: threading.RLock) -> None:
        self._compute: Callable[[], Value] | None = compute
        self._lock = lock

    def __call__(self) -> Value:
        with self._lock:
            if self._compute is not None:
                self._value = self._compute()
                self._compute = None  # the arrays that it refers to may be freed
        return self._value


class DeferredArray:
    """Array of known shape and type that a function returns when it is first needed."""

    def __init__(self, shape: tuple[int, ...], compute: Callable[[], np.ndarray], dtype: type = float) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self.compute = compute


class Attributes(dict[str, Any]):
    """Attributes of a run; those given as `Deferred` are computed when they are first read."""

    def __getitem__(self, name: str) -> Any:
        value = super().__getitem__(name)
        if isinstance(value, Deferred):
            value = value()
            super().__setitem__(name, value)
        return value

    # an own iterator makes `dict(attributes)` and `{**attributes}` read each value by `__getitem__`
    def __iter__(self) -> Iterator[str]:
        return super().__iter__()

    def get(self, name: str, default: Any = None) -> Any:
        """Return the value of an attribute, or a default if the run does not have it."""
        return self[name] if name in self else default  # noqa: SIM401  `dict.get` returns what is stored

    def pop(self, name: str, *default: Any) -> Any:
        """Remove an attribute and return its value."""
        if name not in self:
            return super().pop(name, *default)
        value = self[name]
        super().__delitem__(name)
        return value

    def popitem(self) -> tuple[str, Any]:
        """Remove the last attribute and return it."""
        name = next(reversed(self))
        return name, self.pop(name)

    def setdefault(self, name: str, default: Any = None) -> Any:
        """Return the value of an attribute, set to a default if the run does not have it."""
        if name not in self:
            self[name] = default
        return self[name]

    def with_values(self, **values: Any) -> Attributes:
        """Return a copy with further attributes; deferred values stay deferred."""
        return Attributes(self._stored() | values)

    def _stored(self) -> dict[str, Any]:
        return dict(super().items())

    def _plain(self) -> dict[str, Any]:
        return {name: self[name] for name in self}

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        return self._plain().values()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        return self._plain().items()

    def copy(self) -> dict[str, Any]:
        """Return the attributes as a plain dictionary."""
        return self._plain()

    __copy__ = copy

    def __eq__(self, other: object) -> bool:
        return self._plain() == (other._plain() if isinstance(other, Attributes) else other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:  # type: ignore[override]
        return self._plain() | dict(other)

    def __repr__(self) -> str:
        return repr(self._plain())

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (self._plain(),)
