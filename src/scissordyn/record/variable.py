"""Variable of a run: an array, its dimensions, its unit and its long name."""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.record.deferred import DeferredArray


class Variable:
    """Array with the names of its dimensions, and attributes: unit and long name."""

    __slots__ = ("_array", "attrs", "dims")

    def __init__(self, dims: tuple[str, ...], values: np.ndarray | DeferredArray, attrs: dict[str, str]) -> None:
        self.dims, self.attrs = dims, attrs
        self._array = values

    @property
    def values(self) -> np.ndarray:
        array = self._array
        if isinstance(array, DeferredArray):
            array = self._array = array.compute()
        return array

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array; asking for the shape does not compute the array."""
        return self._array.shape

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the array's elements."""
        return self._array.dtype
