"""Stills of the structure: bodies in place, and clearance joints magnified."""

import dataclasses
import math

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import scissordyn as sd
from scissordyn.plot.animation_scene import outline
from scissordyn.plot.drawing import BAR_FILLS
from scissordyn.plot.still import structure
from scissordyn.plot.style import SIZES, SKY, VERMILION
from scissordyn.record.placement import Placement
from scissordyn.warning import LISTED_MAX

from .made_up import CLEARANCE, CLEARANCE_JOINTS, magnified, mechanism_with


def test_positions_of_bars(run, arm):
    """Closed form: bar 1 goes from the origin to L (cos th, sin th), bar 2 from the slider to its mirror image."""
    axes = structure(run, arm, times=[0.025])[0]
    theta = math.pi / 6 + 5.0 * math.pi * 0.025
    tip = 2.0 * np.array([math.cos(theta), math.sin(theta)])
    first, second = [np.array(line.get_xydata()) for line in axes.lines if line.get_color() in BAR_FILLS][:2]
    np.testing.assert_allclose(first, [(0.0, 0.0), tip], atol=1e-12)
    np.testing.assert_allclose(second, [(0.0, tip[1]), (tip[0], 0.0)], atol=1e-12)
    assert axes.get_title(loc="left") == "t = 25 ms"
    assert [text.get_text() for text in axes.texts] == ["0.5 m", "A"]
    assert len(axes.patches) == 3  # slider, and the two parts of the ground pin


def test_turned_frame(run, arm):
    """Closed form: a quarter turn of a body rotates its points about its mass centre."""
    placed = Placement.at(arm, run, [0])
    turned = placed.angles.copy()
    turned[:, placed.index["unit 1/bar 1"]] = math.pi / 2
    quarter = dataclasses.replace(placed, angles=turned)
    middle = placed.centre("unit 1/bar 1")
    np.testing.assert_allclose(quarter.place(("unit 1/bar 1", "end")), np.add(middle, [[0.0, 1.0]]), atol=1e-15)
    aside = quarter.points("unit 1/bar 1", np.array([[1.0, 0.5]]))
    np.testing.assert_allclose(aside, [np.add(middle, [[-0.5, 0.0]])], atol=1e-15)
    np.testing.assert_array_equal(quarter.place(("ground", "origin")), [[0.0, 0.0]])


