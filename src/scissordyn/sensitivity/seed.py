"""Derivatives of a run's tables, numbers and start by parameters, as differences of the mechanism compiled at other values.

The functions are smooth and cheap, so that differences of sixth order have an error of about 1e-12 of their size.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.equilibrium.start import prepare_start
from scissordyn.errors import InputError, ScissordynError
from scissordyn.integrate.integration import LOG_COLUMNS
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import System
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.model.parameter_path import changed, number
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.system import make_system
from scissordyn.run.ideal_path import ideal_path

STEP = 4e-3
"""Distance of neighbouring values, relative to the parameter: a difference of sixth order has an error of 1e-14 f_7/f there,
and round-off adds 1e-13."""

CENTRAL = ((-3, -2, -1, 1, 2, 3), (-1 / 60, 3 / 20, -3 / 4, 3 / 4, -3 / 20, 1 / 60), (0, 1 / 12, -2 / 3, 2 / 3, -1 / 12, 0))
FORWARD = (
    (0, 1, 2, 3, 4, 5, 6),
    (-49 / 20, 6, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6),
    (-137 / 60, 5, -5, 10 / 3, -5 / 4, 1 / 5, 0),
)
"""Places in steps, weights of sixth order, and weights of a lower order from which the error is estimated."""

KINK_TOL = 1e-6  # Difference of both orders above which a number is not a smooth function of the parameter, relative to it

OWNERS = ("model", "parameters", "state", "friction")  # Parts of a system that are not scratch


@dataclass(frozen=True)
class Parameter:
    """Parameter of a gradient: its path, value [SI], the scale of its change, and its unit."""

    path: str
    value: float
    scale: float
    unit: str


def parameter_of(mechanism: Mechanism, path: str, size: float) -> Parameter:
    """Return the parameter at a path; `size` [m] is the scale of a length that is zero."""
    place = number(mechanism, path)
    assert place.quantity is not None
    if isinstance(place.value, int):
        raise InputError(f"'{path}' is a whole number", "a parameter that can change by any small amount")
    unit, value = place.quantity.unit, float(place.value)
    return Parameter(path, value, abs(value) or (size if unit == "m" else 1.0), unit)


@dataclass
class Start:
    """Mechanism, the kind of its start, and all arrays there; with `compared`, also the path of the ideal mechanism."""

    mechanism: Mechanism
    kind: StartKind
    compared: Options | None = None

    @cached_property
    def arrays(self) -> dict[str, np.ndarray]:
        return self.arrays_of(self.mechanism)

    def arrays_of(self, mechanism: Mechanism) -> dict[str, np.ndarray]:
        """Return the arrays of the mechanism with another value of a parameter."""
        made = plan(mechanism)
        arrays = arrays_at_start(made, self.kind)
        if self.compared is not None:
            path = ideal_path(made, self.compared)
            arrays["parameters.ideal"], arrays["parameters.ideal_step"] = path.table, np.array([path.step])
        return arrays


def arrays_at_start(made: Plan, start: StartKind) -> dict[str, np.ndarray]:
    """Return the arrays of a system and the state `y` at the start of a run, by name."""
    system = make_system(made)
    prepared = prepare_start(made, system, start)
    y = prepared.y
    functions.activate(system.address)
    functions.accept(0.0, y, system.address, np.zeros(3))
    content: System = system.content
    arrays = dict(_arrays("", {owner: getattr(content, owner) for owner in OWNERS}))
    # the only scratch that is written at the start alone
    arrays["work.value"], arrays["work.part_weight"] = content.work.value, content.work.part_weight
    arrays["y"] = y
    arrays["log"] = np.array(prepared.initial_events, float).reshape(-1, LOG_COLUMNS)
    return arrays


def _arrays(path: str, content: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield all arrays of named tuples, by path; a field of a structured array is an array."""
    for name, part in (content if isinstance(content, dict) else content._asdict()).items():
        if isinstance(part, np.ndarray) and part.dtype.names:
            yield from ((f"{path}{name}.{key}", part[key]) for key in part.dtype.names)
        elif isinstance(part, np.ndarray):
            yield f"{path}{name}", part
        elif hasattr(part, "_asdict"):
            yield from _arrays(f"{path}{name}.", part)


def derivatives(start: Start, parameter: Parameter) -> dict[str, np.ndarray]:
    """Return the derivatives of all arrays at the start by parameter / scale; those that are zero are left out."""
    error: ScissordynError | None = None
    for places, weights, lower in (CENTRAL, FORWARD, _mirrored(FORWARD)):
        try:
            several = [_changed_arrays(start, parameter, place * STEP * parameter.scale) for place in places]
        except ScissordynError as refused:
            error = error or refused
            continue
        return _differences(parameter, start.arrays, several, weights, lower)
    assert error is not None
    raise InputError(
        f"'{parameter.path}' cannot change alone: {getattr(error, 'what', error)}", "another parameter, or a pattern"
    )


def _mirrored(scheme: Any) -> Any:
    places, weights, lower = scheme
    return tuple(-place for place in places), tuple(-weight for weight in weights), tuple(-weight for weight in lower)


def _changed_arrays(start: Start, parameter: Parameter, change: float) -> dict[str, np.ndarray]:
    if change == 0.0:
        return start.arrays
    arrays = start.arrays_of(changed(start.mechanism, parameter.path, parameter.value + change))
    for name, array in start.arrays.items():
        same = arrays[name].shape == array.shape
        if not same or (array.dtype.kind == "i" and not np.array_equal(arrays[name], array)):
            raise InputError("the structure of the mechanism changes with it", "another parameter")
    return arrays


def _differences(
    parameter: Parameter,
    base: dict[str, np.ndarray],
    several: Sequence[dict[str, np.ndarray]],
    weights: Sequence[float],
    lower: Sequence[float],
) -> dict[str, np.ndarray]:
    found = {}
    for name, array in base.items():
        if array.dtype.kind != "f" or not array.size:
            continue
        if all(arrays[name].tobytes() == array.tobytes() for arrays in several):
            continue
        with np.errstate(invalid="ignore"):
            stack = np.stack([arrays[name] for arrays in several]) - array
        stack[~np.isfinite(stack)] = 0.0
        if not np.any(stack):  # 0 and -0
            continue
        slope = np.tensordot(np.array(weights), stack, 1) / STEP
        error = np.abs(slope - np.tensordot(np.array(lower), stack, 1) / STEP)
        scale = np.max(np.abs(array[np.isfinite(array)]), initial=0.0) + np.max(np.abs(slope), initial=0.0)
        if "friction" not in name and np.max(error) > KINK_TOL * scale:
            raise InputError(
                f"'{parameter.path}' = {parameter.value:g}: the start or the tables ({name}) are not a smooth function of it",
                "another value",
            )
        found[name] = slope
    return found
