"""Warnings of a run with hard contacts: steps that are not solved, over-determined positions, jamming."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from scissordyn.kernel import Handle
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.run.options import Options
from scissordyn.warning import RunWarning, warning

DEEP = 0.2  # Indentation beyond that of the law, over clearance, above which the step is too long for a journal in its bearing
JAMMED = 1e-9  # Speed of all coordinates, as a fraction of the largest in the run, below which the mechanism stands

FOLLOWS, NOT_CONVERGED = 3.0, 0.05
"""Steps within which a contact follows the one before in its joint, so that their sequence is not resolved; and part of all
that contacts and friction dissipate that such contacts may take by restitution without a warning."""

LASTING = 0.02  # Part of the run at its end for which a mechanism that has jammed stands


def hard_contact_warnings(path: Trajectory, options: Options) -> list[RunWarning]:
    """The warnings of time stepping, or of another method whose steps ignore where contacts begin and end."""
    if "step" not in path.statistics:
        return ignored_roots(path.plan, options)
    return stepping_warnings(path.plan, path.system, path.statistics) + _not_converged(path) + _jammed(path)


def ignored_roots(plan: Plan, options: Options) -> list[RunWarning]:
    """The warning of a run whose contacts begin and end with steps."""
    return [warning("contacts with steps", step=options.step)] if plan.contacts and options.step is not None else []


def stepping_warnings(plan: Plan, system: Handle, counts: Mapping[str, Any]) -> list[RunWarning]:
    """What the counters of time stepping warn of: impulses that are not solved or not determined, surfaces that overlap."""
    warnings, steps = [], counts["contact_steps"]
    if counts["steps_not_solved"]:
        warnings.append(warning("not solved", count=counts["steps_not_solved"], steps=steps))
    if counts["over_determined_steps"]:
        warnings.append(warning("over-determined", count=counts["over_determined_steps"], steps=steps))
    clearance, overlap = system.content.parameters.contact["clearance"], counts["overlap"]
    deepest = {j: overlap.get(plan.contacts[j].name, 0.0) / float(clearance[j]) for j in plan.hard_places}
    deep = [j for j in plan.hard_places if deepest[j] > DEEP]
    if deep:
        worst = max(deep, key=lambda j: deepest[j])
        others = f", and those of {len(deep) - 1} more" if len(deep) > 1 else ""
        numbers = {"overlap": deepest[worst], "others": others, "step": counts["step"]}
        warnings.append(warning("overlap", plan.contacts[worst].name, **numbers))
    return warnings


def _not_converged(path: Trajectory) -> list[RunWarning]:
    """That the losses of restitution are those of sequences of impacts that the step does not resolve."""
    step, ends, unresolved = path.statistics["step"], dict[int, float](), 0.0
    hard, contacts = set(path.plan.hard_places), path.contacts()
    for contact in contacts:
        if contact.joint in hard and contact.start < ends.get(contact.joint, -math.inf) + FOLLOWS * step:
            unresolved += contact.damping_loss
        ends[contact.joint] = contact.start + (math.inf if math.isnan(contact.duration) else contact.duration)
    lost = sum(contact.damping_loss for contact in contacts if contact.joint in hard)
    dissipated = sum(contact.damping_loss + contact.friction_loss for contact in contacts)
    if path.statistics["impacts_located"] or not unresolved > NOT_CONVERGED * dissipated:
        return []
    return [warning("not converged", unresolved=unresolved, lost=lost, within=FOLLOWS, step=0.25 * step)]


def _jammed(path: Trajectory) -> list[RunWarning]:
    """That the mechanism has come to a stand while contacts stick, and which."""
    n, samples = path.plan.coordinates.free, path.samples
    speed = np.max(np.abs(samples.state[:, n : 2 * n]), axis=1, initial=0.0)
    moving = np.flatnonzero(speed > JAMMED * np.max(speed, initial=0.0))
    sticking = path.statistics["sticking"]
    if not moving.size or not sticking or path.status != "complete":
        return []
    last = float(samples.time[moving[-1]])
    closed = [path.plan.contacts[j].name for j in path.plan.hard_places if samples.mode[-1, j] == 1]
    stuck = [name for name in closed if name in sticking]
    if last > (1.0 - LASTING) * path.end or not stuck:
        return []
    names = ", ".join(f"'{name}'" for name in stuck)
    return [warning("jammed", time=last, names=names)]
