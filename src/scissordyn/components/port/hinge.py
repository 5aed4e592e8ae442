"""Port of a hinge: the angle of one body relative to another [rad], including full turns, and a torque [N m] on the first."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, direction, frame, place
from scissordyn.components.port.stroke import SQUARE, Drawn, Scene, Strokes, arc, hatched, spiral, turned
from scissordyn.kernel import kernel


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachments of both bodies' directions."""
    return direction(2, component.body), frame(4, component.base)


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return the initial angle."""
    return (turned(component.body) - turned(component.base),)


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw around the pivot, turning with the body; the letter of a motor stays upright."""
    where, enlarged = scene.pivot(component.body, component.base)
    angle = scene.angle(component.body) * (component.declaration.symbol != "motor")
    return turned(strokes, where, angle, scene.size * enlarged), where


# Strokes of symbols about the pivot [symbol sizes]: circle with the letter M, section of a tape spring, arrow head, latch
_MOTOR = (arc(1.0, 0.0, 360.0, 37), np.array([[-0.4, -0.4], [-0.4, 0.4], [0.0, -0.1], [0.4, 0.4], [0.4, -0.4]]))
_TAPE = np.concatenate([arc(0.8, -60.0, 60.0), arc(1.15, 60.0, -60.0), arc(0.8, -60.0, -59.0, 2)[:1]])
_ARROW_HEAD = np.array([[-1.0, 0.85], arc(1.0, 135.0, 135.0, 1)[0], [-0.45, 1.15]])
_HOOK = np.array([[0.3, -1.3], [1.2, -1.3], [1.2, -0.5], [0.85, -0.5], [0.85, -0.95], [0.3, -0.95], [0.3, -1.3]])

# Attachment of a component between two bodies, by their relative angle
HINGE = Port(
    name="hinge",
    code=1,
    coordinates=("angle",),
    rates=("speed",),
    forces=("torque",),
    turning=("body", "base"),
    outputs=(
        Output("torque", "N m", "torque on the body"),
        Output("angle", "rad", "angle of the body against its base", coordinate=True),
    ),
    symbols={
        "hinge": (SQUARE,),
        "spiral": (spiral(),),
        "tape": (_TAPE,),
        "arc": (arc(1.0, -135.0, 135.0), _ARROW_HEAD),
        "motor": _MOTOR,
        "stop": hatched(np.array([0.35, 0.75]), np.array([0.7, 1.5]), np.array([-0.35, -0.1]), 4),
        "latch": (_HOOK, arc(0.55, -90.0, 0.0, 9)),
    },
    attachments=attachments,
    start=start,
    drawn=drawn,
    angle=True,
)


def actuator_attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachments of both bodies' directions, then of the sensor and its origin."""
    places = attachments(component)
    if component.sensor is not None:
        places = (*places, place(component.sensor))
        if component.sensor_origin is not None:
            places = (*places, place(component.sensor_origin, -1.0))
    return places


ACTUATOR = dataclasses.replace(
    HINGE,
    name="actuator",
    code=5,
    outputs=(Output("torque", "N m", "torque on the body"),),
    symbols={"motor": _MOTOR},
    attachments=actuator_attachments,
)
"""Attachment of an actuator: a hinge with a controller, which may measure the position of a further point."""


@kernel
def sense(maps, angle, q, v):
    """Write the coordinate of the port, an angle, to q, and its rate to v."""
    _, _, ax, ay, bx, by, _, _, px, py, qx, qy = maps
    q[0] = angle
    v[0] = (ax * py - ay * px) - (bx * qy - by * qx)


@kernel
def forces(maps, q, out):
    """Return the forces on the maps: a torque is the force torque J d on a unit direction d."""
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = maps
    torque, opposite = out[0], -out[0]
    return 0.0, 0.0, -torque * ay, torque * ax, -opposite * by, opposite * bx


@kernel
def wrench(maps, along, out, fx, fy):
    """Return the torques on both bodies."""
    return 0.0, 0.0, out[0], -out[0]


@kernel
def gradients(maps, G, R):
    """Compute the gradients of the angle and of its rate by the maps."""
    _, _, ax, ay, bx, by, _, _, px, py, qx, qy = maps
    G[0, 2], G[0, 3], G[0, 4], G[0, 5] = -ay, ax, by, -bx
    R[0, 2], R[0, 3], R[0, 4], R[0, 5] = py, -px, -qy, qx


@kernel
def curvature(q, out, G, K):
    """Add to K how the forces on the direction vectors of both bodies change as these turn, at constant torque `out[0]`."""
    torque = out[0]
    K[2, 3] -= torque
    K[3, 2] += torque
    K[4, 5] += torque
    K[5, 4] -= torque
