"""Where the tracked points of a mechanism would be with ideal joints: a table that the loop compares with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scissordyn.mechanics.outputs import record
from scissordyn.plan.plan import Plan
from scissordyn.run.options import Options
from scissordyn.run.trajectory import compute

__all__ = ["IdealPath", "ideal_path"]

NODES = 64
"""Intervals of the first table that is tried."""

FINER = 4
"""How many times finer each further one is."""

MOST_NODES = 2**18

ACCURATE = 1e-10
"""Error of the table between its nodes, as a fraction of the mechanism's size, from which on it is not refined."""

UNRELIABLE = 1e-7
"""Error of the finest table, as a fraction of the mechanism's size, above which there is a warning."""


TIGHT = 1e-8
"""Tolerance of the ideal motion at most: at larger ones its errors are no smooth functions of time, which no table resolves."""


@dataclass(frozen=True, eq=False)
class IdealPath:
    """Tracked points of the ideal mechanism at equidistant instants.

    Parameters
    ----------
    table : ndarray, shape (nodes, 6 tracks)
        Position, velocity and acceleration of each [m, m/s, m/s^2].
    step : float
        Time between two rows [s].
    warnings : tuple of str
        If it ends early, or is not accurate.
    """

    table: np.ndarray
    step: float
    warnings: tuple[str, ...]

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return float(self.step * (self.table.shape[0] - 1))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Positions at some instants, shape (nt, tracks, 2) [m]; NaN beyond the end."""
        if self.table.shape[0] < 2:
            return np.full((times.size, self.table.shape[1] // 6, 2), np.nan)
        node = np.clip((times / self.step).astype(int), 0, self.table.shape[0] - 2)
        u = (times / self.step - node)[:, None, None]
        a, b = (np.moveaxis(self.table[k].reshape(times.size, -1, 3, 2), 2, 0) for k in (node, node + 1))
        found = _quintic(u, self.step, a, b)
        found[times > self.end + 1e-9 * self.step] = np.nan
        return found


def ideal_path(plan: Plan, options: Options) -> IdealPath:
    """Simulate the ideal mechanism and tabulate its tracked points, as finely as a quintic between two rows needs.

    Parameters
    ----------
    plan : Plan
        With tracked points.
    options : Options

    Returns
    -------
    IdealPath
    """
    ideal = plan.ideal
    rtol, atol = min(options.rtol, TIGHT), min(options.atol, TIGHT)
    smooth = replace(options, start="concentric", method="auto", trust=False, step=None, rtol=rtol, atol=atol)
    intervals = NODES
    while True:
        # every other instant lies between two rows, and shows the error there
        times = np.linspace(0.0, options.until, 2 * intervals + 1)
        path = compute(ideal, smooth, times=times, monitor=False)
        if path.status == "interrupted":  # before anything of the run itself has been computed
            raise KeyboardInterrupt
        found = record(path.plan.maps, path.system, path.samples)
        maps = [path.plan.coordinates.tracked(track) for track in ideal.tracks]
        rows = np.stack([[each.at(part) for each in maps] for part in (found.X, found.V, found.A)])  # kind, track, time, axis
        values = np.moveaxis(rows, 2, 0).swapaxes(1, 2)  # time, track, kind, axis
        table, between = values[::2], values[1::2, :, 0]
        step = 2.0 * times[1]
        kept = between[: max(0, table.shape[0] - 1)]
        guess = _quintic(0.5, step, *(np.moveaxis(part, 2, 0) for part in (table[:-1], table[1:])))
        error = float(np.max(np.abs(guess - kept), initial=0.0)) / ideal.size
        if error <= ACCURATE or intervals * FINER > MOST_NODES:
            break
        intervals *= FINER
    warnings = []
    if path.status != "complete":
        warnings.append(f"deviations of tracked points are unknown from t = {path.end:.6g} s: the ideal mechanism {path.cause}")
    if error > UNRELIABLE:
        warnings.append(f"deviations of tracked points err by up to {error * ideal.size:.3g} m, where drives move in jerks")
    flat = np.ascontiguousarray(table.reshape(table.shape[0], -1))
    return IdealPath(flat, step, tuple(warnings))


def _quintic(u: float | np.ndarray, h: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Position at the fraction u of an interval h between two ends a, b = (position, velocity, acceleration).

    The same polynomial stands in `monitored.track_deviation`.
    """
    end = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    slope, end_slope = u - u**3 * (6.0 - 8.0 * u + 3.0 * u * u), u**3 * (-4.0 + 7.0 * u - 3.0 * u * u)
    bend, end_bend = 0.5 * u * u * (1.0 - 3.0 * u + 3.0 * u * u - u**3), 0.5 * u**3 * (1.0 - 2.0 * u + u * u)
    found = (1.0 - end) * a[0] + end * b[0] + h * (slope * a[1] + end_slope * b[1]) + h * h * (bend * a[2] + end_bend * b[2])
    return np.asarray(found)
