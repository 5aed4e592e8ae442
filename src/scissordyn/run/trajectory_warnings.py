"""Warnings about a trajectory: hard contacts, Painlevé's paradox, unsuitable scales of states."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from scissordyn.components.declaration import Component
from scissordyn.kernel import Handle
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.mechanics.outputs import rates_without, sampled
from scissordyn.mechanics.sample import Record
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import rates
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.advance.tolerance import state_tolerance
from scissordyn.run.bristle_recoil import recoil_warnings
from scissordyn.units import State
from scissordyn.warning import RunWarning, warning


def trajectory_warnings(path: Trajectory, record: Record, options: Options) -> list[RunWarning]:
    """Return the warnings about states, friction and steps of a run."""
    warnings = _painleve(path, record) + _coarse_scales(options, path)
    warnings += recoil_warnings(path.plan, path.system, _instants(path))
    if "step" not in path.statistics:
        return warnings + ignored_roots(path.plan, options)
    return warnings + stepping_warnings(path.plan, path.system, path.statistics) + _not_converged(path) + _jammed(path)


def ignored_roots(plan: Plan, options: Options) -> list[RunWarning]:
    """Warn that contacts begin and end only at the ends of steps, if every step has a fixed size."""
    return [warning("contacts with steps", step=options.step)] if plan.contacts and options.step is not None else []


def stepping_warnings(plan: Plan, system: Handle, counts: Mapping[str, Any]) -> list[RunWarning]:
    """Return warnings from the counters of time stepping: unsolved or undetermined impulses, and overlapping surfaces."""
    warnings, steps = [], counts["contact_steps"]
    if counts["steps_not_solved"]:
        warnings.append(warning("not solved", count=counts["steps_not_solved"], steps=steps))
    if counts["over_determined_steps"]:
        warnings.append(warning("over-determined", count=counts["over_determined_steps"], steps=steps))
    clearance, overlap = system.content.parameters.contact["clearance"], counts["overlap"]
    deepest = {j: overlap.get(plan.contacts[j].name, 0.0) / float(clearance[j]) for j in plan.hard_places}
    # [clearances] the step is too long for a journal in its bearing above this overlap beyond the law's indentation
    overlap_max = 0.2
    deep = [j for j in plan.hard_places if deepest[j] > overlap_max]
    if deep:
        worst = max(deep, key=lambda j: deepest[j])
        others = f", and those of {len(deep) - 1} more" if len(deep) > 1 else ""
        numbers = {"overlap": deepest[worst], "others": others, "step": counts["step"]}
        warnings.append(warning("overlap", plan.contacts[worst].name, **numbers))
    return warnings


def _not_converged(path: Trajectory) -> list[RunWarning]:
    """Warn if sequences of impacts that the step does not resolve cause much of the dissipation."""
    # [steps] a contact that starts within this time after the previous one of its joint is not resolved
    resolved_steps = 3.0
    step, ends, unresolved = path.statistics["step"], dict[int, float](), 0.0
    hard, columns = set(path.plan.hard_places), ["joint", "start", "duration", "damping_loss", "friction_loss"]
    contacts = path.contacts[columns].tolist()
    for joint, start, duration, loss, _ in contacts:
        if joint in hard and start < ends.get(joint, -math.inf) + resolved_steps * step:
            unresolved += loss
        ends[joint] = start + (math.inf if math.isnan(duration) else duration)
    lost = sum(loss for joint, _, _, loss, _ in contacts if joint in hard)
    dissipated = sum(loss + friction for *_, loss, friction in contacts)
    if path.statistics["impacts_located"] or not unresolved > 0.05 * dissipated:
        return []
    return [warning("not converged", unresolved=unresolved, lost=lost, within=resolved_steps, step=0.25 * step)]


def _jammed(path: Trajectory) -> list[RunWarning]:
    """Warn if the mechanism has stopped while contacts stick, and name these contacts."""
    n, samples = path.plan.coordinates.free, path.samples
    stopped, stopped_part = 1e-9, 0.02  # fraction of the largest speed, and fraction of the run at its end
    speed = np.max(np.abs(samples.state[:, n : 2 * n]), axis=1, initial=0.0)
    moving = np.flatnonzero(speed > stopped * np.max(speed, initial=0.0))
    sticking = path.statistics["sticking"]
    if not moving.size or not sticking or path.status != "complete":
        return []
    last = float(samples.time[moving[-1]])
    closed = [path.plan.contacts[j].name for j in path.plan.hard_places if samples.mode[-1, j] == 1]
    stuck = [name for name in closed if name in sticking]
    if last > (1.0 - stopped_part) * path.end or not stuck:
        return []
    names = ", ".join(f"'{name}'" for name in stuck)
    return [warning("jammed", time=last, names=names)]


def _painleve(path: Trajectory, run: Record) -> list[RunWarning]:
    """Warn of contacts whose force, friction included, accelerates the surfaces into each other.

    f is the normal force, mu the friction coefficient, n and t the normal and the tangent. M is the inverse of the mass that
    the joints leave. The indentation accelerates by -f (n M n - mu n M t). If the bracket is negative, a rigid contact has no
    solution or several (Painlevé's paradox), and the motion depends on the stiffness and damping of the contact.

    References
    ----------
    Champneys and Varkonyi 2016, arXiv:1601.03545
    """
    warnings, contacts = [], path.plan.contacts
    share = max(10, 600 // max(1, len(contacts)))  # samples checked per contact: 600 in all, at least 10 each
    for j in path.plan.compliant_places:  # the impulse solver of a hard contact warns of what it cannot solve
        if isinstance(path.plan.clearances[j].friction, NoFriction):
            continue
        force, friction = run.contact["normal"][:, j], run.contact["tangential"][:, j]
        touching = np.flatnonzero((path.samples.mode[:, j] == 1) & (force > 0.0) & (friction != 0.0))
        samples = touching[:: -(-touching.size // share) or 1]
        paradox = _pressed_together(path, run, j, samples) if samples.size else samples
        if paradox.size:
            first = paradox[0]
            ratio, time = abs(friction[first]) / force[first], path.samples.time[first]
            numbers = {"count": paradox.size, "samples": samples.size, "time": time, "ratio": ratio}
            warnings.append(warning("painleve", contacts[j].name, **numbers))
    return warnings


def _pressed_together(path: Trajectory, run: Record, contact: int, samples: np.ndarray) -> np.ndarray:
    """Return the samples at which a contact's force increases its approach: accelerations with it minus those without."""
    vector, n = path.plan.eccentricity(contact), path.plan.coordinates.free
    free = vector.columns < n
    columns, rows = vector.columns[free], vector.rows[:, free]
    rates = np.zeros((samples.size, path.samples.state.shape[1]))
    rates_without(sampled(path.samples), np.ascontiguousarray(samples), contact, path.system.address, rates)
    acceleration = (run.A[samples][:, columns] - rates[:, n + columns]) @ rows.T
    row = run.contact[samples, contact]
    return np.asarray(samples[acceleration[:, 0] * row["nx"] + acceleration[:, 1] * row["ny"] > 0.0])


def _coarse_scales(options: Options, path: Trajectory) -> list[RunWarning]:
    """Warn of each state whose declared scale is so large that its allowed error changes the component's force visibly.

    A change above 1000 times the tolerance, relative to the largest force of the component, means that three digits are lost.
    """
    places = _component_states(path)
    content, warnings = path.system.content, list[RunWarning]()
    allowed = state_tolerance(options.rtol, options.position_tolerance)
    change, size = np.zeros(len(places)), np.zeros(len(places))
    for time, y in _instants(path) if places else ():
        for k, (i, component, entry, _) in enumerate(places):
            forces, here = len(component.declaration.port.forces), y[entry]
            error = allowed * content.parameters.state_scale[entry - 2 * path.plan.coordinates.free]
            answers = []
            for moved in (here, here + error, here - error):
                y[entry] = moved
                rates(path.system, time, y)
                answers.append(np.array(content.work.result[i, :forces]))
            y[entry] = here
            size[k] = max(size[k], np.abs(answers[0]).max())
            change[k] = max(change[k], 0.5 * np.abs(answers[1] - answers[2]).max())
    for k, (_, component, entry, declared) in enumerate(places):
        if not change[k] > 1e3 * allowed * size[k] > 0.0:
            continue
        scale, share = content.parameters.state_scale[entry - 2 * path.plan.coordinates.free], change[k] / size[k]
        force = component.declaration.port.forces[0].partition("_")[0]
        numbers = {"error": allowed * scale, "unit": declared.unit, "state": declared.name, "share": share, "force": force}
        numbers |= {"scale": scale, "fitting": scale * allowed / share}
        warnings.append(warning("state scale", component.name, component.declaration.label, **numbers))
    return warnings


def _instants(path: Trajectory) -> Iterator[tuple[float, np.ndarray]]:
    """Yield times and states of up to 500 samples; before each, set the modes and memories of the system to it."""
    samples, state = path.samples, path.system.content.state
    instants = samples.time.size
    for at in np.unique(np.linspace(0, instants - 1, min(instants, 500)).astype(int)).tolist() if instants else ():
        state.mode[:], state.memory[:], state.mass[:] = samples.mode[at], samples.memory[at], samples.mass[at]
        state.reference[:] = samples.reference[at]
        functions.activate(path.system.address)
        yield float(samples.time[at]), samples.state[at].copy()


def _component_states(path: Trajectory) -> list[tuple[int, Component, int, State]]:
    """Return component index, component, index in y and declaration of each state of a component."""
    start, places = path.system.content.model.state_start, []
    controlled = dict(path.plan.actuators)
    for i, component in enumerate(path.plan.acting):
        if i not in controlled:
            first = 2 * path.plan.coordinates.free + int(start[len(path.plan.contacts) + i])
            places += [(i, component, first + s, state) for s, state in enumerate(component.states)]
    return places
