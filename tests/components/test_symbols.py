"""Positions of the symbols of components: each port places its strokes in a scene of two bodies."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scissordyn.components.port import ACTUATOR, FRAME, HINGE, LINE, POINT, TRAVEL

SIZE = 0.2  # [m] size of a symbol
PLACES = {"tip": (3.0, 1.0), "foot": (1.0, -1.0), "pin": (2.0, 0.5)}  # [m] positions of the points that symbols join, by name
ARM_ANGLE = 0.4  # [rad] angle of the body that carries a symbol


class Scene:
    """Two samples: the second is the first, moved by one along y."""

    size = SIZE

    def place(self, reference):
        """Return a named point."""
        return np.array(PLACES[reference[1]]) + np.array([[0.0, 0.0], [0.0, 1.0]])

    def angle(self, body):
        """Return the angle of the arm or of the ground."""
        return np.full(2, ARM_ANGLE if body == "arm" else 0.0)

    def pivot(self, body, base):
        """Return the pin as pivot, with symbols 1.5 times as large."""
        return self.place((body, "pin")), 1.5

    def force(self, component):
        """Return a force upwards, half as large as the largest of the run."""
        return np.array([[0.0, 0.5], [0.0, 0.5]])


def drawn(port, symbol, **fields):
    """Return strokes and anchor of a component with these fields."""
    component = SimpleNamespace(declaration=SimpleNamespace(symbol=symbol), **fields)
    return port.drawn(component, port.symbols[symbol], Scene())


def rotation(angle):
    """Return the matrix of a counter-clockwise rotation."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


@pytest.mark.parametrize("symbol", LINE.symbols)
def test_strokes_on_a_line_lie_between_its_ends(symbol):
    """Closed form: the place on the line is the part of the distance, aside of it and along it in sizes."""
    strokes, anchor = drawn(LINE, symbol, start=("a", "foot"), end=("b", "tip"))
    start, end = np.array(PLACES["foot"]), np.array(PLACES["tip"])
    along = (end - start) / np.linalg.norm(end - start)
    across = rotation(0.5 * math.pi) @ along
    for given, placed in zip(LINE.symbols[symbol], strokes, strict=True):
        for sample in range(2):
            local = placed[sample] - start - (0.0, sample)
            part = given[:, 0] * np.linalg.norm(end - start)
            np.testing.assert_allclose(local @ along, part + SIZE * given[:, 1], atol=1e-12)
            np.testing.assert_allclose(local @ across, SIZE * given[:, 2], atol=1e-12)
    np.testing.assert_allclose(anchor[0], 0.5 * (start + end))


def test_a_line_without_length_is_drawn_at_its_point():
    """Limit: both ends at one point have no direction, and no symbol is a NaN."""
    strokes, _ = drawn(LINE, "rod", start=("a", "tip"), end=("b", "tip"))
    np.testing.assert_allclose(strokes[0][0], [PLACES["tip"]] * 2)


@pytest.mark.parametrize(("port", "symbol"), [(port, name) for port in (HINGE, ACTUATOR) for name in port.symbols])
def test_what_is_at_a_hinge_turns_with_its_body_but_a_motor_stays_upright(port, symbol):
    """Closed form: a rotation about the pivot, enlarged."""
    strokes, anchor = drawn(port, symbol, body="arm", base="ground")
    turn = rotation(0.0 if symbol == "motor" else ARM_ANGLE)
    np.testing.assert_allclose(anchor[0], PLACES["pin"])
    for given, placed in zip(port.symbols[symbol], strokes, strict=True):
        np.testing.assert_allclose(placed[0], PLACES["pin"] + 1.5 * SIZE * given @ turn.T, atol=1e-12)
        np.testing.assert_allclose(placed[1] - placed[0], np.broadcast_to([0.0, 1.0], given.shape), atol=1e-12)


def test_a_stop_of_travel_is_drawn_at_its_limit_and_a_spring_of_travel_at_its_point():
    """Closed form: the foot of the point on the line that the limit draws across the direction."""
    direction, limit = math.radians(30.0), 1.7
    along, across = rotation(direction).T
    _, where = drawn(TRAVEL, "stop", point=("a", "tip"), direction=direction, limit=limit)
    assert where[0] @ along == pytest.approx(limit)
    assert where[0] @ across == pytest.approx(np.array(PLACES["tip"]) @ across)
    strokes, where = drawn(TRAVEL, "travel", point=("a", "tip"), direction=direction, limit=limit)
    np.testing.assert_allclose(where[0], PLACES["tip"])
    np.testing.assert_allclose(strokes[0][0], PLACES["tip"] + SIZE * np.outer([-1.5, 1.5], along), atol=1e-12)


def test_a_frame_has_a_line_to_its_end():
    """Closed form: its symbol turns with the body of the start; the line joins both points."""
    strokes, anchor = drawn(FRAME, "frame", start=("arm", "foot"), end=("b", "tip"))
    np.testing.assert_allclose(anchor[0], PLACES["foot"])
    square = FRAME.symbols["frame"][0]
    np.testing.assert_allclose(strokes[0][0], PLACES["foot"] + SIZE * square @ rotation(ARM_ANGLE).T, atol=1e-12)
    np.testing.assert_allclose(strokes[-1][0], [PLACES["foot"], PLACES["tip"]])


def test_an_arrow_ends_at_its_point():
    """Closed form: as long as its force's part of three sizes, its head symmetric about the shaft."""
    (shaft, head), tail = drawn(POINT, "arrow", point=("a", "tip"))
    np.testing.assert_allclose(shaft[0], [[3.0, 1.0 - 1.5 * SIZE], PLACES["tip"]])
    np.testing.assert_allclose(tail[0], shaft[0][0])
    np.testing.assert_allclose(head[0, [0, 2]].mean(axis=0), [3.0, 1.0 - 0.3 * 1.5 * SIZE])
    np.testing.assert_allclose(np.abs(head[0, [0, 2], 0] - 3.0), 0.12 * 1.5 * SIZE)
