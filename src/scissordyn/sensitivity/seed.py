"""Derivatives of the arrays at the start of a run by parameters, as finite differences of the compiled mechanism.

The arrays are smooth functions of a parameter. The step of their differences of sixth order is as long as their truncation
error allows, which differences of second and fourth order show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from scissordyn.equilibrium.start import prepare_start
from scissordyn.errors import InputError, ScissordynError
from scissordyn.integrate.integration import LOG_COLUMNS
from scissordyn.kinematics.assembly import refined_assemblies
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import System
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.model.parameter_path import changed, number
from scissordyn.plan.hard_contact import hard_contacts, put_hard_numbers
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.system import make_system
from scissordyn.run.advance.driver import fill_history
from scissordyn.run.advance.tolerance import controller_delays
from scissordyn.run.ideal_path import ideal_path
from scissordyn.tolerance import DATA_TOL, ROUND_OFF_TOL

LARGEST_STEP = 4e-3  # [parameter scales] largest step of finite differences by a parameter

# [-] round-off of a difference with the step `LARGEST_STEP`; inversely proportional to the step
STEP_ROUND_OFF = float(np.finfo(float).eps) / LARGEST_STEP

# Central finite differences of sixth, fourth and second order: places in steps, and weights
CENTRAL_DIFFERENCES = (
    (-3, -2, -1, 1, 2, 3),
    (
        (-1 / 60, 3 / 20, -3 / 4, 3 / 4, -3 / 20, 1 / 60),
        (0, 1 / 12, -2 / 3, 2 / 3, -1 / 12, 0),
        (0, 0, -1 / 2, 1 / 2, 0, 0),
    ),
)
# Weights that interpolate the value at place 0 from the six places of `CENTRAL_DIFFERENCES`
MIDDLE_WEIGHTS = (1 / 20, -3 / 10, 3 / 4, 3 / 4, -3 / 10, 1 / 20)
# One-sided finite differences of sixth, fifth and fourth order: places in steps, and weights
FORWARD_DIFFERENCES = (
    (0, 1, 2, 3, 4, 5, 6),
    (
        (-49 / 20, 6, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6),
        (-137 / 60, 5, -5, 10 / 3, -5 / 4, 1 / 5, 0),
        (-25 / 12, 4, -3, 4 / 3, -1 / 4, 0, 0),
    ),
)

ANGLES = ("maps.offset", "state.reference")  # Names of the arrays that contain angles of bodies
NUMBERS = "parameters."  # First word of the names of arrays that are computed without compiling or assembling the mechanism

# Central and one-sided finite differences of fourth order: weight by place in steps
FOURTH_ORDER = tuple(
    {sense * place: sense * weight for place, weight in zip(places, orders[row], strict=True) if weight}
    for (places, orders), row, sense in ((CENTRAL_DIFFERENCES, 1, 1), (FORWARD_DIFFERENCES, 2, 1), (FORWARD_DIFFERENCES, 2, -1))
)

# Names of the fields of `System` that keep their values between evaluations
PERSISTENT_PARTS = ("model", "parameters", "state", "friction")


@dataclass(frozen=True)
class Parameter:
    """Parameter of a gradient: its path, its value in SI units, the scale of its changes, and its unit.

    `mechanism` returns the mechanism with another value of the parameter.
    """

    path: str
    value: float
    scale: float
    unit: str
    mechanism: Callable[[float], Mechanism]

    @property
    def has_size(self) -> bool:
        """False for a value of zero that is no length: then a relative change is no change."""
        return self.value != 0.0 or self.unit == "m"

    def moved(self, part: float) -> Mechanism:
        """Return the mechanism with the parameter changed by a fraction of its scale."""
        return self.mechanism(self.value + part * self.scale)


def weighted_mechanisms(mechanism: Callable[[float], Mechanism], step: float) -> list[tuple[float, float, Mechanism]]:
    """Return the terms of a derivative by parameter / scale: weight, change of the parameter / scale, changed mechanism.

    The differences are one-sided for a parameter at its bound. `mechanism` returns the mechanism with a changed parameter.
    """
    refused: ScissordynError | None = None
    for weights in FOURTH_ORDER:
        try:
            return [(weight / step, place * step, mechanism(place * step)) for place, weight in weights.items()]
        except ScissordynError as error:
            refused = refused or error
    assert refused is not None
    raise refused


def parameter_of(mechanism: Mechanism, path: str, size: float) -> Parameter:
    """Return the parameter at a path; the scale of its changes is its value, or `size` [m] for a length of zero."""
    place = number(mechanism, path)
    assert place.quantity is not None
    if isinstance(place.value, int):
        raise InputError(f"'{path}' is an integer", "a parameter that can change by any small amount")
    unit, value = place.quantity.unit, float(place.value)
    if place.quantity.zero and value == 0.0:
        raise InputError(f"'{path}' = 0 means {place.quantity.zero}: there is no derivative by it", "a value above zero")
    scale = abs(value) or (size if unit == "m" else 1.0)
    return Parameter(path, value, scale, unit, partial(changed, mechanism, path))


@dataclass
class Start:
    """Start of the runs of a mechanism, which gives their arrays.

    With `compared` there are also those of the ideal mechanism's path, with `curves` those of the bodies' maps.
    """

    mechanism: Mechanism
    kind: StartKind
    compared: Options | None = None
    curves: bool = False

    @cached_property
    def arrays(self) -> dict[str, np.ndarray]:
        return self.arrays_of(self.mechanism)

    @cached_property
    def has_plain_numbers(self) -> bool:
        """True if the start leaves the parameters of the kernels as the plan has them."""
        numbers = self.numbers_of(self.mechanism)
        return self.compared is None and all(numbers[name].tobytes() == self.arrays[name].tobytes() for name in numbers)

    def numbers_of(self, mechanism: Mechanism) -> dict[str, np.ndarray]:
        """Return the parameters of the kernels for a mechanism, by name."""
        return dict(_arrays(NUMBERS, plan(mechanism).numbers()))

    def arrays_of(self, mechanism: Mechanism) -> dict[str, np.ndarray]:
        """Return the arrays at the start of a mechanism, which differs from this one by the value of a parameter."""
        tables = plan(mechanism)
        arrays = arrays_at_start(tables, self.kind)
        if self.compared is not None:
            path = ideal_path(tables, self.compared)
            arrays["parameters.ideal"], arrays["parameters.ideal_step"] = path.table, np.array([path.step])
        if self.curves:
            arrays.update(_arrays("maps.", tables.maps))
        return arrays


def arrays_at_start(made: Plan, start: StartKind) -> dict[str, np.ndarray]:
    """Return the arrays of a system at the start of a run by name; "y" is the state, "log" the initial events."""
    system = make_system(made)
    with refined_assemblies():
        prepared = prepare_start(made, system, start)
    y = prepared.y
    functions.activate(system.address)
    functions.accept(0.0, y, system.address, np.zeros(3))
    content: System = system.content
    arrays = dict(_arrays("", {owner: getattr(content, owner) for owner in PERSISTENT_PARTS}))
    # the only work arrays that are written at the start and not again
    arrays["work.value"], arrays["work.part_weight"] = content.work.value, content.work.part_weight
    arrays["y"] = y
    arrays["delays"] = np.array(controller_delays(made))
    if arrays["state.initial_history"].size:
        fill_history(system, y)
    if made.hard_places:
        contacts = hard_contacts(made)
        put_hard_numbers(contacts, made)
        arrays.update(_arrays("hard.parameters.", contacts.parameters))
    arrays["log"] = np.array(prepared.initial_events, float).reshape(-1, LOG_COLUMNS)
    return arrays


def _arrays(path: str, content: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield path and content of all arrays in nested named tuples; a field of a structured array counts as an array."""
    for name, part in (content if isinstance(content, dict) else content._asdict()).items():
        if isinstance(part, np.ndarray) and part.dtype.names:
            yield from ((f"{path}{name}.{key}", part[key]) for key in part.dtype.names)
        elif isinstance(part, np.ndarray):
            yield f"{path}{name}", part
        elif hasattr(part, "_asdict"):
            yield from _arrays(f"{path}{name}.", part)


