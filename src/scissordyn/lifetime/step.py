"""Wear step: change of one bearing's contour by the loads of a cycle, repeated for many cycles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.laws.foundation import pressure_table
from scissordyn.lifetime.loads import Loads
from scissordyn.mechanics import contour as kernels
from scissordyn.model.joint import Revolute
from scissordyn.plan.numbers import contour_table


class Worn(NamedTuple):
    """Contour of a bearing after a wear step."""

    depths: np.ndarray | None  # (angles,) [m]; None if the wear is too large for one step
    deepened: float  # largest increase of the depth [m]


class Bearing:
    """Bearing with a wear coefficient: its geometry, initial contour and pressure table."""

    def __init__(self, joint: Revolute, angles: int) -> None:
        clearance = joint.clearance
        assert clearance is not None
        assert clearance.wear is not None
        surfaces = clearance.surfaces
        if clearance.contour and len(clearance.contour) != angles:
            raise InputError(
                f"joint '{joint.name}': a contour of {len(clearance.contour)} depths",
                f"{angles} depths, one for each angle of the wear computation",
                f"angles = {len(clearance.contour)}",
            )
        self.coefficient, self.bush = clearance.wear, clearance.bush
        self.clearance, self.radius = clearance.clearance, surfaces.bearing_radius
        self.area = 2.0 * np.pi * self.radius * surfaces.length / angles
        self.depths = np.array(clearance.contour or (0.0,) * angles)
        self.table = pressure_table(clearance.stiffness, surfaces)

    def worn(self, depths: np.ndarray, loads: Loads, joint: int, cycles: int, substeps: int = 4000) -> Worn:
        """Return the contour after some cycles; `joint` is the index of this bearing in the loads.

        `substeps`: largest number of substeps of one wear step.
        """
        done, new = self._wear(depths, loads, joint, cycles, substeps)
        return Worn(new if done >= 1.0 else None, float(np.max(new - depths)))

    def rate(self, depths: np.ndarray, loads: Loads, joint: int) -> np.ndarray:
        """Return the depth that one cycle wears on a given contour at each angle, shape (angles,) [m]."""
        done, new = self._wear(depths, loads, joint, 1, 1)
        return np.asarray((new - depths) / done)

    def _wear(self, depths: np.ndarray, loads: Loads, joint: int, cycles: int, substeps: int) -> tuple[float, np.ndarray]:
        """Wear a contour in at most some substeps; return the fraction of the cycles that is done, and the new depths [m]."""
        energy, force = loads.by_direction(joint)
        contour, places = contour_table(depths.tolist()), np.full((energy.size, 2), np.nan)
        done = kernels.wear_out(
            *(contour, self.table, self.clearance, self.area, energy, force, places),
            *(self.coefficient * cycles, substeps, np.zeros((3, depths.size))),
        )
        return done, contour[:, kernels.DEPTH].copy()
