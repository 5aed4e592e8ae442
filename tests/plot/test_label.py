"""Names in drawings: of stills and of films, whose joints move."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from scissordyn.config.file import read_case
from scissordyn.plot.animation_scene import ring_size
from scissordyn.plot.label import LEADER
from scissordyn.plot.label_place import LETTER, LINE, REGION, asides
from scissordyn.plot.preview import preview
from scissordyn.plot.still import structure
from scissordyn.run.simulate import simulate

EXAMPLE = Path(__file__).parents[2] / "examples" / "ring.toml"

RADIUS, RING = (
    4.1,
    5.5,
)  # Of the circles about joints, with their lines: clearance joints of stills, joints of films [pt]


@pytest.fixture(scope="module")
def anchored() -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Of each name in a still of the ring: its box, its joint, and the other clearance joints [pt]."""
    case = read_case(EXAMPLE)
    run = simulate(case.mechanism, until=0.25, samples=4)
    axes = structure(run, case.mechanism)[0]  # of four instants
    dot = axes.get_figure(root=True).dpi / 72.0
    names = [text for text in axes.texts if text.get_text()]
    places = np.array([axes.transData.transform(text.xy) for text in names]) / dot
    boxes = [text.get_window_extent() for text in names]
    return [
        (np.array([box.x0, box.y0]) / dot, np.array([box.x1, box.y1]) / dot, places[k], np.delete(places, k, axis=0))
        for k, box in enumerate(boxes)
    ]


def test_names_are_with_their_joints(anchored: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Contract: a name is nearest to its own joint, or has a leader to it that passes no other clearance joint."""
    assert len(anchored) == 3
    for low, high, place, others in anchored:
        near = np.clip(place, low, high)
        away = math.dist(near, place)
        if away > LEADER:
            steps = np.linspace(0.0, 1.0, 200)[:, None]
            points = place + steps * (near - place)
            assert np.linalg.norm(points[:, None] - others, axis=2).min() > RADIUS
        else:
            assert away < np.linalg.norm(np.clip(others, low, high) - others, axis=1).min()


def test_names_of_a_preview_are_on_no_line() -> None:
    """Contract: no name in the preview of the ring and of the slider that is driven periodically is upon a bar or a symbol."""
    for example in ("ring", "periodic"):
        axes = preview(read_case(EXAMPLE.with_name(f"{example}.toml")).mechanism)
        names = [text for text in axes.texts if text.get_text()]
        lines = [line for line in axes.lines if line.get_linewidth() > 0.5]  # leaders are thinner
        paths = [line.get_transform().transform_path(line.get_path()).interpolated(40).vertices for line in lines]
        points = np.concatenate(paths)
        for text in names:
            box = text.get_window_extent().padded(-1.5)
            assert not np.any(np.all((points > box.p0) & (points < box.p1), axis=1)), (example, text.get_text())


def test_names_keep_off_lines_joints_and_each_other() -> None:
    """Contract: in every frame of a crank that turns half a revolution, no name is on a joint, a bar, or another name."""
    angle = np.linspace(0.0, math.pi, 60)
    crank = 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    end = np.stack([crank[:, 0] + np.sqrt(0.25 - crank[:, 1] ** 2), 0.0 * angle], axis=1)
    fixed = np.zeros((60, 2))
    joints, names = np.stack([crank, end], axis=1), ["crank pin", "slider pin"]
    lines = [np.stack([fixed, crank], axis=1), np.stack([crank, end], axis=1)]
    every = asides(names, joints, lines, fixed[:, None], (np.array([-0.4, -0.3]), np.array([0.8, 0.4])), looks=60)
    half = 0.5 * np.array([[LETTER * len(name), LINE] for name in names])
    hidden = 0
    for frame, found in enumerate(every):
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
    assert hidden == 0
    assert np.all(np.linalg.norm(every, axis=2) < 60.0)
    jumps = (np.abs(np.diff(every, axis=0)) > 0.0).any(axis=2).sum(axis=0)
    assert np.all(jumps <= 3)


def test_names_of_a_crowd_stay_apart() -> None:
    """Contract: names of six joints on a line that a film draws two letters apart never cover each other."""
    names = [f"unit {k}/pivot" for k in range(2, 8)]
    high = np.linspace(0.1, 0.4, 24)[:, None] * np.arange(1, 7)
    joints = np.stack([0.0 * high, high], axis=2)
    region = np.array([-2.0, -0.5]), np.array([2.0, 9.5])
    half = 0.5 * np.array([LETTER * 12, LINE])
    for longer in (200.0, 340.0):
        every = asides(names, joints, [joints], np.empty((24, 0, 2)), region, longer=longer, looks=24)
        for places, found in zip(longer / 10.0 * joints, every, strict=True):
            apart = np.abs(places + found - (places + found)[:, None])
            assert not np.any(np.all(apart < 2.0 * half, axis=2) & ~np.eye(6, dtype=bool))


def test_few_instants_are_enough_for_what_stands_still() -> None:
    """Limit: in a film that does not move no name does, however many instants are looked at; no more than there are frames."""
    joints = np.tile([[[0.0, 0.0], [0.3, 0.1]]], (40, 1, 1))
    region = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    for looks, count in ((5, 5), (40, 40), (90, 40)):
        found = asides(["A", "B"], joints, [joints], np.empty((40, 0, 2)), region, looks=looks)
        assert found.shape == (count, 2, 2)
        assert np.all(found == found[0])


def test_rings_leave_room_between_joints() -> None:
    """Closed form: half of the distance of neighbours, at least the smallest and at most the largest; one place counts once."""
    line = np.stack([np.arange(5.0), np.zeros(5)], axis=1)
    assert ring_size(line[None], 10.0, 8.0) == 5.0
    assert abs(ring_size(np.concatenate([line, line + 1e-6])[None], 10.0, 8.0) - 5.0) < 1e-4
    assert ring_size(line[None], 1.0, 8.0) == 3.5
    assert ring_size(line[None], 100.0, 8.0) == ring_size(line[None, :1], 10.0, 8.0) == 8.0


def test_names_stay_with_their_joints_and_in_the_picture() -> None:
    """Contract: of three joints of an array that closes, each name is nearest to its own joint, and none is cut off."""
    gap = np.linspace(1.0, 0.25, 30)
    joints = np.stack([np.stack([k * gap, 0.0 * gap], axis=1) for k in range(3)], axis=1)
    region = np.array([-0.05, -0.5]), np.array([2.2, 0.5])
    every = asides(["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"], joints, [joints], np.empty((30, 0, 2)), region, looks=30)
    scale, half = REGION / 2.25, 0.5 * np.array([LETTER * 12, LINE])
    for places, found in zip(scale * joints, every, strict=True):
        for k in range(3):
            low, high = places[k] + found[k] - half, places[k] + found[k] + half
            away = np.linalg.norm(np.clip(places, low, high) - places, axis=1)
            assert np.argmin(away) == k
            assert np.all(low >= scale * region[0])


def test_no_names_need_no_place() -> None:
    """Limit: without a joint to name there is nothing to place."""
    assert asides([], np.empty((3, 0, 2)), [], np.empty((3, 0, 2)), (np.zeros(2), np.ones(2))).shape == (3, 0, 2)