class JumpError(InputError):
    """Error: the start is no smooth function of the parameter at its value."""


class OtherContactsError(JumpError):
    """Error: a change of the parameter closes or opens a contact at the start."""


class IsolatedStartError(JumpError):
    """Error: the start at a parameter's value differs from those at smaller and larger values, which agree."""


@dataclass(frozen=True)
class _Slope:
    """Derivative of an array, its estimated error relative to the size of both, and True if a shorter step reduces it."""

    values: np.ndarray
    error: float
    truncated: bool


class SidedSlopes(NamedTuple):
    """Derivatives of the start's arrays by a parameter, divided by its scale, by name; without constant arrays.

    `side` has the values for which they hold, and the reason, if they are one-sided: for a parameter at its bound, or where the
    start jumps at its value. Up to a change by `reach` [parameter scales] the start is smooth, with the same contacts.
    """

    slopes: dict[str, np.ndarray]
    side: tuple[str, str] | None
    reach: float

    def start_limit(self, start: Start, parameter: Parameter, change: float) -> str:
        """Return why derivatives are not valid at the start for a change, a key of `LIMIT_REASONS`; empty if they are.

        The mechanism is assembled with the changed parameter if the change exceeds those of the differences.
        """
        if change <= self.reach or all(name.startswith(NUMBERS) for name in self.slopes):
            return ""
        n, y = plan(start.mechanism).coordinates.free, start.arrays["y"]
        slope = self.slopes.get("y", 0.0 * y)
        signs = (1.0, -1.0) if self.side is None else (1.0,) if self.side[0] == "larger values" else (-1.0,)
        for part in (change * sign for sign in signs):
            try:
                moved = _changed_arrays(start, parameter, part)["y"] - y
            except OtherContactsError:
                return "near"
            except ScissordynError:
                return "start"
            linear = part * slope
            for part_of_state in (slice(0, n), slice(n, 2 * n)):  # coordinates and rates
                sizes = [np.max(np.abs(array[part_of_state]), initial=0.0) for array in (moved - linear, linear, y)]
                if sizes[0] > 0.5 * sizes[1] + DATA_TOL * sizes[2]:
                    return "start"
        return ""


