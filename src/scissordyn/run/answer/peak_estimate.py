"""The peak force that a compliant law gives for an impact of known energy m v^2: an estimate.

Of a free body of mass m that comes in at v on F = F_el(delta) (1 + xi delta'/v), with s = delta'/v:

    W(delta) = int F_el d delta = m v^2 ((1 - s)/xi - ln((1 + xi)/(1 + xi s))/xi^2),

so that at the deepest point, s = 0, int F_el d delta = m v^2 (xi - ln(1 + xi))/xi^2. The force is largest at some s in between.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.laws.evaluate import elastic_energy, elastic_force
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.plugin.element import pointers, row_of

POINTS = 201  # Values of s at which the largest force is looked for, and a parabola through the best three
DEPTHS = 400  # Indentations of the table of energies, each the same factor above the one before
SMALL = 1e-6  # Damping factors below this are taken as none: the formula would lose its digits


def peak_forces(clearance: Clearance | GuideClearance, struck: np.ndarray) -> np.ndarray:
    """Largest normal forces [N] of impacts with m v^2 [J] by the elastic and the damping law of a joint, shape (k,)."""
    surfaces, law = clearance.surfaces, clearance.stiffness
    damping: Any = clearance.damping
    at, row, xi = pointers(law), row_of(law, surfaces), float(damping.factor)
    depth = np.geomspace(1e-9, 2.0, DEPTHS) * surfaces.journal_radius
    force = np.array([elastic_force(at["force"], d, row) for d in depth.tolist()])
    energy = np.array([elastic_energy(at["energy"], at["force"], d, row) for d in depth.tolist()])
    sensible = np.isfinite(force) & np.isfinite(energy) & (force > 0.0) & (energy > 0.0)
    s = np.linspace(0.0, 1.0, POINTS)[:-1]
    share = 0.5 * (1.0 - s * s) if xi < SMALL else (1.0 - s) / xi - np.log((1.0 + xi) / (1.0 + xi * s)) / xi**2
    positive = np.isfinite(struck) & (struck > 0.0)
    forces = np.full(np.shape(struck), np.nan)
    energies = struck[positive][:, None] * share[None, :]
    logs = np.interp(np.log(energies), np.log(energy[sensible]), np.log(force[sensible]), left=np.nan, right=np.nan)
    over = np.exp(logs) * (1.0 + xi * s)
    best = np.clip(np.nanargmax(np.where(np.isnan(over), -1.0, over), axis=1), 1, s.size - 2) if over.size else np.zeros(0, int)
    rows = np.arange(best.size)
    left, middle, right = over[rows, best - 1], over[rows, best], over[rows, best + 1]
    curve = left - 2.0 * middle + right
    step = np.where(curve < 0.0, 0.5 * (left - right) / np.where(curve == 0.0, 1.0, curve), 0.0)
    forces[positive] = np.maximum(np.maximum(left, right), middle - 0.25 * (left - right) * np.clip(step, -1.0, 1.0))
    return forces
