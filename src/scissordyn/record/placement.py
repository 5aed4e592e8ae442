"""Positions of points of a mechanism at the samples of a run, for pictures, films and reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.model.mechanism import Mechanism
from scissordyn.record.results import Run, along


def turned(vectors: np.ndarray, turns: int) -> np.ndarray:
    """Return vectors rotated by a number of quarter turns counter-clockwise, shape (..., 2)."""
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack(((x, y), (-y, x), (-x, -y), (y, -x))[turns % 4], axis=-1)


def placed(centre: np.ndarray, angle: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Convert points relative to a body's mass centre to the fixed frame, shape (samples, points, 2) [m]."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = local.T
    return np.asarray(centre[:, None] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1))


@dataclass(frozen=True)
class Placement:
    """Positions and angles of a mechanism's bodies at some samples of a run."""

    mechanism: Mechanism
    index: dict[str, int]  # Index of each body in the arrays
    centres: np.ndarray  # (samples, bodies, 2) Mass centres [m]
    angles: np.ndarray  # (samples, bodies) [rad]
    # Quarter turns counter-clockwise by which everything is rotated, for example so that a picture has gravity downwards
    turns: int = 0

    @classmethod
    def at(cls, mechanism: Mechanism, run: Run, samples: Sequence[int] | np.ndarray | slice, *, turns: int = 0) -> Placement:
        """Return the placement of a mechanism at samples of its run, rotated by a number of quarter turns."""
        names = [body.name for body in mechanism.bodies]
        place = {name: k for k, name in enumerate(run.variables["body"].values.tolist())}
        order = [place[name] for name in names]
        position = along(run.variables["position"], "time", "body", "axis")[samples][:, order]
        angle = along(run.variables["angle"], "time", "body")[samples][:, order]
        return cls(mechanism, {name: k for k, name in enumerate(names)}, position, angle, turns)

    _places: dict[BodyPoint | tuple[str, None], np.ndarray] = field(default_factory=dict, repr=False, compare=False)

    @property
    def count(self) -> int:
        return int(self.angles.shape[0])

    def angle(self, body: str) -> np.ndarray:
        """Return the angle of a body or of the ground at the samples, shape (samples,) [rad]."""
        turn = self.turns * 0.5 * math.pi
        return turn + (np.zeros(self.count) if body == GROUND else np.asarray(self.angles[:, self.index[body]]))

    def vectors(self, vectors: np.ndarray) -> np.ndarray:
        """Convert vectors of the mechanism's frame to that of the placement, shape (..., 2)."""
        return turned(vectors, self.turns)

    def centre(self, body: str) -> np.ndarray:
        """Return the mass centre of a body, shape (samples, 2) [m]."""
        return self.vectors(self.centres[:, self.index[body]])

    def points(self, body: str, local: np.ndarray) -> np.ndarray:
        """Convert points in the frame of a body or of the ground to the fixed frame, shape (samples, points, 2) [m]."""
        if body == GROUND:
            return np.broadcast_to(self.vectors(local), (self.count, *local.shape))
        return placed(self.centre(body), self.angle(body), local - np.array(self.mechanism.body(body).centre))

    def place(self, reference: BodyPoint | tuple[str, None]) -> np.ndarray:
        """Return the position of a named point, or of the origin, of a body or the ground, shape (samples, 2) [m]."""
        if (position := self._places.get(reference)) is not None:
            return position
        body, point = reference
        if point is None:
            local = np.zeros((1, 2))
        else:
            named = dict(self.mechanism.ground) if body == GROUND else self.mechanism.body(body).points
            local = np.array([named[point]], float)
        return self._places.setdefault(reference, np.asarray(self.points(body, local)[:, 0]))