def test_outlines():
    """Contract: a bar is the line between its extreme points, a bent body a polygon, a point mass a point."""
    np.testing.assert_array_equal(outline(sd.bar("b", length=2.0, mass=1.0)), [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(outline(sd.point_mass("p", mass=1.0)), [[0.0, 0.0]])
    bent = sd.Body("k", 1.0, 1.0, {"a": (0.0, 0.0), "c": (2.0, 0.0), "b": (1.0, 0.5), "d": (1.0, -0.5)})
    corners = outline(bent).tolist()
    start = corners.index([0.0, 0.0])
    assert corners[start:] + corners[:start] == [[0.0, 0.0], [1.0, -0.5], [2.0, 0.0], [1.0, 0.5]]


def test_magnified_joint(run, arm):
    """Closed form: in units of R_J the clearance is 0.35, so that a journal in contact overlaps the bearing by delta only."""
    sample = int(np.argmax(run["normal_force"].sel(joint="A").values))
    axes = magnified(run, arm, sample, "A")
    bearing, journal = axes.patches
    away = math.hypot(*journal.center)
    assert bearing.radius == 1.0 + SIZES.magnified_clearance
    assert away == pytest.approx(
        SIZES.magnified_clearance * (1.0 + run["indentation"].sel(joint="A").values[sample] / CLEARANCE), rel=1e-12
    )
    assert journal.get_edgecolor() == to_rgba(VERMILION)
    assert axes.get_xlabel() == "clearance magnified 7\ntimes"
    flying = magnified(run, arm, 0, "A")
    assert flying.patches[1].get_edgecolor() == to_rgba(SKY)
    with pytest.raises(sd.InputError, match="joint 'O'"):
        structure(run, arm, joint="O")


def test_instants_are_numbered_on_the_orbit(run, arm):
    """Contract: each number's mark is at the journal's place at its instant, and a turned picture turns it with the bars."""
    samples = [100, 900, 1700]
    drawn = structure(run, arm, times=[float(run["time"][k]) for k in samples])
    assert [axes.get_title(loc="left")[:2] for axes in drawn[:3]] == ["1:", "2:", "3:"]
    marks = [line.get_xydata()[0] for line in drawn[3].lines if line.get_zorder() == 5.0]
    place = 1e3 * run["eccentricity"].sel(joint="A").values[samples]
    directions = [np.arctan2(*mark) for mark in marks]
    np.testing.assert_allclose(np.sort(directions), np.sort(np.arctan2(*place.T)), atol=1e-12)
    assert {text.get_text() for text in drawn[3].texts} >= {"1", "2", "3"}
    upwards = dataclasses.replace(arm, gravity=9.81, gravity_direction=math.pi)
    turned = [line.get_xydata()[0] for line in structure(run, upwards, times=[0.001])[1].lines if line.get_label() == "start"]
    first = 1e3 * run["eccentricity"].sel(joint="A").values[0]
    np.testing.assert_allclose(turned, [[-first[1], first[0]]], atol=1e-12)
    assert "x ↑, y ←" in structure(run, upwards, times=1)[0].texts[0].get_text()


@pytest.mark.parametrize("joint", ["A", None])
def test_rings_of_stills_show_contact(run, arm, joint):
    """Contract: the ring of a joint in a still has the colour of `in_contact` at its sample."""
    touched = run["in_contact"].sel(joint="A").values.astype(bool)
    samples = [int(np.argmax(touched)), int(np.argmin(touched))]
    drawn = structure(run, arm, joint=joint, times=[float(run["time"][k]) for k in samples])
    stills = [axes for axes in drawn if "t =" in axes.get_title(loc="left")]
    rings = [
        line.get_color() for axes in stills for line in axes.lines if line.get_markersize() > 5.0 and line.get_zorder() == 5.0
    ]
    assert touched[samples].tolist() == [True, False]
    assert rings == [VERMILION, SKY]


def test_structure_at_chosen_instants(two_joints):
    """Contract: one panel per instant and clearance joint, with the same axes for all structures."""
    drawn = structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=[0.0, 0.0300004])
    assert [axes.get_title(loc="left") for axes in drawn[:2]] == ["1: t = 0 ms", "2: t = 30 ms"]
    assert len(drawn) == 4
    assert drawn[0].get_xlim() == drawn[1].get_xlim()
    (explained,) = drawn[0].get_figure(root=True).legends
    assert {"joint in contact", "joint in free flight"} <= {text.get_text() for text in explained.get_texts()}
    with pytest.raises(sd.InputError, match="times"):
        structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=0)


def test_stills_name_the_joints_that_they_magnify():
    """Contract: the clearance joints with the largest forces are magnified and named, the others have a ring only."""
    arm = sd.scissor(units=4)
    names = [joint.name for joint in arm.joints]
    for name in names:
        arm = arm.with_clearance(name, sd.Clearance(CLEARANCE))
    started = sd.simulate(arm.driven(speed=1.0), until=1e-4, samples=2)
    drawn = structure(started, arm, times=1)
    titles = [axes.get_title().replace("joint ", "").split("\n")[0] for axes in drawn[1:]]
    shown = {text.get_text() for text in drawn[0].texts if text.get_text()}
    assert len(titles) == LISTED_MAX
    assert shown & set(names) == set(titles)
    figure = drawn[0].get_figure(root=True)
    assert figure.get_supxlabel() == f"{len(names) - LISTED_MAX} more clearance joints with smaller forces"


def test_height_of_wide_structures():
    """Contract: structures of six and twenty units are at least 0.7 in high, with titles inside the figure."""
    for units in (6, 20):
        arm = sd.scissor(units=units, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=math.radians(30.0))
        arm = arm.with_clearance("all", sd.Clearance(5e-4))
        drawn = structure(sd.simulate(arm, until=1e-4, samples=2), arm, times=2)
        figure = drawn[0].get_figure(root=True)
        figure.draw_without_rendering()
        assert drawn[0].bbox.height > 0.7 * figure.dpi
        assert max(axes.title.get_window_extent().y1 for axes in drawn) <= figure.bbox.y1 + 1.0
