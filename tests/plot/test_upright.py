"""Pictures, films and drags of a mechanism that stands: gravity points downwards whatever its direction in the case."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.explore.case import open_case
from scissordyn.explore.drag import Drag
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import scene_of, upright
from scissordyn.plot.preview import preview
from scissordyn.plot.still import structure

LIFT = Path(__file__).parents[2] / "examples" / "lift.toml"


@pytest.fixture(scope="module")
def lift() -> Mechanism:
    """The lift, whose gravity points along -x, without clearance."""
    return read_case(LIFT).mechanism.ideal()


@pytest.fixture(scope="module")
def start(lift: Mechanism) -> xr.Dataset:
    return sd.simulate(lift, until=1e-9, samples=2)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_scene_is_turned_as_a_whole(lift: Mechanism, start: xr.Dataset, turns: int) -> None:
    """Cross-check: every point of the scene is that of the scene with gravity downwards, turned about the origin."""
    plain = scene_of(start, dataclasses.replace(lift, gravity_direction=-0.5 * math.pi), np.array([0, 1]), [])
    standing = scene_of(start, dataclasses.replace(lift, gravity_direction=-0.5 * math.pi * (1 + turns)), np.array([0, 1]), [])
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    turn = np.linalg.matrix_power(turn, turns).T
    assert [shape.name for shape in standing.shapes] == [shape.name for shape in plain.shapes]
    for now, before in zip(standing.shapes, plain.shapes, strict=True):
        assert np.allclose(now.points, before.points @ turn, atol=1e-12), now.name
    assert np.allclose(standing.pins, plain.pins @ turn, atol=1e-12)
    assert np.allclose(standing.supports, plain.supports @ turn, atol=1e-12)
    corners = np.array([plain.low, plain.high]) @ turn
    assert np.allclose([standing.low, standing.high], [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)


def test_lift_stands_upright(lift: Mechanism, start: xr.Dataset) -> None:
    """Contract: the three units are above each other; the axes are those of the case, with its numbers."""
    for axes in (preview(lift, start=start), structure(start, lift, times=1)[0]):
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("y [m]", "x [m]")
        bars = [line.get_xydata() for line in axes.lines if line.get_linewidth() == 2.0]
        height = [float(np.mean(np.asarray(bar)[:2, 1])) for bar in bars]
        assert np.allclose(height, np.repeat(np.array([1, 3, 5]) * 0.5 * math.sqrt(1.0 - 0.9397**2), 2), atol=1e-9)
        assert axes.xaxis.get_major_formatter()(-0.25, 0) == "0.25"
        assert axes.xaxis.get_major_formatter()(0.0, 0) == "0"


def test_oblique_gravity_turns_nothing(lift: Mechanism) -> None:
    """Limit: a picture is turned by whole quarters only, and not at all without gravity."""
    assert upright(lift) == 1
    assert upright(dataclasses.replace(lift, gravity_direction=math.radians(200.0))) == 0
    assert upright(dataclasses.replace(lift, gravity=0.0)) == 0


def test_drag_follows_the_pointer_in_the_turned_picture() -> None:
    """Contract: a pointer that moves upwards in the picture moves the joint along the x axis of the case."""
    drag = Drag(open_case(LIFT), "pin", "unit 1/upper")
    reach = 0.03 * drag.size
    for part in (0.5, 1.0, 1.0):
        drag.to(0.0, part * reach)
    assert np.allclose(drag.present - drag.origin, [reach, 0.0], atol=1e-3 * drag.size)
