"""Port of a line between two points: their distance [m], and a tension [N] that pulls them together."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, place
from scissordyn.components.port.stroke import Drawn, Scene, Strokes, arc, around, spiral, spread
from scissordyn.kernel import kernel


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachments of the end and the start."""
    return place(component.end), place(component.start, -1.0)


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return the initial coordinate of the port: the distance between both points [m]."""
    return (math.dist(where(component.start), where(component.end)),)


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw along the line."""
    return spread(strokes, scene.place(component.start), scene.place(component.end), scene.size)


def _coils() -> np.ndarray:
    part = np.concatenate([[0.0, 0.15], np.linspace(0.2, 0.8, 8), [0.85, 1.0]])
    aside = np.concatenate([[0.0, 0.0], np.resize([0.4, -0.4], 8), [0.0, 0.0]])
    return np.column_stack([part, np.zeros(part.size), aside])


# Strokes of symbols on a line: fraction of the distance, then coordinates along and across it [symbol sizes]
_STRAIGHT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
_DIAMOND = around(0.5, np.array([[-0.4, 0.0], [0.0, 0.3], [0.4, 0.0], [0.0, -0.3], [-0.4, 0.0]]))
_EYE = arc(0.25, 0.0, 360.0)
_REEL = (around(0.0, arc(0.7, 0.0, 360.0)), around(0.0, 0.65 * spiral()), np.array([[0.0, 0.0, 0.7], [1.0, 0.0, 0.0]]))
_CYLINDER = np.array(
    [
        [0.05, 0.0, 0.0],
        *([part, 0.0, aside] for part, aside in ((0.05, 0.3), (0.6, 0.3), (0.6, -0.3), (0.05, -0.3))),
        [0.05, 0.0, 0.0],
    ]
)
# Drawn piston and rod of a gas spring: fraction of the distance, along and across it [symbol sizes]
_PISTON = np.array([[0.4, 0.0, 0.3], [0.4, 0.0, -0.3], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]])

# Attachment of a component between two points, by their distance
LINE = Port(
    name="line",
    code=0,
    coordinates=("length",),
    rates=("rate",),
    forces=("tension",),
    points=("start", "end"),
    outputs=(
        Output("force", "N", "force along the line, positive in tension"),
        Output("length", "m", "distance of the two points", coordinate=True),
    ),
    symbols={
        "line": (_STRAIGHT, _DIAMOND),
        "spring": (_coils(),),
        "cable": (_STRAIGHT, around(0.0, _EYE), around(1.0, _EYE)),
        "coil": _REEL,
        "rod": (_STRAIGHT,),
        "gas": (np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]]), _CYLINDER, _PISTON),
    },
    attachments=attachments,
    start=start,
    drawn=drawn,
    sense=-1.0,
)


@kernel
def sense(maps, angle, q, v):
    """Write the coordinate of the port, a distance, to q, and its rate to v; at zero distance the speed of the points."""
    ux, uy, _, _, _, _, vx, vy, _, _, _, _ = maps
    q[0] = math.sqrt(ux * ux + uy * uy)
    v[0] = (ux * vx + uy * vy) / q[0] if q[0] > 0.0 else math.sqrt(vx * vx + vy * vy)


@kernel
def forces(maps, q, out):
    """Return the forces on the maps, against the line; zero without a direction."""
    if not q[0] > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return -out[0] * maps[0] / q[0], -out[0] * maps[1] / q[0], 0.0, 0.0, 0.0, 0.0


@kernel
def wrench(maps, along, out, fx, fy):
    """Return the force on the end; there are no torques."""
    return fx, fy, 0.0, 0.0


@kernel
def gradients(maps, G, R):
    """Compute the gradients of the distance and of its rate by the maps."""
    ux, uy, _, _, _, _, vx, vy, _, _, _, _ = maps
    length = math.sqrt(ux * ux + uy * uy)
    if length > 0.0:
        nx, ny = ux / length, uy / length
        along = nx * vx + ny * vy
        # the component of u' across the line, over its length, is the line's angular velocity
        G[0, 0], G[0, 1] = nx, ny
        R[0, 0], R[0, 1] = (vx - along * nx) / length, (vy - along * ny) / length


@kernel
def curvature(q, out, G, K):
    """Add the change of the maps' forces by the rotation of the gradients, at constant tension."""
    if q[0] > 0.0:
        across = -out[0] / q[0]
        nx, ny = G[0, 0], G[0, 1]
        K[0, 0] += across * (1.0 - nx * nx)
        K[0, 1] -= across * nx * ny
        K[1, 0] -= across * nx * ny
        K[1, 1] += across * (1.0 - ny * ny)
