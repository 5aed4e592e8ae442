"""The time loop over the mechanics."""

from __future__ import annotations

from scissordyn.integrate import advance, time_stepping
from scissordyn.integrate.integration import Problem
from scissordyn.integrate.time_stepping import Jumps
from scissordyn.kernel import I1, entry
from scissordyn.mechanics.functions import FUNCTIONS, HARD_FUNCTIONS

MECHANICS = Problem(**FUNCTIONS)
HARD = Jumps(**HARD_FUNCTIONS)


@entry
def advance_systems(systems: I1, hard: I1, touching: I1, integrations: I1, most_steps: int, statuses: I1) -> None:
    """Advance systems one after another, without Python in between; `hard` is 0 for one without hard contacts."""
    for k in range(systems.size):
        if hard[k] == 0:
            statuses[k] = advance.advance(MECHANICS, systems[k], integrations[k], most_steps)
        else:
            statuses[k] = time_stepping.advance(MECHANICS, HARD, systems[k], hard[k], touching[k], integrations[k], most_steps)
