"""Bars that are kinked at their pivot."""

from __future__ import annotations

import math

from scissordyn.component.place import Point
from scissordyn.errors import InputError
from scissordyn.model.body import Body

__all__ = ["angulated_bar", "check_lengths"]


def check_lengths(**lengths: float) -> None:
    """Raise `InputError` for the first length that is not a finite number above zero."""
    for name, length in lengths.items():
        if isinstance(length, bool) or not isinstance(length, int | float) or not (math.isfinite(length) and length > 0.0):
            raise InputError(f"{name} = {length!r}", "a finite number > 0 [m]")


def angulated_bar(
    name: str,
    *,
    first: float,
    second: float,
    kink: float = 0.0,
    mass: float,
    position: Point = (0.0, 0.0),
    angle: float = 0.0,
) -> Body:
    """A uniform bar of two straight legs that meet at a pivot; without a kink a straight bar with a pivot outside its middle.

    Parameters
    ----------
    name : str
    first, second : float
        Lengths from the start to the pivot and from there to the end [m].
    kink : float
        Angle from the direction of the first leg to that of the second [rad].
    mass : float
        Of both legs, distributed in proportion to their lengths [kg].
    position : (float, float)
        Position of its start [m].
    angle : float
        Direction of the first leg [rad].

    Returns
    -------
    Body
        With points "start", "pivot" and "end".
    """
    check_lengths(first=first, second=second)
    end = first + second * math.cos(kink), second * math.sin(kink)
    fractions = first / (first + second), second / (first + second)
    middles = (0.5 * first, 0.0), (0.5 * (first + end[0]), 0.5 * end[1])
    centre = tuple(sum(fraction * middle[axis] for fraction, middle in zip(fractions, middles, strict=True)) for axis in (0, 1))
    legs = zip(fractions, (first, second), middles, strict=True)
    inertia = mass * sum(fraction * (leg**2 / 12.0 + math.dist(middle, centre) ** 2) for fraction, leg, middle in legs)
    return Body(
        name=name,
        mass=mass,
        inertia=inertia,
        points={"start": (0.0, 0.0), "pivot": (first, 0.0), "end": end},
        centre=(centre[0], centre[1]),
        position=position,
        angle=angle,
    )
