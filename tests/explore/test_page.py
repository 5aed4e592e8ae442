"""Messages that a page gets and sends, in order, without a browser."""

import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.explore.case import open_case
from scissordyn.explore.drag import assembled
from scissordyn.plot.canvas import declared_positions
from scissordyn.record.results import values_at

from .heard import Heard, until

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))  # Case files of all examples
GUESSED = {"four_bar": 0.2, "lift": 1e-4, "press": 1e-6}
"""[m] Error of the declared positions of bodies, in examples that declare only approximate ones."""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_declared_position_is_the_assembled_one(path):
    """Cross-check: bodies of every example are drawn where the solver assembles them, but where the case declares a guess."""
    mechanism = open_case(path).mechanism
    first = declared_positions(mechanism.ideal())
    solved, _ = assembled(mechanism)
    found, wanted = (values_at(run, "position", "time", "body", "axis", body=first["body"].values) for run in (first, solved))
    apart = found[0] - wanted[0]
    assert np.abs(apart).max() < GUESSED.get(path.stem, 1e-12)


@pytest.fixture
def heard(case):
    """Yield a page of a case with two clearance joints."""
    heard = Heard(case)
    yield heard
    heard.page.close()


def test_page_begins_with_the_numbers_and_ends_with_the_run(heard):
    """Contract: the numbers come first, then runs with rising numbers."""
    run = heard.until_run(0)
    kinds = [message["type"] for message in heard.messages]
    assert kinds[0] == "form"
    numbers = [message["run"] for message in heard.of("run")]
    assert numbers == sorted(numbers)
    assert {"figures", "orbit", "scene", "table", "cards", "bar", "until"} <= set(run)
    time_axis = run["figures"][0]["lines"][0]["x"]
    assert time_axis[-1] == pytest.approx(run["until"])


def test_next_run_waits_until_one_is_drawn(heard):
    """Contract: a page that has not drawn a run gets no other; of many changes it then gets the last."""
    first = heard.until_run(0)["run"]
    heard.blind = True
    for speed in range(100, 120, 4):
        heard.say("change", key="drive.speed", text=f"{speed} rpm")
        time.sleep(0.25)
    sent = {run["run"] for run in heard.of("run") if run["run"] > first}
    assert len(sent) == 1
    heard.blind = False
    last = heard.until_run(max(sent))
    assert heard.page.session.case.field("drive.speed").text == "116 rpm"
    assert last["run"] == heard.page.session.worker.number


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("{", "unknown message"),
        ('{"type": "close"}', "unknown message"),
        ('{"type": "change", "key": 1}', "'key' in a message is not a printable text"),
        ('{"type": "change", "key": "nothing", "text": "1"}', "the case has no field 'nothing'"),
        ('{"type": "magnify", "factor": -1}', "magnification of deflections"),
        ('{"type": "drag", "phase": "start", "kind": "pin", "name": "O"}', "no length or angle of the case moves joint 'O'"),
        ('{"type": "film", "time": 1e999}', "'time' in a message is not a number"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(heard, message, words):
    """Bad input: one line each, and the page goes on."""
    heard.until_run(0)
    heard.page.hear(message)
    complaints = [said["text"] for said in heard.of("said")]
    assert len(complaints) == 1
    assert words in complaints[0]
    assert "\n" not in complaints[0]


def test_long_run_says_how_long_it_will_take_and_is_stopped(heard):
    """Contract: the time that is left is in proportion to the part that is not done; a stopped run is shown as far as it is."""
    first = heard.until_run(0)["run"]
    heard.messages.clear()
    heard.say("change", key="run.until", text="60 s")
    until(lambda: any(state["lasting"] > 1.0 for state in heard.of("state")))
    heard.say("stop")
    state = next(state for state in heard.of("state") if state["lasting"] > 1.0)
    assert state["computing"]
    assert 0.0 < state["fraction"] < 1.0
    assert state["left"] == pytest.approx(state["lasting"] * (1.0 / state["fraction"] - 1.0), rel=0.05)
    assert heard.until_run(first)["until"] > 0.0
    shown = heard.page.session.good
    assert shown is not None
    assert shown.run is not None
    assert shown.run.attrs["status"] == "interrupted"
