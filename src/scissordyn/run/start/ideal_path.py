"""Where the tracked points of a mechanism would be on the commanded path: a table that the loop compares with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scissordyn.errors import InputError
from scissordyn.model.commanded import commanded, rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.plan.plan import Plan
from scissordyn.plan.plan import plan as make_plan
from scissordyn.run.advance.trajectory import compute

PARTS = ("servo", "bending", "clearance")
"""What lets tracked points leave the commanded path, in the order in which it is added."""

NODES = 64  # Intervals of the first table that is tried
FINER = 4  # How many times finer each further one is

MOST_NODES = 2**18

ACCURATE = 1e-10  # Error of the table between its nodes, as a fraction of the mechanism's size, from which on it is not refined
UNRELIABLE = 1e-7  # Error of the finest table, as a fraction of the mechanism's size, above which there is a warning


TIGHT = 1e-8
"""Tolerance of the ideal motion at most: at larger ones its errors are no smooth functions of time, which no table resolves."""


@dataclass(frozen=True, eq=False)
class IdealPath:
    """Tracked points at equidistant instants: joints ideal, bars rigid, servos on their references."""

    table: np.ndarray  # (nodes, 6 tracks) Position, velocity and acceleration of each [m, m/s, m/s^2]
    step: float  # Time between two rows [s]
    warnings: tuple[str, ...]  # If it ends early, or is not accurate
    stages: tuple[Mechanism, ...]  # That of the path; with its servos; with its bars that bend, too

    @property
    def end(self) -> float:
        return float(self.step * (self.table.shape[0] - 1))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Positions at some instants, shape (nt, tracks, 2) [m]; NaN beyond the end."""
        if self.table.shape[0] < 2:
            return np.full((times.size, self.table.shape[1] // 6, 2), np.nan)
        node = np.clip((times / self.step).astype(int), 0, self.table.shape[0] - 2)
        u = (times / self.step - node)[:, None, None]
        a, b = (np.moveaxis(self.table[k].reshape(times.size, -1, 3, 2), 2, 0) for k in (node, node + 1))
        positions = _quintic(u, self.step, a, b)
        positions[times > self.end + 1e-9 * self.step] = np.nan
        return positions


def stages(mechanism: Mechanism) -> tuple[Mechanism, ...]:
    """The mechanism on its commanded path, with its servos, and with its bars that bend; joints are ideal in all."""
    bending = mechanism.ideal()
    stiff = rigid(bending)
    path = commanded(stiff)
    if path is not stiff:
        try:
            make_plan(path)
        except InputError:  # servos that contradict each other as drives
            path = stiff
    return path, stiff, bending


def deviates(mechanism: Mechanism) -> bool:
    """Whether anything lets a mechanism leave its commanded path."""
    return any(stage is not mechanism for stage in stages(mechanism))


def tracked(plan: Plan, motion: np.ndarray) -> np.ndarray:
    """The tracked points in a record's X, V or A, shape (nt, tracks, 2)."""
    points = [plan.coordinates.tracked(track).at(motion) for track in plan.mechanism.tracks]
    return np.stack(points, axis=1) if points else np.zeros((len(motion), 0, 2))


def ideal_path(plan: Plan, options: Options) -> IdealPath:
    """Simulate the commanded path and tabulate its tracked points, as finely as a quintic between two rows needs."""
    chosen = stages(plan.mechanism)
    ideal = make_plan(chosen[0])
    rtol, atol = min(options.rtol, TIGHT), min(options.atol, TIGHT)
    smooth = replace(options, start="concentric", method="auto", trust=False, step=None, rtol=rtol, atol=atol)
    intervals = NODES
    while True:
        # every other instant lies between two rows, and shows the error there
        times = np.linspace(0.0, options.until, 2 * intervals + 1)
        path = compute(ideal, smooth, times=times, monitor=False)
        if path.status == "interrupted":  # before anything of the run itself has been computed
            raise KeyboardInterrupt
        outputs = path.record()
        values = np.stack([tracked(ideal, part) for part in (outputs.X, outputs.V, outputs.A)], axis=2)
        table, between = values[::2], values[1::2, :, 0]
        step = 2.0 * times[1]
        kept = between[: max(0, table.shape[0] - 1)]
        guess = _quintic(0.5, step, *(np.moveaxis(part, 2, 0) for part in (table[:-1], table[1:])))
        error = float(np.max(np.abs(guess - kept), initial=0.0)) / ideal.coordinates.size
        if error <= ACCURATE or intervals * FINER > MOST_NODES:
            break
        intervals *= FINER
    warnings = []
    if path.status != "complete":
        warnings.append(
            f"deviations of tracked points are unknown from t = {path.end:.6g} s: the rigid ideal mechanism {path.cause}"
        )
    if error > UNRELIABLE:
        apart = error * ideal.coordinates.size
        warnings.append(f"deviations of tracked points err by up to {apart:.3g} m, where drives move in jerks")
    flat = np.ascontiguousarray(table.reshape(table.shape[0], -1))
    return IdealPath(flat, step, tuple(warnings), chosen)


def deviation_parts(path: IdealPath, mechanism: Mechanism, options: Options, times: np.ndarray, at: np.ndarray) -> np.ndarray:
    """What servos, bars that bend and clearance add to the deviation, in this order, shape (parts, time, tracks, 2) [m].

    Each is the change of place as its cause is added to the mechanism on its commanded path; their sum is the deviation.
    """
    before, place = path.stages[0], path.at(times)
    parts = np.zeros((len(PARTS), *place.shape))
    start: StartKind = "static" if options.start == "static" else "concentric"
    until = max(float(times[-1]), 1e-12) if times.size else options.until
    calm = replace(options, start=start, method="auto", trust=False, step=None, samples=2, until=until)
    for number, stage in enumerate((*path.stages[1:], mechanism)):
        if stage is before:
            continue
        there = at
        if stage is not mechanism:
            run = compute(make_plan(stage), calm, times=times, monitor=False)
            if run.status == "interrupted":
                raise KeyboardInterrupt
            reached = tracked(run.plan, run.record().X)
            there = np.full(place.shape, np.nan)
            there[: len(reached)] = reached
        parts[number] = there - place
        before, place = stage, there
    return parts


def _quintic(u: float | np.ndarray, h: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Position at the fraction u of an interval h between two ends a, b = (position, velocity, acceleration).

    The same polynomial stands in `monitored.track_deviation`.
    """
    end = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    slope, end_slope = u - u**3 * (6.0 - 8.0 * u + 3.0 * u * u), u**3 * (-4.0 + 7.0 * u - 3.0 * u * u)
    bend, end_bend = 0.5 * u * u * (1.0 - 3.0 * u + 3.0 * u * u - u**3), 0.5 * u**3 * (1.0 - 2.0 * u + u * u)
    position = (1.0 - end) * a[0] + end * b[0] + h * (slope * a[1] + end_slope * b[1]) + h * h * (bend * a[2] + end_bend * b[2])
    return np.asarray(position)
