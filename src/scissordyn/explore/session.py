"""The state of one page: its case, what is wrong with its numbers, undo, the last good run, pinned runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.worker import Outcome, Worker

if TYPE_CHECKING:
    from scissordyn.explore.case import Case

MOST_PINS = 3  # Runs that can be compared at the same time

MOST_UNDO = 200

SLOW = 2.0  # After a run that takes longer than this, the next is preceded by the ideal motion and a coarse run [s]
LOOK = 0.2  # How often the progress of a run is reported [s]


class Session:
    """The state of one page; it knows nothing of browsers.

    `updated` is called, also from a thread, with what has changed: "fields", "run", "fine" (its curves), "status", "pins".
    `computed` is the run of the case as it was opened, where it has been computed for another session.
    """

    def __init__(self, case: Case, updated: Callable[[str], None], computed: Outcome | None = None) -> None:
        self.opened = self.case = case
        self.updated = updated
        self._undo: list[Case] = []
        self._redo: list[Case] = []
        self.errors: dict[str, str] = {}
        self.typed: dict[str, str] = {}
        self.pins: list[Outcome] = []
        self.good: Outcome | None = None
        self.first: Outcome | None = computed
        self.message = ""
        self.fraction: float | None = None
        self._began = self._stage = self._told = 0.0
        self._slow = False
        self._base: Case | None = None
        if computed is None and case.saved is not None:
            computed = Outcome(1, case, case.saved)
        self.worker = Worker(self._take, self._progress, earlier=0 if computed is None else computed.number)
        if computed is None:
            self._order(staged=True)
        else:
            self._take(replace(computed, fine=None))
            if computed.fine is not None:
                self._take(computed)

    @property
    def computing(self) -> bool:
        """Whether a run is going on."""
        return self.fraction is not None

    def state(self) -> dict[str, Any]:
        """What the bar shows; "left" is how much longer the present stage takes if it goes on like this [s]."""
        stage = time.monotonic() - self._stage
        return {
            "undo": bool(self._undo),
            "redo": bool(self._redo),
            "horizon": self.case.options.trust,
            "computing": self.computing,
            "ordered": self.worker.number,
            "fraction": self.fraction or 0.0,
            "lasting": self._lasting(),
            "left": stage * (1.0 - self.fraction) / self.fraction if self.fraction else None,
            "name": self.case.name,
            "text": "" if self.computing else self.message,
        }

    def _lasting(self) -> float:
        """For how long the present run has been going on [s]; 0 without one."""
        return time.monotonic() - self._began if self.computing else 0.0

    def change(self, texts: dict[str, str], *, final: bool = True) -> bool:
        """Change numbers and run again; what is wrong with them is kept in `errors`. Whether they could be used.

        Steps of a slider on its way, which are not final, are one change for undo.
        """
        before = self.case
        written = {field.key: field.text for field in before.fields}
        try:
            # a slider that is released says once more what it said last
            new = before if all(written.get(key) == text for key, text in texts.items()) else before.changed(texts)
        except ScissordynError as error:
            if not (wrong := written.keys() & texts):
                raise
            for key in wrong:
                self.errors[key], self.typed[key] = _beside_field(error), texts[key]
            self.updated("fields")
            return False
        for key in texts:
            self.errors.pop(key, None)
            self.typed.pop(key, None)
        self.case, self._base = new, self._base or before
        if final:
            if _differ(self._base, new):
                self._remember(self._base)
            self._base = None
        if _differ(before, new):
            self._compute()
        self.updated("fields")  # while the run is going on
        return True

    def open(self, case: Case) -> None:
        """Go to another case; it is a change that can be taken back."""
        self._remember(self.case)
        self._go(case)

    def undo(self, *, again: bool = False) -> None:
        """Take the last change back, or make it again."""
        cases, others = (self._redo, self._undo) if again else (self._undo, self._redo)
        if cases:
            others.append(self.case)
            self._go(cases.pop())

    def _go(self, case: Case) -> None:
        self.case = case
        self.errors.clear()
        self.typed.clear()
        self._compute()
        self.updated("fields")

    def _remember(self, case: Case) -> None:
        self._undo = [*self._undo[1 - MOST_UNDO :], case]
        self._redo.clear()

    def _compute(self) -> None:
        """Run the present case, in stages if runs take long; a run that is going on ends."""
        self._slow |= self._lasting() > SLOW
        self._order(staged=self._slow)

    def _order(self, *, staged: bool) -> None:
        self.fraction, self.message = 0.0, ""
        self._began = self._stage = self._told = time.monotonic()
        self.worker.order(self.case, staged=staged)
        self.updated("status")

    def pin(self, *more: Outcome) -> None:
        """Keep a run for comparison, the oldest goes if there are too many; without one, forget all."""
        self.pins = [*self.pins, *more][-MOST_PINS:] if more else []
        self.updated("pins")

    def _progress(self, number: int, fraction: float) -> None:
        now = time.monotonic()
        if fraction < (self.fraction or 0.0):
            self._stage = now  # the next of several stages
        self.fraction = fraction
        if now - self._told > LOOK:
            self._told = now
            self.updated("status")

    def _take(self, outcome: Outcome) -> None:
        run = outcome.run
        if outcome.fine is not None:
            if self.first is not None and self.first.number == outcome.number:
                self.first.fine = outcome.fine
            if self.good is not None and self.good.number == outcome.number:
                self.good.fine = outcome.fine
                self.updated("fine")
            return
        if outcome.note:
            if run is not None and run.sizes["time"] > 1 and (self.good is None or self.good.number < outcome.number):
                self._show(outcome)
            return
        self._slow, self.fraction = self._lasting() > SLOW, None
        # what somebody has stopped is not the run of the case
        if self.first is None and outcome.case is self.opened and (run is None or run.attrs["status"] != "interrupted"):
            self.first = outcome
        if run is None:
            self.message = outcome.error
        else:
            self.message = "" if run.attrs["status"] == "complete" else str(run.attrs["cause"])
            if run.sizes["time"] < 2:
                self.message += "; it ended before its second sample: the run before stays"
            else:
                self._show(outcome)
        self.updated("status")

    def _show(self, outcome: Outcome) -> None:
        self.good = outcome
        self.updated("run")


def _differ(one: Case, other: Case) -> bool:
    return one.mechanism != other.mechanism or one.options != other.options


def _beside_field(error: ScissordynError) -> str:
    """An error beside the field that it is about: without the place in the file, with what is allowed and what to type."""
    if not isinstance(error, InputError):
        return str(error)
    what = getattr(error, "text", "") or error.what
    parts = [what, f"allowed: {error.allowed}" if error.allowed else "", f"type: {error.type_this}" if error.type_this else ""]
    return "; ".join(filter(None, parts))
