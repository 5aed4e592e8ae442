"""Components in the order of the kernels, their coordinates at the start, and the layout of tables."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.declaration import Component
from scissordyn.components.place import GROUND
from scissordyn.components.time_function import ConstantSpeed
from scissordyn.model.clearance import ContactPoint, contact_states
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import State, hints_of


def acting(mechanism: Mechanism) -> tuple[Component, ...]:
    """Return the components that the kernels read: those that exert forces, then the latches."""
    latches: tuple[Any, ...] = mechanism.latches
    return (*mechanism.exerting, *latches)


def start_coordinates(mechanism: Mechanism, component: Any) -> tuple[float, ...]:
    """Return the coordinates of a component's port for the placed bodies."""

    def angle(body: str) -> float:
        return 0.0 if body == GROUND else mechanism.body(body).placed_angle

    coordinates: tuple[float, ...] = component.declaration.port.start(component, mechanism.place, angle)
    return coordinates


def states_of(contact: Revolute | ContactPoint) -> tuple[State, ...]:
    assert contact.clearance is not None
    return contact_states(contact.clearance)


def time_functions(mechanism: Mechanism, first: int) -> tuple[np.ndarray, np.ndarray, list[tuple[Any, float]]]:
    """Return the indices of each component's time function and feed-forward torque, and the list of these functions.

    Indices start at `first`; -1 means none. The list pairs each function with its value
    at t = 0, because a function given by a speed is integrated from there.
    """
    components = acting(mechanism)
    index, feed = np.full((2, len(components)), -1, np.int64)
    listed: list[tuple[Any, float]] = []
    for i, component in enumerate(components):
        if isinstance(component, Actuator):
            index[i] = first + len(listed)
            listed.append((component.reference or ConstantSpeed(0.0), start_coordinates(mechanism, component)[0]))
            if component.feed_forward is not None:
                feed[i] = first + len(listed)
                listed.append((component.feed_forward, 0.0))
        elif "factor" in component.declaration.context and component.time_function is not None:  # type: ignore[attr-defined]
            index[i] = first + len(listed)
            listed.append((component.time_function, 0.0))  # type: ignore[attr-defined]
    return index, feed, listed


def offsets(counts: Any) -> np.ndarray:
    """Return the first index of each of several consecutive blocks and the end of the last, from their numbers of entries."""
    return np.array(list(accumulate(counts, initial=0)), np.int64)


def scratch(described: Any, shapes: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return zero arrays for fields of a kernel's named tuple, with the declared types."""
    declared = hints_of(described)
    return {name: np.zeros(shape, declared[name].__metadata__[0].dtype) for name, shape in shapes.items()}
