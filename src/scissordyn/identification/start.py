"""Where a mechanism is when a record begins: as many numbers as it has degrees of freedom, and their rates."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from scissordyn.component.port import AXIS
from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import Held, Start, assemble, natural_state, placed_start
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.elimination import in_words
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import plan
from scissordyn.run.advance.system import make_system

ROUND_OFF = 1e-9  # Singular values of the constraints below this fraction of the largest are zero


def check_autonomous(mechanism: Mechanism) -> None:
    """Raise `InputError` unless the motion can begin at any instant of a record: nothing is prescribed, nothing is loose."""
    reasons = [f"the drive of '{drive.body}'" for drive in mechanism.drives]
    reasons += [f"rod '{rod.name}'" for rod in mechanism.rods if rod.motion is not None]
    reasons += [f"drive '{drive.name}'" for drive in mechanism.coordinate_drives]
    reasons += [f"'{part.name}'" for part in mechanism.components if getattr(part, "time_function", None) is not None]
    reasons += [f"the bending of '{part.name}'" for part in mechanism.components if part.declaration.port is AXIS]
    reasons += [f"clearance joint '{contact.name}'" for contact in mechanism.contacts]
    if reasons:
        raise InputError(
            f"segments with {in_words(reasons[:3])}, which a segment cannot start amid",
            "records without segments, whose start the case gives; its numbers may be free",
            "--free crank.angle --free crank.angular_velocity",
        )


@dataclass(frozen=True)
class Chart:
    """Positions and velocities of the bodies near a reference, by as few numbers as there are."""

    mechanism: Mechanism  # Placed at the reference
    # (natural coordinates, degrees of freedom) Along which it can move there; the largest entry of each is one
    directions: np.ndarray
    offsets: dict[str, int]  # First natural coordinate of each body
    position: np.ndarray  # Natural coordinates and their rates at the reference
    velocity: np.ndarray

    @property
    def size(self) -> int:
        """Numbers of a state: twice the degrees of freedom."""
        return 2 * int(self.directions.shape[1])

    def bodies(self, numbers: np.ndarray) -> tuple[Body, ...]:
        """The bodies as placed at a state, to first order: the assembly closes what is left."""
        half = self.directions.shape[1]
        position = self.position + self.directions @ numbers[:half]
        velocity = self.velocity + self.directions @ numbers[half:]
        return tuple(_placed(body, position, velocity, self.offsets[body.name]) for body in self.mechanism.bodies)


def _placed(body: Body, position: np.ndarray, velocity: np.ndarray, p: int) -> Body:
    changes: dict[str, object] = {
        "position": tuple(position[p : p + 2].tolist()),
        "velocity": tuple(velocity[p : p + 2].tolist()),
    }
    if body.rotates:
        (cos, sin), (cos_rate, sin_rate) = position[p + 2 : p + 4].tolist(), velocity[p + 2 : p + 4].tolist()
        angle = math.atan2(sin, cos)
        changes["angle"] = angle + 2.0 * math.pi * round((body.placed_angle - angle) / (2.0 * math.pi))  # turns count
        changes["angular_velocity"] = (cos * sin_rate - sin * cos_rate) / (cos * cos + sin * sin)
    return dataclasses.replace(body, **changes)  # type: ignore[arg-type]


def placed_at(mechanism: Mechanism, bodies: tuple[Body, ...]) -> Mechanism:
    """A mechanism whose bodies start where others of the same names are."""
    where = {body.name: body for body in bodies}
    names = ("position", "angle", "velocity", "angular_velocity")
    placed = [
        dataclasses.replace(body, **{name: getattr(where[body.name], name) for name in names}) for body in mechanism.bodies
    ]
    return mechanism.with_parts({"bodies": tuple(placed)}, check=False)


def chart_of(mechanism: Mechanism) -> Chart:
    """The chart about the position in which the bodies, as placed, are assembled."""
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
        free = rows[int(np.sum(sizes > ROUND_OFF * sizes.max(initial=0.0))) :].T
    if not free.shape[1]:
        raise InputError("segments of a mechanism that cannot move", "a mechanism with a degree of freedom")
    moving = coordinates.matrix[:, : coordinates.free] @ free
    moving = np.asarray(moving) / np.max(np.abs(moving), axis=0)
    position, velocity = natural_state(tables, system, start)
    chart = Chart(mechanism, moving, coordinates.natural.offsets, position, velocity)
    return dataclasses.replace(chart, mechanism=placed_at(mechanism, chart.bodies(np.zeros(chart.size))))
