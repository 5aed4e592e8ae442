"""The inertia that a drive feels: twice the kinetic energy at unit speed of the drive, along the stroke."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scissordyn.kinematics.path import Path


@dataclass(frozen=True)
class DriveInertia:
    """What the drive of a body has to accelerate."""

    drive: str  # The driven body
    start: float  # At both ends of its motion, and the largest on the way [kg m^2]
    end: float
    largest: float

    def plain(self) -> dict[str, Any]:
        """Its numbers."""
        return asdict(self)

    def __str__(self) -> str:
        start, end, largest = (f"{value:.4g} kg m^2" for value in (self.start, self.end, self.largest))
        return f"{start} at the start, {end} at the end, at most {largest}"


def drive_inertia(path: Path) -> np.ndarray:
    """Inertia of a mechanism with ideal joints about its only drive, at each point of a path.

    It is what a servo has to accelerate: with the feedback gains ``k_p = J w**2`` and ``k_d = 2 z J w`` the error of its angle
    decays with the natural frequency w and the damping ratio z.

    Shapes: returns (points,) [kg m^2].

    References
    ----------
    Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7
    """
    mass = path.closure.plan.coordinates.mass
    inertia = np.full(path.place.size, np.nan)
    for k in range(path.place.size):
        rate = drive_rate(path, k)
        inertia[k] = rate @ (mass @ rate)
    return inertia


def drive_rate(path: Path, k: int) -> np.ndarray:
    """Derivative of the natural coordinates by the only drive at a point of a path.

    Shapes: returns (nZ,) [m].
    """
    closure, z, place = path.closure, path.z[k], path.place[k]
    inputs = np.array([place])
    turned = np.array([0.0, -np.sin(place), np.cos(place)]) if closure.inputs.bodies else np.zeros(1)
    driven = closure.prescribed @ turned
    wanted = np.zeros(closure.chosen.size)
    if not closure.inputs.bodies:
        step = 1e-6 * (place or 1.0)  # the values are linear or quadratic: a central difference has no error
        wanted = (closure.values_at(inputs + step) - closure.values_at(inputs - step)) / (2.0 * step)
    try:
        free = np.linalg.solve(closure.jacobian(z), wanted - closure.product(z, driven))
    except np.linalg.LinAlgError:
        return np.full(closure.natural.total, np.nan)
    rate = driven + closure.free @ free
    rate[closure.origins] *= closure.size
    return np.asarray(rate[: closure.natural.total])
