"""Hard contact: Moreau's time stepping for the woodpecker toy in Glocker's coordinates; no equation of the package is used.

Coordinates are the height of the sleeve, its rotation and that of the bird, small angles; contacts are the beak and the lower
and the upper edge of the sleeve on the pole. Model and parameters of Glocker 1995 and of Leine, Glocker and van Campen 2001.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["march"]

MASS_SLEEVE, MASS_BIRD, INERTIA_SLEEVE, INERTIA_BIRD = 0.3e-3, 4.5e-3, 5e-9, 7e-7
TO_SPRING, TO_BIRD, BEAK_UP, BEAK_BACK = 0.010, 0.015, 0.020, 0.0201
POLE, SLEEVE, HALF_HEIGHT, STIFFNESS, GRAVITY = 2.5e-3, 3.1e-3, 5.8e-3, 5.6e-3, 9.81
RESTITUTION = np.array([0.5, 0.0, 0.0])


@njit
def _gaps(q):
    return np.array(
        [
            TO_SPRING + TO_BIRD - BEAK_BACK - POLE - BEAK_UP * q[2],
            SLEEVE - POLE + HALF_HEIGHT * q[1],
            SLEEVE - POLE - HALF_HEIGHT * q[1],
        ]
    )


@njit
def march(q, u, step, until, friction):
    """Heights of the sleeve and the instants at which the beak hits the pole."""
    a, b = MASS_BIRD * TO_SPRING, MASS_BIRD * TO_BIRD
    mass = np.array(
        [
            [MASS_SLEEVE + MASS_BIRD, a, b],
            [a, INERTIA_SLEEVE + a * TO_SPRING, a * TO_BIRD],
            [b, b * TO_SPRING, INERTIA_BIRD + b * TO_BIRD],
        ]
    )
    inverse = np.linalg.inv(mass)
    normal = np.array([[0.0, 0.0, -BEAK_UP], [0.0, HALF_HEIGHT, 0.0], [0.0, -HALF_HEIGHT, 0.0]])
    along = np.array([[1.0, TO_SPRING, TO_BIRD - BEAK_BACK], [1.0, SLEEVE, 0.0], [1.0, SLEEVE, 0.0]])
    count = int(until / step + 0.5)
    heights, hits = np.empty(count + 1), [0.0]
    heights[0] = q[0]
    for k in range(count):
        middle = q + 0.5 * step * u
        twist = STIFFNESS * (middle[1] - middle[2])
        force = np.array(
            [
                -(MASS_SLEEVE + MASS_BIRD) * GRAVITY,
                -twist - MASS_BIRD * GRAVITY * TO_SPRING,
                twist - MASS_BIRD * GRAVITY * TO_BIRD,
            ]
        )
        free = u + step * inverse @ force
        gap = _gaps(middle)
        pressed, rubbed = np.zeros(3), np.zeros(3)
        new = free.copy()
        for _ in range(200 if gap.min() <= 0.0 else 0):
            before = new.copy()
            for i in range(3):
                if gap[i] > 0.0:
                    continue
                w, t = normal[i], along[i]
                wanted = w @ new + RESTITUTION[i] * (w @ u)
                change = max(pressed[i] - wanted / (w @ inverse @ w), 0.0) - pressed[i]
                pressed[i] += change
                new = new + inverse @ w * change
                limit = friction[i] * pressed[i]
                change = min(max(rubbed[i] - (t @ new) / (t @ inverse @ t), -limit), limit) - rubbed[i]
                rubbed[i] += change
                new = new + inverse @ t * change
            if np.max(np.abs(new - before)) < 1e-12:
                break
        if pressed[0] > 0.0 and (k * step - hits[-1]) > 0.02:
            hits.append(k * step)
        q = middle + 0.5 * step * new
        u = new
        heights[k + 1] = q[0]
    return heights, np.array(hits[1:])
