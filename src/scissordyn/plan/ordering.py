"""Orders of unknowns in which coupled ones are near each other, for matrices with a narrow band.

Some unknowns of the step matrix are eliminated beforehand.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from scissordyn.plan.coordinates import Constraint


class Ordering(NamedTuple):
    """Order of the rows of the step matrix."""

    permutation: np.ndarray  # (n+m+nz,) Row of each acceleration, multiplier and internal state; -1 if it is eliminated
    reach: int  # Number of off-diagonals on either side
    # (pairs, 3) Constraint whose multiplier is eliminated: its only part and its two coordinates, read by no other constraint
    pair: np.ndarray
    pair_of: np.ndarray  # (m,) Row of `pair` for each constraint, or -1


def order_unknowns(
    free: int, constraints: Sequence[Constraint], latched: set[int], elements: Sequence[np.ndarray], states: Sequence[int]
) -> Ordering:
    """Return an order of accelerations, multipliers and internal states in which the step matrix has a narrow band.

    `latched` are the constraints of latches, `elements` the free columns of each force element, `states` its number of internal
    states.
    """
    m, first = len(constraints), free + len(constraints)
    size = first + sum(states)
    if size <= 12:  # a small step matrix is full
        nothing = np.zeros((0, 3), np.int64), np.full(m, -1, np.int64)
        return Ordering(np.arange(size, dtype=np.int64), max(0, size - 1), *nothing)
    columns = [constraint.columns[constraint.columns < free] for constraint in constraints]
    pair, pair_of = _pairs(constraints, columns, latched, free)
    is_kept = np.ones(size, bool)
    is_kept[free + np.flatnonzero(pair_of >= 0)] = False
    partner = np.arange(size)
    if pair.size:
        is_kept[pair[:, 2]] = False
        partner[pair[:, 2]] = pair[:, 1]
    groups = [np.append(columns[k], free + k) for k in range(m) if pair_of[k] < 0]
    for element, count in zip(elements, states, strict=True):
        internal = np.arange(first, first + count)
        if count == 1:
            is_kept[internal] = False
            internal = internal[:0]
        groups.append(np.concatenate([np.unique(partner[element]), internal]))
        first += count
    row = np.cumsum(is_kept) - 1
    near, place = narrow([row[partner[group]] for group in groups], int(is_kept.sum()))
    permutation = np.where(is_kept[partner], place[row[partner]], -1).astype(np.int64)  # -1: eliminated
    return Ordering(permutation, reach(near, place), pair, pair_of)


def _pairs(
    constraints: Sequence[Constraint], columns: Sequence[np.ndarray], latched: set[int], free: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the constraints whose multipliers can be eliminated (rows of `Ordering.pair`), and the row of each constraint."""
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


def narrow(groups: Iterable[np.ndarray], size: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Return, for each unknown, the unknowns that share a group with it, and an order that keeps these close together."""
    near, place = coupled([*groups, *np.arange(size)[:, None]], size), np.empty(size, np.int64)
    place[reverse_cuthill_mckee(near)] = np.arange(size)
    return near, place


def members(groups: Iterable[np.ndarray], size: int) -> list[np.ndarray]:
    """Return for each of `size` unknowns the indices of its groups."""
    numbers: list[list[int]] = [[] for _ in range(size)]
    for number, group in enumerate(groups):
        for k in set(group.tolist()):
            numbers[k].append(number)
    return [np.array(of_one, np.int64) for of_one in numbers]


def coupled(groups: Sequence[np.ndarray], size: int) -> list[np.ndarray]:
    """Return for each of `size` unknowns those that share a group with it, including itself, in increasing order."""
    near, shared = list[np.ndarray](), np.zeros(size, bool)
    for numbers in members(groups, size):
        for number in numbers.tolist():
            shared[groups[number]] = True
        near.append(np.flatnonzero(shared))
        shared[near[-1]] = False
    return near


def pairs_of(near: Sequence[np.ndarray]) -> np.ndarray:
    """Return the pairs k >= l of coupled unknowns, by k, shape (pairs, 2)."""
    k = np.repeat(np.arange(len(near)), [others.size for others in near])
    pairs = np.stack([k, np.concatenate([np.zeros(0, np.int64), *near])], axis=1)
    return np.ascontiguousarray(pairs[pairs[:, 0] >= pairs[:, 1]])


def reach(near: Sequence[np.ndarray], place: np.ndarray) -> int:
    """Return the largest distance between coupled unknowns at given positions."""
    return max((int(np.max(np.abs(place[others] - place[k]))) for k, others in enumerate(near) if others.size), default=0)


def reverse_cuthill_mckee(near: Sequence[Sequence[int] | np.ndarray]) -> np.ndarray:
    """Return the reverse Cuthill-McKee order: breadth first from an unknown of lowest degree, lower degrees first."""
    degree = [len(others) for others in near]
    order, waiting = list[int](), np.ones(len(near), bool)
    for seed in np.argsort(np.array(degree, np.int32)).tolist():
        level = [seed] if waiting[seed] else []
        waiting[level] = False
        while level:
            order += level
            after = list[int]()
            for k in level:
                further = [j for j in near[k] if waiting[j]]
                waiting[further] = False
                after += sorted(further, key=degree.__getitem__)
            level = after
    return np.array(order[::-1], np.int64)
