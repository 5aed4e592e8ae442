"""What a driver of a mechanism with hard contacts has beside its integration, and the loop that advances it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.integrate.time_stepping import Touching
from scissordyn.kernel import Handle
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.mechanics.hard_rows import HardContacts
from scissordyn.plan.hard_contact import hard_contacts, put_hard_numbers
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.loop import advance_hard

if TYPE_CHECKING:
    from scissordyn.run.advance.driver import Driver

KEPT = ("mode", "stuck", "slope", "stick", "ahead", "counts", "pressed", "overlap", "longest", "struck")
"""What the next step depends on, and what has been counted."""


class Stepping:
    """The hard contacts of a driver, and the size of its steps."""

    def __init__(self, plan: Plan, size: float, turn: tuple[float, float], *, located: bool) -> None:
        self.plan = plan
        self.hard = Handle(hard_contacts(plan))
        content: HardContacts = self.hard.content
        content.locate[0] = int(located)
        self.touching = Handle(
            Touching(
                content.which[content.compliant == 0],
                content.result,
                content.impact,
                content.locate,
                content.ahead,
                content.work,
                np.array([size]),
                content.ending,
                content.longest,
                np.array(turn),
                (np.arange(plan.model.guard_component.size) >= len(plan.contacts)).astype(np.int64),
                np.array([plan.model.n if plan.model.nb else 0], np.int64),
            )
        )

    @property
    def content(self) -> HardContacts:
        """Live arrays."""
        found: HardContacts = self.hard.content
        return found

    @property
    def size(self) -> float:
        """Of a step [s]."""
        return float(self.touching.content.size[0])

    def restart(self, plan: Plan, size: float, turn: tuple[float, float]) -> None:
        """Begin another case of the same tables."""
        self.plan = plan
        put_hard_numbers(self.content, plan)
        self.touching.content.size[0], self.touching.content.turn[:] = size, turn

    def forget(self) -> None:
        """Begin anew from a state that was put back."""
        for name in ("mode", "stuck", "slope", "pressed", "struck"):
            getattr(self.content, name)[:] = 0
        self.content.ahead[:] = -np.inf, np.inf
        self.content.longest[:] = np.inf

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays that the way onwards depends on."""
        return {f"hard.{name}": getattr(self.content, name) for name in KEPT}

    def statistics(self, time: float) -> dict[str, Any]:
        """The step, the counters, and the part of the time for which each joint has stuck."""
        names = [contact.name for contact in self.plan.contacts]
        which = self.content.which.tolist()
        stuck = zip(which, self.content.stick.tolist(), strict=True)
        sticking = {names[j]: lasting / time for j, lasting in stuck if lasting > 0.0}
        deep = {names[j]: beyond for j, beyond in zip(which, self.content.overlap.tolist(), strict=True) if beyond > 0.0}
        found = {"step": self.size, "impacts_located": bool(self.content.locate[0]), **self.counted()}
        return {**found, "sticking": sticking, "overlap": deep}

    def counted(self) -> dict[str, int]:
        """Counters of the solver of impulses by name."""
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


def advance_stepping(drivers: Sequence[Driver], steppings: Sequence[Stepping], most_steps: int) -> list[int]:
    """Advance some drivers one after another."""
    statuses = np.zeros(len(drivers), np.int64)
    systems = np.array([driver.system.address for driver in drivers], np.int64)
    integrations = np.array([driver.integration.address for driver in drivers], np.int64)
    hard = np.array([each.hard.address for each in steppings], np.int64)
    touching = np.array([each.touching.address for each in steppings], np.int64)
    advance_hard(systems, hard, touching, integrations, most_steps, statuses)
    found: list[int] = statuses.tolist()
    return found
