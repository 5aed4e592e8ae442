"""The state of an integration as copies, to be put back or stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate.integration import STATE_TYPES


@dataclass(frozen=True)
class Snapshot:
    """A state to go on from, bit for bit: copies of everything in an integrator's state."""

    arrays: dict[str, np.ndarray]  # By the names of `integration.State`

    @property
    def time(self) -> float:
        """Time of the state [s]."""
        return float(self.arrays["clock"]["time"][0])

    @property
    def y(self) -> np.ndarray:
        """Free coordinates, their rates, internal states, shape (ny,)."""
        return self.arrays["y"]

    @property
    def mode(self) -> np.ndarray:
        """1 for each guard that acts, shape (guards,)."""
        return self.arrays["mode"]

    def changed(self, **arrays: np.ndarray) -> Snapshot:
        """A copy with other arrays in the place of some."""
        return Snapshot({name: np.array(arrays.get(name, part)) for name, part in self.arrays.items()})

    def plain(self) -> dict[str, np.ndarray]:
        """Arrays of plain numbers, to be stored; every number survives bit for bit."""
        return {
            name: part if part.dtype.names is None else np.array([float(part[field][0]) for field in part.dtype.names])
            for name, part in self.arrays.items()
        }

    @classmethod
    def from_plain(cls, arrays: Mapping[str, np.ndarray]) -> Snapshot:
        """The state that `plain` wrote."""
        state: dict[str, np.ndarray] = {}
        for name, kind in STATE_TYPES.items():
            if name not in arrays:
                raise InputError(f"a state without '{name}'", "a state that this version of scissordyn wrote")
            part = np.asarray(arrays[name])
            if kind.names is None:
                state[name] = np.ascontiguousarray(part, kind)
                continue
            if part.shape != (len(kind.names),):
                raise InputError(f"a state with {part.shape} numbers as '{name}'", f"{len(kind.names)} numbers")
            state[name] = np.zeros(1, kind)
            for field, number in zip(kind.names, part.tolist(), strict=True):
                state[name][field] = number
        return cls(state)
