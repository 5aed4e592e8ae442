"""Stills of the structure: bodies where they are, clearance joints magnified beside it."""

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn.model.body import Body, bar, point_mass
from scissordyn.model.clearance import Clearance
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor
from scissordyn.plot.animation_scene import GAP, outline
from scissordyn.plot.series import MOST_JOINTS
from scissordyn.plot.still import magnified, structure
from scissordyn.plot.style import BLUE, GREEN, SKY, VERMILION
from scissordyn.run.answer.placement import Placement
from scissordyn.run.simulate import simulate

from .made_up import CLEARANCE, CLEARANCE_JOINTS, mechanism_with


def test_bars_are_drawn_where_they_are(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: at angle th bar 1 goes from the origin to L (cos th, sin th), bar 2 from the slider to its mirror image."""
    axes = structure(run, arm, times=[0.025])[0]
    theta = math.pi / 6 + 5.0 * math.pi * 0.025
    tip = 2.0 * np.array([math.cos(theta), math.sin(theta)])
    first, second = [np.array(line.get_xydata()) for line in axes.lines if line.get_color() in (BLUE, GREEN)][:2]
    np.testing.assert_allclose(first, [(0.0, 0.0), tip], atol=1e-12)
    np.testing.assert_allclose(second, [(0.0, tip[1]), (tip[0], 0.0)], atol=1e-12)
    assert axes.get_title(loc="left") == "t = 25 ms"
    assert [text.get_text() for text in axes.texts] == ["A"]
    assert len(axes.patches) == 3  # slider, and the two parts of the ground pin


def test_turned_frame(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: a body turned by a quarter rotates its points by a quarter revolution about its mass centre."""
    placed = Placement.at(arm, run, [0])
    turned = placed.angles.copy()
    turned[:, placed.index["unit 1/bar 1"]] = math.pi / 2
    quarter = dataclasses.replace(placed, angles=turned)
    middle = placed.centre("unit 1/bar 1")
    np.testing.assert_allclose(quarter.place(("unit 1/bar 1", "end")), np.add(middle, [[0.0, 1.0]]), atol=1e-15)
    aside = quarter.points("unit 1/bar 1", np.array([[1.0, 0.5]]))
    np.testing.assert_allclose(aside, [np.add(middle, [[-0.5, 0.0]])], atol=1e-15)
    np.testing.assert_array_equal(quarter.place(("ground", "origin")), [[0.0, 0.0]])


def test_outlines() -> None:
    """Identity: a bar is the line between its extreme points, a bent body the polygon of its points, a point mass a point."""
    np.testing.assert_array_equal(outline(bar("b", length=2.0, mass=1.0)), [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(outline(point_mass("p", mass=1.0)), [[0.0, 0.0]])
    bent = Body("k", 1.0, 1.0, {"a": (0.0, 0.0), "c": (2.0, 0.0), "b": (1.0, 0.5), "d": (1.0, -0.5)})
    corners = outline(bent).tolist()
    start = corners.index([0.0, 0.0])
    assert corners[start:] + corners[:start] == [[0.0, 0.0], [1.0, -0.5], [2.0, 0.0], [1.0, 0.5]]


def test_magnified_joint(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: in units of R_J the clearance is 0.35, so a journal in contact overlaps the bearing by delta only."""
    sample = int(np.argmax(run["normal_force"].sel(joint="A").values))
    axes = magnified(run, arm, sample, "A", axes=Figure().subplots())
    bearing, journal = axes.patches
    away = math.hypot(*journal.center)
    assert bearing.radius == 1.0 + GAP
    assert away == pytest.approx(GAP * (1.0 + run["indentation"].sel(joint="A").values[sample] / CLEARANCE), rel=1e-12)
    assert journal.get_edgecolor() == to_rgba(VERMILION)
    assert axes.get_title() == "A: contact\nclearance magnified 7 times"
    flying = magnified(run, arm, 0, "A", axes=Figure().subplots())
    assert flying.patches[1].get_edgecolor() == to_rgba(SKY)
    with pytest.raises(InputError, match="joint 'O'"):
        magnified(run, arm, 0, "O", axes=Figure().subplots())


def test_structure_at_chosen_instants(two_joints: xr.Dataset) -> None:
    """Contract: a panel per instant and per clearance joint, all structures on the same axes."""
    drawn = structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=[0.0, 0.0300004])
    assert [axes.get_title(loc="left") for axes in (drawn[0], drawn[3])] == ["t = 0 ms", "t = 30 ms"]
    assert len(drawn) == 6
    assert drawn[0].get_xlim() == drawn[3].get_xlim()
    with pytest.raises(InputError, match="times"):
        structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=0)


def test_stills_name_the_joints_that_they_magnify() -> None:
    """Contract: of many clearance joints those with the largest forces are magnified and named, the others only ringed."""
    arm = scissor(units=4)
    names = [joint.name for joint in arm.joints]
    for name in names:
        arm = arm.with_clearance(name, Clearance(CLEARANCE))
    started = simulate(arm.driven(speed=1.0), until=1e-4, samples=2)
    drawn = structure(started, arm, times=1)
    titles = [axes.get_title().split(":")[0] for axes in drawn[1:]]
    shown = {text.get_text() for text in drawn[0].texts if text.get_text()}
    assert len(titles) == MOST_JOINTS
    assert shown & set(names) == set(titles)
    figure = drawn[0].get_figure(root=True)
    assert figure.get_supxlabel() == f"{len(names) - MOST_JOINTS} more clearance joints with smaller forces"


def test_wide_structure_has_room_beside_its_joints() -> None:
    """Limit: of six and of twenty units the structure is drawn at least 0.7 in high, and each title within the figure."""
    for units in (6, 20):
        arm = scissor(units=units, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=math.radians(30.0))
        arm = arm.with_clearance("all", Clearance(5e-4))
        drawn = structure(simulate(arm, until=1e-4, samples=2), arm, times=2)
        figure = drawn[0].get_figure(root=True)
        figure.draw_without_rendering()
        assert drawn[0].bbox.height > 0.7 * figure.dpi
        assert max(axes.title.get_window_extent().y1 for axes in drawn) <= figure.bbox.y1 + 1.0
