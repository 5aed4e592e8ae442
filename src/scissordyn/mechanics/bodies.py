"""Motion of the bodies from the columns [x; b] at the samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.reduced import ReducedModel

__all__ = ["BodyMotion", "body_motion"]


class BodyMotion(NamedTuple):
    """Motion of all bodies.

    Parameters
    ----------
    position, velocity, acceleration : ndarray, shape (nt, bodies, 2)
        Of the mass centres [m, m/s, m/s^2].
    direction : ndarray, shape (nt, bodies, 2)
        Cosine and sine of the angle.
    angle, spin, spin_rate : ndarray, shape (nt, bodies)
        Angle, continuous in time, and its derivatives [rad, rad/s, rad/s^2].
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    direction: np.ndarray
    angle: np.ndarray
    spin: np.ndarray
    spin_rate: np.ndarray


def body_motion(reduced: ReducedModel, found: Record) -> BodyMotion:
    """Positions, angles and their derivatives.

    Parameters
    ----------
    reduced : ReducedModel
    found : Record

    Returns
    -------
    BodyMotion
    """
    mechanism = reduced.mechanism
    bodies, instants = mechanism.bodies, found.X.shape[0]
    fixed, still = np.zeros((len(bodies), 2)), np.zeros((len(bodies), 2))
    centre: list[tuple[int, int, float]] = []
    turned: list[tuple[int, int, float]] = []
    for k, body in enumerate(bodies):
        p, (x, y) = reduced.offsets[body.name], body.centre
        centre += [(2 * k, p, 1.0), (2 * k + 1, p + 1, 1.0)]
        if body.rotates:
            centre += [(2 * k, p + 2, x), (2 * k, p + 3, -y), (2 * k + 1, p + 2, y), (2 * k + 1, p + 3, x)]
            turned += [(2 * k, p + 2, 1.0), (2 * k + 1, p + 3, 1.0)]
        else:
            cos, sin = np.cos(body.angle), np.sin(body.angle)
            fixed[k] = cos * x - sin * y, sin * x + cos * y
            still[k] = cos, sin

    def matrix(entries: list[tuple[int, int, float]]) -> sp.csr_array:
        rows, columns, values = zip(*entries, strict=True) if entries else ((), (), ())
        shape = (2 * len(bodies), reduced.coordinates.shape[0])
        return sp.csr_array(sp.csr_array((values, (rows, columns)), shape=shape) @ reduced.coordinates)

    to_centre, to_direction = matrix(centre), matrix(turned)

    def at(maps: sp.csr_array, columns: np.ndarray) -> np.ndarray:
        return np.asarray((maps @ columns.T).T).reshape(instants, len(bodies), 2)

    direction = at(to_direction, found.X) + still
    turning, bending = at(to_direction, found.V), at(to_direction, found.A)
    angle = np.unwrap(np.arctan2(direction[..., 1], direction[..., 0]), axis=0)
    starts = np.array([body.angle for body in bodies])
    if instants:
        angle += 2.0 * np.pi * np.round((starts - angle[0]) / (2.0 * np.pi))
    return BodyMotion(
        position=at(to_centre, found.X) + fixed,
        velocity=at(to_centre, found.V),
        acceleration=at(to_centre, found.A),
        direction=direction,
        angle=angle,
        spin=direction[..., 0] * turning[..., 1] - direction[..., 1] * turning[..., 0],
        spin_rate=direction[..., 0] * bending[..., 1] - direction[..., 1] * bending[..., 0],
    )
