"""Largest forces, stresses and buckling ratios of flexible bars over the samples of a run."""

from __future__ import annotations

from scissordyn.equilibrium.buckling import buckling_ratios
from scissordyn.integrate.integration import Samples
from scissordyn.mechanics.outputs import Record
from scissordyn.plan.plan import Plan
from scissordyn.record.dataset import component_variables, motion_variables
from scissordyn.record.internal_forces import largest_variables
from scissordyn.record.results import Variables, labels
from scissordyn.record.trajectory import Trajectory


def bar_extremes(plan: Plan, samples: Samples, record: Record, variables: Variables) -> Variables:
    """Return the largest forces, stresses, deflections and buckling ratios of each flexible bar over the samples."""
    ratios = buckling_ratios(plan, samples, record, variables)
    return largest_variables(plan.mechanism, variables, samples.time, ratios)


def largest_along_bars(path: Trajectory, record: Record) -> Variables:
    """Return `bar_extremes` of a motion whose other variables are not needed."""
    plan = path.plan
    variables = {
        "body": labels("body", [body.name for body in plan.bodies]),
        **motion_variables(plan, record),
        **component_variables(plan, path, record),
    }
    return bar_extremes(plan, path.samples, record, variables)
