"""The time stepping behind the published record of the slider-crank with a clearance guide.

Moreau's stepping with the midpoint rule for positions, but with the mass matrix at the end of the step. The record's first step
shows this: its error is 5e-7 rad/s so, and 2e-4 rad/s with the mass matrix at the start or in the middle of the step.
The scheme is of first order.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from reference.moreau import SliderCrank, corner, impulses, matrices

__all__ = ["REVOLUTIONS", "SPEED", "START", "STEP", "march"]

START = np.array([0.0, 0.0, 0.0, 150.0, -75.0, 0.0])
"""Directions and angular velocities; the slider starts without rotation, other than in the article."""

STEP = 1e-4
"""Step of the record [s]."""

SPEED = (2.2e-3, 117.4702863455974)
"""Time [s] before the first contact and angular velocity of the crank [rad/s]."""

REVOLUTIONS = ((0.03, 0.4126206014), (0.05, 0.7704326172), (0.1, 1.4916377438), (0.15, 2.2320116737), (0.2, 3.0543284199))
"""Time [s] and revolutions of the crank."""


@njit
def _projected(p, q, u):
    """Positions without penetration."""
    for _ in range(50):
        m, _f = matrices(p, q, u)
        inverse = np.linalg.inv(m)
        worst = 0.0
        for k in range(4):
            gap, n, _t = corner(p, q, k)
            if gap < 0.0:
                q = q - inverse @ n * (gap / (n @ (inverse @ n)))
                worst = max(worst, -gap)
        if worst < 1e-10:
            break
    return q


@njit
def _steps(p, q, u, count, step, every):
    kept = np.empty((count // every + 1, 6))
    kept[0, :3], kept[0, 3:] = q, u
    for i in range(1, count + 1):
        active = np.zeros(4, np.bool_)
        for k in range(4):
            gap, n, _t = corner(p, q, k)
            active[k] = gap + 0.5 * step * (n @ u) <= 0.0
        _, h_start = matrices(p, q, u)
        new = u.copy()
        for _ in range(60):
            end = q + 0.5 * step * (u + new)
            m, h_end = matrices(p, end, new)
            inverse = np.linalg.inv(m)
            last = new
            new = u + inverse @ (0.5 * step * (h_start + h_end))
            if active.any():
                normals, tangents = np.empty((4, 3)), np.empty((4, 3))
                for k in range(4):
                    _, normals[k], tangents[k] = corner(p, end, k)
                new = impulses(p, u, new, inverse, active, normals, tangents, 500, 1e-12)
            if np.max(np.abs(new - last)) < 1e-10:
                break
        q = _projected(p, q + 0.5 * step * (u + new), new)
        u = new
        if i % every == 0:
            kept[i // every, :3], kept[i // every, 3:] = q, u
    return kept


def march(until: float, step: float) -> np.ndarray:
    """Directions and angular velocities at every multiple of the record's step [s]."""
    every = round(STEP / step)
    return _steps(SliderCrank(), START[:3].copy(), START[3:].copy(), round(until / step), step, every)
