"""Banded equations against the dense solution, with and without row exchanges."""

from __future__ import annotations

import numpy as np
import pytest

from scissordyn.mechanics.band import factorize, solve

LOWER, UPPER = 2, 1


def banded(dense):
    """A dense matrix in the storage of the kernels: row i holds columns i - lower to i + lower + upper."""
    size = len(dense)
    band = np.zeros((size, 2 * LOWER + UPPER + 1))
    for i in range(size):
        for j in range(max(0, i - LOWER), min(size, i + UPPER + 1)):
            band[i, j - i + LOWER] = dense[i, j]
    return band


@pytest.mark.parametrize("exchanges", [False, True])
@pytest.mark.parametrize("size", [1, 2, 3, 9])
def test_the_solution_is_that_of_dense_equations(size: int, exchanges: bool) -> None:
    """Independent formulation: numpy. With a small diagonal every pivot comes from the last row that a column reaches."""
    rng = np.random.default_rng(size)
    dense = np.triu(np.tril(rng.normal(size=(size, size)), UPPER), -LOWER)
    if exchanges:
        dense[np.diag_indices(size)] *= 1e-14
        dense += 10.0 * np.eye(size, k=-LOWER)
        dense[-LOWER:, -LOWER:] += np.eye(min(size, LOWER))
    else:
        dense += 10.0 * np.eye(size)
    band, pivots, x = banded(dense), np.zeros(size, np.int64), rng.normal(size=size)
    wanted = np.linalg.solve(dense, x)
    assert factorize(band, LOWER, UPPER, pivots) == -1
    if exchanges and size > 2 * LOWER:
        assert np.any(pivots == np.arange(size) + LOWER)
    solve(band, LOWER, UPPER, pivots, x)
    np.testing.assert_allclose(x, wanted, rtol=1e-9 if exchanges else 1e-13)


def test_the_first_row_without_a_pivot_is_named() -> None:
    """Closed form: a column of zeros below and on the diagonal."""
    dense = np.eye(4)
    dense[2, 2] = 0.0
    assert factorize(banded(dense), LOWER, UPPER, np.zeros(4, np.int64)) == 2
