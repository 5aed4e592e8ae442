"""Normal equations of the reactions, vectorised and one by one, compared with numpy."""

import numpy as np
import pytest

from scissordyn.mechanics.band import width
from scissordyn.mechanics.reactions import careful, solve_lanes

SIZE, REACH, LANES = 7, 2, 3  # Number of unknowns, of off-diagonals on either side, and of systems solved at once


def normal_equations(rank, rng):
    """Return a banded matrix A^T A in the kernels' storage, the same dense, and a load in its range."""
    rows = np.zeros((SIZE, SIZE))
    for i in range(rank):
        rows[i, i : i + REACH + 1] = rng.normal(size=min(REACH + 1, SIZE - i))
        rows[i, i] += 3.0
    dense = rows.T @ rows
    stored = np.zeros((SIZE, 2 * REACH + 1, LANES))
    for i in range(SIZE):
        for below in range(min(REACH, i) + 1):
            stored[i, below, :] = dense[i, i - below]
    return dense, stored, rows.T @ rng.normal(size=SIZE)


def solved_carefully(stored, load, lane):
    """Return the solution of one lane by the rank-revealing method."""
    work = (np.zeros((SIZE, width(REACH, REACH))), np.zeros(2 * SIZE, np.int64), np.zeros(SIZE), np.zeros(SIZE), np.zeros(SIZE))
    careful(REACH, LANES, lane, stored, load, *work)
    return work[-1]


@pytest.mark.parametrize("seed", range(3))
def test_determined_equations(seed):
    """Independent formulation: the dense solution, in every lane and by both methods."""
    rng = np.random.default_rng(seed)
    dense, stored, right = normal_equations(SIZE, rng)
    load = np.outer(right, np.arange(1.0, LANES + 1.0))
    wanted = np.linalg.solve(dense, load)
    for lane in range(LANES):
        np.testing.assert_allclose(solved_carefully(stored, load, lane), wanted[:, lane], rtol=1e-8)
    solve_lanes(REACH, stored, load)
    np.testing.assert_allclose(load, wanted, rtol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_undetermined_unknowns_are_nan(seed):
    """Closed form: unknowns in the null space of a rank-deficient matrix are NaN; the others are solved."""
    rng = np.random.default_rng(seed)
    dense, stored, right = normal_equations(SIZE - 1, rng)
    null = np.linalg.svd(dense)[2][-1]
    found = solved_carefully(stored, np.outer(right, np.ones(LANES)), 1)
    free = np.abs(null) > 1e-6
    assert np.all(np.isnan(found[free]))
    assert np.all(np.isfinite(found[~free]))


def test_determined_unknown_of_a_singular_matrix():
    """Closed form: only the sum of two unknowns is determined, and a third one alone."""
    stored, load = np.zeros((3, 5, 1)), np.array([[2.0], [2.0], [6.0]])
    stored[:, 0, 0] = 1.0, 1.0, 2.0
    stored[1, 1, 0] = 1.0
    work = (np.zeros((3, width(2, 2))), np.zeros(6, np.int64), np.zeros(3), np.zeros(3), np.zeros(3))
    careful(2, 1, 0, stored, load, *work)
    assert np.all(np.isnan(work[-1][:2]))
    assert work[-1][2] == pytest.approx(3.0)
