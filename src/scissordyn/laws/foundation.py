r"""Pressure of an elastic law by local indentation: the foundation that gives the law's force on a round bearing.

A journal at the eccentricity e = c + delta in a round bearing indents it at the angle theta from e by w = e cos(theta) - c. A
pressure p(w) gives the force

.. math:: F(\delta) = 2 L R \int_0^{\theta_0} p(w) \cos\theta\, d\theta

With s = (c + w)^2 and S = (c + delta)^2 this is Abel's equation, for each elastic law F and without approximation,

.. math:: G(S) = \frac{(c+\delta) F}{L R} = \int_{c^2}^{S} \frac{p(s)}{\sqrt{S-s}}\, ds, \qquad
    p(s) = \frac{1}{\pi} \int_{c^2}^{s} \frac{G'(S)}{\sqrt{s-S}}\, dS

A law with the exponent 3/2, as the elastic foundation of Liu, gives p proportional to w. A line contact, whose force is nearly
proportional to delta, gives p proportional to sqrt(w), which is the half ellipse of Hertz.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from scissordyn.errors import InputError
from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.evaluate import elastic_forces
from scissordyn.plugin.element import pointers, row_of

# [clearances] smallest and largest indentation of the table; its first and last power laws continue beyond them
INDENTATION_RATIO_MIN, INDENTATION_RATIO_MAX = 1e-8, 2.0
PRESSURE, EXPONENT, FIRST, SECOND, INDENTATION, STEP = range(6)
"""Columns of the table: p at the start of a piece, exponent of p in the piece, first and second integral of p, w there, and the
change of log(w) in the piece.
"""

# Gauss's rule of 16 points on [-1, 1]
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)


@lru_cache(64)
def pressure_table(law: Elastic, joint: JointContact, density: int = 8) -> np.ndarray:
    """Return the pressure of an elastic law by indentation, as pieces of power laws with equal ratios of indentations.

    Shapes: returns (pieces, 6) with the columns above [Pa, 1, Pa m, Pa m^2, m, 1].

    Raises
    ------
    InputError
        If the law's force does not follow from a pressure that grows with the indentation.

    `density`: pieces of the table for each factor of e in the indentation.
    """
    pieces = math.ceil(density * math.log(INDENTATION_RATIO_MAX / INDENTATION_RATIO_MIN))
    w = joint.clearance * np.geomspace(INDENTATION_RATIO_MIN, INDENTATION_RATIO_MAX, pieces + 1)
    p = _pressures(law, joint, w)
    if not (np.all(np.isfinite(p)) and np.all(p > 0.0) and np.all(np.diff(p) > 0.0)):
        raise InputError(
            f"stiffness law '{law.name}' in a worn bearing: no pressure that grows with the indentation gives its force",
            "a law whose force grows faster than the square root of the indentation",
            'stiffness = "liu"',
        )
    table = np.zeros((pieces, 6))
    exponent = np.diff(np.log(p)) / np.diff(np.log(w))
    table[:, PRESSURE], table[:, EXPONENT], table[:, INDENTATION] = p[:-1], exponent, w[:-1]
    table[:, STEP] = math.log(INDENTATION_RATIO_MAX / INDENTATION_RATIO_MIN) / pieces
    table[0, FIRST] = p[0] * w[0] / (exponent[0] + 1.0)
    table[0, SECOND] = table[0, FIRST] * w[0] / (exponent[0] + 2.0)
    for k in range(pieces - 1):
        table[k + 1, FIRST], table[k + 1, SECOND] = _integrals(table[k], float(w[k + 1]))
    return table


def _integrals(row: np.ndarray, w: float) -> tuple[float, float]:
    """Return the first and second integral of the pressure at an indentation in a piece."""
    start, m = row[INDENTATION], row[EXPONENT]
    p = row[PRESSURE] * (w / start) ** m
    first = row[FIRST] + (p * w - row[PRESSURE] * start) / (m + 1.0)
    rest = row[FIRST] - row[PRESSURE] * start / (m + 1.0)
    second = row[SECOND] + rest * (w - start) + (p * w * w - row[PRESSURE] * start * start) / ((m + 1.0) * (m + 2.0))
    return float(first), float(second)


def _pressures(law: Elastic, joint: JointContact, w: np.ndarray) -> np.ndarray:
    """Return local pressures at local indentations w [m] that add up to the law's force (Abel's equation), shape of w [Pa]."""
    c, pointer, row = joint.clearance, pointers(law)["force"], row_of(law, joint)

    def scaled(delta: np.ndarray) -> np.ndarray:
        force = elastic_forces(pointer, delta, row)
        return (c + delta) * force / (joint.length * joint.bearing_radius)

    # S = s - (s - c^2) x^2 and x = sin(pi u / 2) remove the singularities at both ends
    angle = 0.5 * math.pi * (0.5 * (GAUSS_NODES + 1.0))
    span = w * (2.0 * c + w)
    delta = span[:, None] * np.cos(angle) ** 2
    delta = delta / (np.sqrt(c * c + delta) + c)
    h = 1e-3 * delta  # step of differences of fourth order
    near, far = scaled(delta + h) - scaled(delta - h), scaled(delta + 2.0 * h) - scaled(delta - 2.0 * h)
    slope = (8.0 * near - far) / (12.0 * h) / (2.0 * (c + delta))
    integral = 0.5 * math.pi * (slope * np.cos(angle)) @ (0.5 * GAUSS_WEIGHTS)
    return np.asarray(2.0 / math.pi * np.sqrt(span) * integral)
