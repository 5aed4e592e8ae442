"""Copy the arrays of a run to dual numbers in the layout of dual.c; arrays that share memory share a copy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissordyn.kernel import address_of, fields_of
from scissordyn.mechanics.system import LAW_KERNELS
from scissordyn.sensitivity.library import DERIVATIVES

DUAL_DOUBLES = DERIVATIVES + 1  # Number of doubles in a dual number: derivatives, then value
VALUE = DERIVATIVES  # Index of the value among the doubles of a dual number


POINTER_FIELDS = ("controller", "law", "energy")  # Names of the fields of named tuples that contain kernel pointers


class Twin:
    """Dual-number copies of the arrays in named tuples.

    Parameters
    ----------
    doubles : tuple of type
        Types of named tuples whose arrays have no derivatives and are not copied.
    pointers : mapping of int to int
        Kernel pointers in the dual-number library, by the pointers in the package's library.
    """

    def __init__(self, doubles: tuple[type, ...], pointers: Mapping[int, int]) -> None:
        self.doubles, self.pointers = doubles, pointers
        self._copies: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._memory: list[np.ndarray] = []

    def address(self, content: Any) -> int:
        """Return the address of a named tuple with dual-number arrays; the memory is freed with this object."""
        memory = np.array(self._words(content, type(content)), np.int64)
        self._memory.append(memory)
        return int(memory.ctypes.data)

    def copy_of(self, array: np.ndarray) -> np.ndarray:
        """Return the dual-number copy of an array: derivatives at [..., :VALUE] and values at [..., VALUE]."""
        return self._copies[id(array)][1]

    def grow(self, old: np.ndarray, new: np.ndarray) -> None:
        """Replace the copy of an array by that of a longer array with the same first rows."""
        rows, _ = self._copy("", new), self._copies.pop(id(new), None)
        rows[: len(old)] = self.copy_of(old)
        self._copies[id(new)] = new, rows

    def _words(self, content: Any, described: type) -> list[int]:
        plain, words = described in self.doubles, list[int]()
        for (name, hint), part in zip(fields_of(described), content, strict=True):
            if isinstance(part, np.ndarray):
                array = self._array(name, part, plain=plain)
                words += [address_of(array), *part.shape, *([part.shape[1]] if part.ndim == 2 else [])]
            elif isinstance(part, tuple) and hasattr(part, "_fields"):
                words += self._words(part, hint)
            elif isinstance(part, tuple):
                words += [int(word) for word in part]
            elif hint is float:
                words += [*[0] * (0 if plain else DERIVATIVES), int(np.float64(part).view(np.int64))]
            else:
                words.append(int(part))
        return words

    def _array(self, name: str, array: np.ndarray, *, plain: bool) -> np.ndarray:
        if array.dtype.kind == "i" and (name.endswith("_kernel") or name in POINTER_FIELDS):
            copy = np.array([self.pointers.get(int(word), int(word)) for word in array], np.int64)
            self._memory.append(copy)
            return copy
        if plain:
            return array
        if id(array) not in self._copies:
            owner = self._copies.get(id(array.base))
            self._copies[id(array)] = array, self._copy(name, array) if owner is None else _same_part(array, *owner)
        return self._copies[id(array)][1]

    def _copy(self, name: str, array: np.ndarray) -> np.ndarray:
        names = array.dtype.names
        if names is None:
            if array.dtype.kind != "f":
                return array.copy()
            numbers = np.zeros((*array.shape, DUAL_DOUBLES))
            numbers[..., VALUE] = array
            return numbers
        kinds = [
            (key, array.dtype[key], (DUAL_DOUBLES,)) if array.dtype[key].kind == "f" else (key, array.dtype[key])
            for key in names
        ]
        records = np.zeros(array.shape, kinds)
        for key in names:
            if array.dtype[key].kind == "f":
                records[key][..., VALUE] = array[key]
            elif name == "law" and key in LAW_KERNELS:
                records[key] = [self.pointers.get(int(word), int(word)) for word in array[key]]
            else:
                records[key] = array[key]
        return records


def _same_part(view: np.ndarray, array: np.ndarray, duals: np.ndarray) -> np.ndarray:
    """Return the part of an array's dual-number copy that corresponds to a contiguous view of the array."""
    first = (view.ctypes.data - array.ctypes.data) // array.itemsize
    return duals.reshape(-1, DUAL_DOUBLES)[first : first + view.size].reshape(*view.shape, DUAL_DOUBLES)
