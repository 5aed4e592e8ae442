"""History of recorded signals, against closed forms."""

import math

import numpy as np
import pytest
from course import polynomials, run, waves

from scissordyn.integrate import advance as loop
from scissordyn.integrate.history import CHEBYSHEV_NODES, make_history, up_to_multiple


def looked_back(row, signal, t):
    """Return a signal at an instant inside the step of a row, by its series in s from -1 to 1."""
    s = 2.0 * (t - row[0]) / row[1] - 1.0
    first = 2 + signal * CHEBYSHEV_NODES.size
    return float(np.polynomial.Polynomial(row[first : first + CHEBYSHEV_NODES.size])(s))


def test_recorded_signals(name):
    """Closed form: a polynomial of degree seven and a constant are looked back at exactly, at any instant of any step."""
    seventh = np.polynomial.Polynomial((0.3, -1.0, 0.5, 2.0, -1.0, 0.7, 0.2, -0.9))
    found = run(name, 1.0, signals=polynomials(tuple(seventh.coef), (2.5,)), delays=(0.3,), step=0.21, first=0.21)
    rows = found.state.history[: found.state.history_length[0]]
    assert rows[0, 0] == 0.0
    assert rows[:-1, 0] + rows[:-1, 1] == pytest.approx(rows[1:, 0], abs=1e-15)
    assert rows[-1, 0] + rows[-1, 1] == pytest.approx(1.0, abs=1e-15)
    for row in rows:
        for part in (0.0, 0.17, 0.5, 0.93, 1.0):
            t = row[0] + part * row[1]
            assert looked_back(row, 0, t) == pytest.approx(seventh(t), abs=2e-13)
            assert looked_back(row, 1, t) == pytest.approx(2.5, abs=2e-13)


def test_error_of_a_recorded_wave():
    """Order of convergence: through eight Chebyshev points the error of a wave falls as the step to the eighth power."""
    errors = []
    for step in (0.02, 0.01):
        found = run("dop853", 0.04, signals=polynomials(waves(1.0)), delays=(10.0,), step=step, first=step)
        rows = found.state.history[: found.state.history_length[0]]
        places = [(row, row[0] + part * row[1]) for row in rows for part in np.linspace(0.0, 1.0, 21)]
        errors.append(max(abs(looked_back(row, 0, t) - math.sin(40.0 * t)) for row, t in places))
    assert abs(math.log2(errors[0] / errors[1]) - 8.0) < 0.2


def test_steps_end_on_multiples_of_delays(name):
    """Identity: every multiple of every delay is the end of a step, to round-off, and no step is longer than a delay."""
    found = run(name, 2.0, signals=polynomials((1.0,)), delays=(0.3, 0.47), first=0.05)
    ends = found.ends
    for delay in (0.3, 0.47):
        for multiple in delay * np.arange(1, int(2.0 / delay) + 1):
            assert np.min(np.abs(ends - multiple)) < 1e-12
    assert np.max(np.diff(np.concatenate([[0.0], ends]))) <= 0.3 * (1.0 + 1e-9)


def test_up_to_a_multiple():
    """Closed form: the rest of the way to the next multiple; from a multiple, or a rounding before it, a whole delay."""
    delays = np.array([0.25])
    assert up_to_multiple(0.1, 1.0, delays) == pytest.approx(0.15)
    assert up_to_multiple(0.1, 0.1, delays) == 0.1
    assert up_to_multiple(0.5, 1.0, delays) == pytest.approx(0.25)
    assert up_to_multiple(0.75 - 1e-16, 1.0, delays) == pytest.approx(0.25)
    assert up_to_multiple(0.1, 1.0, np.array([0.25, 0.12])) == pytest.approx(0.02)
    assert up_to_multiple(0.1, 1.0, np.zeros(0)) == 1.0


def test_room_for_history():
    """Limit: a history that is full stops the loop before anything is lost, with the status that asks for room."""
    found = run("dopri5", 1.0, signals=polynomials((1.0,)), delays=(0.1,), first=0.05, history=4)
    assert found.status == loop.HISTORY_FULL
    assert int(found.state.history_length[0]) == 4
    assert make_history(3, 7).shape == (7, 2 + 3 * CHEBYSHEV_NODES.size)
