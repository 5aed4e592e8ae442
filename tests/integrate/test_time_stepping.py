"""Steps of time stepping that are shortened, with a substitute for the mechanics."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scissordyn.integrate.time_stepping import AS_DEEP, IN_ANY_CASE, STEP, TOO_LONG, step_and_events
from scissordyn.tolerance import EVENT_TOL


class ForcedError(Exception):
    """End of a test: the step was made in any case."""


@pytest.mark.parametrize("size", [1e-3, 30.0])
def test_step_that_no_law_accepts(size):
    """Closed form: a step is halved up to 1/64 of its size, then made with any indentation, and below 1e-9 in any case."""
    tried = []
    nothing = np.zeros(0)
    clock = SimpleNamespace(time=0.0, end=math.inf, longest=math.inf, monitors=0)
    counts = SimpleNamespace(samples=0, rejected=0)
    state = SimpleNamespace(clock=[clock], counts=[counts], mode=nothing, y=np.zeros(1))
    work = SimpleNamespace(delays=nothing, saved_mode=nothing, new=np.zeros(1))
    contacts = SimpleNamespace(
        which=nothing, size=[size], longest=[math.inf], ahead=[0.0, math.inf], impact=np.zeros(2, np.int64)
    )
    samples = SimpleNamespace(samples=SimpleNamespace(time=nothing))

    def step(t, h, *_):
        tried.append((int(contacts.impact[1]), h / size))
        if contacts.impact[1] == IN_ANY_CASE:
            raise ForcedError
        contacts.impact[1] = TOO_LONG

    with pytest.raises(ForcedError):
        step_and_events(None, SimpleNamespace(step=step), 0.0, state, work, None, None, contacts, samples)
    fractions = 0.5 ** np.arange(len(tried))
    np.testing.assert_allclose([fraction for _, fraction in tried], fractions, rtol=1e-12)
    expected = np.where(fractions > 1.0 / 64.0, STEP, np.where(fractions > EVENT_TOL, AS_DEEP, IN_ANY_CASE))
    np.testing.assert_array_equal([request for request, _ in tried], expected)
    assert counts.rejected == len(tried) - 1 == math.ceil(math.log2(1.0 / EVENT_TOL))
