"""The numbers that the kernels work on, and their work space, in one tuple of arrays."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numba import types
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.control.signal import SIGNALS
from scissordyn.errors import InputError
from scissordyn.jit import opener
from scissordyn.laws.contact import PARAMETERS, Damping, Elastic, Friction
from scissordyn.laws.dispatch import friction_start
from scissordyn.mechanics.actuator import controller_tables
from scissordyn.mechanics.band import width
from scissordyn.mechanics.element import ELEMENT_NUMBERS, courses, element_form, element_numbers, start_angle, stop_guards
from scissordyn.mechanics.layout import Form, Layout, join_forms
from scissordyn.mechanics.motion import COLUMNS, motion_rows
from scissordyn.model.body import GROUND
from scissordyn.model.element import Actuator
from scissordyn.model.guide_clearance import ContactPoint
from scissordyn.model.joint import Revolute

__all__ = ["APPROACH_FLOOR", "System", "build_system", "open_system", "sliding_states"]

APPROACH_FLOOR = 1e-6
"""Least approach speed of a contact [m/s]: a contact that starts at rest must not divide by zero."""

LATCH_CLEARANCE = 1e-6
"""A latch nearer than this [rad] to its angle at the start would be locked before it moves."""

JOINT_OUTPUTS = 9
"""Width of `System.joint`; `joint` says what its columns are."""


F1 = Annotated[np.ndarray, types.float64[::1]]
F2 = Annotated[np.ndarray, types.float64[:, ::1]]
I1 = Annotated[np.ndarray, types.int64[::1]]
I2 = Annotated[np.ndarray, types.int64[:, ::1]]


class System(NamedTuple):
    """Constants, contact state and work space of a mechanism's kernels, which are handed its address.

    Columns 0 .. n-1 are the free coordinates, n .. n+nb-1 the entries of b(t). "Form" arrays hold sparse rows: the entries
    of row k are start[k] .. start[k+1]-1.
    """

    n: int
    nb: int
    weight: F1  # (n+nb,) generalized force of gravity
    inertia: F2  # (n, nb) coupling of x'' and b''
    inertia_b: F2  # (nb, nb)
    motion: F2  # (pieces, COLUMNS) of the drives, then of the elements' courses
    motion_start: I1  # (courses+1,)
    part_start: I1  # (parts+1,) forms of the quadratic conditions
    part_condition: I1  # (parts,)
    part_weight: F1  # (parts,) zero while a latch is open
    part_full: F1  # (parts,) weights of conditions that hold
    idle: F1  # (m,) 1 for an open latch
    level: F2  # (4, m) with three derivatives by time
    timed: I1  # conditions whose level follows a course
    timed_course: I1  # rows of motion_start
    latch: I2  # (latches, 2) condition and first part
    latch_side: F1  # (latches,) sense of rotation in which it is reached
    length_start: I1  # (m+1,) entries of all parts of each condition
    length_column: I1
    length_row: F2  # (2, entries)
    overlap: I2  # (pairs, 3): conditions k >= l that share columns, and where their matches start
    match: I2  # (matches, 2): entries of k and l on the same column
    link_start: I1  # (links+1,) loose joints, then elements
    link_column: I1
    link_row: F2  # (6, entries): e, direction of the journal's body, of the bearing's; for elements u, body, base
    radius: F2  # (nj, 2): clearance and radius of the journal or corner
    flat: I1  # (nj,) 1 for a corner at a wall, 0 for a journal in a bearing
    wall: F2  # (nj, 3): n in the frame of the wall's body, u.n at which a corner touches
    law: I2  # (nj, 3): tags of stiffness, damping, friction
    elastic: F2  # (nj, PARAMETERS)
    damping: F2  # (nj, PARAMETERS)
    friction: F2  # (nj, PARAMETERS)
    state_start: I1  # (links+1,) hidden states
    element: F2  # (elements, ELEMENT_NUMBERS)
    course: I1  # (elements,) row of motion_start, or -1
    guard: I1  # (elements,) guard of an end stop, or -1
    feed: I1  # (elements,) likewise for feed-forward torques
    control: F2  # (elements, PARAMETERS) controllers of actuators
    recorder: I1  # (elements,) which recorded signal, or -1
    history: F2  # (steps, 2 + signals * coefficients) of the steps made: start, size, each signal's polynomial in -1 .. 1
    kept: I1  # (1,) steps in it
    past: F1  # (signals,) before the start
    signal: F1  # (SIGNALS,) of one actuator, work space
    signal_rate: F1  # (SIGNALS,) by time at a fixed state
    slope: F2  # (1 + most states, SIGNALS + most states + 1)
    control_work: F2  # (2, most states)
    observed: F2  # (elements, 2) angle error and recorded signal
    element_x: F2  # (6, 6) work space
    element_v: F2
    mode: I1  # (guards,) loose joints, latches, end stops: 0 free flight, 1 contact or locked
    approach: F1  # (guards,) approach speed of the present contact
    block_start: I1  # (links+1,) where a link's k x k blocks start
    place: I1  # (n+m+nz,) row of the step matrix for each unknown
    band: F2  # step matrix
    band_limits: I1  # (4,) lower, upper of the step matrix and of the Gram matrix
    pivots: I1
    gram: F2  # (m, band)
    gram_pivots: I1
    basis: F2  # (4, nb)
    angle: F1  # (4,)
    X: F1  # (n+nb,) position, and so on
    V: F1
    A: F1
    force: F1  # (n+nb,)
    direction: F2  # (parts, 2) the forms d, then their derivatives
    direction_rate: F2
    direction_acceleration: F2
    gradient: F1  # (length entries,)
    multiplier: F1  # (m,)
    frozen_direction: F2  # the same where the step matrix was linearised
    frozen_rate: F2
    frozen_gradient: F1
    frozen_multiplier: F1
    joint: F2  # (nj, JOINT_OUTPUTS) what the joint kernel found
    block_x: F1  # joint blocks: d force / d X
    block_v: F1  # d force / d V
    force_by_state: F1  # (joint entries * states)
    rate_by_x: F1  # (states * joint entries)
    rate_by_v: F1
    rate_by_state: F1  # states x states of each joint
    force_state_start: I1  # (links+1,)
    state_state_start: I1  # (links+1,)
    work: F1  # (n+m+nz,)
    scratch: F1  # (2n+nz,)
    state_work: F2  # (2, most states)
    state_jacobian: F2  # (most states + 3, most states)
    work_b: F1  # (nb,)
    local: F2  # (8, widest joint)
    gamma: F1  # (1,) step size times the method's gamma


open_system = opener(System)
"""From the address of a system's handle to the system, inside kernels."""


