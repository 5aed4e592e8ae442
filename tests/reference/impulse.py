"""Plastic impacts of rigid bodies in a plane, in coordinates (x, y, angle) of each mass centre, by momentum balance.

With the masses M, the gradients J of all constraints after the impact and their prescribed rates r,

    M (v+ - v-) = J^T p,    J v+ = r,

are linear in the velocities after the impact and the impulses p. The impulse of a drive does the work p r, as its rate is
constant during the impact.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class Chain:
    """Bars in a row from a bearing on the ground, each pinned to the end of the previous one."""

    length: np.ndarray  # (bars,)
    mass: np.ndarray  # (bars,)
    angle: np.ndarray  # (bars,)

    @property
    def masses(self) -> np.ndarray:
        return np.diag(np.concatenate([[m, m, m * l * l / 12.0] for m, l in zip(self.mass, self.length, strict=True)]))

    def turned(self, bar: int) -> np.ndarray:
        """Return half the bar, rotated by a right angle: the velocity of its end per angular velocity."""
        return 0.5 * self.length[bar] * np.array([-np.sin(self.angle[bar]), np.cos(self.angle[bar])])

    def pins(self) -> np.ndarray:
        """Return the gradients of the pins between the end of each bar and the start of the next one."""
        rows = np.zeros((2 * self.mass.size, 3 * self.mass.size))
        for bar in range(self.mass.size):
            here = rows[2 * bar : 2 * bar + 2]
            here[:, 3 * bar : 3 * bar + 2], here[:, 3 * bar + 2] = np.eye(2), -self.turned(bar)
            if bar:
                before = 3 * (bar - 1)
                here[:, before : before + 2], here[:, before + 2] = -np.eye(2), -self.turned(bar - 1)
        return rows

    def rotation(self, bar: int, base: int | None = None) -> np.ndarray:
        """Return the gradient of the angle of a bar relative to another one or the ground."""
        row = np.zeros((1, 3 * self.mass.size))
        row[0, 3 * bar + 2] = 1.0
        if base is not None:
            row[0, 3 * base + 2] = -1.0
        return row


def plastic_impact(chain, before, drives, latch):
    """Return the loss (of kinetic energy and drive work together) and the drive work [J].

    `before` are velocities, shape (3 bars,); `drives` are angular velocities of bars relative to the ground; `latch` are two
    bars that no longer rotate relative to each other.
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
