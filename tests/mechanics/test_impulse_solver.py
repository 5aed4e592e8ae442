"""Impulses of hard contacts: which solutions of the eliminated equations are accepted."""

from types import SimpleNamespace

import numpy as np
import pytest

from scissordyn.mechanics.hard_rows import OPEN, SLIP, STICK
from scissordyn.mechanics.impulse_solver import accurate


@pytest.mark.parametrize("where", [0, 1, 2])
@pytest.mark.parametrize(
    ("closed", "mode", "equations"),
    [(1, STICK, (0, 1, 2)), (1, SLIP, (0, 1)), (1, OPEN, (0,)), (0, STICK, (0,))],
    ids=["stick", "slip", "open", "not closed"],
)
def test_violated_equations_of_a_contact(closed, mode, equations, where):
    """Identity: constraint, U_N + compliance P_N + offset and U_T vanish where they hold; one that does not is found."""
    impulse = np.array([2.0, 3.0, -1.0])
    compliance, offset = 0.25, 0.5
    velocity = np.array([0.0, -compliance * impulse[1] - offset, 0.0])
    contacts = SimpleNamespace(
        model=SimpleNamespace(reach=[0], place=np.arange(3), which=np.zeros(1, np.int64)),
        state=SimpleNamespace(mode=[mode]),
        work=SimpleNamespace(
            free=np.ones(3), gram=np.ones((3, 1)), impulse=impulse, velocity=velocity, closed=[closed],
            compliance=[compliance], offset=[offset],
        ),
    )  # fmt: skip
    assert accurate(1, contacts)
    velocity[where] += 1e-3
    assert bool(accurate(1, contacts)) == (where not in equations)
