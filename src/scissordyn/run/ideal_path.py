"""Table of the positions that the tracked points of a mechanism would have on the commanded path; the time loop uses it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scissordyn.equilibrium.cause import describe_failed_latch
from scissordyn.errors import InputError
from scissordyn.model.commanded import commanded, rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.plan import plan as make_plan
from scissordyn.record.ideal_path import IdealPath, quintic
from scissordyn.record.track import tracked
from scissordyn.run.trajectory import compute


def make_stages(mechanism: Mechanism) -> tuple[Mechanism, ...]:
    """Return a mechanism with ideal joints in three versions: rigid on its commanded path, rigid with servos, and bending."""
    bending = mechanism.ideal()
    stiff = rigid(bending)
    path = commanded(stiff)
    if path is not stiff:
        try:
            make_plan(path)
        except InputError:  # servos that contradict each other as drives
            path = stiff
    return path, stiff, bending


def can_deviate(mechanism: Mechanism) -> bool:
    """Report whether servos, bending or clearance let a mechanism leave its commanded path."""
    return any(stage is not mechanism for stage in make_stages(mechanism))


def ideal_path(
    plan: Plan, options: Options, *, intervals: int = 64, refinement: int = 4, intervals_max: int = 2**18
) -> IdealPath:
    """Simulate the commanded path and tabulate its tracked points finely enough for quintic interpolation.

    The path has no latches if one of them would have to stop a servo's reference.

    `refinement`: refinement factor from one table to the next.

    `intervals_max`: intervals of the finest table.
    """
    chosen = make_stages(plan.mechanism)
    has_servo_drives = chosen[0] is not chosen[1]
    ideal = make_plan(chosen[0])
    accuracy = 1e-10  # [mechanism sizes] table error that ends the refinement
    warned_error = 1e-7  # [mechanism sizes] error above which the table is reported
    # A larger tolerance gives errors that are not smooth in time, which no table resolves.
    rtol, atol = min(options.rtol, 1e-8), min(options.position_tolerance, 1e-8)
    smooth = replace(options, start="concentric", method="auto", trust=False, step=None, rtol=rtol, atol=atol)
    while True:
        # every second instant lies midway between two rows and gives the interpolation error there
        times = np.linspace(0.0, options.until, 2 * intervals + 1)
        path = compute(ideal, smooth, times=times, monitor=False)
        if path.status == "interrupted":  # interrupted before the run itself has started
            raise KeyboardInterrupt
        if has_servo_drives and describe_failed_latch(ideal, path.system):
            ideal = make_plan(replace(chosen[0], latches=()))
            chosen = (ideal.mechanism, *chosen[1:])
            continue
        outputs = path.record()
        values = np.stack([tracked(ideal, part) for part in (outputs.X, outputs.V, outputs.A)], axis=2)
        table, between = values[::2], values[1::2, :, 0]
        step = 2.0 * times[1]
        midpoints = between[: max(0, table.shape[0] - 1)]
        guess = quintic(0.5, step, *(np.moveaxis(part, 2, 0) for part in (table[:-1], table[1:])))
        error = float(np.max(np.abs(guess - midpoints), initial=0.0)) / ideal.coordinates.size
        if error <= accuracy or intervals * refinement > intervals_max:
            break
        intervals *= refinement
    warnings = []
    if path.status != "complete":
        warnings.append(
            f"deviations of tracked points are unknown from t = {path.end:.6g} s: the rigid ideal mechanism {path.cause}"
        )
    if error > warned_error:
        length_error = error * ideal.coordinates.size
        warnings.append(
            f"deviations of tracked points err by up to {length_error:.3g} m, where drives move in jerks or latches lock"
        )
    flat = np.ascontiguousarray(table.reshape(table.shape[0], -1))
    return IdealPath(flat, step, tuple(warnings), chosen)
