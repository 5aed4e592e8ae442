"""Life of worn joints: the cycle at which a requirement fails, and the warnings of a result."""

import json
import math

import numpy as np
import pytest
import xarray as xr

from scissordyn.lifetime.life import first_crossing
from scissordyn.record.warn import warning_lines, warnings_of
from scissordyn.warning import first_of_each, warning


def test_first_crossing():
    cycles = np.array([0.0, 10.0, 30.0])
    assert first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 3.0) == pytest.approx(20.0)
    assert first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 0.5) == 0.0
    assert math.isnan(first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 4.0))


def test_a_warning_is_given_once_for_each_joint():
    """Contract: warnings that differ in their numbers are one, those about other joints or texts are not."""
    told = [warning("scatter", f"unit {k}/pivot", percent=part) for k in (1, 2) for part in (8.0, 3.0)]
    told += [warning("unused coefficient", pair=pair) for pair in ("steel/brass", "steel/bronze")]
    assert first_of_each(told) == [told[0], told[2], told[4], told[5]]


def test_warnings_of_alike_joints_are_one_line():
    told = [warning("scatter", name, percent=part) for name, part in (("A", 2.0), ("unit 2/pivot", 9.5), ("B", 3.0))]
    told.append(warning("ideal deviation"))
    run = xr.Dataset(attrs={"warning_data": json.dumps([item.data for item in told])})
    first, second = warning_lines(warnings_of(run))
    assert first.startswith("3 joints ('A', 'unit 2/pivot', 'B'): cycles do not repeat")
    assert "scatters by 2 to 9.5 %" in first
    assert first.endswith("the worst is 'unit 2/pivot'")
    assert second == str(told[-1])
