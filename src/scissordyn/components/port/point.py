"""Port on a point of a body: its position [m], the direction of the body's x axis, and a force on it [N]."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, frame, place
from scissordyn.components.port.stroke import Drawn, Scene, Strokes
from scissordyn.kernel import kernel


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachments of the point and of its body's direction."""
    return place(component.point), frame(2, component.point[0])


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return the initial position and direction."""
    angle = turned(component.point[0])
    return (*where(component.point), math.cos(angle), math.sin(angle))


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw an arrow that ends at the point, along the force, with a length relative to the run's largest force."""
    vector = 3.0 * scene.size * scene.force(component)
    tip = scene.place(component.point)
    across = np.stack([-vector[:, 1], vector[:, 0]], axis=-1)
    tail = tip - vector
    head = np.stack([tip - 0.3 * vector + 0.12 * across, tip, tip - 0.3 * vector - 0.12 * across], axis=1)
    return (np.stack([tail, tip], axis=1), head), tail


# Attachment of a component at one point, by its position and the direction of its body
POINT = Port(
    name="point",
    code=3,
    coordinates=("x", "y", "cosine", "sine"),
    rates=("x_rate", "y_rate", "cosine_rate", "sine_rate"),
    forces=("force_x", "force_y"),
    points=("point",),
    outputs=(Output("force", "N", "force on the point", components=2),),
    symbols={"arrow": ()},
    attachments=attachments,
    start=start,
    drawn=drawn,
)


@kernel
def sense(maps, angle, q, v):
    """Write the coordinates of the port, position of the point and x axis of its body, to q, and their rates to v."""
    q[0], q[1], q[2], q[3] = maps[0], maps[1], maps[2], maps[3]
    v[0], v[1], v[2], v[3] = maps[6], maps[7], maps[8], maps[9]


@kernel
def forces(maps, q, out):
    """Return the forces on the maps."""
    return out[0], out[1], 0.0, 0.0, 0.0, 0.0


@kernel
def wrench(maps, along, out, fx, fy):
    """Return the force on the point."""
    return out[0], out[1], 0.0, 0.0


@kernel
def gradients(maps, G, R):
    """Write to G the derivatives of the coordinates with respect to the maps, the numbers that describe both attachments."""
    G[0, 0] = G[1, 1] = G[2, 2] = G[3, 3] = 1.0


@kernel
def curvature(q, out, G, K):
    """Add nothing: the coordinates are linear in the maps."""