def build_system(layout: Layout) -> System:
    """The kernels' arrays for a mechanism.

    Parameters
    ----------
    layout : Layout

    Returns
    -------
    System
    """
    mechanism, n, nb = layout.mechanism, layout.free, layout.basis
    full = csr_array(layout.coordinates.T @ layout.mass @ layout.coordinates)
    loose = mechanism.contacts
    nj, m = len(loose), len(layout.conditions)
    elements = mechanism.elements
    states = [len(joint.clearance.friction.states) for joint in loose if joint.clearance]
    states += [len(element.controller.states) if isinstance(element, Actuator) else 0 for element in elements]
    nz = sum(states)

    rows = [motion_rows(drive.motion, mechanism.body(drive.body).angle) for drive in mechanism.drives]
    course, feed, pieces = courses(layout, len(rows))
    rows += pieces
    timed = [k for k, condition in enumerate(layout.conditions) if condition.motion]
    timed_course = len(rows) + np.arange(len(timed))
    rows += [motion_rows(layout.conditions[k].motion, 0.0) for k in timed]  # type: ignore[arg-type]
    numbers = np.zeros((len(elements), ELEMENT_NUMBERS))
    for i, element in enumerate(elements):
        described = element_numbers(element, start_angle(layout, element))
        numbers[i, : len(described)] = described
    control, recorder = controller_tables(elements)
    parts = [(k, weight, form) for k, condition in enumerate(layout.conditions) for weight, form in condition.parts]
    part_start, length_column, length_row = _forms([form for _, _, form in parts], 2)
    part_weight = np.array([weight for _, weight, _ in parts], float)
    latch, latch_side = _latches(layout)
    idle = np.zeros(m)
    idle[latch[:, 0]] = 1.0
    first_stop = nj + latch.shape[0]
    guard = stop_guards(elements, first_stop)
    guards = first_stop + int(np.sum(guard >= 0))
    links = [_contact_form(layout, contact) for contact in loose] + [element_form(layout, element) for element in elements]
    link_start, link_column, link_row = _forms(links, 6)
    overlap, match = _overlaps(layout)
    counts = np.diff(link_start)

    laws = np.zeros((nj, 3), np.int64)
    tables = [np.zeros((nj, PARAMETERS)) for _ in range(3)]
    radius, wall = np.zeros((nj, 2)), np.zeros((nj, 3))
    for index, joint in enumerate(loose):
        clearance = joint.clearance
        assert clearance is not None
        contact = clearance.contact
        radius[index] = clearance.clearance, contact.journal_radius
        if isinstance(joint, ContactPoint):
            wall[index] = *joint.normal, joint.distance - contact.journal_radius
        chosen: tuple[Elastic | Damping | Friction, ...] = (clearance.stiffness, clearance.damping, clearance.friction)
        for which, law in enumerate(chosen):
            parameters = law.parameters(contact)
            laws[index, which] = law.kernel_kind
            tables[which][index, : len(parameters)] = parameters

    place, lower, upper = _ordering(layout, link_start, link_column, states)
    gram_lower = max((int(k - l) for k, l, _ in overlap[:-1]), default=0)
    size = n + m + nz
    return System(
        n=n,
        nb=nb,
        weight=layout.coordinates.T @ layout.weight,
        inertia=np.ascontiguousarray(full[:n, n:].toarray()),
        inertia_b=np.ascontiguousarray(full[n:, n:].toarray()),
        motion=np.vstack(rows) if rows else np.zeros((0, COLUMNS)),
        motion_start=np.cumsum([0, *map(len, rows)], dtype=np.int64),
        part_start=part_start,
        part_condition=np.array([k for k, _, _ in parts], np.int64),
        part_weight=part_weight * np.array([1.0 - idle[k] for k, _, _ in parts]),
        part_full=part_weight,
        idle=idle,
        level=np.array([[condition.level for condition in layout.conditions], *(3 * [[0.0] * m])], float),
        timed=np.array(timed, np.int64),
        timed_course=timed_course.astype(np.int64),
        latch=latch,
        latch_side=latch_side,
        length_start=np.cumsum([0, *(condition.columns.size for condition in layout.conditions)], dtype=np.int64),
        length_column=length_column,
        length_row=length_row,
        overlap=overlap,
        match=match,
        link_start=link_start,
        link_column=link_column,
        link_row=link_row,
        radius=radius,
        flat=np.array([isinstance(joint, ContactPoint) for joint in loose], np.int64),
        wall=wall,
        law=laws,
        elastic=tables[0],
        damping=tables[1],
        friction=tables[2],
        state_start=np.cumsum([0, *states], dtype=np.int64),
        element=numbers,
        course=course,
        guard=guard,
        feed=feed,
        control=control,
        recorder=recorder,
        history=np.zeros((0, 2)),
        kept=np.zeros(1, np.int64),
        past=np.zeros(int(np.max(recorder, initial=-1)) + 1),
        signal=np.zeros(len(SIGNALS)),
        signal_rate=np.zeros(len(SIGNALS)),
        slope=np.zeros((1 + max(states, default=0), len(SIGNALS) + max(states, default=0) + 1)),
        control_work=np.zeros((2, max(states, default=0))),
        observed=np.zeros((len(elements), 2)),
        element_x=np.zeros((6, 6)),
        element_v=np.zeros((6, 6)),
        mode=np.zeros(guards, np.int64),
        approach=np.full(guards, APPROACH_FLOOR),
        block_start=np.cumsum([0, *counts**2], dtype=np.int64),
        place=place,
        band=np.zeros((size, width(lower, upper))),
        band_limits=np.array([lower, upper, gram_lower, gram_lower], np.int64),
        pivots=np.zeros(size, np.int64),
        gram=np.zeros((m, width(gram_lower, gram_lower))),
        gram_pivots=np.zeros(m, np.int64),
        basis=np.zeros((4, nb)),
        angle=np.zeros(4),
        X=np.zeros(n + nb),
        V=np.zeros(n + nb),
        A=np.zeros(n + nb),
        force=np.zeros(n + nb),
        direction=np.zeros((len(parts), 2)),
        direction_rate=np.zeros((len(parts), 2)),
        direction_acceleration=np.zeros((len(parts), 2)),
        gradient=np.zeros(length_column.size),
        multiplier=np.zeros(m),
        frozen_direction=np.zeros((len(parts), 2)),
        frozen_rate=np.zeros((len(parts), 2)),
        frozen_gradient=np.zeros(length_column.size),
        frozen_multiplier=np.zeros(m),
        joint=np.zeros((nj, JOINT_OUTPUTS)),
        block_x=np.zeros(int(np.sum(counts**2))),
        block_v=np.zeros(int(np.sum(counts**2))),
        force_by_state=np.zeros(int(np.dot(counts, states)) if links else 0),
        rate_by_x=np.zeros(int(np.dot(counts, states)) if links else 0),
        rate_by_v=np.zeros(int(np.dot(counts, states)) if links else 0),
        rate_by_state=np.zeros(int(np.dot(states, states)) if links else 0),
        force_state_start=np.cumsum([0, *(counts * np.array(states, np.int64))], dtype=np.int64),
        state_state_start=np.cumsum([0, *(s * s for s in states)], dtype=np.int64),
        work=np.zeros(size),
        scratch=np.zeros(2 * n + nz),
        state_work=np.zeros((2, max(states, default=0))),
        state_jacobian=np.zeros((max(states, default=0) + 3, max(states, default=0))),
        work_b=np.zeros(nb),
        local=np.zeros((8, int(np.max(counts, initial=0)))),
        gamma=np.zeros(1),
    )


