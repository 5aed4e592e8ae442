"""The state of one page: its case, what is wrong with its numbers, undo, and its runs, one at a time in the background."""

from __future__ import annotations

import copy
import logging
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, ScissordynError

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case
    from scissordyn.record.results import Results
    from scissordyn.record.summary import Summary

log = logging.getLogger(__name__)

MOST_PINS = 3  # Runs that can be compared at the same time

MOST_UNDO = 200

SLOW = 2.0  # After a run that takes longer than this, the next is preceded by the ideal motion and a coarse run [s]
LOOK = 0.2  # How often the progress of a run is reported [s]
COARSE, COARSE_SAMPLES = 1e-5, 201  # Tolerances of a coarse run, and its most samples
PREVIEW = 2.0  # Longest time that the motion with ideal joints may take [s]; what it has reached by then is shown
PICTURE = 0.5  # Longest time that the finer curves of a run wait for its first picture [s]

JUDGED, LONG = 1.0, 5.0
"""When the length of an accurate run is estimated; a longer one than the second is preceded by a coarse one [s]."""


@dataclass(eq=False)
class Outcome:
    """What became of the run of an order."""

    number: int
    case: Case
    run: xr.Dataset | None  # None if it could not begin, or if a newer order took its place
    error: str = ""  # Why it could not begin
    note: str = ""  # What it is, if it precedes the run of the order
    # The same motion with the instants of the contacts among its samples, for curves and orbits: the run is reported once
    # more when it has been computed
    fine: xr.Dataset | None = None
    results: Results | None = None  # What `run` was made of

    @cached_property
    def summary(self) -> Summary:
        """What the run answers."""
        from scissordyn.casefile.configuration import ATTRIBUTE, Configuration
        from scissordyn.record.summary import summary_of

        assert self.run is not None
        configuration = Configuration(self.run.attrs[ATTRIBUTE], self.case.mechanism, self.case.options)
        return summary_of(self.results or self.run, configuration)

    @property
    def curves(self) -> xr.Dataset | None:
        """The run as its curves are drawn: with the instants of its contacts, when they have come."""
        return self.run if self.fine is None else self.fine


class Worker:
    """A thread that simulates the newest order.

    `done` gets the outcome of each order that no newer one has replaced, and those that precede it, with smaller numbers;
    `progress` the number of the order and the simulated part of its time. Orders before were numbered up to `earlier`.
    """

    def __init__(self, done: Callable[[Outcome], None], progress: Callable[[int, float], None], *, earlier: int = 0) -> None:
        self._done, self._progress = done, progress
        self._changed = threading.Condition()
        self._order: tuple[int, Case, bool] | None = None
        self.number = earlier
        self._stopped = self._drawn = 0
        self._closed = False
        self._thread: threading.Thread | None = None

    def order(self, case: Case, *, staged: bool = False) -> int:
        """Run a case in place of anything that is waiting or going on; the number of the order.

        A staged order begins with the motion with ideal joints, and a coarse run if the accurate one takes long; their numbers
        are the two before.
        """
        with self._changed:
            self.number += 3 if staged else 1
            self._order = self.number, case, staged
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="scissordyn explore", daemon=True)
                self._thread.start()
            self._changed.notify()
            return self.number

    def stop(self) -> None:
        """Stop the present run; what it has computed so far is its result."""
        self._stopped = self.number

    def drawn(self, number: int) -> None:
        """The browser shows a run: its finer curves can be computed."""
        with self._changed:
            self._drawn = number
            self._changed.notify()

    def close(self) -> None:
        """End the thread, at the next look at it of a run that is going on."""
        with self._changed:
            self._closed, self._order = True, None
            self._changed.notify()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._order is not None)
                if self._closed or self._order is None:
                    return
                (number, case, staged), self._order = self._order, None
            for outcome in self._stages(number, case) if staged else [self._outcome(number, case)]:
                if number == self.number and not self._closed:
                    self._done(outcome)
            outcome.fine, outcome.results = self._fine(outcome), None
            if outcome.fine is not None and number == self.number and not self._closed:
                self._done(outcome)

    def _fine(self, outcome: Outcome) -> xr.Dataset | None:
        """A run with the instants of its contacts, for curves; None if it has none, or another one is wanted."""
        from scissordyn.casefile.configuration import write_configuration
        from scissordyn.model.options import AUTO

        run, results = outcome.run, outcome.results
        if run is None or results is None or outcome.note or not run.sizes.get("contact", 0):
            return None
        with self._changed:  # a browser that draws has the processors for itself
            self._changed.wait_for(lambda: self._closed or self._order is not None or self._drawn >= outcome.number, PICTURE)
        if self._closed or outcome.number != self.number:
            return None
        try:
            fine = results.finer
        except Exception:  # the run is there without it
            log.exception("curves go through the samples of the run")
            return None
        if fine is results:
            return None
        configuration = write_configuration(outcome.case.mechanism, replace(outcome.case.options, samples=AUTO))
        return fine.dataset().assign_attrs(configuration=configuration)

    def _stages(self, number: int, case: Case) -> Iterator[Outcome]:
        """The runs of a staged order, the accurate one last."""
        ideal = brief(case)
        ideal.mechanism = case.mechanism.ideal()
        if ideal.mechanism != case.mechanism:
            spent = _stopwatch()
            early = self._outcome(number, ideal, lambda done: spent() > PREVIEW)
            if early.run is not None:
                yield replace(early, number=number - 2, note="ideal joints")
        spent_since, judged = _stopwatch(), list[bool]()

        def is_long(done: float) -> bool:
            spent = spent_since()
            if not judged and spent > JUDGED:
                judged.append(spent > LONG * done)
            return judged == [True]

        accurate = self._outcome(number, case, is_long if case.options.rtol < COARSE else None)
        if judged == [True]:
            coarse = self._outcome(number, brief(case))
            if coarse.run is not None:
                yield replace(coarse, case=case, number=number - 1, note=f"coarse run, rtol {COARSE:.0e}".replace("e-0", "e-"))
            accurate = self._outcome(number, case)
        yield accurate

    def _outcome(self, number: int, case: Case, ends: Callable[[float], bool] | None = None) -> Outcome:
        from scissordyn.run.simulate import results_of  # in the thread that needs it: the page comes first

        def look(time: float) -> None:
            if self._closed or number != self.number or number <= self._stopped:
                raise KeyboardInterrupt  # what a run takes as the wish to end between two steps
            if ends is not None and ends(time / case.options.until):
                raise KeyboardInterrupt
            self._progress(number, time / case.options.until)

        try:
            results = results_of(case.mechanism, case.options.equally_spaced, look, curves=True)
            return Outcome(number, case, results.dataset(), results=results)
        except ScissordynError as error:
            return Outcome(number, case, None, str(error))
        except KeyboardInterrupt:
            return Outcome(number, case, None, "stopped before the first step")
        except Exception as error:  # a fault of the program must not end the thread silently
            return Outcome(number, case, None, f"{type(error).__name__}: {error}")


