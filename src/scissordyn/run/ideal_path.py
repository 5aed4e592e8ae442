"""Where the tracked points of a mechanism would be on the commanded path: a table that the loop compares with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scissordyn.errors import InputError
from scissordyn.model.commanded import commanded, rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.plan import plan as make_plan
from scissordyn.record.ideal_path import IdealPath, quintic
from scissordyn.record.track import tracked
from scissordyn.run.trajectory import compute

NODES = 64  # Intervals of the first table that is tried
FINER = 4  # How many times finer each further one is

MOST_NODES = 2**18

ACCURATE = 1e-10  # Error of the table between its nodes, as a fraction of the mechanism's size, from which on it is not refined
UNRELIABLE = 1e-7  # Error of the finest table, as a fraction of the mechanism's size, above which there is a warning


TIGHT = 1e-8
"""Tolerance of the ideal motion at most: at larger ones its errors are no smooth functions of time, which no table resolves."""


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
        guess = quintic(0.5, step, *(np.moveaxis(part, 2, 0) for part in (table[:-1], table[1:])))
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
