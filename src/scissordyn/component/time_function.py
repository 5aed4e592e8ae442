"""Functions of time, for prescribed angles and lengths, loads and references."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from scissordyn.errors import InputError
from scissordyn.units import Quantity, check_quantities, checked


@dataclass(frozen=True)
class ConstantSpeed:
    """theta = theta_0 + w t, with theta_0 the angle of the body at the start.

    Parameters
    ----------
    speed : float
        w [rad/s].
    """

    speed: Annotated[float, Quantity("rad/s", help="angular velocity")]

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True)
class Harmonic:
    """theta = theta_m + theta_a sin(W t + phi).

    Parameters
    ----------
    mean, amplitude : float
        theta_m and theta_a [rad].
    angular_frequency : float
        W [rad/s].
    phase : float
        phi [rad].
    """

    mean: Annotated[float, Quantity("rad", help="mean angle")]
    amplitude: Annotated[float, Quantity("rad", help="amplitude of the angle")]
    angular_frequency: Annotated[float, Quantity("rad/s", above=0.0, help="angular frequency; 1 Hz is one turn per second")]
    phase: Annotated[float, Quantity("rad", help="phase at t = 0")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True)
class Tabulated:
    """Values at instants, interpolated by a spline of fifth degree, which is four times continuously differentiable.

    Parameters
    ----------
    times : tuple of float
        Increasing instants [s], at least six.
    values : tuple of float
        Values there: [rad] for an angle, [m] for a length, [N m] for a torque, [1] for a factor.
    """

    times: Annotated[tuple[float, ...], Quantity("s", help="instants")]
    values: Annotated[tuple[float, ...], Quantity("1", help="values in SI")]

    def __post_init__(self) -> None:
        check_quantities(self)
        times, values = np.asarray(self.times, float), np.asarray(self.values, float)
        if times.ndim != 1 or times.shape != values.shape or times.size < 6:
            raise InputError(
                f"table of {times.size} times and {values.size} values", "as many values as times, six or more of them"
            )
        if not np.all(np.diff(times) > 0.0):
            raise InputError("table with times that do not increase", "increasing times")


@checked
def tabulated(
    function: Callable[[float], float],
    *,
    until: Annotated[float, Quantity("s", above=0.0, help="last instant")],
    points: Annotated[int, Quantity("1", minimum=6, maximum=10_000_000, help="number of instants")] = 2001,
) -> Tabulated:
    """Any time function: a Python function of time, sampled into a table.

    Parameters
    ----------
    function : callable
        Value at time [s].
    until : float
        Last instant of the table [s].
    points : int
        Number of instants; the error of the spline is of sixth order in their distance.

    Returns
    -------
    Tabulated
    """
    times = np.linspace(0.0, until, points)
    return Tabulated(tuple(times.tolist()), tuple(float(function(t)) for t in times.tolist()))


@dataclass(frozen=True)
class Polynomial:
    """A polynomial of time of at most fifth degree: c_0 + c_1 t + c_2 t^2 + ...

    Parameters
    ----------
    coefficients : tuple of float
        c_0 [rad], c_1 [rad/s], ..., at most six.
    """

    coefficients: Annotated[tuple[float, ...], Quantity("1", minimum=-1e15, maximum=1e15, help="from the constant up, in SI")]

    def __post_init__(self) -> None:
        check_quantities(self)
        if not 1 <= len(self.coefficients) <= 6:
            raise InputError(f"polynomial with {len(self.coefficients)} coefficients", "one to six")


@dataclass(frozen=True)
class Cycloidal:
    """A smooth move from one value to another, at rest before and after, with zero acceleration at both ends.

    Parameters
    ----------
    start, end : float
        Values before and after [rad].
    duration : float
        Of the move [s], which starts at t = 0.
    """

    start: Annotated[float, Quantity("rad", help="value before the move")]
    end: Annotated[float, Quantity("rad", help="value after the move")]
    duration: Annotated[float, Quantity("s", above=0.0, help="duration of the move")]

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True)
class Trapezoidal:
    """A move from one value to another with constant acceleration, constant speed, constant deceleration, to and fro if wanted.

    Parameters
    ----------
    start, end : float
        Values before and after the first stroke [rad].
    duration : float
        Of a stroke [s]; the first one starts at t = 0. The constant speed is |end - start| / (duration (1 - ramp)).
    ramp : float
        Fraction of the duration that each of the two ramps takes [1].
    strokes : int
        Strokes to and fro, each of which reverses the one before; it rests after the last.
    begin : float
        Time of the first stroke that is over at t = 0 [s].
    """

    start: Annotated[float, Quantity("rad", help="value before the move")]
    end: Annotated[float, Quantity("rad", help="value after the move")]
    duration: Annotated[float, Quantity("s", above=0.0, help="duration of the move")]
    ramp: Annotated[float, Quantity("1", above=0.0, maximum=0.5, help="fraction of each ramp")] = 0.25
    strokes: Annotated[int, Quantity("1", minimum=1, maximum=10_000, help="strokes to and fro before it rests")] = 1
    begin: Annotated[float, Quantity("s", minimum=0.0, help="time of the first stroke that is over at t = 0")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.begin >= self.duration:
            raise InputError(
                f"a stroke of {self.duration:g} s that begins after {self.begin:g} s", "a beginning within the first stroke"
            )

    def after(self, value: float) -> float:
        """Time of a stroke after which it is at a value between start and end [s]."""
        part, speed = (value - self.start) / (self.end - self.start), 1.0 / (1.0 - self.ramp)
        near = min(part, 1.0 - part)
        time = math.sqrt(2.0 * self.ramp * near / speed) if near < 0.5 * speed * self.ramp else near / speed + 0.5 * self.ramp
        return self.duration * (time if part < 0.5 else 1.0 - time)


TimeFunction = ConstantSpeed | Harmonic | Tabulated | Polynomial | Cycloidal | Trapezoidal


@dataclass(frozen=True)
class OverTime:
    """What an annotated time function gives: ``Annotated[TimeFunction | None, OverTime("m", "the distance over time")]``."""

    unit: str  # SI unit of its values
    help: str


Factor = Annotated[TimeFunction | None, OverTime("1", "a factor over time, 1 without it")]
