"""Warnings that a trajectory shows: hard contacts, Painlevé's paradox, scales of states that do not fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from scissordyn.components.declaration import Component
from scissordyn.kernel import Handle
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.mechanics.outputs import Record, rates_without, sampled
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import rates
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.advance.tolerance import state_tolerance
from scissordyn.units import State
from scissordyn.warning import RunWarning, warning

DEEP = 0.2  # Indentation beyond that of the law, over clearance, above which the step is too long for a journal in its bearing
JAMMED = 1e-9  # Speed of all coordinates, as a fraction of the largest in the run, below which the mechanism stands

FOLLOWS, NOT_CONVERGED = 3.0, 0.05
"""Steps within which a contact follows the one before in its joint, so that their sequence is not resolved; and part of all
that contacts and friction dissipate that such contacts may take by restitution without a warning."""

LASTING = 0.02  # Part of the run at its end for which a mechanism that has jammed stands


def trajectory_warnings(path: Trajectory, record: Record, options: Options) -> list[RunWarning]:
    """What is doubtful in a run by its states, friction and steps."""
    warnings = _painleve(path, record) + _coarse_scales(options, path)
    if "step" not in path.statistics:
        return warnings + ignored_roots(path.plan, options)
    return warnings + stepping_warnings(path.plan, path.system, path.statistics) + _not_converged(path) + _jammed(path)


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


MOST_SAMPLES, FEWEST = 600, 10
"""So many samples of a run are looked at, shared by its contacts and evenly spread over each, and no fewer of a contact."""


def _painleve(path: Trajectory, run: Record) -> list[RunWarning]:
    """Contacts whose force, friction included, accelerates the surfaces into each other.

    With f the normal force, mu the friction over it and n, t the normal and the tangent, the indentation accelerates by
    -f (n M n - mu n M t), M the inverse of the mass that the joints leave. Where the bracket is negative a rigid contact has no
    solution or several (Painlevé's paradox), and the motion depends on the stiffness and damping of the contact.

    References
    ----------
    Champneys and Varkonyi 2016, arXiv:1601.03545
    """
    warnings, contacts = [], path.plan.contacts
    share = max(FEWEST, MOST_SAMPLES // max(1, len(contacts)))
    for j in path.plan.compliant_places:  # the solver of impulses of a hard contact warns of what it cannot solve
        if isinstance(path.plan.clearances[j].friction, NoFriction):
            continue
        force, friction = run.contact["normal"][:, j], run.contact["tangential"][:, j]
        touching = np.flatnonzero((path.samples.mode[:, j] == 1) & (force > 0.0) & (friction != 0.0))
        samples = touching[:: -(-touching.size // share) or 1]
        paradox = _pressed_together(path, run, j, samples)
        if paradox.size:
            first = paradox[0]
            ratio, time = abs(friction[first]) / force[first], path.samples.time[first]
            numbers = {"count": paradox.size, "samples": samples.size, "time": time, "ratio": ratio}
            warnings.append(warning("painleve", contacts[j].name, **numbers))
    return warnings


def _pressed_together(path: Trajectory, run: Record, contact: int, samples: np.ndarray) -> np.ndarray:
    """The samples at which the force of a contact accelerates its indentation: accelerations with it less those without."""
    vector, n = path.plan.eccentricity(contact), path.plan.coordinates.free
    free = vector.columns < n
    columns, rows = vector.columns[free], vector.rows[:, free]
    rates = np.zeros((samples.size, path.samples.state.shape[1]))
    rates_without(sampled(path.samples), np.ascontiguousarray(samples), contact, path.system.address, rates)
    apart = (run.A[samples][:, columns] - rates[:, n + columns]) @ rows.T
    row = run.contact[samples, contact]
    return np.asarray(samples[apart[:, 0] * row["nx"] + apart[:, 1] * row["ny"] > 0.0])


COARSE = 1e3
"""A state whose allowed error changes a force by more than this times the tolerance, as a part of the largest force of its
component, has a scale that does not fit: three digits are lost. One that fits loses none."""

MOST = 500  # Samples at which this is looked at


def _coarse_scales(options: Options, path: Trajectory) -> list[RunWarning]:
    """A warning for each state whose declared scale is so large that its allowed error is seen in the force."""
    places = _places(path)
    instants = path.samples.time.size
    if not places or not instants:
        return []
    content, warnings, samples, state = path.system.content, list[RunWarning](), path.samples, path.system.content.state
    allowed = state_tolerance(options.rtol, options.atol)
    change, size = np.zeros(len(places)), np.zeros(len(places))
    for at in np.unique(np.linspace(0, instants - 1, min(instants, MOST)).astype(int)).tolist():
        state.mode[:], state.memory[:], state.mass[:] = samples.mode[at], samples.memory[at], samples.mass[at]
        state.reference[:] = samples.reference[at]
        functions.activate(path.system.address)
        y = samples.state[at].copy()
        for k, (i, component, entry, _) in enumerate(places):
            forces, here = len(component.declaration.port.forces), y[entry]
            error = allowed * content.parameters.state_scale[entry - 2 * path.plan.coordinates.free]
            answers = []
            for moved in (here, here + error, here - error):
                y[entry] = moved
                rates(path.system, samples.time[at], y)
                answers.append(np.array(content.work.result[i, :forces]))
            y[entry] = here
            size[k] = max(size[k], np.abs(answers[0]).max())
            change[k] = max(change[k], 0.5 * np.abs(answers[1] - answers[2]).max())
    for k, (_, component, entry, declared) in enumerate(places):
        if not change[k] > COARSE * allowed * size[k] > 0.0:
            continue
        scale, share = content.parameters.state_scale[entry - 2 * path.plan.coordinates.free], change[k] / size[k]
        force = component.declaration.port.forces[0].partition("_")[0]
        numbers = {"error": allowed * scale, "unit": declared.unit, "state": declared.name, "share": share, "force": force}
        numbers |= {"scale": scale, "fitting": scale * allowed / share}
        warnings.append(warning("state scale", component.name, component.declaration.label, **numbers))
    return warnings


def _places(path: Trajectory) -> list[tuple[int, Component, int, State]]:
    """Of each state of a component: the component's number, itself, the entry of y, the declared state."""
    start, places = path.system.content.model.state_start, []
    controlled = dict(path.plan.actuators)
    for i, component in enumerate(path.plan.acting):
        if i not in controlled:
            first = 2 * path.plan.coordinates.free + int(start[len(path.plan.contacts) + i])
            places += [(i, component, first + s, state) for s, state in enumerate(component.states)]
    return places
