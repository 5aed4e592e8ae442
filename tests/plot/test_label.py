"""Names in a drawing that stands still."""

import math
from pathlib import Path

import numpy as np
import pytest

from scissordyn.config.file import read_case
from scissordyn.plot.label import LEADER
from scissordyn.plot.preview import preview
from scissordyn.plot.still import structure
from scissordyn.run.simulate import simulate

RING = Path(__file__).parents[2] / "examples" / "ring.toml"

RADIUS = 4.1  # Of the circle about a clearance joint, with its line [pt]


@pytest.fixture(scope="module")
def anchored() -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Of each name in a still of the ring: its box, its joint, and the other clearance joints [pt]."""
    case = read_case(RING)
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
        axes = preview(read_case(RING.with_name(f"{example}.toml")).mechanism)
        names = [text for text in axes.texts if text.get_text()]
        lines = [line for line in axes.lines if line.get_linewidth() > 0.5]  # leaders are thinner
        paths = [line.get_transform().transform_path(line.get_path()).interpolated(40).vertices for line in lines]
        points = np.concatenate(paths)
        for text in names:
            box = text.get_window_extent().padded(-1.5)
            assert not np.any(np.all((points > box.p0) & (points < box.p1), axis=1)), (example, text.get_text())
