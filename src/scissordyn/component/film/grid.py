"""Where impedances are tabulated: finer near contact, and near the direction that lies between approach and separation."""

from __future__ import annotations

import math

import numpy as np

GAPS, DIRECTIONS = 20, 33
"""Nodes over the root of the least film thickness, and over the direction psi of the velocity from 0 to pi."""

NEAREST = 1e-3  # Least film thickness of the table over the clearance; below, impedances grow as those of a long bearing

POWERS = 1.5, 1.0, 2.0
"""By which powers of the film thickness radial force, tangential force and pressure of the table are divided."""

SHARP = 0.15  # Range of psi about pi/2 in which nodes are closest [rad]: there the film passes from one side to the other

WIDEST = math.asinh(0.5 * math.pi / SHARP)


def eccentricities() -> np.ndarray:
    """At even steps of the root of the least film thickness, increasing from contact, shape (GAPS,)."""
    return 1.0 - np.linspace(math.sqrt(NEAREST), 1.0, GAPS) ** 2


def directions() -> np.ndarray:
    """psi, shape (DIRECTIONS,) [rad]."""
    return 0.5 * math.pi + SHARP * np.sinh(WIDEST * np.linspace(-1.0, 1.0, DIRECTIONS))


def steepness(eccentricity: float | np.ndarray) -> np.ndarray:
    """What the impedances are divided by, shape (..., 3): powers of the film thickness, about as they grow towards contact."""
    return np.asarray((1.0 - np.asarray(eccentricity))[..., None] ** -np.array(POWERS))
