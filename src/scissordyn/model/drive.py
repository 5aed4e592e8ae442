"""Prescribed motions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from scissordyn.errors import InputError
from scissordyn.units import Quantity, check_quantities

__all__ = ["ConstantSpeed", "Drive", "Harmonic", "Motion", "TableMotion", "tabulated"]


@dataclass(frozen=True)
class ConstantSpeed:
    """theta = theta_0 + w t, theta_0 the angle that the body has at the start.

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
    frequency : float
        W [rad/s].
    phase : float
        phi [rad].
    """

    mean: Annotated[float, Quantity("rad", help="mean angle")]
    amplitude: Annotated[float, Quantity("rad", help="amplitude of the angle")]
    frequency: Annotated[float, Quantity("rad/s", above=0.0, help="angular frequency of the drive")]
    phase: Annotated[float, Quantity("rad", help="phase at t = 0")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True)
class TableMotion:
    """An angle given at instants; a spline of fifth degree, four times continuously differentiable, runs through them.

    Parameters
    ----------
    times : tuple of float
        Increasing instants [s], at least six.
    angles : tuple of float
        Angles there [rad].
    """

    times: tuple[float, ...]
    angles: tuple[float, ...]

    def __post_init__(self) -> None:
        times, angles = np.asarray(self.times, float), np.asarray(self.angles, float)
        if times.ndim != 1 or times.shape != angles.shape or times.size < 6:
            raise InputError(
                f"table of {times.size} times and {angles.size} angles", "as many angles as times, six or more of them"
            )
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(angles)) and np.all(np.diff(times) > 0.0)):
            raise InputError("table with values that are not finite or times that do not increase", "increasing times")


def tabulated(angle: Callable[[float], float], *, until: float, points: int = 2001) -> TableMotion:
    """Any prescribed angle: a Python function of time, sampled into a table.

    Parameters
    ----------
    angle : callable
        Angle [rad] at time [s].
    until : float
        Last instant of the table [s].
    points : int
        How many instants; the spline's error falls with the sixth power of their distance.

    Returns
    -------
    TableMotion
    """
    times = np.linspace(0.0, until, points)
    return TableMotion(tuple(times.tolist()), tuple(float(angle(t)) for t in times.tolist()))


Motion = ConstantSpeed | Harmonic | TableMotion


@dataclass(frozen=True)
class Drive:
    """A motor that makes a body's direction follow a motion, whatever torque that takes.

    Parameters
    ----------
    body : str
        The driven body.
    motion : ConstantSpeed, Harmonic or TableMotion
        Its prescribed angle.
    """

    body: str
    motion: Motion

    def angle_at_start(self, placed: float) -> float:
        """The prescribed angle at t = 0 [rad], for a body placed at an angle `placed`."""
        if isinstance(self.motion, ConstantSpeed):
            return placed
        if isinstance(self.motion, Harmonic):
            return self.motion.mean + self.motion.amplitude * math.sin(self.motion.phase)
        return float(np.interp(0.0, self.motion.times, self.motion.angles))
