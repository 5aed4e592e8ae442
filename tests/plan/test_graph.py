"""Orders of unknowns that keep coupled ones close to each other."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee as of_scipy

from scissordyn.plan.ordering import coupled, members, pairs_of, reach, reverse_cuthill_mckee


@pytest.mark.parametrize("seed", range(8))
def test_groups_couple_their_members(seed):
    """Second formulation: products of incidence matrices, and scipy's order and bandwidth."""
    random = np.random.default_rng(seed)
    size, count = (int(number) for number in random.integers(1, 60, 2))
    groups = [random.choice(size, int(random.integers(0, min(size, 5) + 1)), replace=False) for _ in range(count)]
    incidence = np.zeros((count, size))
    for row, group in zip(incidence, groups, strict=True):
        row[group] = 1.0
    assert [own.tolist() for own in members(groups, size)] == [np.flatnonzero(column).tolist() for column in incidence.T]
    for own, product in ((groups, incidence.T @ incidence), (members(groups, size), incidence @ incidence.T)):
        near = coupled(own, len(product))
        assert [others.tolist() for others in near] == [np.flatnonzero(row).tolist() for row in product]
        k, l = np.nonzero(np.tril(product))
        np.testing.assert_array_equal(pairs_of(near), np.stack([k, l], axis=1))
        order, place = reverse_cuthill_mckee(near), np.empty(len(product), int)
        np.testing.assert_array_equal(order, of_scipy(sparse.csr_array(product), symmetric_mode=True))
        place[order] = np.arange(len(product))
        rows, columns = np.nonzero(product)
        assert reach(near, place) == np.max(np.abs(place[rows] - place[columns]), initial=0)
