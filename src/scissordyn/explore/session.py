"""State of one page: its case, input errors and undo history, and its runs in a background thread."""

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
    from scissordyn.explore.case import Case
    from scissordyn.record.results import Run
    from scissordyn.record.summary import Summary

log = logging.getLogger(__name__)


COARSE_TOL = 1e-5  # [-] relative and absolute tolerance of the coarse runs that precede accurate ones


@dataclass(eq=False)
class Outcome:
    """Result of one run; an order may have several runs, such as a coarse and an accurate one."""

    number: int
    case: Case
    run: Run | None  # None if the run failed to start, or if a newer order replaced it
    error: str = ""  # Reason why the run failed to start
    note: str = ""  # Kind of a preliminary run; "" for the accurate run
    # The same motion with additional samples at contacts, for curves and orbits. It is computed later, and the outcome is then
    # reported again.
    fine: Run | None = None

    @cached_property
    def summary(self) -> Summary:
        """Summary of the run."""
        from scissordyn.casefile.configuration import Configuration
        from scissordyn.record.summary import summary_of

        assert self.run is not None
        # the summary does not read the text of the configuration, which takes long to write
        return summary_of(self.run, Configuration("", self.case.mechanism, self.case.options))

    @property
    def has_curves(self) -> bool:
        """True for a run with several samples."""
        return self.run is not None and self.run.sizes["time"] > 1

    @property
    def curves(self) -> Run | None:
        """Run from which curves are drawn: `fine` if it is available, else `run`."""
        return self.run if self.fine is None else self.fine


