"""Port of a point that travels along a fixed direction: its coordinate [m], and a force along it [N]."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, place
from scissordyn.components.port.stroke import Drawn, Scene, Strokes, hatched, turned
from scissordyn.kernel import kernel


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachment of the point along the direction."""
    return (place(component.point, along=component.direction),)


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return the initial coordinate."""
    x, y = where(component.point)
    return (x * math.cos(component.direction) + y * math.sin(component.direction),)


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw at the point along the direction; a stop is drawn at its limit."""
    where = scene.place(component.point)
    turn = component.direction + scene.angle(GROUND)
    if component.declaration.symbol == "stop":
        along = np.array([math.cos(turn[0]), math.sin(turn[0])])
        where = where + (component.limit - where @ along)[:, None] * along
    return turned(strokes, where, turn, scene.size), where


_SHAFT = np.array([[-1.5, 0.0], [1.5, 0.0]])  # Drawn shaft of an arrow along the direction of travel [symbol sizes]
_HEAD = np.array([[1.1, 0.25], [1.5, 0.0], [1.1, -0.25]])  # Drawn head of an arrow along the direction of travel [symbol sizes]

# Attachment of a component at one point, by its position along a fixed direction
TRAVEL = Port(
    name="travel",
    code=2,
    coordinates=("travel",),
    rates=("speed",),
    forces=("force",),
    points=("point",),
    numbers=("direction",),
    outputs=(
        Output("force", "N", "force along the direction of travel"),
        Output("travel", "m", "coordinate along the direction of travel", coordinate=True),
    ),
    symbols={
        "travel": (_SHAFT, _HEAD, _HEAD * (-1.0, 1.0)),
        "stop": hatched(np.array([0.0, -1.2]), np.array([0.0, 1.2]), np.array([0.4, 0.4]), 6),
    },
    attachments=attachments,
    start=start,
    drawn=drawn,
)


@kernel
def sense(maps, angle, q, v):
    """Write the coordinate of the port to q, and its rate to v."""
    q[0], v[0] = maps[0], maps[6]


@kernel
def forces(maps, q, out):
    """Return the forces on the maps."""
    return out[0], 0.0, 0.0, 0.0, 0.0, 0.0


@kernel
def wrench(maps, along, out, fx, fy):
    """Return the force out[0] on the point, along the unit vector `along` of its travel; there are no torques."""
    return out[0] * along[0], out[0] * along[1], 0.0, 0.0


@kernel
def gradients(maps, G, R):
    """Compute the gradient of the coordinate by the maps."""
    G[0, 0] = 1.0


@kernel
def curvature(q, out, G, K):
    """Add nothing: the coordinate is linear in the maps."""
