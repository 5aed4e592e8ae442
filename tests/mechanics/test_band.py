"""Banded equations compared with the dense solution, with and without row exchanges."""

import numpy as np
import pytest

from scissordyn.mechanics.band import eliminate, factorize, product, solve, substitute, width

LOWER, UPPER = 2, 1  # Number of diagonals below and above the main diagonal


def banded(dense):
    """Return a dense matrix in the kernels' storage: row i holds columns i - lower to i + lower + upper."""
    size = len(dense)
    band = np.zeros((size, width(LOWER, UPPER)))
    for i in range(size):
        for j in range(max(0, i - LOWER), min(size, i + UPPER + 1)):
            band[i, j - i + LOWER] = dense[i, j]
    return band


@pytest.mark.parametrize("exchanges", [False, True])
@pytest.mark.parametrize("size", [1, 2, 3, 9])
def test_solution_with_row_exchanges(size, exchanges):
    """Independent formulation: numpy. With a small diagonal every pivot comes from the last row within the band."""
    rng = np.random.default_rng(size)
    dense = np.triu(np.tril(rng.normal(size=(size, size)), UPPER), -LOWER)
    if exchanges:
        dense[np.diag_indices(size)] *= 1e-14
        dense += 10.0 * np.eye(size, k=-LOWER)
        dense[-LOWER:, -LOWER:] += np.eye(min(size, LOWER))
    else:
        dense += 10.0 * np.eye(size)
    band, pivots, x = banded(dense), np.zeros(2 * size, np.int64), rng.normal(size=size)
    wanted = np.linalg.solve(dense, x)
    assert factorize(band, LOWER, UPPER, pivots) == -1
    if exchanges and size > 2 * LOWER:
        assert np.any(pivots[:size] == np.arange(size) + LOWER)
    solve(band, LOWER, pivots, x)
    np.testing.assert_allclose(x, wanted, rtol=1e-9 if exchanges else 1e-13)


def test_index_of_a_row_without_pivot():
    """Closed form: a column of zeros on and below the diagonal."""
    dense = np.eye(4)
    dense[2, 2] = 0.0
    assert factorize(banded(dense), LOWER, UPPER, np.zeros(8, np.int64)) == 2


@pytest.mark.parametrize("reach", [1, 3, 11])
@pytest.mark.parametrize("first", [0, 4, 25])
def test_elimination_from_the_first_changed_row(reach, first):
    """Independent formulation: numpy, for a matrix whose rows change from one row on."""
    rng, size = np.random.default_rng(reach), 26

    def equations():
        dense = np.triu(np.tril(rng.normal(size=(size, size)), reach), -reach)
        return dense + 3.0 * reach * np.eye(size), rng.normal(size=size)

    band, right, found = np.zeros((size, width(reach, reach))), np.zeros(size), np.zeros(size)

    def write(dense, x, since):
        right[since:], band[since:] = x[since:], 0.0
        for i in range(since, size):
            for j in range(max(0, i - reach), min(size, i + reach + 1)):
                band[i, j - i + reach] = dense[i, j]

    dense, x = equations()
    write(dense, x, 0)
    assert eliminate(band, reach, 0, right) == -1
    later, y = equations()
    dense[first:], x[first:] = later[first:], y[first:]
    write(dense, x, first)
    assert eliminate(band, reach, first, right) == -1
    substitute(band, reach, right, found)
    np.testing.assert_allclose(found, np.linalg.solve(dense, x), rtol=1e-12)
    write(dense, x, 0)
    np.testing.assert_allclose([product(band, reach, i, found) for i in range(size)], x, rtol=0.0, atol=1e-12)


def test_index_of_a_zero_pivot_without_exchanges():
    """Closed form: zeros on the diagonal, which row exchanges would avoid."""
    band, right = np.zeros((3, width(1, 1))), np.ones(3)
    band[:, 0] = band[:, 2] = 1.0
    assert eliminate(band, 1, 0, right) == 0
