"""Largest forces, stresses and buckling ratios of flexible bars over the samples of a run."""

from __future__ import annotations

from scissordyn.equilibrium.buckling import buckling_ratios
from scissordyn.mechanics.sample import Record
from scissordyn.record.dataset import component_variables, motion_variables
from scissordyn.record.deferred import Deferred
from scissordyn.record.internal_forces import Largest, bars_of, largest_along, largest_variables
from scissordyn.record.results import Variables, labels
from scissordyn.record.trajectory import Trajectory


def bar_extremes(path: Trajectory, record: Record, variables: Variables) -> Variables:
    """Return variables with each flexible bar's largest forces, stresses, deflections and buckling ratios over the samples.

    All values are computed when one of them is first read.
    """
    mechanism, samples = path.plan.mechanism, path.samples
    bars = bars_of(mechanism)
    if not bars or not samples.time.size:
        return {}
    run_variables = dict(variables)  # without the returned ones: variables that refer to themselves are freed late

    def largest() -> Largest:
        return largest_along(mechanism, run_variables, samples.time, buckling_ratios(path.plan, samples, record, run_variables))

    return largest_variables(bars, Deferred(largest, path.system.lock))


def largest_along_bars(path: Trajectory, record: Record) -> Variables:
    """Return `bar_extremes` of a motion; compute only the variables that it needs."""
    plan = path.plan
    variables = {
        "body": labels("body", [body.name for body in plan.bodies]),
        **motion_variables(plan, record),
        **component_variables(plan, path, record),
    }
    return bar_extremes(path, record, variables)
