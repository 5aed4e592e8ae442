"""Port on the axis of a bending bar: the points of its cross-sections and the amplitudes of its shapes [m].

Its forces are not computed with six maps: `mechanics.flexible_bar` reads all shapes of the bar.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.components.port.declaration import Attachment, Ends, Port, Turned, Where
from scissordyn.components.port.stroke import AXIS_LINE, Drawn, Scene, Strokes, bent


def attachments(component: Any) -> tuple[Attachment, ...]:
    """Return no attachments to the six rows of other components."""
    return ()


def start(component: Any, where: Where, turned: Turned) -> tuple[float, ...]:
    """Return no coordinates."""
    return ()


def ends(component: Any) -> Ends:
    """Return the bodies on which the bar acts: its first and last cross-section; `mechanics.bending_loads` has the others."""
    return (component.sections[0], None), (component.sections[-1], None)


def drawn(component: Any, strokes: Strokes, scene: Scene) -> Drawn:
    """Return the bent axis, from section to section."""
    axis = bent_axis(component, scene, strokes[0][:, 0])
    return (axis,), axis[:, axis.shape[1] // 2]


def bent_axis(component: Any, scene: Any, part: np.ndarray) -> np.ndarray:
    """Return points of the bent axis at fractions of each span, shape (samples, spans * points, 2) [m]."""
    sections, along = component.sections, component.places
    places = [scene.place((name, None)) for name in sections]
    turns = [scene.angle(name) + angle for name, angle in zip(sections, component.angles, strict=True)]
    spans = [
        bent(part, places[k], places[k + 1], along[k + 1] - along[k], (turns[k], turns[k + 1]))
        for k in range(len(sections) - 1)
    ]
    return np.concatenate(spans, axis=1)


# Attachment of a flexible bar, to all of its cross-sections
AXIS = Port(
    name="axis",
    code=6,
    coordinates=(),
    rates=(),
    forces=(),
    numbers=("sections", "places", "turned", "modes", "mass_per_length", "axial_stiffness", "bending_stiffness"),
    symbols={"beam": (AXIS_LINE,)},
    attachments=attachments,
    start=start,
    ends=ends,
    drawn=drawn,
)