def derivatives(start: Start, parameter: Parameter) -> dict[str, np.ndarray]:
    """Return the derivatives of the start's arrays by the parameter divided by its scale, by name; without constant arrays."""
    return sided_derivatives(start, parameter).slopes


def sided_derivatives(start: Start, parameter: Parameter) -> SidedSlopes:
    """Return the derivatives of the start's arrays by a parameter."""
    refused: InputError | None = None
    for places, weights in (CENTRAL_DIFFERENCES, FORWARD_DIFFERENCES, _mirrored(FORWARD_DIFFERENCES)):
        try:
            slopes, reach = _derivatives_at(start, parameter, places, weights)
        except IsolatedStartError:
            raise
        except ScissordynError as error:
            if refused is None or isinstance(error, JumpError):
                refused = error if isinstance(error, InputError) else InputError(str(error))
            continue
        side = None if refused is None else ("larger values" if places[-1] > 0 else "smaller values", str(refused))
        return SidedSlopes(slopes, side, reach)
    assert refused is not None
    raise InputError(
        refused.what if parameter.path in refused.what else f"'{parameter.path}' cannot change alone: {refused.what}",
        refused.expected or "another parameter, or a pattern that changes several parameters together",
    )


def _derivatives_at(
    start: Start, parameter: Parameter, places: Sequence[int], weights: Sequence[Sequence[float]]
) -> tuple[dict[str, np.ndarray], float]:
    """Return the derivatives of the start's arrays by differences, for each array with the step of its smallest error.

    Return also the largest change of the shortest differences [parameter scales].
    """
    most_steps, longest, shortest = 6, 0.5, 1.0 / 64.0  # number of tried steps, and ratios of a step to the one before
    step, best, largest = LARGEST_STEP, dict[str, _Slope](), 1.0
    for tried in range(most_steps):
        tried_step = step
        try:
            slopes_by_name = _derivatives_by(start, parameter, step, places, weights)
        except OtherContactsError:
            if best or tried == most_steps - 1:
                raise
            step *= shortest
            continue
        except IsolatedStartError:
            if tried > 0:
                raise
            step *= shortest
            continue
        for name, slope in slopes_by_name.items():
            if name not in best or slope.error < best[name].error:
                best[name] = slope
        largest = max(
            (slope.error for slope in slopes_by_name.values() if slope.truncated or slope.error > DATA_TOL), default=0.0
        )
        accurate = all(slope.error <= DATA_TOL for slope in best.values())
        if largest <= STEP_ROUND_OFF or (accurate and tried >= 2):
            break
        step *= min(longest, max(shortest, (STEP_ROUND_OFF / largest) ** (1 / 7)))
    if any(slope.error > DATA_TOL for slope in best.values()):
        raise JumpError(
            f"'{parameter.path}' = {parameter.value:g}: the arrays at the start are not smooth functions of it",
            "another value of the parameter",
        )
    return {name: slope.values for name, slope in best.items()}, min(map(abs, (places[-1], places[1]))) * tried_step


