"""Port between two frames: a point's position [m] and its body's angle [rad] in another body's frame, a force and a torque.

The force [N] acts on the end along the axes of the start's body, the torque [N m] on the end's body. Angles include full turns.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, frame, place
from scissordyn.components.port.stroke import AXIS_LINE, SQUARE, Drawn, Scene, Strokes, arc, bent, turned
from scissordyn.kernel import kernel


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachments of the end, of the start, and of both bodies' directions, the end's first."""
    ends = place(component.end), place(component.start, -1.0)
    return (*ends, frame(2, component.end[0]), frame(4, component.start[0]))


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return the initial displacement and angle."""
    (ax, ay), (bx, by) = where(component.start), where(component.end)
    base = turned(component.start[0])
    cos, sin = math.cos(base), math.sin(base)
    x, y = bx - ax, by - ay
    return cos * x + sin * y, cos * y - sin * x, turned(component.end[0]) - base


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw around the start, turning with its body, and a line to the end; draw a beam as its bent axis."""
    start, end = scene.place(component.start), scene.place(component.end)
    if component.declaration.symbol == "beam":
        angles = scene.angle(component.start[0]), scene.angle(component.end[0])
        axis = bent(strokes[0][:, 0], start, end, component.length, angles)
        return (axis,), axis[:, len(strokes[0]) // 2]
    if component.declaration.symbol in ("cam", "edge"):
        (profile, disc), angle = component.outline, scene.angle(component.start[0])
        profile_strokes = turned((profile,), start, angle, 1.0)
        if not len(profile):
            profile_strokes = turned(strokes, start, angle + component.direction, scene.size)
        return (*profile_strokes, *turned((disc,), end, np.zeros(len(end)), 1.0)), start
    return (*turned(strokes, start, scene.angle(component.start[0]), scene.size), np.stack([start, end], axis=1)), start


# Drawn spokes between the circles of a bushing [symbol sizes]
_SPOKES = tuple(np.stack([0.45 * spoke, spoke]) for spoke in arc(1.0, 22.5, 337.5, 8))

# Drawn hatching to the right of an edge without ends [symbol sizes]
_HATCH = tuple(np.array([[along, 0.0], [along - 0.5, -0.7]]) for along in range(-3, 5))

# Attachment between two body-fixed frames: relative position and angle, as seen from the start's body
FRAME = Port(
    name="frame",
    code=4,
    coordinates=("x", "y", "angle"),
    rates=("x_rate", "y_rate", "speed"),
    forces=("force_x", "force_y", "torque"),
    points=("start", "end"),
    outputs=(
        Output("force", "N", "force on the end point, along the axes of the start's body", components=2),
        Output("torque", "N m", "torque on the end's body", first=2),
        Output("displacement", "m", "of the end from the start, along the axes of the start's body", 0, 2, coordinate=True),
        Output("angle", "rad", "angle of the end's body against the start's", first=2, coordinate=True),
    ),
    symbols={
        "frame": (SQUARE,),
        "bushing": (arc(0.45, 0.0, 360.0, 37), arc(1.0, 0.0, 360.0, 37), *_SPOKES),
        "beam": (AXIS_LINE,),
        "cam": (arc(1.0, 0.0, 360.0, 37),),
        "edge": (np.array([[-4.0, 0.0], [4.0, 0.0]]), *_HATCH),
    },
    attachments=attachments,
    start=start,
    drawn=drawn,
    angle=True,
)


@kernel
def sense(maps, angle, q, v):
    """Write the coordinates of the port, displacement and angle, to q, and their rates to v."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    q[0], q[1] = bx * ux + by * uy, bx * uy - by * ux
    v[0] = bx * vx + by * vy + qx * ux + qy * uy
    v[1] = bx * vy - by * vx + qx * uy - qy * ux
    q[2] = angle
    v[2] = (ax * py - ay * px) - (bx * qy - by * qx)


@kernel
def forces(maps, q, out):
    """Return the forces on the maps u, a and b for the force out[0:2] and the torque out[2].

    The force is along the axes of the start's body; its moment about the start acts on that body.
    """
    ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = maps
    fx, fy, torque = out[0] * bx - out[1] * by, out[0] * by + out[1] * bx, out[2]
    gx, gy = out[0] * ux + out[1] * uy, out[0] * uy - out[1] * ux
    return fx, fy, -torque * ay, torque * ax, gx + torque * by, gy - torque * bx


@kernel
def wrench(maps, along, out, fx, fy):
    """Return the force on the end and the torques on both bodies."""
    return fx, fy, out[2], -out[2] - (maps[0] * fy - maps[1] * fx)


@kernel
def gradients(maps, G, R):
    """Compute the gradients of the coordinates and of their rates by the maps."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    G[0, 0], G[0, 1], G[0, 4], G[0, 5] = bx, by, ux, uy
    G[1, 0], G[1, 1], G[1, 4], G[1, 5] = -by, bx, uy, -ux
    R[0, 0], R[0, 1], R[0, 4], R[0, 5] = qx, qy, vx, vy
    R[1, 0], R[1, 1], R[1, 4], R[1, 5] = -qy, qx, vy, -vx
    G[2, 2], G[2, 3], G[2, 4], G[2, 5] = -ay, ax, by, -bx
    R[2, 2], R[2, 3], R[2, 4], R[2, 5] = py, -px, -qy, qx


@kernel
def curvature(q, out, G, K):
    """Add the change of the maps' forces by the rotation of the gradients, at constant force and torque."""
    fx, fy, torque = out[0], out[1], out[2]
    K[0, 4] += fx
    K[1, 5] += fx
    K[4, 0] += fx
    K[5, 1] += fx
    K[0, 5] -= fy
    K[1, 4] += fy
    K[4, 1] += fy
    K[5, 0] -= fy
    K[2, 3] -= torque
    K[3, 2] += torque
    K[4, 5] += torque
    K[5, 4] -= torque