class Worker:
    """Background thread that simulates the newest order: a case to run.

    `done` is called with the outcomes of an order unless a newer order has replaced it. Preliminary outcomes come first, with
    smaller numbers. The accurate one is reported again at the end, with fine curves if it has contacts. `progress` is called
    with the number of the order and the simulated fraction of its time. Numbers up to `earlier` are already used. The duration
    of a run is estimated after `estimate_seconds`; if it is longer than `long_run_seconds`, a coarse run precedes it.
    """

    def __init__(
        self,
        done: Callable[[Outcome], None],
        progress: Callable[[int, float], None],
        *,
        earlier: int = 0,
        estimate_seconds: float = 1.0,
        long_run_seconds: float = 5.0,
    ) -> None:
        self._done, self._progress = done, progress
        self.estimate_seconds, self.long_run_seconds = estimate_seconds, long_run_seconds
        self._changed = threading.Condition()
        self._order: tuple[int, Case, bool] | None = None
        self.number = earlier
        self._stopped = self._drawn = 0
        self._closed = False
        self._thread: threading.Thread | None = None

    def order(self, case: Case, *, staged: bool = False) -> int:
        """Order the run of a case, which replaces a waiting or current order; return the number of the order.

        A staged order begins with the ideal motion, and with a coarse run if the accurate one takes long. These outcomes have
        the two previous numbers.
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
        """Stop the current run; its result is the part already computed."""
        self._stopped = self.number

    def drawn(self, number: int) -> None:
        """Record that the browser has drawn a run, so that its fine curves can be computed."""
        with self._changed:
            self._drawn = number
            self._changed.notify()

    def close(self) -> None:
        """End the thread at the next progress check of a current run."""
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
            outcome.fine = self._fine(outcome)
            if outcome.has_curves and number == self.number and not self._closed:
                self._done(outcome)

    def _fine(self, outcome: Outcome) -> Run | None:
        """Return the run with samples at its contacts, for curves; None without contacts, or if a newer order exists."""
        picture = 0.5  # longest time that the computation waits for the browser's first picture of the run [s]
        from scissordyn.casefile.configuration import ATTRIBUTE, write_configuration
        from scissordyn.model.options import AUTO
        from scissordyn.record.deferred import Deferred
        from scissordyn.record.results import Results

        run = outcome.run
        if not isinstance(run, Results) or outcome.note or not run.sizes.get("contact", 0):
            return None
        with self._changed:  # wait, so that a drawing browser gets the processors
            self._changed.wait_for(lambda: self._closed or self._order is not None or self._drawn >= outcome.number, picture)
        if self._closed or outcome.number != self.number:
            return None
        try:
            fine = run.finer
        except Exception:  # the run is usable without fine curves
            log.exception("fine curves failed: the curves use the samples of the run")
            return None
        run.make_finer = None  # it holds the samples between which the finer ones are
        if fine is run:
            return None
        mechanism, options = outcome.case.mechanism, replace(outcome.case.options, samples=AUTO)
        fine.attrs[ATTRIBUTE] = Deferred(lambda: write_configuration(mechanism, options), threading.RLock())
        return fine

    def _stages(self, number: int, case: Case) -> Iterator[Outcome]:
        """Yield the outcomes of a staged order, the accurate one last."""
        preview = 2.0  # time limit for the motion with ideal joints; the part that is computed until then is shown [s]
        ideal = coarse_case(case)
        ideal.mechanism = case.mechanism.ideal()
        if ideal.mechanism != case.mechanism:
            spent = _stopwatch()
            early = self._outcome(number, ideal, lambda done: spent() > preview)
            if early.run is not None:
                yield replace(early, number=number - 2, note="ideal joints")
        spent_since, judged = _stopwatch(), list[bool]()

        def is_long(done: float) -> bool:
            spent = spent_since()
            if not judged and spent > self.estimate_seconds:
                judged.append(spent > self.long_run_seconds * done)
            return judged == [True]

        accurate = self._outcome(number, case, is_long if case.options.rtol < COARSE_TOL else None)
        if judged == [True]:
            coarse = self._outcome(number, coarse_case(case))
            if coarse.run is not None:
                note = f"coarse run, rtol {COARSE_TOL:.0e}".replace("e-0", "e-")
                yield replace(coarse, case=case, number=number - 1, note=note)
            accurate = self._outcome(number, case)
        yield accurate

    def _outcome(self, number: int, case: Case, ends: Callable[[float], bool] | None = None) -> Outcome:
        from scissordyn.run.simulate import compute_results  # imported in this thread, so that the page appears earlier

        def look(time: float) -> None:
            if self._closed or number != self.number or number <= self._stopped:
                raise KeyboardInterrupt  # interrupts the run between two steps
            if ends is not None and ends(time / case.options.until):
                raise KeyboardInterrupt
            self._progress(number, time / case.options.until)

        try:
            return Outcome(number, case, compute_results(case.mechanism, case.options.equally_spaced, look, curves=True))
        except ScissordynError as error:
            return Outcome(number, case, None, str(error))
        except KeyboardInterrupt:
            return Outcome(number, case, None, "stopped before the first step")
        except Exception as error:  # an internal error must not end the thread silently
            return Outcome(number, case, None, f"{type(error).__name__}: {error}")


def _stopwatch() -> Callable[[], float]:
    """Return a function that returns the seconds since its first call; a run calls it first after the assembly."""
    began: list[float] = []

    def spent() -> float:
        if not began:
            began.append(time.monotonic())
        return time.monotonic() - began[0]

    return spent


def coarse_case(case: Case) -> Case:
    """Return the case with a coarse tolerance and few samples, and without predictability horizon."""
    most_samples = 201  # largest number of samples of a coarse run
    options, shorter = case.options, copy.copy(case)
    samples = most_samples if isinstance(options.samples, str) else min(options.samples, most_samples)
    rtol, atol = max(options.rtol, COARSE_TOL), max(options.position_tolerance, COARSE_TOL)
    shorter.options = replace(options, rtol=rtol, atol=atol, samples=samples, trust=False)
    return shorter


class Session:
    """State of one page, without the communication with the browser.

    `updated` is called, also from another thread, with the part that has changed: "fields", "run", "fine" (the run has its fine
    curves, if it has contacts), "status" or "pins". `computed` is the run of the opened case, if another session has computed
    it. After a run that takes longer than `slow_run_seconds`, later runs are preceded by the ideal motion and a coarse run.
    """

    def __init__(
        self, case: Case, updated: Callable[[str], None], computed: Outcome | None = None, *, slow_run_seconds: float = 2.0
    ) -> None:
        self.slow_run_seconds = slow_run_seconds
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
        self._slow = True  # assumption before the first run
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
        """True while a run is in progress."""
        return self.fraction is not None

    def state(self) -> dict[str, Any]:
        """Return the contents of the status bar; "left" is the estimated remaining time of the current stage [s]."""
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
        """Return the time since the start of the current run [s]; 0 if no run is in progress."""
        return time.monotonic() - self._began if self.computing else 0.0

    def change(self, texts: dict[str, str], *, final: bool = True) -> bool:
        """Change fields and run again; return False if a text is invalid.

        Invalid texts are kept in `wrong` with their errors. Intermediate steps of a slider (`final=False`) count as one
        change for undo.
        """
        before = self.case
        written = {key: field.text for key, field in before.fields.items()}
        try:
            # a slider sends its last text again when it is released
            new = before if all(written.get(key) == text for key, text in texts.items()) else before.changed(texts)
        except ScissordynError as error:
            if not (wrong := written.keys() & texts):
                raise
            self.wrong |= {key: (texts[key], _field_error(error)) for key in wrong}
            self.updated("fields")
            return False
        for key in texts:
            self.wrong.pop(key, None)
        self.case, self._base = new, self._base or before
        if final:
            if _is_changed(self._base, new):
                self._remember(self._base)
            self._base = None
        if _is_changed(before, new):
            self._compute()
        self.updated("fields")  # before the run has finished
        return True

    def open(self, case: Case) -> None:
        """Switch to another case; the user can undo this change."""
        self._remember(self.case)
        self._go(case)

    def undo(self, *, again: bool = False) -> None:
        """Undo the last change, or redo it with `again`."""
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
        most_undo = 200  # largest number of changes that can be undone
        self._undo = [*self._undo[1 - most_undo :], case]
        self._redo.clear()

    def _compute(self) -> None:
        """Order the run of the present case, in stages if runs take long."""
        self._slow |= self._lasting() > self.slow_run_seconds
        self.fraction, self.message = 0.0, ""
        self._began = self._stage = self._reported = time.monotonic()
        self.worker.order(self.case, staged=self._slow)
        self.updated("status")

    def pin(self, *more: Outcome) -> None:
        """Pin a run for comparison; if there are too many, unpin the oldest; without a run, unpin all."""
        most_pins = 3  # largest number of pinned runs
        self.pins = [*self.pins, *more][-most_pins:] if more else []
        self.updated("pins")

    def _progress(self, number: int, fraction: float) -> None:
        interval = 0.2  # time between progress reports of a run [s]
        now = time.monotonic()
        if fraction < (self.fraction or 0.0):
            self._stage = now  # next of several stages
        self.fraction = fraction
        if now - self._reported > interval:
            self._reported = now
            self.updated("status")

    def _take(self, outcome: Outcome) -> None:
        run = outcome.run
        if outcome is self.good:  # the outcome is reported again at the end
            self.updated("fine")
            return
        if not outcome.note:
            self._slow, self.fraction = self._lasting() > self.slow_run_seconds, None
            # an interrupted run is not a complete run of the case
            if self.first is None and outcome.case is self.opened and (run is None or run.attrs["status"] != "interrupted"):
                self.first = outcome
            self.message = (
                outcome.error if run is None else "" if run.attrs["status"] == "complete" else str(run.attrs["cause"])
            )
        if outcome.has_curves:
            self.good = outcome
            self.updated("run")
        elif run is not None and not outcome.note:
            self.message += "; it ended before its second sample: the previous run is kept"
        self.updated("status")


def _is_changed(case: Case, other: Case) -> bool:
    return case.mechanism != other.mechanism or case.options != other.options


def _field_error(error: ScissordynError) -> str:
    """Return the text of an error without file, line and key, for display at its form field."""
    if not isinstance(error, InputError):
        return str(error)
    what = getattr(error, "text", "") or error.what
    return str(InputError(what, error.expected, error.example))