def _derivatives_by(
    start: Start, parameter: Parameter, step: float, places: Sequence[int], weights: Sequence[Sequence[float]]
) -> dict[str, _Slope]:
    """Return the derivatives of the arrays by differences with a step [parameter scales]."""
    changed = {place: _changed_arrays(start, parameter, place * step) for place in (places[-1], places[1])}
    # in a shorter step round-off hides a bend
    slopes = _linear_slopes(start.arrays, changed, step) if step == LARGEST_STEP else None
    if slopes is not None:
        return {name: _Slope(values, 0.0, False) for name, values in slopes.items()}
    constant = start.has_plain_numbers and not any(
        _is_changed(start.arrays, changed.values(), name) for name in start.arrays if not name.startswith(NUMBERS)
    )
    several = [
        changed[place] if place in changed else _changed_arrays(start, parameter, place * step, constant=constant)
        for place in places
    ]
    if places[0] != 0 and _is_isolated(start.arrays["y"], [arrays["y"] for arrays in several]):
        raise IsolatedStartError(
            f"'{parameter.path}' = {parameter.value:g}: the start of the run is another one at all smaller and larger values",
            "a parameter that can change alone",
        )
    return _differences(start.arrays, several, weights, step)


def _is_isolated(state: np.ndarray, several: Sequence[np.ndarray]) -> bool:
    """Return whether a state is not that between states at smaller and larger values of a parameter.

    Central differences do not contain it. A loop that closes within round-off only at this value starts otherwise beside it.
    """
    middle = np.tensordot(np.array(MIDDLE_WEIGHTS), np.stack(several), 1)
    return bool(np.max(np.abs(middle - state), initial=0.0) > DATA_TOL * np.max(np.abs(state), initial=0.0))


def _is_changed(base: dict[str, np.ndarray], several: Iterable[dict[str, np.ndarray]], name: str) -> bool:
    """Return whether an array differs from that of the start in any of several mechanisms."""
    return any(arrays[name] is not base[name] and arrays[name].tobytes() != base[name].tobytes() for arrays in several)


