"""A scissor array with clearance at the slider joint in minimal coordinates: Lagrange's equations of docs/theory (S2), (S3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from reference.marching import ClearanceJoint, Load, Minimal, Relative

TimeFunction = Callable[[float], tuple[float, float, float]]  # Angle [rad], angular velocity and angular acceleration at a time


def constant_speed(angle, speed):
    """Return the motion theta_0 + w t."""
    return lambda t: (angle + speed * t, speed, 0.0)


def harmonic(mean, amplitude, frequency):
    """Return the motion theta_m + theta_a sin(W t)."""

    def motion(t):
        oscillation = amplitude * math.sin(frequency * t)
        return mean + oscillation, amplitude * frequency * math.cos(frequency * t), -(frequency**2) * oscillation

    return motion


@dataclass(frozen=True)
class Array(Minimal):
    """N units with one driven bar family and clearance at joint A.

    The bars pinned to the ground have the direction p, the couplers k; driven_bar "pinned" drives p, "slider" drives k, and the
    driven angle is th_1 in both. The coordinates are psi = p + k, which is zero in the ideal array, and e_y. Both are as small
    as the clearance, so that tolerances and rounding stay small compared with it:

        e_x = (L/2) (cos p - cos k),  e_y = (L/2) (sin p - sin k) - y
    """

    joint: ClearanceJoint
    motion: TimeFunction  # th_1
    units: int = 2
    driven_bar: str = "pinned"
    length: float = 2.0  # L [m]
    mass: float = 5.68  # m [kg]
    slider: float = 5.0  # m_s [kg]
    gravity: float = 9.81  # Along -y [m/s^2]

    def inertias(self) -> tuple[float, float, float]:
        """Return the coefficients of p'^2/2, k'^2/2 and cos(p-k) p' k' in the kinetic energy [kg m^2]."""
        n, unit = self.units, self.mass * self.length**2
        squares, fewer, products = n * (n + 1) * (2 * n + 1) / 6, (n - 1) * n * (2 * n - 1) / 6, (n - 1) * n * (n + 1) / 3
        return unit * (squares / 2 + n / 12), unit * (fewer / 2 + n / 12), unit * products / 2

    def weights(self) -> tuple[float, float]:
        """Return the coefficients of sin p and sin k in the potential energy [J]."""
        n, unit = self.units, self.mass * self.gravity * self.length
        return unit * n * (n + 1) / 2, unit * n * (n - 1) / 2

    def angles(self, t: float, psi: float, rate: float) -> tuple[float, float, float, float]:
        """Return p, k and their rates."""
        driven, speed, _ = self.motion(t)
        if self.driven_bar == "pinned":
            return driven, psi - driven, speed, rate - speed
        return psi - driven, driven, rate - speed, speed

    def relative(self, t: float, q: np.ndarray, v: np.ndarray) -> list[Relative]:
        """Return the position of the journal in its bearing."""
        psi, e_y = q.tolist()
        rate, u_y = v.tolist()
        p, k, w_p, w_k = self.angles(t, psi, rate)
        # cos p - cos k as a product, exact for small psi
        e_x = -self.length * math.sin(0.5 * psi) * math.sin(0.5 * (p - k))
        u_x = 0.5 * self.length * (math.sin(k) * w_k - math.sin(p) * w_p)
        return [Relative(e_x, e_y, u_x, u_y, w_k, 0.0)]

    def accelerate(self, t: float, q: np.ndarray, v: np.ndarray, loads: Sequence[Load]) -> tuple[np.ndarray, float, float]:
        """Return psi'', e_y'', the drive torque and its power."""
        load, half = loads[0], 0.5 * self.length
        p, k, w_p, w_k = self.angles(t, *q[:1].tolist(), *v[:1].tolist())
        _, speed, driven = self.motion(t)
        j_p, j_k, j_pk = self.inertias()
        g_p, g_k = self.weights()
        cross, twist = j_pk * math.cos(p - k), j_pk * math.sin(p - k)
        # forces on p and k: weight, centrifugal terms, contact at r_J = (L/2)(u_p - u_k)
        r_p = -twist * w_k**2 - g_p * math.cos(p) + half * (load.fy * math.cos(p) - load.fx * math.sin(p))
        r_k = twist * w_p**2 - g_k * math.cos(k) - half * (load.fy * math.cos(k) - load.fx * math.sin(k)) + load.journal_moment
        if self.driven_bar == "pinned":
            a_p = driven
            a_k = (r_k - cross * a_p) / j_k
            torque = j_p * a_p + cross * a_k - r_p
        else:
            a_k = driven
            a_p = (r_p - cross * a_k) / j_p
            torque = j_k * a_k + cross * a_p - r_k
        slider = -load.fy / self.slider - self.gravity
        journal = half * (math.cos(p) * a_p - math.sin(p) * w_p**2 - math.cos(k) * a_k + math.sin(k) * w_k**2)
        return np.array([a_p + a_k, journal - slider]), torque, torque * speed

    def slider_position(self, t: float, q: np.ndarray) -> float:
        p, k, _, _ = self.angles(t, float(q[0]), 0.0)
        return 0.5 * self.length * (math.sin(p) - math.sin(k)) - float(q[1])

    def energy(self, t: float, q: np.ndarray, v: np.ndarray) -> float:
        p, k, w_p, w_k = self.angles(t, float(q[0]), float(v[0]))
        j_p, j_k, j_pk = self.inertias()
        g_p, g_k = self.weights()
        rise = 0.5 * self.length * (math.cos(p) * w_p - math.cos(k) * w_k) - float(v[1])
        moving = 0.5 * (j_p * w_p**2 + j_k * w_k**2 + self.slider * rise**2) + j_pk * math.cos(p - k) * w_p * w_k
        return moving + g_p * math.sin(p) + g_k * math.sin(k) + self.slider * self.gravity * self.slider_position(t, q)
