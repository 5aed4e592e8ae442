"""The time loops over the mechanics."""

from __future__ import annotations

from scissordyn.integrate import advance, time_stepping
from scissordyn.integrate.integration import Problem
from scissordyn.integrate.time_stepping import Jumps
from scissordyn.kernel import I1, entry
from scissordyn.mechanics.functions import FUNCTIONS
from scissordyn.mechanics.hard_functions import HARD_FUNCTIONS

MECHANICS = Problem(**FUNCTIONS)
HARD = Jumps(**HARD_FUNCTIONS)


@entry
def advance_systems(systems: I1, integrations: I1, most_steps: int, statuses: I1) -> None:
    """See `integrate.advance.advance_all`."""
    advance.advance_all(MECHANICS, systems, integrations, most_steps, statuses)


@entry
def advance_hard(systems: I1, hard: I1, touching: I1, integrations: I1, most_steps: int, statuses: I1) -> None:
    """See `integrate.time_stepping.advance_jumps`."""
    time_stepping.advance_jumps(MECHANICS, HARD, systems, hard, touching, integrations, most_steps, statuses)
