"""Places of names beside joints that move."""

import itertools
import math

import numpy as np

from scissordyn.plot.label_place import LETTER, LINE, REGION, aside

RING = 5.5
"""Radius of a drawn joint with its line [pt]."""


def test_names_keep_off_lines_joints_and_each_other() -> None:
    """Identity: in every frame of a crank that turns half a revolution, no name is on a joint, a bar, or another name."""
    angle = np.linspace(0.0, math.pi, 60)
    crank = 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    end = np.stack([crank[:, 0] + np.sqrt(0.25 - crank[:, 1] ** 2), 0.0 * angle], axis=1)
    fixed = np.zeros((60, 2))
    joints, names = np.stack([crank, end], axis=1), ["crank pin", "slider pin"]
    lines = [np.stack([fixed, crank], axis=1), np.stack([crank, end], axis=1)]
    found = aside(names, joints, lines, fixed[:, None], (np.array([-0.4, -0.3]), np.array([0.8, 0.4])))
    half = 0.5 * np.array([[LETTER * len(name), LINE] for name in names])
    hidden = 0
    for frame in range(60):
        places = REGION / 1.2 * np.stack([crank[frame], end[frame], fixed[frame]])
        boxes = [(places[k] + found[k] - half[k], places[k] + found[k] + half[k]) for k in range(2)]
        for low, high in boxes:
            assert np.all(np.linalg.norm(np.clip(places, low, high) - places, axis=1) > RING)
            for line in lines:
                points = (
                    REGION / 1.2 * (line[frame][0] + np.linspace(0.0, 1.0, 400)[:, None] * (line[frame][1] - line[frame][0]))
                )
                hidden += int(np.any(np.all((points > low) & (points < high), axis=1)))
        assert not any(np.all((a[0] < b[1]) & (b[0] < a[1])) for a, b in itertools.combinations(boxes, 2))
    # the coupler sweeps every side of the pins, so that some frames must have it behind a name
    assert hidden <= 20
    assert np.all(np.linalg.norm(found, axis=1) < 60.0)


def test_names_stay_with_their_joints_and_in_the_picture() -> None:
    """Identity: of three joints of an array that closes, each name is nearest to its own joint, and none is cut off."""
    gap = np.linspace(1.0, 0.25, 30)
    joints = np.stack([np.stack([k * gap, 0.0 * gap], axis=1) for k in range(3)], axis=1)
    region = np.array([-0.05, -0.5]), np.array([2.2, 0.5])
    found = aside(["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"], joints, [joints], np.empty((30, 0, 2)), region)
    scale, half = REGION / 2.25, 0.5 * np.array([LETTER * 12, LINE])
    for places in scale * joints:
        for k in range(3):
            low, high = places[k] + found[k] - half, places[k] + found[k] + half
            away = np.linalg.norm(np.clip(places, low, high) - places, axis=1)
            assert np.argmin(away) == k
            assert np.all(low >= scale * region[0])


def test_no_names_need_no_place() -> None:
    """Limit: without a joint to name there is nothing to place."""
    assert aside([], np.empty((3, 0, 2)), [], np.empty((3, 0, 2)), (np.zeros(2), np.ones(2))).shape == (0, 2)
