"""Hard contact against the event-driven solution of the comparison of engines."""

import numpy as np
import pytest
from validation.engines.compare import _with_kept
from validation.engines.convergence import CLEARANCE, JOURNAL, START, energy, ours
from validation.engines.exact_pin import Pin, motion


@pytest.fixture(scope="module")
def exact():
    """Return the pendulum with friction and its exact state after 0.5 s."""
    pin = Pin(CLEARANCE, JOURNAL + CLEARANCE, 0.7, 0.2)
    states, impacts = motion(pin, np.array([0.5]), np.array(START))
    assert impacts > 20  # an infinite sequence of impacts, up to the speed of rest
    return pin, states[-1]


def test_located_events_converge_to_the_exact_motion_with_order_two(exact):
    """Order of convergence: a pendulum on a pin in a hole, against its event-driven solution."""
    pin, state = exact
    errors = [abs(ours(pin, step, "located")[0][-1, 2] - state[2]) for step in (1e-3, 1e-4, 1e-5)]
    assert errors[2] < 2e-8
    assert np.log10(errors[0] / errors[2]) / 2.0 == pytest.approx(2.0, abs=0.2)


def test_crossed_events_converge_to_another_motion(exact):
    """Limit: closed contacts that yield leave a difference that shorter steps do not remove."""
    pin, state = exact
    ends = [ours(pin, step, "crossed")[0][-1, 2] for step in (1e-5, 5e-6)]
    assert abs(ends[1] - ends[0]) < 0.2 * abs(ends[1] - state[2]) < 1e-6


def test_contact_without_loss_keeps_the_energy():
    """Closed form: with restitution 1 and without friction the energy stays zero while 4.9 J fall."""
    pin = Pin(CLEARANCE, JOURNAL + CLEARANCE, 1.0)
    assert np.abs(energy(pin, ours(pin, 1e-4, "located")[0])).max() < 1e-6
    states, _ = motion(pin, np.linspace(0.0, 0.2, 5)[1:], np.array(START))
    assert np.abs(energy(pin, states)).max() < 1e-12


def test_rows_of_named_engines_replace_those_of_the_page():
    """Contract: rows of engines that are not run again stay, and each row is there once."""
    names = ("slider-crank", "scissor array", "parallelogram", "pin in a hole")
    before = _with_kept({name: [] for name in names})
    fresh = [["drake", setting, "1", "2", "3", "4", ""] for setting in ("default", "careful")]
    after = _with_kept({name: [*fresh] for name in names})
    for name in names:
        assert [row[:2] for row in after[name]] == [row[:2] for row in before[name]]
        assert [row for row in after[name] if row[0] == "drake"] == fresh
        assert [row for row in after[name] if row[0] != "drake"] == [row for row in before[name] if row[0] != "drake"]
