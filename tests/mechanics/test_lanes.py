"""Short loops with vector instructions."""

from __future__ import annotations

import numpy as np
import pytest
from tests.build import in_c

from scissordyn.kernel import F1, F2
from scissordyn.mechanics.lanes import LANES, combine, padded, pull, stretch


def loops(table: F1, first: int, rows: int, width: int, source: F2, target: F2) -> None:
    combine(table, first, rows, width, source[0], source[1], target[0], target[1])
    stretch(target[0], target[1], 0.1, target[2], target[3], width)
    pull(-2.0, target[3], target[2], target[0], target[1], target[4][3:], target[5][3:], width)


@pytest.mark.parametrize(("rows", "width"), [(1, LANES), (11, 2 * LANES), (23, 3 * LANES), (7, 5 * LANES)])
def test_compiled_loops_are_those_in_python(rows, width):
    """Contract: compiled loops give the bits of the same lines in Python; zeros that fill lanes stay zero."""
    rng = np.random.default_rng(rows)
    table, source = rng.normal(size=3 + rows * width), rng.normal(size=(2, rows))
    table[3:].reshape(rows, width)[:, -1] = 0.0
    found, expected = np.zeros((2, 6, width + 8))
    in_c(loops)(table, 3, rows, width, source, found)
    np.linalg.svd(np.eye(2), compute_uv=False)  # fails after an invalid operation
    loops(table, 3, rows, width, source, expected)
    assert found == pytest.approx(expected, rel=0.0, abs=0.0)
    assert found[4, 3 + width - 1] == found[5, 3 + width - 1] == 0.0
    assert not found[:, width + 3 :].any()


def test_rows_have_whole_lanes():
    """Contract: row lengths are rounded up to whole vectors."""
    assert [padded(count) for count in (0, 1, LANES, LANES + 1)] == [0, LANES, LANES, 2 * LANES]
