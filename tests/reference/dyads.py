"""Positions of linkages point by point, as intersections of circles. No equation of the package is used."""

import cmath
import math

__all__ = ["carried", "meet", "polar"]


def polar(length, angle):
    """Return a vector as a complex number."""
    return cmath.rect(length, angle)


def meet(first, near, second, far, *, left):
    """Return the point at distance `near` from the first and `far` from the second point, left or right of their line."""
    span = abs(second - first)
    along = (near**2 - far**2 + span**2) / (2.0 * span)
    height = math.sqrt(near**2 - along**2)
    unit = (second - first) / span
    return first + unit * complex(along, height if left else -height)


def carried(first, second, in_body, length):
    """Return a point of a rigid body whose frame has its origin at the first point and its x axis towards the second one."""
    return first + in_body * (second - first) / length
