"""Plastic impacts of rigid bodies in a plane, in coordinates (x, y, angle) of each mass centre, by the momentum balance alone.

With M the masses, J the gradients of all constraints that hold after the impact and r their prescribed rates,

    M (v+ - v-) = J^T p,    J v+ = r,

are linear in the velocities after the impact and the impulses p. The impulse of a drive does the work p r, as its rate is the
same throughout.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class Chain:
    """Bars one after another from a bearing on the ground, each pinned to the end of the one before."""

    length: np.ndarray  # (bars,)
    mass: np.ndarray  # (bars,)
    angle: np.ndarray  # (bars,)

    @property
    def masses(self) -> np.ndarray:
        return np.diag(np.concatenate([[m, m, m * l * l / 12.0] for m, l in zip(self.mass, self.length, strict=True)]))

    def turned(self, bar: int) -> np.ndarray:
        """Half the bar, turned by a right angle: what its end gains by its rotation."""
        return 0.5 * self.length[bar] * np.array([-np.sin(self.angle[bar]), np.cos(self.angle[bar])])

    def pins(self) -> np.ndarray:
        """Gradients of the pins: the end of the bar before, and the start of the bar, stay together."""
        rows = np.zeros((2 * self.mass.size, 3 * self.mass.size))
        for bar in range(self.mass.size):
            here = rows[2 * bar : 2 * bar + 2]
            here[:, 3 * bar : 3 * bar + 2], here[:, 3 * bar + 2] = np.eye(2), -self.turned(bar)
            if bar:
                before = 3 * (bar - 1)
                here[:, before : before + 2], here[:, before + 2] = -np.eye(2), -self.turned(bar - 1)
        return rows

    def rotation(self, bar: int, base: int | None = None) -> np.ndarray:
        """Gradient of the angle of a bar, against another one or the ground."""
        row = np.zeros((1, 3 * self.mass.size))
        row[0, 3 * bar + 2] = 1.0
        if base is not None:
            row[0, 3 * base + 2] = -1.0
        return row


def plastic_impact(chain: Chain, before: np.ndarray, drives: dict[int, float], latch: tuple[int, int]) -> tuple[float, float]:
    """Loss of the kinetic energy and of the drives' work together, and this work [J].

    Of the velocities `before`, shape (3 bars,); `drives` are angular velocities of bars against the ground, `latch` are bars
    that no longer rotate against each other.
    """
    rows = [chain.pins(), chain.rotation(*latch), *(chain.rotation(bar) for bar in drives)]
    rates = np.concatenate([np.zeros(2 * chain.mass.size + 1), list(drives.values())])
    J, M = np.concatenate(rows), chain.masses
    size = J.shape[0]
    found = np.linalg.solve(np.block([[M, -J.T], [J, np.zeros((size, size))]]), np.concatenate([M @ before, rates]))
    after, impulses = found[: before.size], found[before.size :]
    work = float(impulses @ rates)
    gained = 0.5 * float(after @ M @ after - before @ M @ before)
    return work - gained, work
