"""Bars that are kinked at their pivot."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.component.place import Point
from scissordyn.model.body import Body
from scissordyn.units import Meaning, Quantity, checked, documented


@documented
@checked
def angulated_bar(
    name: str,
    *,
    first: Annotated[float, Quantity("m", above=0.0, help="from the start to the pivot")],
    second: Annotated[float, Quantity("m", above=0.0, help="from the pivot to the end")],
    kink: Annotated[float, Quantity("rad", help="angle from the direction of the first leg to that of the second")] = 0.0,
    mass: Annotated[float, Quantity("kg", above=0.0, help="of both legs, in proportion to their lengths")],
    position: Annotated[Point, Meaning("of its start [m]")] = (0.0, 0.0),
    angle: Annotated[float, Quantity("rad", help="direction of the first leg")] = 0.0,
) -> Body:
    """A uniform bar of two straight legs that meet at a pivot; without a kink a straight bar with a pivot outside its middle.

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
