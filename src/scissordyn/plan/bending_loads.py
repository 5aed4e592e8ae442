"""Tables of what bars that bend exert on their cross-sections, for friction in ideal joints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.mechanics.bending_loads import BendingLoads
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import beam_mass
from scissordyn.plan.coordinates import Coordinates


def no_bending_loads() -> BendingLoads:
    """Empty tables."""
    return _tables([], [], [], np.zeros((0, 4)), np.zeros((0, 2)), 0)


def bending_loads(mechanism: Mechanism, coordinates: Coordinates, gravity: np.ndarray) -> BendingLoads:
    """Tables for a mechanism with bars that bend."""
    natural = coordinates.natural
    mass = beam_mass(mechanism, natural)
    rows, weight = (mass @ coordinates.matrix), mass @ natural.uniform(gravity)
    rows = rows if isinstance(rows, np.ndarray) else rows.toarray()
    entries, weights = [], np.zeros((len(mechanism.bodies), 4))
    for b, body in enumerate(mechanism.bodies):
        p, count = natural.offsets[body.name], 4 if natural.rotates(body.name) else 2
        table = np.zeros((4, rows.shape[1]))
        table[:count], weights[b, :count] = rows[p : p + count], weight[p : p + count]
        columns = np.flatnonzero(np.any(table != 0.0, axis=0))
        entries.append((columns, table[:, columns]))
    index = {body.name: b for b, body in enumerate(mechanism.bodies)}
    vectors, first, bars = [], 0, {}
    for axis in natural.axes:
        sections = axis.bar.sections
        bars[id(axis)] = first
        vectors += [(first + k, index[name], 0, 0.0) for k, name in enumerate(sections)]
        for row, k in enumerate(axis.shapes.clamped, len(sections)):
            if k in axis.directed:
                vectors.append((first + row, index[sections[k]], 1, axis.bar.angles[k]))
        first += axis.shapes.count
    couples, parts = [], len(mechanism.contacts) + len(mechanism.components)
    joints = enumerate(mechanism.clearance_joints)
    for e, joint in (*joints, *((parts + f, joint) for f, (joint, _, _) in enumerate(mechanism.lubricated))):
        for side, (name, _) in enumerate((joint.journal, joint.bearing)):
            if name in natural.tangents:
                axis, k = natural.tangents[name]
                slopes = axis.shapes.at(np.array([axis.shapes.places[k]]), 1)[0]
                # the force of a film acts on the bearing at the journal's centre
                couples.append((e, side, bars[id(axis)], int(side == 1 and e >= parts), axis.bar.angles[k], slopes))
    origin = -np.array([body.centre for body in mechanism.bodies])
    return _tables(entries, vectors, couples, weights, origin, first)


def _tables(
    entries: list[Any], vectors: list[Any], couples: list[Any], weight: np.ndarray, origin: np.ndarray, count: int
) -> BendingLoads:
    slopes = [slope for *_, slope in couples]
    return BendingLoads(
        start=np.cumsum([0, *(columns.size for columns, _ in entries)], dtype=np.int64) if entries else np.zeros(0, np.int64),
        column=np.concatenate([np.zeros(0, np.int64), *(columns for columns, _ in entries)]),
        row=np.ascontiguousarray(np.hstack([np.zeros((4, 0)), *(rows for _, rows in entries)])),
        weight=weight,
        origin=origin,
        shape=np.zeros((count, 2)),
        vector=np.array([row[:3] for row in vectors], np.int64).reshape(-1, 3),
        turned=np.array([(math.cos(angle), math.sin(angle)) for *_, angle in vectors], float).reshape(-1, 2),
        couple=np.array(
            [(*row[:4], at) for row, at in zip(couples, np.cumsum([0, *map(len, slopes)])[:-1].tolist(), strict=True)], np.int64
        ).reshape(-1, 5),
        couple_turned=np.array([(math.cos(row[4]), math.sin(row[4])) for row in couples], float).reshape(-1, 2),
        couple_weight=np.concatenate([np.zeros(0), *slopes]),
        couple_shapes=np.array(list(map(len, slopes)), np.int64),
    )
