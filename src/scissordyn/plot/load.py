"""Payloads and panels as they are drawn: where `with_payload` and `with_panels` have left their points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissordyn.model.mechanism import Mechanism
from scissordyn.model.payload import panel_ends, payload_points
from scissordyn.run.answer.placement import Placement

SQUARE = 1.5
"""Half the side of a payload, in sizes of a block."""

BAND = 0.55
"""Half the width of a panel, in sizes of a block."""


@dataclass(frozen=True)
class Load:
    """The outline of a payload or of a panel."""

    name: str
    kind: str
    corners: np.ndarray  # (samples, 4, 2) [m]


def loads(mechanism: Mechanism, placement: Placement, size: float) -> list[Load]:
    """The payloads and panels of a mechanism."""
    square = placement.vectors(SQUARE * size * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
    panels, payloads = [], []
    for body in mechanism.bodies:
        for start, end in panel_ends(body):
            ends = placement.points(body.name, np.array([body.points[start], body.points[end]], float))
            along = ends[:, 1] - ends[:, 0]
            aside = BAND * size * np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
            corners = np.stack([ends[:, 0] - aside, ends[:, 1] - aside, ends[:, 1] + aside, ends[:, 0] + aside], axis=1)
            panels.append(Load(start.replace(" start", ""), "panel", corners))
        for name in payload_points(body):
            middle = placement.place((body.name, name))
            payloads.append(Load(name, "payload", middle[:, None] + square))
    return [*panels, *payloads]