def _linear_slopes(
    base: dict[str, np.ndarray], known: dict[int, dict[str, np.ndarray]], step: float
) -> dict[str, np.ndarray] | None:
    """Return the derivatives of arrays from two changes of a parameter if all are linear up to round-off, else None.

    The second divided difference of an array that is not linear exceeds the round-off of its three values.
    """
    (far, far_arrays), (near, near_arrays) = known.items()
    from_base = far * near > 0  # both on one side
    roundings = 4.0  # number of them by which a linear array may differ from a line
    slopes = dict[str, np.ndarray]()
    for name, array in base.items():
        if array.dtype.kind != "f" or not array.size or not _is_changed(base, known.values(), name):
            continue
        with np.errstate(invalid="ignore"):
            terms = near * far_arrays[name], -far * near_arrays[name], (far - near) * array
            bend, size = np.abs(sum(terms)), sum(map(np.abs, terms))
            slope = (far_arrays[name] - (array if from_base else near_arrays[name])) / (
                (far if from_base else far - near) * step
            )
        if np.any(bend > roundings * np.finfo(float).eps * size):
            return None
        slope[~np.isfinite(slope)] = 0.0
        if np.any(slope):
            slopes[name] = slope
    return slopes


def _mirrored(scheme: Any) -> Any:
    places, weights = scheme
    return tuple(-place for place in places), tuple(tuple(-weight for weight in order) for order in weights)


def _changed_arrays(start: Start, parameter: Parameter, part: float, *, constant: bool = False) -> dict[str, np.ndarray]:
    """Return the arrays with the parameter changed by a part of its scale; with `constant` only its numbers change."""
    if part == 0.0:
        return start.arrays
    if constant:
        return {**start.arrays, **start.numbers_of(parameter.moved(part))}
    arrays = start.arrays_of(parameter.moved(part))
    for name, array in start.arrays.items():
        changed = arrays[name]
        if changed is array:  # a table that both mechanisms share
            continue
        if changed.shape != array.shape or (array.dtype.kind == "i" and changed.tobytes() != array.tobytes()):
            if name == "state.mode" and changed.shape == array.shape:
                raise OtherContactsError(
                    f"'{parameter.path}': a small change of it begins or ends a contact at the start",
                    "another start of the run",
                )
            raise InputError("a change of the parameter changes the structure of the mechanism")
    return arrays


def _differences(
    base: dict[str, np.ndarray], several: Sequence[dict[str, np.ndarray]], weights: Sequence[Sequence[float]], step: float
) -> dict[str, _Slope]:
    most_ratio = 0.25  # largest ratio of the distance between orders 4 and 6 to that between 2 and 4 if a shorter step helps
    slopes = dict[str, _Slope]()
    for name, array in base.items():
        if array.dtype.kind != "f" or not array.size:
            continue
        if not _is_changed(base, several, name):
            continue
        with np.errstate(invalid="ignore"):
            stack = np.stack([arrays[name] for arrays in several]) - array
        stack[~np.isfinite(stack)] = 0.0
        if not np.any(stack):  # the arrays differ only in the sign of zeros
            continue
        sixth, fourth, second = (np.tensordot(np.array(order), stack, 1) / step for order in weights)
        sixth[np.abs(sixth) <= ROUND_OFF_TOL * np.tensordot(np.abs(weights[0]), np.abs(stack), 1) / step] = 0.0
        last, before = float(np.max(np.abs(sixth - fourth))), float(np.max(np.abs(fourth - second)))
        scale = float(np.max(np.abs(array[np.isfinite(array)]), initial=0.0) + np.max(np.abs(sixth)))
        if name in ANGLES:
            scale = max(scale, 1.0)  # [rad] angles of zero have round-off
        ratio = last / before if before > 0.0 else 0.0
        # the workspace of friction in ideal joints may be discontinuous
        error = min(1.0, ratio) * last / scale if scale > 0.0 and "friction" not in name else 0.0
        # the ratio of round-off is about 1
        slopes[name] = _Slope(sixth, error, ratio < most_ratio)
    return slopes
