"""Coordinates of states near a reference state, in terms of the degrees of freedom."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import Held, Start, assemble, natural_state, placed_start
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system


@dataclass(frozen=True)
class Chart:
    """Local coordinates of states near a reference state: displacements and rates along the degrees of freedom."""

    mechanism: Mechanism  # Mechanism at the reference state
    # (natural coordinates, degrees of freedom) Directions of motion at the reference, scaled to a largest entry of one
    directions: np.ndarray
    offsets: dict[str, int]  # Index of the first natural coordinate of each body
    position: np.ndarray  # Natural coordinates at the reference
    velocity: np.ndarray  # Rates of the natural coordinates at the reference

    @property
    def size(self) -> int:
        """Number of local coordinates of a state: twice the degrees of freedom."""
        return 2 * int(self.directions.shape[1])

    def mechanism_at(self, mechanism: Mechanism, numbers: np.ndarray) -> Mechanism:
        """Return a mechanism whose bodies start at the state with the local coordinates `numbers`.

        The state is linearised about the reference; the assembly of the mechanism corrects the error of second order.

        Shapes: `numbers` (size,), displacements and then rates along the degrees of freedom.
        """
        half = self.directions.shape[1]
        position = self.position + self.directions @ numbers[:half]
        velocity = self.velocity + self.directions @ numbers[half:]
        return with_start_states(
            mechanism, [_with_start(body, position, velocity, self.offsets[body.name]) for body in self.mechanism.bodies]
        )


def _with_start(body: Body, position: np.ndarray, velocity: np.ndarray, p: int) -> Body:
    """Return a body that starts with natural coordinates and rates; those of the body begin at index `p`."""
    changes: dict[str, object] = {
        "position": tuple(position[p : p + 2].tolist()),
        "velocity": tuple(velocity[p : p + 2].tolist()),
    }
    if body.rotates:
        (cos, sin), (cos_rate, sin_rate) = position[p + 2 : p + 4].tolist(), velocity[p + 2 : p + 4].tolist()
        angle = math.atan2(sin, cos)
        # keep the full turns of the body's angle
        changes["angle"] = angle + 2.0 * math.pi * round((body.placed_angle - angle) / (2.0 * math.pi))
        changes["angular_velocity"] = (cos * sin_rate - sin * cos_rate) / (cos * cos + sin * sin)
    return dataclasses.replace(body, **changes)  # type: ignore[arg-type]


def with_start_states(mechanism: Mechanism, bodies: Iterable[Body]) -> Mechanism:
    """Return a mechanism whose bodies start with the positions and velocities of the bodies of the same names in `bodies`."""
    where = {body.name: body for body in bodies}
    names = ("position", "angle", "velocity", "angular_velocity")
    placed = [
        dataclasses.replace(body, **{name: getattr(where[body.name], name) for name in names}) for body in mechanism.bodies
    ]
    return mechanism.with_parts({"bodies": tuple(placed)}, check=False)


def chart_of(mechanism: Mechanism) -> Chart:
    """Assemble a mechanism and return the coordinates of states near its start; raise `InputError` if it cannot move."""
    tables = plan(mechanism)
    system = make_system(tables).content
    start: Start = assemble(tables, system, placed_start(tables, system), Held(places=True, speeds=True))
    coordinates = tables.coordinates
    constraints = [constraint for constraint in coordinates.constraints if not constraint.latch]
    free = np.eye(coordinates.free)
    if constraints:
        gradients = Gradients(coordinates.free, coordinates.basis, constraints)
        jacobian = gradients.jacobian(np.append(start.position, np.ones(coordinates.basis)))[:, : coordinates.free]
        dense = np.asarray(jacobian if isinstance(jacobian, np.ndarray) else jacobian.toarray())
        _, sizes, rows = np.linalg.svd(dense)
        free = rows[
            int(np.sum(sizes > 1e-9 * sizes.max(initial=0.0))) :
        ].T  # singular values below 1e-9 of the largest count as zero
    if not free.shape[1]:
        raise InputError(
            "segments: the mechanism cannot move, so a start cannot be estimated", "at least one degree of freedom"
        )
    moving = coordinates.matrix[:, : coordinates.free] @ free
    moving = np.asarray(moving) / np.max(np.abs(moving), axis=0)
    position, velocity = natural_state(tables, system, start)
    chart = Chart(mechanism, moving, coordinates.natural.offsets, position, velocity)
    return dataclasses.replace(chart, mechanism=chart.mechanism_at(mechanism, np.zeros(chart.size)))
