"""Bars that are kinked at their pivot."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.component.place import Point
from scissordyn.model.body import Body
from scissordyn.units import Quantity, checked


@checked
def angulated_bar(
    name: str,
    *,
    first: Annotated[float, Quantity("m", above=0.0)],
    second: Annotated[float, Quantity("m", above=0.0)],
    kink: Annotated[float, Quantity("rad")] = 0.0,
    mass: Annotated[float, Quantity("kg", above=0.0)],
    position: Point = (0.0, 0.0),
    angle: Annotated[float, Quantity("rad")] = 0.0,
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
