"""Motion of the N-four-bar mechanism, a rotating pendulum, in Jacobi's elliptic functions."""

from __future__ import annotations

import mpmath
import numpy as np

__all__ = ["place"]


def place(units: int, t: float, gravity: float = 9.81) -> np.ndarray:
    """Return the position of the first upper pin, 1 m from its ground pin [m].

    With s the angle from the upright, s'' = a sin s, s(0) = 0, s'(0) = 1, so that s'^2 = 1 + 4 a sin^2(s/2); with
    w = pi/2 - s/2 this is w'^2 = (1/4)(1 + 4 a)(1 - m sin^2 w), m = 4 a/(1 + 4 a).
    """
    with mpmath.workdps(30):
        a = ((mpmath.mpf(units) + 1) / 2 + units) / ((mpmath.mpf(units) + 1) / 3 + units) * mpmath.mpf(gravity)
        m = 4 * a / (1 + 4 * a)
        phase = mpmath.ellipk(m) - mpmath.sqrt(1 + 4 * a) / 2 * t
        sn, cn = mpmath.ellipfun("sn", phase, m=m), mpmath.ellipfun("cn", phase, m=m)
        return np.array([float(2 * sn * cn), float(sn**2 - cn**2)])
