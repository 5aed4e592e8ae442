"""The arrays of an integration: going on, beginning anew, and stores that are full."""

import numpy as np
from motions import OSCILLATOR, solve_problem

from scissordyn.integrate.advance import ADVANCING, FINISHED, LOG_FULL, RECORD_FULL
from scissordyn.integrate.integration import NO_EVENT, make_state, reset_state


def test_full_stores_lose_nothing(name):
    """Contract: where the log or the record is full the run stops before a step, with all that was found so far."""
    options = {"levels": (0.3,), "rtol": 1e-7, "atol": 1e-7}
    whole = solve_problem(name, OSCILLATOR, (0.0, 1.0), 40.0, **options)
    assert whole.status == FINISHED
    short = solve_problem(name, OSCILLATOR, (0.0, 1.0), 40.0, log_rows=9, **options)
    assert short.status == LOG_FULL
    assert 4 <= len(short.log) <= 9
    assert np.array_equal(short.log, whole.log[: len(short.log)])
    recorded = solve_problem(name, OSCILLATOR, (0.0, 1.0), 40.0, record_rows=11, **options)
    assert recorded.status == RECORD_FULL
    assert np.array_equal(recorded.ends, whole.ends[:11])
    few = solve_problem(name, OSCILLATOR, (0.0, 1.0), 40.0, most_steps=5, **options)
    assert few.status == ADVANCING


def test_begin_anew():
    """Contract: after `reset_state` nothing of an earlier run is left but the problem's own arrays."""
    mode = np.array([1, 0])
    state = make_state(
        np.array([1.0, 2.0]), mode=mode, memory=np.ones(2), mass=np.ones(2), reference=np.zeros(0), quadratures=1, monitors=2,
        band=np.array([0.5, np.inf]),
    )  # fmt: skip
    for part in (state.y, state.total, state.monitored, state.peak):
        part[:] = 7.0
    state.band[:, 1:] = 3.0
    state.clock["time"], state.counts["steps"] = 4.0, 9
    reset_state(state, np.array([3.0, 4.0]), crosses=True)
    assert np.array_equal(state.y, [3.0, 4.0])
    assert not np.any(state.total) and not np.any(state.monitored) and not np.any(state.peak)  # noqa: PT018
    assert np.array_equal(state.band[:, 0], [0.5, np.inf])
    assert np.all(np.isnan(state.band[:, 1:]))
    assert state.clock["time"][0] == 0.0
    assert state.counts["steps"][0] == 0
    assert state.clock["last_event"][0] == NO_EVENT
    assert (state.clock["crosses"][0], state.clock["monitors"][0]) == (1, 1)
    assert (state.clock["longest"][0], state.clock["reach"][0]) == (np.inf, np.inf)
    assert np.array_equal(mode, [1, 0])