def _stopwatch() -> Callable[[], float]:
    """Seconds since the first call, which is after the mechanism has been assembled."""
    began: list[float] = []

    def spent() -> float:
        if not began:
            began.append(time.monotonic())
        return time.monotonic() - began[0]

    return spent


def brief(case: Case) -> Case:
    """The case with a coarse tolerance and few samples, and without the predictability horizon."""
    options, shorter = case.options, copy.copy(case)
    samples = COARSE_SAMPLES if isinstance(options.samples, str) else min(options.samples, COARSE_SAMPLES)
    rtol, atol = max(options.rtol, COARSE), max(options.atol, COARSE)
    shorter.options = replace(options, rtol=rtol, atol=atol, samples=samples, trust=False)
    return shorter


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
        self.wrong: dict[str, tuple[str, str]] = {}
        self.pins: list[Outcome] = []
        self.good: Outcome | None = None
        self.first: Outcome | None = computed
        self.message = ""
        self.fraction: float | None = None
        self._began = self._stage = self._reported = 0.0
        self._slow = True  # As far as is known before the first run
        self._base: Case | None = None
        if computed is None and case.saved is not None:
            computed = Outcome(1, case, case.saved)
        self.worker = Worker(self._take, self._progress, earlier=0 if computed is None else computed.number)
        if computed is None:
            self._compute()
        else:
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
        """Change numbers and run again; wrong ones are kept in `wrong`, as typed and why. Whether they could be used.

        Steps of a slider on its way, which are not final, are one change for undo.
        """
        before = self.case
        written = {key: field.text for key, field in before.fields.items()}
        try:
            # a slider that is released says once more what it said last
            new = before if all(written.get(key) == text for key, text in texts.items()) else before.changed(texts)
        except ScissordynError as error:
            if not (wrong := written.keys() & texts):
                raise
            self.wrong |= {key: (texts[key], _beside_field(error)) for key in wrong}
            self.updated("fields")
            return False
        for key in texts:
            self.wrong.pop(key, None)
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
        self.wrong.clear()
        self._compute()
        self.updated("fields")

    def _remember(self, case: Case) -> None:
        self._undo = [*self._undo[1 - MOST_UNDO :], case]
        self._redo.clear()

    def _compute(self) -> None:
        """Run the present case, in stages if runs take long; a run that is going on ends."""
        self._slow |= self._lasting() > SLOW
        self.fraction, self.message = 0.0, ""
        self._began = self._stage = self._reported = time.monotonic()
        self.worker.order(self.case, staged=self._slow)
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
        if now - self._reported > LOOK:
            self._reported = now
            self.updated("status")

    def _take(self, outcome: Outcome) -> None:
        run = outcome.run
        if outcome is self.good:  # once more, with its finer curves
            self.updated("fine")
            return
        if not outcome.note:
            self._slow, self.fraction = self._lasting() > SLOW, None
            # what somebody has stopped is not the run of the case
            if self.first is None and outcome.case is self.opened and (run is None or run.attrs["status"] != "interrupted"):
                self.first = outcome
            self.message = (
                outcome.error if run is None else "" if run.attrs["status"] == "complete" else str(run.attrs["cause"])
            )
        if run is not None and run.sizes["time"] > 1:
            self.good = outcome
            self.updated("run")
        elif run is not None and not outcome.note:
            self.message += "; it ended before its second sample: the run before stays"
        self.updated("status")


def _differ(one: Case, other: Case) -> bool:
    return one.mechanism != other.mechanism or one.options != other.options


def _beside_field(error: ScissordynError) -> str:
    """An error beside the field that it is about: without the place in the file, with what is allowed and what to type."""
    if not isinstance(error, InputError):
        return str(error)
    what = getattr(error, "text", "") or error.what
    parts = [what, f"allowed: {error.allowed}" if error.allowed else "", f"type: {error.type_this}" if error.type_this else ""]
    return "; ".join(filter(None, parts))
