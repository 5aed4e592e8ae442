"""The positions of the points of a mechanism at a sample of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism

__all__ = ["Placement", "outline"]


@dataclass(frozen=True)
class Placement:
    """The positions of a mechanism at one sample of a run.

    Parameters
    ----------
    mechanism : Mechanism
    centre : dict of str to ndarray
        Mass centres by body [m].
    angle : dict of str to float
        Angles by body [rad].
    """

    mechanism: Mechanism
    centre: dict[str, np.ndarray]
    angle: dict[str, float]

    @classmethod
    def at(cls, mechanism: Mechanism, run: xr.Dataset, sample: int) -> Placement:
        """The placement at a sample of a run of that mechanism."""
        now = run.isel(time=sample)
        names = [body.name for body in mechanism.bodies]
        return cls(
            mechanism,
            {name: now["position"].sel(body=name).transpose("axis").values for name in names},
            {name: float(now["angle"].sel(body=name)) for name in names},
        )

    def points(self, body: Body, local: np.ndarray) -> np.ndarray:
        """Points of a body's frame in the fixed frame, shape (points, 2) [m]."""
        cos, sin = np.cos(self.angle[body.name]), np.sin(self.angle[body.name])
        turned = (local - np.array(body.centre)) @ np.array([[cos, sin], [-sin, cos]])
        placed: np.ndarray = self.centre[body.name] + turned
        return placed

    def place(self, reference: BodyPoint) -> np.ndarray:
        """A named point of a body or of the ground in the fixed frame [m]."""
        name, point = reference
        if name == GROUND:
            return np.array(dict(self.mechanism.ground)[point])
        body = self.mechanism.body(name)
        return self.points(body, np.array([body.points[point]])).reshape(2)


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
