"""The numbers that the kernels work on, and their work space, in one tuple of arrays."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numba import types
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.jit import opener
from scissordyn.laws.contact import PARAMETERS, Damping, Elastic, Friction
from scissordyn.laws.ladder import friction_start
from scissordyn.mechanics.band import width
from scissordyn.mechanics.layout import Form, Layout
from scissordyn.mechanics.motion import COLUMNS, motion_rows

__all__ = ["APPROACH_FLOOR", "System", "build_system", "open_system", "sliding_states"]

APPROACH_FLOOR = 1e-6
"""Least approach speed of a contact [m/s]: a contact that starts at rest must not divide by zero."""

JOINT_OUTPUTS = 12


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
    motion: F2  # (rows, COLUMNS)
    motion_start: I1  # (drives+1,)
    length_start: I1  # (m+1,)
    length_column: I1
    length_row: F2  # (2, entries)
    overlap: I2  # (pairs, 3): conditions k >= l that share columns, and where their matches start
    match: I2  # (matches, 2): entries of k and l on the same column
    joint_start: I1  # (nj+1,)
    joint_column: I1
    joint_row: F2  # (6, entries): e, direction of the journal's body, direction of the bearing's body
    radius: F2  # (nj, 3): clearance, R_J, R_B
    law: I2  # (nj, 3): tags of stiffness, damping, friction
    elastic: F2  # (nj, PARAMETERS)
    damping: F2  # (nj, PARAMETERS)
    friction: F2  # (nj, PARAMETERS)
    state_start: I1  # (nj+1,) hidden states
    mode: I1  # (nj,) 0 free flight, 1 contact
    approach: F1  # (nj,) approach speed of the present contact
    block_start: I1  # (nj+1,) where a joint's k x k blocks start
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
    direction: F2  # (m, 2) d, then its derivatives
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
    state_rate: F1  # (nz,)
    force_by_state: F1  # (joint entries * states)
    rate_by_x: F1  # (states * joint entries)
    rate_by_v: F1
    rate_by_state: F1  # states x states of each joint
    force_state_start: I1  # (nj+1,)
    state_state_start: I1  # (nj+1,)
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
    loose = mechanism.loose
    nj, m = len(loose), len(layout.lengths)
    states = [len(joint.clearance.friction.states) for joint in loose if joint.clearance]
    nz = sum(states)

    rows = [motion_rows(drive, mechanism.body(drive.body)) for drive in mechanism.drives]
    length_start, length_column, length_row = _forms(layout.lengths, 2)
    joints = [_joint_form(layout, index) for index in range(nj)]
    joint_start, joint_column, joint_row = _forms(joints, 6)
    overlap, match = _overlaps(layout)
    counts = np.diff(joint_start)

    laws = np.zeros((nj, 3), np.int64)
    tables = [np.zeros((nj, PARAMETERS)) for _ in range(3)]
    radius = np.zeros((nj, 3))
    for index, pin in enumerate(loose):
        clearance = pin.clearance
        assert clearance is not None
        contact = clearance.contact
        radius[index] = clearance.clearance, clearance.journal_radius, contact.bearing_radius
        chosen: tuple[Elastic | Damping | Friction, ...] = (clearance.stiffness, clearance.damping, clearance.friction)
        for which, law in enumerate(chosen):
            numbers = law.parameters(contact)
            laws[index, which] = law.tag
            tables[which][index, : len(numbers)] = numbers

    place, lower, upper = _ordering(layout, joint_start, joint_column, states)
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
        length_start=length_start,
        length_column=length_column,
        length_row=length_row,
        overlap=overlap,
        match=match,
        joint_start=joint_start,
        joint_column=joint_column,
        joint_row=joint_row,
        radius=radius,
        law=laws,
        elastic=tables[0],
        damping=tables[1],
        friction=tables[2],
        state_start=np.cumsum([0, *states], dtype=np.int64),
        mode=np.zeros(nj, np.int64),
        approach=np.full(nj, APPROACH_FLOOR),
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
        direction=np.zeros((m, 2)),
        direction_rate=np.zeros((m, 2)),
        direction_acceleration=np.zeros((m, 2)),
        gradient=np.zeros(length_column.size),
        multiplier=np.zeros(m),
        frozen_direction=np.zeros((m, 2)),
        frozen_rate=np.zeros((m, 2)),
        frozen_gradient=np.zeros(length_column.size),
        frozen_multiplier=np.zeros(m),
        joint=np.zeros((nj, JOINT_OUTPUTS)),
        block_x=np.zeros(int(np.sum(counts**2))),
        block_v=np.zeros(int(np.sum(counts**2))),
        state_rate=np.zeros(nz),
        force_by_state=np.zeros(int(np.dot(counts, states)) if nj else 0),
        rate_by_x=np.zeros(int(np.dot(counts, states)) if nj else 0),
        rate_by_v=np.zeros(int(np.dot(counts, states)) if nj else 0),
        rate_by_state=np.zeros(int(np.dot(states, states)) if nj else 0),
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


def _joint_form(layout: Layout, index: int) -> Form:
    """The six rows of a loose joint on the union of their columns."""
    joint = layout.mechanism.loose[index]
    journal, bearing = layout.place(joint.journal), layout.place(joint.bearing)
    parts = [(journal, 0, 1.0), (bearing, 0, -1.0)]
    parts += [(layout.direction(joint.journal[0]), 2, 1.0), (layout.direction(joint.bearing[0]), 4, 1.0)]
    columns = np.unique(np.concatenate([form.columns for form, _, _ in parts]))
    rows = np.zeros((6, columns.size))
    for form, first, sign in parts:
        rows[first : first + 2, np.searchsorted(columns, form.columns)] += sign * form.rows
    return Form(columns, rows)


def _overlaps(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of length conditions on common free coordinates, with the matching entries."""
    pairs: list[tuple[int, int, int]] = []
    matches: list[tuple[int, int]] = []
    offset = np.cumsum([0, *(form.columns.size for form in layout.lengths)])
    by_column: dict[int, list[tuple[int, int]]] = {}
    for k, form in enumerate(layout.lengths):
        for where, column in enumerate(form.columns.tolist()):
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
    layout: Layout, joint_start: np.ndarray, joint_column: np.ndarray, states: list[int]
) -> tuple[np.ndarray, int, int]:
    """Rows of the step matrix for accelerations, multipliers and hidden states, so that its band is narrow."""
    n, m = layout.free, len(layout.lengths)
    size = n + m + sum(states)
    groups = [np.append(form.columns[form.columns < n], n + k) for k, form in enumerate(layout.lengths)]
    first_state = n + m
    for j, count in enumerate(states):
        columns = joint_column[joint_start[j] : joint_start[j + 1]]
        groups.append(np.concatenate([columns[columns < n], np.arange(first_state, first_state + count)]))
        first_state += count
    rows = np.concatenate([np.arange(size), *(np.repeat(group, group.size) for group in groups)])
    beside = np.concatenate([np.arange(size), *(np.tile(group, group.size) for group in groups)])
    graph = csr_array((np.ones(rows.size), (rows, beside)), shape=(size, size))
    order = reverse_cuthill_mckee(graph, symmetric_mode=True)
    place = np.empty(size, np.int64)
    place[order] = np.arange(size)
    reach = int(np.max(np.abs(place[rows] - place[beside]), initial=0))
    return place, reach, reach


def sliding_states(system: System) -> np.ndarray:
    """Size of each hidden state in steady sliding, the natural scale of its error."""
    scale = np.zeros(int(system.state_start[-1]))
    for j in range(system.mode.size):
        part = slice(system.state_start[j], system.state_start[j + 1])
        if part.stop > part.start:
            state = np.zeros(part.stop - part.start)
            friction_start(system.law[j, 2], 1.0, state, system.friction[j])
            scale[part] = np.abs(state)
    return scale
