"""Where a run ends whose accelerations are not defined at a sample: at the last sample before."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from scissordyn.integrate.integration import Samples
from scissordyn.mechanics.outputs import Record, record
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.cause import singular_position
from scissordyn.run.advance.change_point import recorded_across
from scissordyn.run.advance.log import unknown
from scissordyn.run.advance.trajectory import Trajectory, compute
from scissordyn.run.options import Options
from scissordyn.run.start.ideal_path import IdealPath


def recorded(
    plan: Plan,
    options: Options,
    path: Trajectory,
    progress: Callable[[float], None] | None = None,
    *,
    ideal: IdealPath | None = None,
) -> tuple[Trajectory, Record]:
    """A trajectory up to the first sample at which the accelerations are not defined, and what is recorded of it.

    If there is one, the run counts as failed there and is computed again up to the last sample before: events, peaks,
    deviations and integrals of what is still going on hold until there.
    """
    samples = path.samples
    state = samples.state.copy() if path.change_points else samples.state
    outputs = record(path.plan.maps, path.system, samples)
    recorded_across(path.plan.maps, path.system, samples, state, outputs, path.change_points)
    undefined = np.flatnonzero(~np.all(np.isfinite(outputs.A), axis=1))
    if not undefined.size:
        return path, outputs
    first, time = int(undefined[0]), float(samples.time[undefined[0]])
    why = singular_position(path.plan, path.system, samples.state[first], time) or "accelerations are not defined"
    kept = Samples(*(part[:first] for part in samples))
    last = float(kept.time[-1]) if first else 0.0
    if last > 0.0:
        cut = compute(plan, dataclasses.replace(options, until=last, samples=2), progress, times=kept.time, ideal=ideal)
        if cut.status == "interrupted":
            return cut, record(cut.plan.maps, cut.system, cut.samples)
    else:
        cut = dataclasses.replace(path, samples=kept, log=path.log[:0], peak=unknown(path.peak), band=unknown(path.band))
    cut = dataclasses.replace(cut, end=last, status="failed", cause=f"stopped at t = {time:.9g} s: {why}")
    return cut, record(cut.plan.maps, cut.system, cut.samples)
