"""Where the points of a mechanism are at the samples of a run: the one way for all pictures and films."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism

__all__ = ["Corners", "Placement", "outline"]

MARGIN = 0.1
"""Around a mechanism, as a fraction of its longer side."""

Corners = tuple[np.ndarray, np.ndarray]
"""Lower left and upper right corner [m]."""


@dataclass(frozen=True)
class Placement:
    """The positions of a mechanism at some samples of a run.

    Parameters
    ----------
    mechanism : Mechanism
    index : dict of str to int
        Places of the bodies in the arrays.
    centres : ndarray, shape (samples, bodies, 2)
        Mass centres [m].
    angles : ndarray, shape (samples, bodies)
        [rad]
    """

    mechanism: Mechanism
    index: dict[str, int]
    centres: np.ndarray
    angles: np.ndarray

    @classmethod
    def at(cls, mechanism: Mechanism, run: xr.Dataset, samples: Sequence[int] | np.ndarray | slice) -> Placement:
        """The placement at samples of a run of that mechanism."""
        names = [body.name for body in mechanism.bodies]
        now = run[["position", "angle"]].isel(time=samples).sel(body=names)
        return cls(
            mechanism,
            {name: k for k, name in enumerate(names)},
            now["position"].transpose("time", "body", "axis").values,
            now["angle"].transpose("time", "body").values,
        )

    @property
    def count(self) -> int:
        """Number of samples."""
        return int(self.angles.shape[0])

    def angle(self, body: str) -> np.ndarray:
        """Angle of a body, or of the ground, shape (samples,) [rad]."""
        return np.zeros(self.count) if body == GROUND else np.asarray(self.angles[:, self.index[body]])

    def centre(self, body: str) -> np.ndarray:
        """Mass centre of a body, shape (samples, 2) [m]."""
        return np.asarray(self.centres[:, self.index[body]])

    def points(self, body: str, local: np.ndarray) -> np.ndarray:
        """Points of a body's frame, or of the ground's, in the fixed frame, shape (samples, points, 2) [m]."""
        if body == GROUND:
            return np.broadcast_to(local, (self.count, *local.shape))
        angle = self.angle(body)[:, None]
        cos, sin = np.cos(angle), np.sin(angle)
        x, y = (local - np.array(self.mechanism.body(body).centre)).T
        placed: np.ndarray = self.centre(body)[:, None] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
        return placed

    def place(self, reference: BodyPoint) -> np.ndarray:
        """A named point of a body or of the ground in the fixed frame, shape (samples, 2) [m]."""
        body, point = reference
        named = dict(self.mechanism.ground) if body == GROUND else self.mechanism.body(body).points
        return np.asarray(self.points(body, np.array([named[point]], float))[:, 0])

    def outlines(self) -> list[np.ndarray]:
        """The outlines of the bodies in their order, each of shape (samples, points, 2) [m]."""
        return [self.points(body.name, outline(body)) for body in self.mechanism.bodies]

    def corners(self) -> Corners:
        """The region of the mechanism and of the points of the ground at all samples, with a margin."""
        fixed = np.array([place for _, place in self.mechanism.ground], float).reshape(-1, 2)
        everything = np.concatenate([*(part.reshape(-1, 2) for part in self.outlines()), fixed])
        low, high = everything.min(axis=0), everything.max(axis=0)
        margin = MARGIN * (float(np.max(high - low)) or 1.0)
        return low - margin, high + margin


def outline(body: Body) -> np.ndarray:
    """The outline of a body in its own frame: the line between its extreme points, or the polygon around them.

    Parameters
    ----------
    body : Body

    Returns
    -------
    ndarray, shape (points, 2)
        One point for a point mass, two for a bar, more for a body whose points are not in a line.
    """
    local = np.array([*dict.fromkeys(body.points.values())] or [body.centre], float)
    if len(local) < 3:
        return local
    apart = np.linalg.norm(local[:, None] - local[None], axis=-1)
    i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
    along = (local[j] - local[i]) / apart[i, j]
    aside = (local - local[i]) @ np.array([-along[1], along[0]])
    if np.max(np.abs(aside)) < 1e-9 * apart[i, j]:
        return local[[i, j]]
    middle = local.mean(axis=0)
    return local[np.argsort(np.arctan2(*(local - middle).T[::-1]))]