def _forms(forms: list[Form] | tuple[Form, ...], height: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    start = np.cumsum([0, *(form.columns.size for form in forms)], dtype=np.int64)
    if not forms:
        return start, np.zeros(0, np.int64), np.zeros((height, 0))
    return start, np.concatenate([form.columns for form in forms]), np.ascontiguousarray(np.hstack([f.rows for f in forms]))


def _contact_form(layout: Layout, joint: Revolute | ContactPoint) -> Form:
    """The six rows of a loose joint, or of a corner at its wall, on the union of their columns."""
    if isinstance(joint, ContactPoint):
        wall = layout.fixed_direction if joint.body == GROUND else layout.direction(joint.body)
        ends = (layout.at(joint.follower, joint.centre), 0, 1.0), (layout.at(joint.body, joint.through), 0, -1.0)
        return join_forms([*ends, (layout.direction(joint.follower), 2, 1.0), (wall, 4, 1.0)])
    parts = [(layout.place(joint.journal), 0, 1.0), (layout.place(joint.bearing), 0, -1.0)]
    parts += [(layout.direction(joint.journal[0]), 2, 1.0), (layout.direction(joint.bearing[0]), 4, 1.0)]
    return join_forms(parts)


def _latches(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Condition and first part of each latch, and the sense in which it is reached."""
    first = np.cumsum([0, *(len(condition.parts) for condition in layout.conditions)])
    table, side = [], []
    for latch in layout.mechanism.latches:
        k = [condition.name for condition in layout.conditions].index(latch.name)
        table.append((k, int(first[k])))
        base = 0.0 if latch.base == GROUND else layout.mechanism.body(latch.base).angle
        ahead = math.remainder(latch.angle - layout.mechanism.body(latch.body).angle + base, 2.0 * math.pi)
        if abs(ahead) < LATCH_CLEARANCE:
            raise InputError(f"latch '{latch.name}' is at its angle at the start", "a weld, or another angle")
        side.append(math.copysign(1.0, ahead))
    return np.array(table, np.int64).reshape(-1, 2), np.array(side, float)


def _overlaps(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of quadratic conditions on common free coordinates, with the matching entries."""
    pairs: list[tuple[int, int, int]] = []
    matches: list[tuple[int, int]] = []
    offset = np.cumsum([0, *(condition.columns.size for condition in layout.conditions)])
    by_column: dict[int, list[tuple[int, int]]] = {}
    for k, condition in enumerate(layout.conditions):
        for where, column in enumerate(condition.columns.tolist()):
            if column < layout.free:
                by_column.setdefault(column, []).append((k, int(offset[k]) + where))
    shared: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for entries in by_column.values():
        for k, at_k in entries:
            for l, at_l in entries:
                if l <= k:
                    shared.setdefault((k, l), []).append((at_k, at_l))
    for (k, l), found in sorted(shared.items()):
        pairs.append((k, l, len(matches)))
        matches.extend(found)
    pairs.append((-1, -1, len(matches)))
    return np.array(pairs, np.int64), np.array(matches, np.int64).reshape(-1, 2)


def _ordering(
    layout: Layout, link_start: np.ndarray, link_column: np.ndarray, states: list[int]
) -> tuple[np.ndarray, int, int]:
    """Rows of the step matrix for accelerations, multipliers and hidden states, so that its band is narrow."""
    n, m = layout.free, len(layout.conditions)
    size = n + m + sum(states)
    groups = [np.append(condition.columns[condition.columns < n], n + k) for k, condition in enumerate(layout.conditions)]
    first_state = n + m
    for j, count in enumerate(states):
        columns = link_column[link_start[j] : link_start[j + 1]]
        groups.append(np.concatenate([columns[columns < n], np.arange(first_state, first_state + count)]))
        first_state += count
    rows = np.concatenate([np.arange(size), *(np.repeat(group, group.size) for group in groups)])
    beside = np.concatenate([np.arange(size), *(np.tile(group, group.size) for group in groups)])
    graph = csr_array((np.ones(rows.size), (rows, beside)), shape=(size, size))
    place = np.empty(size, np.int64)
    if size:
        place[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(size)
    reach = int(np.max(np.abs(place[rows] - place[beside]), initial=0))
    return place, reach, reach


def sliding_states(system: System) -> np.ndarray:
    """Size of each hidden state in steady sliding, the natural scale of its error."""
    scale = np.zeros(int(system.state_start[-1]))
    for j in range(system.radius.shape[0]):
        part = slice(system.state_start[j], system.state_start[j + 1])
        if part.stop > part.start:
            state = np.zeros(part.stop - part.start)
            friction_start(system.law[j, 2], 1.0, state, system.friction[j])
            scale[part] = np.abs(state)
    return scale
