"""The largest force of a run, and whether it belongs to the start."""

from __future__ import annotations

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.run.answer.joint_force import FALLS, force_after_start, joint_summaries
from scissordyn.run.answer.summary import summary_of
from scissordyn.run.configuration import read_configuration

GRAVITY, CLEARANCE = 9.81, 1e-4


@pytest.mark.parametrize("contact", ["compliant", "hard"])
def test_a_journal_that_falls_through_its_clearance(contact: str) -> None:
    """Closed form: the fall takes sqrt(2 c/g); twenty times later the force is the weight, unless the run begins at rest."""
    gap = sd.Clearance(CLEARANCE, damping=sd.Flores(0.5), contact=contact)
    ball = sd.Body("ball", 2.0, None, {"c": (0.0, 0.0)})
    pin = sd.Revolute("pin", ("ball", "c"), ("ground", "o"), gap)
    hung = sd.Mechanism((ball,), joints=(pin,), ground=(("o", (0.0, 0.0)),))
    run = sd.simulate(hung, until=0.5, samples=2001)
    answer = summary_of(run).force
    assert answer is not None
    assert answer.start is not None
    assert answer.after is not None
    assert answer.start == pytest.approx(FALLS * np.sqrt(2.0 * CLEARANCE / GRAVITY), rel=1e-6)
    assert answer.when < 2.0 * np.sqrt(2.0 * CLEARANCE / GRAVITY)
    assert answer.after == pytest.approx(2.0 * GRAVITY, rel=1e-2)
    assert "belongs to the start" in str(answer)
    assert read_configuration(run).options is not None
    assert force_after_start(run, "static", joint_summaries(run)[0]) is None
    short = summary_of(sd.simulate(hung, until=0.5 * answer.start, samples=101)).force
    assert short is not None
    assert short.after is None


def test_a_load_that_is_largest_in_the_start_explains_the_force() -> None:
    """Limit: where the load that journals fall under fades within the start, the force is no matter of the start alone."""
    ball = sd.Body("ball", 2.0, None, {"c": (0.0, 0.0)})
    pin = sd.Revolute("pin", ("ball", "c"), ("ground", "o"), sd.Clearance(CLEARANCE, damping=sd.Flores(0.5)))
    pull = sd.Force("pull", ("ball", "c"), (0.0, -20.0), time_function=sd.Cycloidal(1.0, 0.1, 0.08))
    hung = sd.Mechanism((ball,), joints=(pin,), ground=(("o", (0.0, 0.0)),), gravity=0.0, components=(pull,))
    answer = summary_of(sd.simulate(hung, until=0.5, samples=2001)).force
    assert answer is not None
    assert answer.when < FALLS * np.sqrt(2.0 * CLEARANCE * 2.0 / 20.0)
    assert answer.start is None
