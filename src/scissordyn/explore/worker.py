"""Runs in the background, one at a time: a newer one takes the place of one that is still going on."""

from __future__ import annotations

import copy
import logging
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scissordyn.errors import ScissordynError

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case
    from scissordyn.run.results import Results

log = logging.getLogger(__name__)

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
        from scissordyn.run.configuration import write_configuration

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
        configuration = write_configuration(outcome.case.mechanism, outcome.case.options)
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
