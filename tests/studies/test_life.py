"""Life of worn joints: the cycle at which a requirement fails, and the warnings of a result."""

import json
import math

import numpy as np
import pytest
import xarray as xr

from scissordyn.lifetime.life import first_crossing, warning_lines, without_repetitions


def test_first_crossing():
    cycles = np.array([0.0, 10.0, 30.0])
    assert first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 3.0) == pytest.approx(20.0)
    assert first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 0.5) == 0.0
    assert math.isnan(first_crossing(cycles, np.array([1.0, 2.0, 4.0]), 4.0))


def test_a_warning_is_given_once_for_each_joint():
    """Contract: warnings that differ in their numbers are one, those about joints whose names differ in a number are not."""
    texts = [f"joint 'unit {k}/pivot': began at {speed} m/s" for k in (1, 2) for speed in ("0.007", "6.58e-05")]
    assert without_repetitions(texts) == texts[::2]


def test_warnings_of_alike_joints_are_one_line():
    told = [f"joint '{name}': {k} of 24 contacts are fast" for k, name in enumerate(("A", "unit 2/pivot", "B"), start=1)]
    run = xr.Dataset(attrs={"warnings": json.dumps([*told, "cycles do not repeat"])})
    assert warning_lines(run) == [f"{told[0]}; alike at 'unit 2/pivot', 'B'.", "cycles do not repeat."]
