"""Initial positions and velocities given in a description, as linear equations of the free coordinates.

Where joints and drives do not admit the given values, the assembly minimises the error in the norm of kinetic energy.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scissordyn.model.body import Body
from scissordyn.plan.coordinates import PointMap, combined
from scissordyn.plan.gradients import least_change, matrix_of
from scissordyn.plan.plan import Plan
from scissordyn.tolerance import ASSEMBLY_TOL


class Given(NamedTuple):
    """Linear equations for the initial positions or velocities that the user gives, weighted by the roots of mass and inertia.

    Their unknowns are the free coordinates x and the basis b of the drives, in one vector [x; b].
    """

    rows: Any
    target: np.ndarray

    def misses(self, full: np.ndarray) -> np.ndarray:
        """Return target minus actual value at the coordinates `full`."""
        return np.asarray(self.target - self.rows @ full)

    def is_met(self, full: np.ndarray) -> bool:
        """Return whether the coordinates `full` agree with the given positions or velocities up to round-off."""
        reached = np.asarray(self.rows @ full)
        largest = max(np.max(np.abs(self.target), initial=0.0), np.max(np.abs(reached), initial=0.0))
        return bool(np.all(np.abs(self.target - reached) <= ASSEMBLY_TOL * largest))


def prescribed_bodies(plan: Plan) -> set[str]:
    """Return the bodies whose initial angle is set by a drive or a controller's reference."""
    return {drive.body for drive in plan.drives} | {part.body for _, part in plan.actuators if part.start_on_reference}


def given_places(plan: Plan) -> Given | None:
    """Return the equations of the given positions and angles; None if the placement of the bodies meets them all."""
    if all(body.position is not None and (body.angle is not None or not body.rotates) for body in plan.bodies):
        return None
    prescribed, origins, directions = prescribed_bodies(plan), [], []
    for body in plan.bodies:
        angle = None if body.name in prescribed else body.angle
        origins.append(body.position)
        directions.append(None if angle is None else (math.cos(angle), math.sin(angle)))
    return _rows(plan, origins, directions)


def given_speeds(plan: Plan, full: np.ndarray) -> Given | None:
    """Return linear equations for the velocities and angular velocities that bodies are given; None if no body has any.

    `full` contains the free coordinates, then the drive directions.
    """
    if all(body.velocity is None and body.angular_velocity is None for body in plan.bodies):
        return None
    directions: list[tuple[float, float] | None] = []
    for body in plan.bodies:
        if body.angular_velocity is None:
            directions.append(None)
        else:
            cos, sin = plan.coordinates.direction(body.name).at(full) if body.rotates else (0.0, 0.0)
            directions.append((-body.angular_velocity * sin, body.angular_velocity * cos))
    return _rows(plan, [body.velocity for body in plan.bodies], directions)


def _rows(plan: Plan, origins: list[Any], directions: list[Any]) -> Given | None:
    """Return the equations of the given origins and directions, weighted by mass and moment of inertia."""
    maps: list[PointMap] = []
    target: list[float] = []
    for body, origin, direction in zip(plan.bodies, origins, directions, strict=True):
        for weight, (a, b, c) in _squares(body, origin is not None, direction is not None and body.rotates):
            place, frame = plan.coordinates.origin(body.name), plan.coordinates.direction(body.name)
            normal = PointMap(frame.columns, np.stack([-frame.rows[1], frame.rows[0]]))
            point_map = combined((place, a), (frame, b), (normal, c))
            (x, y), (dx, dy) = origin or (0.0, 0.0), direction or (0.0, 0.0)
            maps.append(PointMap(point_map.columns, weight * point_map.rows))
            target += [weight * (a * x + b * dx - c * dy), weight * (a * y + b * dy + c * dx)]
    if not maps:
        return None
    return Given(matrix_of(maps, plan.coordinates.free + plan.coordinates.basis), np.array(target))


def _squares(body: Body, origin: bool, direction: bool) -> list[tuple[float, tuple[float, float, float]]]:
    """Return the vectors that the given values of a body fix, as weights and coefficients of origin, direction and normal."""
    (x, y), inertia = body.centre, body.inertia or 0.0
    if origin and direction:
        return [(math.sqrt(body.mass), (1.0, x, y)), (math.sqrt(inertia), (0.0, 1.0, 0.0))]
    if direction:
        return [(math.sqrt(inertia + body.mass * (x * x + y * y)), (0.0, 1.0, 0.0))]
    return [(math.sqrt(body.mass), (1.0, 0.0, 0.0))] if origin else []


def change_towards(given: Given, missed: np.ndarray, jacobian: Any, free: int) -> np.ndarray:
    """Return the change of free coordinates that reduces the error `missed` of given values most and keeps the constraints.

    The constraints, with the gradients `jacobian`, are kept to first order. Of several such changes it is the smallest.
    """
    rows = given.rows[:, :free]
    rows = rows if isinstance(rows, np.ndarray) else rows.toarray()
    along = rows - least_change(jacobian, jacobian @ rows.T).T
    # directions that change the given values by less than 1e-8 of the largest are not used
    return np.asarray(np.linalg.lstsq(along, missed, rcond=1e-8)[0])
