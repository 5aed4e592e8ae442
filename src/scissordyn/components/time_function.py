"""Define functions of time for prescribed angles and lengths, loads and references."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, check_quantities, checked, documented


@dataclass(frozen=True)
class _Checked:
    """Base of time functions that checks the bounds of their parameters."""

    def __post_init__(self) -> None:
        check_quantities(self)


@documented
@dataclass(frozen=True)
class ConstantSpeed(_Checked):
    """Constant speed: theta = theta_0 + w t with the initial angle theta_0 of the body."""

    speed: Annotated[float, Quantity("rad/s", help="angular velocity w")]


@documented
@dataclass(frozen=True)
class Harmonic(_Checked):
    """Harmonic motion: theta = theta_m + theta_a sin(W t + phi)."""

    mean: Annotated[float, Quantity("rad", help="mean angle theta_m")]
    amplitude: Annotated[float, Quantity("rad", help="amplitude theta_a of the angle")]
    angular_frequency: Annotated[float, Quantity("rad/s", above=0.0, help="angular frequency W; 1 Hz is one turn per second")]
    phase: Annotated[float, Quantity("rad", help="phase phi at t = 0")] = 0.0


@documented
@dataclass(frozen=True)
class Tabulated(_Checked):
    """Values at instants, interpolated by a spline of fifth degree with four continuous derivatives."""

    times: Annotated[tuple[float, ...], Quantity("s", help="increasing instants, at least six")]
    values: Annotated[tuple[float, ...], Quantity("1", help="values there, in SI")]

    def __post_init__(self) -> None:
        super().__post_init__()
        times, values = np.asarray(self.times, float), np.asarray(self.values, float)
        if times.ndim != 1 or times.shape != values.shape or times.size < 6:
            raise InputError(
                f"the table has {times.size} times and {values.size} values", "as many values as times, at least six"
            )
        if not np.all(np.diff(times) > 0.0):
            raise InputError("the times of the table do not increase", "increasing times")


@documented
@checked
def tabulated(
    function: Annotated[Callable[[float], float], Meaning("value at a time [s]")],
    *,
    until: Annotated[float, Quantity("s", above=0.0, help="last instant")],
    points: Annotated[
        int,
        Quantity("1", minimum=6, maximum=10_000_000, help="number of instants; the error is of sixth order"),
    ] = 2001,
) -> Tabulated:
    """Sample a Python function of time into a table."""
    times = np.linspace(0.0, until, points)
    return Tabulated(tuple(times.tolist()), tuple(float(function(t)) for t in times.tolist()))


@documented
@dataclass(frozen=True)
class Polynomial(_Checked):
    """Polynomial of time of at most fifth degree: c_0 + c_1 t + c_2 t^2 + ..."""

    coefficients: Annotated[tuple[float, ...], Quantity("1", minimum=-1e15, maximum=1e15, help="c_0, c_1, ..., at most six")]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= len(self.coefficients) <= 6:
            raise InputError(f"the polynomial has {len(self.coefficients)} coefficients", "one to six coefficients")


@documented
@dataclass(frozen=True)
class Cycloidal(_Checked):
    """Smooth move from one value to another, at rest before and after, with zero acceleration at both ends."""

    start: Annotated[float, Quantity("rad", help="value before the move")]
    end: Annotated[float, Quantity("rad", help="value after the move")]
    duration: Annotated[float, Quantity("s", above=0.0, help="duration of the move")]


@documented
@dataclass(frozen=True)
class Trapezoidal(_Checked):
    """Move from one value to another with constant acceleration, constant speed and constant deceleration.

    The constant speed is the distance over duration (1 - ramp). Each further stroke reverses the previous one.
    """

    start: Annotated[float, Quantity("rad", help="value before the move")]
    end: Annotated[float, Quantity("rad", help="value after the move")]
    duration: Annotated[float, Quantity("s", above=0.0, help="duration of the move")]
    ramp: Annotated[float, Quantity("1", above=0.0, maximum=0.5, help="fraction of the duration that each ramp takes")] = 0.25
    strokes: Annotated[int, Quantity("1", minimum=1, maximum=10_000, help="strokes to and fro before it rests")] = 1
    begin: Annotated[float, Quantity("s", minimum=0.0, help="time of the first stroke that is over at t = 0")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.begin >= self.duration:
            raise InputError(
                f"begin = {self.begin:g} s is after the first stroke of {self.duration:g} s", "a begin within the first stroke"
            )

    def after(self, value: float) -> float:
        """Return the time [s] of a stroke at which a value between start and end is reached."""
        part, speed = (value - self.start) / (self.end - self.start), 1.0 / (1.0 - self.ramp)
        near = min(part, 1.0 - part)
        time = math.sqrt(2.0 * self.ramp * near / speed) if near < 0.5 * speed * self.ramp else near / speed + 0.5 * self.ramp
        return self.duration * (time if part < 0.5 else 1.0 - time)


TimeFunction = ConstantSpeed | Harmonic | Tabulated | Polynomial | Cycloidal | Trapezoidal


@dataclass(frozen=True)
class OverTime:
    """Meaning of a time function's values: ``Annotated[TimeFunction | None, OverTime("m", "the distance over time")]``."""

    unit: str  # SI unit of its values
    help: str


Factor = Annotated[TimeFunction | None, OverTime("1", "factor over time; 1 if not given")]
