"""Port of a point on a bending bar: its distance across the bar's axis [m], and a force across the axis [N].

Its forces are not computed with six maps: `mechanics.rail` finds the place on the bar, whose shapes get the opposite force.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Output, Port, Turned, Where, place
from scissordyn.components.port.stroke import Drawn, Scene, Strokes, arc, turned


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return the attachment of the point; the bar is added where its shapes are known."""
    return (place(component.point),)


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return a start on the axis: no parameter depends on the initial position."""
    return (0.0,)


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Draw a circle at the point."""
    where = scene.place(component.point)
    return turned(strokes, where, np.zeros(len(where)), scene.size), where


# Attachment between a point and the axis of a flexible bar, by the distance of the point from the axis
RAIL = Port(
    name="rail",
    code=7,
    coordinates=("gap",),
    rates=("gap_rate",),
    forces=("force",),
    points=("point",),
    numbers=("rail",),
    outputs=(
        Output("force", "N", "force on the point across the bar, towards +y of the bar"),
        Output("gap", "m", "distance of the point from the bar's axis, towards +y of the bar", coordinate=True),
        Output("place", "m", "position along the bar from its first cross-section", first=1, coordinate=True),
    ),
    symbols={"roller": (arc(0.6, 0.0, 360.0), np.array([[0.0, 0.0], [0.6, 0.0]]))},
    attachments=attachments,
    start=start,
    drawn=drawn,
)
