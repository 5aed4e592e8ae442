"""Forces and moments that joints, guides and welds transmit, over time and their largest values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from typing import NamedTuple

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.integrate.integration import Samples
from scissordyn.mechanics.monitored import JOINT_FORCE, oiled_contacts
from scissordyn.mechanics.outputs import record_together
from scissordyn.mechanics.reactions import solve_reactions
from scissordyn.mechanics.sample import Record
from scissordyn.plan.bending import bends
from scissordyn.plan.bodies import guides_with_moment
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import state_kept
from scissordyn.record.bars import with_distributed_mass
from scissordyn.record.deferred import Deferred, DeferredArray
from scissordyn.record.results import Variables, described, labels
from scissordyn.record.trajectory import Trajectory

# Meaning, in a run, of the variables of joint forces
FORCE_TEXT = "force on the journal (contact and film at clearance joints, reaction at ideal ones), on the follower for guides"

# Meaning, in a run, of the variables of joint moments
MOMENT_TEXT = (
    "moment that the joint transmits, on the body of the journal about its centre, on the follower about the guided point"
)

# Meaning, in a run, of the largest joint forces
PEAK_TEXT = "largest force that the joint transmits, at ideal ones at the samples and ends of steps"

# Meaning, in a run, of the largest weld forces
WELD_PEAK_TEXT = "largest force that the weld transmits, at the samples and ends of steps"

# Last words of the meaning of largest forces after the starting phase
AFTER_START_TEXT = "after the start, in which concentric journals fall through their clearances"

CHUNK_ROWS = 4096  # [instants] largest number at which joint forces are evaluated together, to limit the memory

# Largest number of samples, in addition to ends of steps, for joint forces in a run without requested samples
COARSE_SAMPLES = 201

START_DURATION = 20.0
"""[times until all contacting joints have had a contact] Length of the starting phase, in which concentric journals fall.

