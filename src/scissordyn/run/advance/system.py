"""Arrays of the time loop: those of a system, of its hard contacts and of the log, by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.integrate import advance, time_stepping
from scissordyn.integrate.integration import Problem
from scissordyn.integrate.time_stepping import Jumps, Touching
from scissordyn.kernel import I1, Handle, entry
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.mechanics.functions import FUNCTIONS, HARD_FUNCTIONS
from scissordyn.mechanics.hard_rows import HardContacts, HardState
from scissordyn.plan.hard_contact import HARD_START, hard_contacts, put_hard_numbers
from scissordyn.plan.plan import Plan

MECHANICS = Problem(**FUNCTIONS)  # functions of the mechanics that the time loop calls
HARD = Jumps(**HARD_FUNCTIONS)  # functions of hard contacts that the time loop calls

CARRIED_FIELDS = [name for name in HardState._fields if name not in ("stick", "counts", "overlap")]
"""Names of the fields of `HardState` on which the next step depends; other fields count since the start of the run."""


@entry
def advance_systems(systems: I1, hard: I1, touching: I1, integrations: I1, most_steps: int, statuses: I1) -> None:
    """Advance systems one after another without Python; `hard` is 0 for a system without hard contacts."""
    for k in range(systems.size):
        if hard[k] == 0:
            statuses[k] = advance.advance(MECHANICS, systems[k], integrations[k], most_steps)
        else:
            statuses[k] = time_stepping.advance(MECHANICS, HARD, systems[k], hard[k], touching[k], integrations[k], most_steps)


class Stepping:
    """Hard contacts of a driver, and the size of its steps."""

    def __init__(self, plan: Plan) -> None:
        self.hard = Handle(hard_contacts(plan))
        content: HardContacts = self.hard.content
        self.touching = Handle(
            Touching(
                content.model.which[content.model.compliant == 0],
                content.work.result,
                content.work.impact,
                content.parameters.locate,
                content.state.ahead,
                content.work.drive_work,
                np.zeros(1),
                content.work.ending,
                content.state.longest,
                np.zeros(2),
                (np.arange(plan.model.guard_component.size) >= len(plan.contacts)).astype(np.int64),
                np.array([plan.model.n if plan.model.nb else 0], np.int64),
            )
        )

    @property
    def content(self) -> HardContacts:
        content: HardContacts = self.hard.content
        return content

    @property
    def size(self) -> float:
        """Step size [s]."""
        return float(self.touching.content.size[0])

    def begin(self, plan: Plan, size: float, turn: tuple[float, float], *, located: bool) -> None:
        """Begin a case whose mechanism has the same tables.

        `size` is the step size [s]. Steps are shorter if bodies rotate too far in them; `turn` has the limits (`Choice.turn`).
        """
        self.plan = plan
        put_hard_numbers(self.content, plan)
        self.content.parameters.locate[0] = int(located)
        self.touching.content.size[0], self.touching.content.turn[:] = size, turn

    def forget(self) -> None:
        """Reset the fields that the next step depends on, after the integrator's state was replaced; counts continue."""
        for name in CARRIED_FIELDS:
            getattr(self.content.state, name)[:] = HARD_START[name]

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the live arrays of the state, by name."""
        return {f"hard.{name}": array for name, array in self.content.state._asdict().items()}

    def statistics(self, time: float) -> dict[str, Any]:
        """Return the step size, the solver's counters, and sticking fraction and largest overlap of each hard contact."""
        names = [contact.name for contact in self.plan.contacts]
        which, state = self.content.model.which.tolist(), self.content.state
        stuck, overlap = (zip(which, part.tolist(), strict=True) for part in (state.stick, state.overlap))
        return {
            "step": self.size,
            "impacts_located": bool(self.content.parameters.locate[0]),
            **self.counters(),
            "sticking": {names[j]: lasting / time for j, lasting in stuck if lasting > 0.0},
            "overlap": {names[j]: depth for j, depth in overlap if depth > 0.0},
        }

    def counters(self) -> dict[str, int]:
        counts = self.content.state.counts
        names = {
            "contact_steps": solver.IMPULSIVE,
            "factorizations": solver.FACTORIZATIONS,
            "most_factorizations_in_a_step": solver.MOST_IN_A_STEP,
            "steps_solved_by_pivoting": solver.PIVOTED,
            "pivots": solver.PIVOTS,
            "steps_not_solved": solver.UNSOLVED,
            "over_determined_steps": solver.DEPENDENT,
        }
        return {name: int(counts[place]) for name, place in names.items()}
