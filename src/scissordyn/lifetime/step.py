"""Wear step: change of the contours of one joint by the loads of a cycle, repeated for many cycles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.laws.foundation import pressure_table
from scissordyn.lifetime.loads import Loads, WornSurface
from scissordyn.mechanics import contour as kernels
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.numbers import contour_table


class Worn(NamedTuple):
    """Contours of a joint after a wear step."""

    depths: np.ndarray | None  # (surfaces, angles) [m]; None if the wear is too large for one step
    deepened: float  # largest increase of the depth [m]


class WornJoint:
    """Joint with one or two worn surfaces: its geometry, initial contours and pressure table."""

    def __init__(self, mechanism: Mechanism, surfaces: Sequence[WornSurface], rows: list[int], angles: int) -> None:
        """`rows`: indices of the surfaces of this joint, the bearing first."""
        clearance = mechanism.joint(surfaces[rows[0]].joint).clearance
        assert clearance is not None
        self.rows, geometry = rows, clearance.surfaces
        contours = [surfaces[row].contour(clearance) for row in rows]
        for depths in contours:
            if depths and len(depths) != angles:
                raise InputError(
                    f"joint '{surfaces[rows[0]].joint}': a contour of {len(depths)} depths",
                    f"{angles} depths, one for each angle of the wear computation",
                    f"angles = {len(depths)}",
                )
        self.depths = np.array([depths or (0.0,) * angles for depths in contours])
        self.coefficients = np.array([clearance.wear or 0.0, clearance.journal_wear or 0.0])[: len(rows)]
        self.bush, self.clearance = clearance.bush, clearance.clearance
        self.radii = np.array([geometry.bearing_radius, geometry.journal_radius])[: len(rows)]
        self.areas = 2.0 * np.pi * self.radii * geometry.length / angles
        self.table = pressure_table(clearance.stiffness, geometry)

    def worn(self, depths: np.ndarray, loads: Loads, cycles: int, substeps: int = 4000) -> Worn:
        """Return the contours after some cycles, from those of all surfaces, shape (surfaces, angles) [m].

        `substeps`: largest number of substeps of one wear step.
        """
        done, new = self._wear(depths, loads, cycles, substeps)
        return Worn(new if done >= 1.0 else None, float(np.max(new - depths[self.rows])))

    def rate(self, depths: np.ndarray, loads: Loads) -> np.ndarray:
        """Return the depth that one cycle wears at each angle, shape (surfaces of this joint, angles) [m]."""
        done, new = self._wear(depths, loads, 1, 1)
        return np.asarray((new - depths[self.rows]) / done)

    def _wear(self, depths: np.ndarray, loads: Loads, cycles: int, substeps: int) -> tuple[float, np.ndarray]:
        """Wear the contours in at most some substeps; return the completed fraction of the cycles and the new depths [m]."""
        energy, force, turn, spread = (np.array(part) for part in zip(*map(loads.by_direction, self.rows), strict=True))
        contours = np.array([contour_table(depths[row].tolist()) for row in self.rows])
        done = kernels.wear_out(
            *(contours, self.table, self.clearance, float(self.areas[0]), self.areas, energy, force, turn, spread),
            *(np.full((*energy.shape, 2), np.nan), self.coefficients * cycles, substeps),
            *(np.zeros((6, depths.shape[1])), np.zeros(contours.shape[1:])),
        )
        return done, contours[..., kernels.DEPTH].copy()
