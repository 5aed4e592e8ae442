"""Equations of the slider-crank with clearance in two unknowns, the rod's angle and the slider's position, by hand."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

import scissordyn as sd

__all__ = [
    "CLEARANCE",
    "CRANK",
    "JOURNAL",
    "LOSS",
    "RESTITUTION",
    "ROD",
    "ROD_INERTIA",
    "ROD_MASS",
    "SAMPLES",
    "SLIDER_MASS",
    "SPEED",
    "STIFFNESS",
    "TIMES",
    "UNTIL",
    "eccentricity",
    "gap_rate",
    "orbit_error",
    "rates",
    "start",
]

CRANK, ROD, ROD_MASS, ROD_INERTIA, SLIDER_MASS = 0.05, 0.12, 0.21, 2.5e-4, 0.14
SPEED, CLEARANCE, JOURNAL, RESTITUTION = 5000.0 * math.pi / 30.0, 0.5e-3, 9.5e-3, 0.9
UNTIL, SAMPLES = 0.012, 2001  # One revolution [s]

STIFFNESS = float(sd.Hertz().parameters(sd.Clearance(CLEARANCE, journal_radius=JOURNAL).surfaces)[0])
LOSS = 0.75 * (1.0 - RESTITUTION**2)
TIMES = np.linspace(0.0, UNTIL, SAMPLES)


@njit
def eccentricity(t, angle, place, spin, speed):
    """Return the rod's end relative to the slider's pin, and its rate, from rod angle, slider position and their rates."""
    phase = SPEED * t
    ex = CRANK * math.cos(phase) + ROD * math.cos(angle) - place
    ey = CRANK * math.sin(phase) + ROD * math.sin(angle)
    ux = -CRANK * SPEED * math.sin(phase) - ROD * math.sin(angle) * spin - speed
    uy = CRANK * SPEED * math.cos(phase) + ROD * math.cos(angle) * spin
    return ex, ey, ux, uy


@njit
def gap_rate(t, angle, place, spin, speed):
    """Return the eccentricity beyond the clearance [m] and its rate, zero at the centre."""
    ex, ey, ux, uy = eccentricity(t, angle, place, spin, speed)
    e = math.hypot(ex, ey)
    return e - CLEARANCE, (ex * ux + ey * uy) / e if e > 0.0 else 0.0


@njit
def rates(t, angle, place, spin, speed, touching, approach):
    """Return Lagrange's equations of rod and slider."""
    ex, ey, ux, uy = eccentricity(t, angle, place, spin, speed)
    fx = fy = 0.0
    e = math.hypot(ex, ey)
    if touching and e > CLEARANCE:
        nx, ny = ex / e, ey / e
        depth = e - CLEARANCE
        force = STIFFNESS * depth * math.sqrt(depth) * (1.0 + LOSS * (ux * nx + uy * ny) / approach)
        force = max(force, 0.0)
        fx, fy = -force * nx, -force * ny
    c, s = math.cos(angle), math.sin(angle)
    pull = CRANK * SPEED * SPEED  # acceleration of the crank pin towards the centre
    px, py = -pull * math.cos(SPEED * t), -pull * math.sin(SPEED * t)
    turning = ROD * (c * fy - s * fx) - 0.5 * ROD_MASS * ROD * (c * py - s * px)
    return spin, speed, turning / (ROD_INERTIA + 0.25 * ROD_MASS * ROD * ROD), -fx / SLIDER_MASS


def start() -> np.ndarray:
    """Return the state with crank and rod stretched and the journal concentric."""
    return np.array([0.0, CRANK + ROD, -CRANK * SPEED / ROD, 0.0])


def orbit_error(orbit: np.ndarray, exact: np.ndarray) -> float:
    """Return the root mean square of the difference, in clearances."""
    return math.sqrt(float(np.mean(np.sum((orbit - exact) ** 2, axis=1)))) / CLEARANCE
