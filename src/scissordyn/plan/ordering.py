"""Which unknowns of the step matrix are eliminated beforehand, and the order of the others that makes its band narrow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scissordyn.plan.coordinates import Constraint
from scissordyn.plan.graph import coupled, reach, reverse_cuthill_mckee

FEW = 12  # Up to so many unknowns the step matrix is taken as full, and nothing is eliminated
ELIMINATED = -1  # In the place of a row


class Ordering(NamedTuple):
    """Rows of the step matrix."""

    permutation: np.ndarray  # (n+m+nz,) Row of each acceleration, multiplier and internal state; -1 if it is eliminated
    reach: int  # Off-diagonals on either side
    pair: np.ndarray  # (pairs, 3) Part of the constraint, and its two coordinates
    pair_of: np.ndarray  # (m,) Pair of a constraint, or -1


def order_unknowns(
    free: int, constraints: Sequence[Constraint], latched: set[int], elements: Sequence[np.ndarray], states: Sequence[int]
) -> Ordering:
    """Rows of the step matrix for accelerations, multipliers and internal states."""
    m, first = len(constraints), free + len(constraints)
    size = first + sum(states)
    if size <= FEW:
        nothing = np.zeros((0, 3), np.int64), np.full(m, -1, np.int64)
        return Ordering(np.arange(size, dtype=np.int64), max(0, size - 1), *nothing)
    columns = [constraint.columns[constraint.columns < free] for constraint in constraints]
    pair, pair_of = _pairs(constraints, columns, latched, free)
    kept = np.ones(size, bool)
    kept[free + np.flatnonzero(pair_of >= 0)] = False
    same = np.arange(size)
    if pair.size:
        kept[pair[:, 2]] = False
        same[pair[:, 2]] = pair[:, 1]
    groups = [np.append(columns[k], free + k) for k in range(m) if pair_of[k] < 0]
    for element, count in zip(elements, states, strict=True):
        internal = np.arange(first, first + count)
        if count == 1:
            kept[internal] = False
            internal = internal[:0]
        groups.append(np.concatenate([np.unique(same[element]), internal]))
        first += count
    row = np.cumsum(kept) - 1
    place, reach = _narrow([row[same[group]] for group in groups], int(kept.sum()))
    permutation = np.where(kept[same], place[row[same]], ELIMINATED).astype(np.int64)
    return Ordering(permutation, reach, pair, pair_of)


def _pairs(
    constraints: Sequence[Constraint], columns: Sequence[np.ndarray], latched: set[int], free: int
) -> tuple[np.ndarray, np.ndarray]:
    """Constraints of one part on two coordinates that no other constraint reads."""
    readers = np.zeros(free, np.int64)
    for read in columns:
        readers[np.unique(read)] += 1
    first_part = np.cumsum([0, *(len(constraint.parts) for constraint in constraints)])
    pairs = list[tuple[int, int, int]]()
    pair_of = np.full(len(constraints), -1, np.int64)
    for k, constraint in enumerate(constraints):
        read = np.unique(columns[k])
        if read.size == columns[k].size == 2 and len(constraint.parts) == 1 and k not in latched and np.all(readers[read] == 1):
            pair_of[k] = len(pairs)
            pairs.append((int(first_part[k]), int(read[0]), int(read[1])))
    return np.array(pairs, np.int64).reshape(-1, 3), pair_of


def _narrow(groups: Sequence[np.ndarray], size: int) -> tuple[np.ndarray, int]:
    """Places of unknowns that are coupled in groups, and how far coupled ones are apart."""
    near, place = coupled([*groups, *np.arange(size)[:, None]], size), np.empty(size, np.int64)
    place[reverse_cuthill_mckee(near)] = np.arange(size)
    return place, reach(near, place)
