"""Commanded path: motion of the tracked points of the ideal mechanism, as a table over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissordyn.model.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class IdealPath:
    """Motion of the tracked points at equidistant instants, with ideal joints, rigid bars and servos on their references."""

    table: np.ndarray  # (nodes, 6 tracks) Position, velocity and acceleration of each point [m, m/s, m/s^2]
    step: float  # Time between two rows [s]
    warnings: tuple[str, ...]  # Warnings that the path ends early or is not accurate
    stages: tuple[Mechanism, ...]  # Ideal mechanism, then with servos, then also with flexible bars

    @property
    def end(self) -> float:
        return float(self.step * (self.table.shape[0] - 1))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the positions at given instants, shape (nt, tracks, 2) [m]; NaN after the end of the path."""
        if self.table.shape[0] < 2:
            return np.full((times.size, self.table.shape[1] // 6, 2), np.nan)
        node = np.clip((times / self.step).astype(int), 0, self.table.shape[0] - 2)
        u = (times / self.step - node)[:, None, None]
        a, b = (np.moveaxis(self.table[k].reshape(times.size, -1, 3, 2), 2, 0) for k in (node, node + 1))
        positions = quintic(u, self.step, a, b)
        positions[times > self.end + 1e-9 * self.step] = np.nan
        return positions


def quintic(u: float | np.ndarray, h: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Interpolate a position by a quintic polynomial at the fraction u of an interval of length h.

    `a` and `b` are (position, velocity, acceleration) at the ends of the interval.

    `monitored.track_deviation` evaluates the same polynomial.
    """
    end = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    slope, end_slope = u - u**3 * (6.0 - 8.0 * u + 3.0 * u * u), u**3 * (-4.0 + 7.0 * u - 3.0 * u * u)
    bend, end_bend = 0.5 * u * u * (1.0 - 3.0 * u + 3.0 * u * u - u**3), 0.5 * u**3 * (1.0 - 2.0 * u + u * u)
    position = (1.0 - end) * a[0] + end * b[0] + h * (slope * a[1] + end_slope * b[1]) + h * h * (bend * a[2] + end_bend * b[2])
    return np.asarray(position)