For six scissor units under gravity that time is 1.6 ms; the largest force occurs at 6.2 ms, and after 30 ms only the load acts.
"""


class Transmitted(NamedTuple):
    """Forces and moments at given instants; NaN if they are not determined."""

    force: np.ndarray  # (nt, joints, 2) Force on the journal or the guided body [N]
    moment: np.ndarray  # (nt, joints) Moment on it about the journal's centre or the guided point [N m]
    weld_force: np.ndarray  # (nt, welds, 2) Force on the weld's first body [N]
    weld_moment: np.ndarray  # (nt, welds) Moment on it about the weld [N m]

    @property
    def sizes(self) -> np.ndarray:
        """Magnitudes of the forces of joints, then of welds, shape (nt, joints + welds) [N]."""
        return np.asarray(np.hypot(*np.moveaxis(np.concatenate([self.force, self.weld_force], axis=1), -1, 0)))


def transmitted(plan: Plan, outputs: Record, time: np.ndarray) -> Transmitted:
    """Return forces and moments of all joints, guides, contact points and welds at the instants of a record."""
    mechanism, wrench = plan.mechanism, outputs.wrench
    reactions = solve_reactions(plan.balance, plan.gravity_vector, with_distributed_mass(plan, outputs, time))
    joints = mechanism.joint_names
    force, moment = np.zeros((time.size, len(joints), 2)), np.zeros((time.size, len(joints)))
    at = plan.places(contact.name for contact in plan.contacts)
    force[:, at], moment[:, at] = wrench[:, : at.size, :2], wrench[:, : at.size, 2]
    films = len(plan.contacts) + len(mechanism.components)
    for f, (joint, _, _) in enumerate(plan.lubricated):
        place = plan.places([joint.name])[0]
        force[:, place] += wrench[:, films + f, :2]
        moment[:, place] += wrench[:, films + f, 2]
    for j, point in enumerate(mechanism.contact_points, len(mechanism.clearance_joints)):
        place, pushed = plan.places([point.guide])[0], wrench[:, j]
        body, guide = mechanism.body(point.follower), mechanism.guide(point.guide)
        x, y = np.subtract(point.centre, body.points[guide.follower[1]])
        cos, sin = outputs.direction[:, plan.bodies.index(body)].T
        force[:, place] += pushed[:, :2]
        moment[:, place] += (cos * x - sin * y) * pushed[:, 1] - (sin * x + cos * y) * pushed[:, 0] + pushed[:, 2]
    force[:, plan.places(joint.name for joint in mechanism.ideal_joints)] = reactions.joints
    for g, guide in enumerate(mechanism.ideal_guides):
        across = np.array([-math.sin(guide.direction), math.cos(guide.direction)])
        if guide.body != GROUND:
            cos, sin = outputs.direction[:, plan.bodies.index(mechanism.body(guide.body))].T
            across = np.stack([cos * across[0] - sin * across[1], sin * across[0] + cos * across[1]], axis=1)
        force[:, plan.places([guide.name])[0]] = reactions.guides[:, g : g + 1] * across
    moment[:, plan.places(guide.name for guide in guides_with_moment(mechanism))] = reactions.guide_moments
    return Transmitted(force, moment, reactions.weld_forces, reactions.weld_moments)


def transmitted_variables(plan: Plan, path: Trajectory, outputs: Record) -> Variables:
    """Return forces and moments of joints and welds over time, and their largest forces; all are computed when read."""
    instants, joints, welds = path.samples.time.size, len(plan.mechanism.joint_names), len(plan.mechanism.welds)
    sampled = Deferred(lambda: transmitted(plan, outputs, path.samples.time), path.system.lock)
    force = DeferredArray((instants, joints, 2), lambda: sampled().force)
    moment = DeferredArray((instants, joints), lambda: sampled().moment)
    variables = {
        "reaction": described(("time", "joint", "axis"), force, "N", FORCE_TEXT),
        "reaction_moment": described(("time", "joint"), moment, "N m", MOMENT_TEXT),
    }
    if welds:
        on = "on the body of the weld's start"
        force = DeferredArray((instants, welds, 2), lambda: sampled().weld_force)
        moment = DeferredArray((instants, welds), lambda: sampled().weld_moment)
        variables |= {
            "weld": labels("weld", [weld.name for weld in plan.mechanism.welds]),
            "weld_force": described(("time", "weld", "axis"), force, "N", f"force {on}"),
            "weld_moment": described(("time", "weld"), moment, "N m", f"moment {on}, about the weld"),
        }
    return variables | _peak_variables(plan, path, sampled)


class Peaks(NamedTuple):
    """Largest forces of joints, then of welds, shape (joints + welds,); NaN if they are not determined."""

    size: np.ndarray  # Magnitude [N]
    time: np.ndarray  # Instant [s]
    after: np.ndarray  # Largest force after the start of the run [N]; NaN if the run ends before `start_end`


def start_end(path: Trajectory) -> float:
    """Return the end of the starting phase, in which journals fall through their clearances [s]; inf without contacts."""
    table = path.contacts
    if not table.size:
        return math.inf
    # contacts are in the order of their starts
    first = dict(zip(table["joint"][::-1].tolist(), table["start"][::-1].tolist(), strict=True))
    return START_DURATION * float(max(first.values()))


def in_chunks(path: Trajectory, sources: Sequence[Samples]) -> Iterator[Samples]:
    """Yield the samples of all sources in chunks, without those after the end of the run or next to a change point."""
    if not sources:
        return
    source = Samples(*map(np.concatenate, zip(*sources, strict=True)))
    wanted = source.time <= path.end
    for instant, width in path.change_points:
        wanted &= np.abs(source.time - instant) >= width
    if source.time.size <= CHUNK_ROWS and wanted.all():
        yield source
        return
    rows = np.flatnonzero(wanted)
    for first in range(0, rows.size, CHUNK_ROWS):
        yield Samples(*(part[rows[first : first + CHUNK_ROWS]] for part in source))


def force_peaks(path: Trajectory, sampled: Transmitted | None = None) -> Peaks:
    """Return the largest forces of a run: located for compliant and oiled contacts, else at samples and ends of steps.

    Forces of hard contacts are NaN, because their impacts have no finite force. `sampled` are the forces at the samples;
    without them only some samples are evaluated, because fast changes occur at the ends of steps.
    """
    plan, sizes, sources = path.plan, list[tuple[np.ndarray, np.ndarray]](), list[Samples]()
    if sampled is not None:
        sizes.append((path.samples.time, sampled.sizes))
        sources = recorded_ends(path)
    else:
        sources = [_coarse(path), *recorded_ends(path)]
    with state_kept(path.system):
        for part in in_chunks(path, sources):
            forces = transmitted(plan, path.record(part), part.time)
            sizes.append((part.time, forces.sizes))
    return _largest(path, sizes)


def force_peaks_together(paths: Sequence[Trajectory]) -> list[Peaks]:
    """Return the largest forces of several runs without samples; runs with the same tables are evaluated in one pass."""
    sources = [list(in_chunks(path, [_coarse(path), *recorded_ends(path)])) for path in paths]
    first, rows = paths[0].plan, sum(part.time.size for parts in sources for part in parts)
    has_same_tables = all(
        path.plan.balance is first.balance and np.array_equal(path.plan.gravity_vector, first.gravity_vector) for path in paths
    )
    if not has_same_tables or bends(first.mechanism) or rows > 4 * CHUNK_ROWS:
        return [force_peaks(path) for path in paths]
    listed = [(path.system, part) for path, parts in zip(paths, sources, strict=True) for part in parts]
    with ExitStack() as states:
        for path in paths:
            states.enter_context(state_kept(path.system))
        time = np.concatenate([part.time for _, part in listed])
        forces = transmitted(first, record_together(first.maps, listed), time).sizes
    peaks, last = list[Peaks](), 0
    for path, parts in zip(paths, sources, strict=True):
        begin, last = last, last + sum(part.time.size for part in parts)
        peaks.append(_largest(path, [(time[begin:last], forces[begin:last])]))
    return peaks


def coarse_count(plan: Plan) -> int:
    """Return the number of samples that largest forces need beside the ends of steps, which are dense around dry contacts."""
    has_dry_contacts = len(plan.contacts) > len(plan.lubricated)
    return 2 if has_dry_contacts else COARSE_SAMPLES


def _coarse(path: Trajectory) -> Samples:
    """Return some of the samples of a run."""
    step = max(1, (path.samples.time.size - 1) // (COARSE_SAMPLES - 1))
    return Samples(*(part[::step] for part in path.samples))


def recorded_ends(path: Trajectory) -> list[Samples]:
    """Return the recorded ends of steps, if there are any."""
    return [] if path.recorded is None else [Samples(*(getattr(path.recorded, name) for name in Samples._fields))]


def _largest(path: Trajectory, sizes: Sequence[tuple[np.ndarray, np.ndarray]]) -> Peaks:
    """Return the largest forces from instants (nt,) and the forces there (nt, joints + welds)."""
    plan = path.plan
    count, begin = len(plan.mechanism.joint_names) + len(plan.mechanism.welds), start_end(path)
    size, when, after = np.full((3, count), math.nan)
    for time, forces in sizes:
        finite_forces = np.where(np.isfinite(forces), forces, -1.0)
        best = np.argmax(finite_forces, axis=0) if time.size else np.zeros(count, int)
        values = finite_forces[best, np.arange(count)] if time.size else np.full(count, -1.0)
        higher = (values >= 0.0) & ~(values <= size)
        size[higher], when[higher] = values[higher], time[best[higher]]
        if (late := time >= begin).any():
            last = finite_forces[late].max(axis=0)
            after = np.where(last >= 0.0, np.fmax(after, last), after)
    _enter_contacts(plan, path, begin, size, when, after)
    return Peaks(size, when, after)


def _enter_contacts(plan: Plan, path: Trajectory, begin: float, size: np.ndarray, when: np.ndarray, after: np.ndarray) -> None:
    """Replace the largest forces at instants by the located ones of contacts."""
    at = plan.places(contact.name for contact in plan.contacts)
    joint, force, start, after_start = (path.contacts[name] for name in ("joint", "peak_force", "start", "peak_time"))
    for j in plan.compliant_places:
        here = np.flatnonzero(joint == j)
        size[at[j]], when[at[j]] = 0.0, 0.0
        if here.size:
            best = here[np.argmax(force[here])]
            size[at[j]], when[at[j]] = force[best], start[best] + after_start[best]
            late = here[start[here] >= begin]
            if late.size:
                after[at[j]] = np.fmax(after[at[j]], force[late].max())
    for j in plan.hard_places:
        size[at[j]] = when[at[j]] = math.nan
    oiled = at[oiled_contacts(path.system.content.model)]
    peaks = path.peaks(JOINT_FORCE)
    size[oiled], when[oiled] = peaks["largest"], peaks["largest_time"]


def _peak_variables(plan: Plan, path: Trajectory, sampled: Deferred[Transmitted]) -> Variables:
    joints, welds = len(plan.mechanism.joint_names), len(plan.mechanism.welds)
    peaks = Deferred(lambda: force_peaks(path, sampled()), path.system.lock)
    has_start = path.contacts.size > 0

    def of(name: str, part: slice) -> np.ndarray:
        return np.asarray(getattr(peaks(), name)[part])

    variables: Variables = {}
    for dim, part, count, text in (
        ("joint", slice(joints), joints, PEAK_TEXT),
        ("weld", slice(joints, None), welds, WELD_PEAK_TEXT),
    ):
        if dim == "weld" and not welds:
            continue
        size, when, after = (DeferredArray((count,), partial(of, name, part)) for name in Peaks._fields)
        variables[f"{dim}_peak_force"] = described(dim, size, "N", text)
        variables[f"{dim}_peak_force_time"] = described(dim, when, "s", f"when it is largest: {text}")
        if has_start:
            variables[f"{dim}_peak_force_after_start"] = described(dim, after, "N", f"{text}, {AFTER_START_TEXT}")
    return variables
