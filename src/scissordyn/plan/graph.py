"""Which unknowns share a group, and an order in which those that do are near each other: the band of their matrix is narrow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np


def members(groups: Iterable[np.ndarray], size: int) -> list[np.ndarray]:
    """For each of so many unknowns, the groups that it is in, by number."""
    numbers: list[list[int]] = [[] for _ in range(size)]
    for number, group in enumerate(groups):
        for k in np.unique(group).tolist():
            numbers[k].append(number)
    return [np.array(of_one, np.int64) for of_one in numbers]


def coupled(groups: Sequence[np.ndarray], size: int) -> list[np.ndarray]:
    """For each of so many unknowns, those that share a group with it, itself included, in increasing order."""
    near, shared = list[np.ndarray](), np.zeros(size, bool)
    for numbers in members(groups, size):
        for number in numbers.tolist():
            shared[groups[number]] = True
        near.append(np.flatnonzero(shared))
        shared[near[-1]] = False
    return near


def pairs_of(near: Sequence[np.ndarray]) -> np.ndarray:
    """Pairs k >= l of coupled unknowns, by k, shape (pairs, 2)."""
    k = np.repeat(np.arange(len(near)), [others.size for others in near])
    pairs = np.stack([k, np.concatenate([np.zeros(0, np.int64), *near])], axis=1)
    return np.ascontiguousarray(pairs[pairs[:, 0] >= pairs[:, 1]])


def reach(near: Sequence[np.ndarray], place: np.ndarray) -> int:
    """How far coupled unknowns are apart, at most, with these places."""
    return max((int(np.max(np.abs(place[others] - place[k]))) for k, others in enumerate(near) if others.size), default=0)


def reverse_cuthill_mckee(near: Sequence[Sequence[int] | np.ndarray]) -> np.ndarray:
    """The unknowns in the reverse order of Cuthill and McKee: breadth first from one of lowest degree, lower degrees first."""
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
