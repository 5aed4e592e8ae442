"""Motion of the pendulum in Jacobi's elliptic functions."""

from __future__ import annotations

import mpmath
import numpy as np

__all__ = ["place"]


def place(t: float, length: float = 1.0, gravity: float = 9.81) -> np.ndarray:
    """Return the position of the mass released at rest from the left horizontal [m]."""
    with mpmath.workdps(30):
        k2 = mpmath.mpf(1) / 2  # the square of sin(45 degrees)
        phase = mpmath.ellipk(k2) - mpmath.sqrt(mpmath.mpf(gravity) / length) * t
        half = mpmath.asin(mpmath.sqrt(k2) * mpmath.ellipfun("sn", phase, m=k2))
        return np.array([float(-length * mpmath.sin(2 * half)), float(-length * mpmath.cos(2 * half))])
