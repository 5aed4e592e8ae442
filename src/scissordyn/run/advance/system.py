"""The arrays that the time loop works on: of a system, of its hard contacts, and of what is logged, by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.integrate import advance, time_stepping
from scissordyn.integrate.integration import Problem
from scissordyn.integrate.time_stepping import Jumps, Touching
from scissordyn.kernel import I1, Handle, entry
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.mechanics.functions import FUNCTIONS, HARD_FUNCTIONS
from scissordyn.mechanics.hard_rows import HardContacts
from scissordyn.plan.hard_contact import HARD_COUNTED, HARD_STATE, hard_contacts, put_hard_numbers
from scissordyn.plan.plan import Plan

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


class Stepping:
    """The hard contacts of a driver, and the size of its steps."""

    def __init__(self, plan: Plan) -> None:
        self.hard = Handle(hard_contacts(plan))
        content: HardContacts = self.hard.content
        self.touching = Handle(
            Touching(
                content.which[content.compliant == 0],
                content.result,
                content.impact,
                content.locate,
                content.ahead,
                content.work,
                np.zeros(1),
                content.ending,
                content.longest,
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
        """Of a step [s]."""
        return float(self.touching.content.size[0])

    def begin(self, plan: Plan, size: float, turn: tuple[float, float], *, located: bool) -> None:
        """Begin a case of the same tables, with steps of a size [s] or shorter ones where bodies turn by more than `turn`."""
        self.plan = plan
        put_hard_numbers(self.content, plan)
        self.content.locate[0] = int(located)
        self.touching.content.size[0], self.touching.content.turn[:] = size, turn

    def forget(self) -> None:
        """Begin anew from a state that was put back."""
        for name, start in HARD_STATE.items():
            getattr(self.content, name)[:] = start

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays that the way onwards depends on, and what has been counted, by name; live."""
        return {f"hard.{name}": getattr(self.content, name) for name in (*HARD_STATE, *HARD_COUNTED)}

    def statistics(self, time: float) -> dict[str, Any]:
        """The step, the counters, and the part of the time for which each joint has stuck."""
        names = [contact.name for contact in self.plan.contacts]
        which = self.content.which.tolist()
        stuck, overlap = (zip(which, part.tolist(), strict=True) for part in (self.content.stick, self.content.overlap))
        return {
            "step": self.size,
            "impacts_located": bool(self.content.locate[0]),
            **self.counted(),
            "sticking": {names[j]: lasting / time for j, lasting in stuck if lasting > 0.0},
            "overlap": {names[j]: depth for j, depth in overlap if depth > 0.0},
        }

    def counted(self) -> dict[str, int]:
        counts = self.content.counts
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
