"""Runs in the background, one at a time: a newer one takes the place of one that is still going on."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scissordyn.errors import ScissordynError

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case

__all__ = ["Outcome", "Worker"]


@dataclass(frozen=True)
class Outcome:
    """What became of a run.

    Parameters
    ----------
    number : int
        Of the order.
    case : Case
    run : Dataset or None
        None if it could not begin, or if a newer order took its place.
    error : str
        Why it could not begin.
    """

    number: int
    case: Case
    run: xr.Dataset | None
    error: str = ""


class Worker:
    """A thread that simulates the newest order.

    Parameters
    ----------
    done : callable
        Called in the thread with the `Outcome` of each order that no newer one has replaced.
    progress : callable
        Called in the thread with the number of the order and the simulated part of its time, 0 to 1.
    earlier : int
        Number of the last order elsewhere; those of this one are larger.
    """

    def __init__(self, done: Callable[[Outcome], None], progress: Callable[[int, float], None], *, earlier: int = 0) -> None:
        self._done, self._progress = done, progress
        self._changed = threading.Condition()
        self._order: tuple[int, Case] | None = None
        self._number = earlier
        self._stopped = 0
        self._closed = False
        self._thread: threading.Thread | None = None

    @property
    def number(self) -> int:
        """Of the last order."""
        return self._number

    def order(self, case: Case) -> int:
        """Run a case in place of anything that is waiting or going on; returns the number of the order."""
        with self._changed:
            self._number += 1
            self._order = self._number, case
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="scissordyn explore", daemon=True)
                self._thread.start()
            self._changed.notify()
            return self._number

    def stop(self) -> None:
        """Stop the present run; what it has computed so far is its result."""
        with self._changed:
            self._stopped = self._number

    def close(self) -> None:
        """End the thread, at the next look at it of a run that is going on."""
        with self._changed:
            self._closed = True
            self._order = None
            self._changed.notify()

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._order is None and not self._closed:
                    self._changed.wait()
                if self._closed or self._order is None:
                    return
                number, case = self._order
                self._order = None
            outcome = self._outcome(number, case)
            if number == self._number and not self._closed:
                self._done(outcome)

    def _outcome(self, number: int, case: Case) -> Outcome:
        from scissordyn.run.simulate import simulate  # in this thread: the page comes first

        options = case.options
        keywords = {name: getattr(options, name) for name in options.__dataclass_fields__}

        def look(time: float) -> None:
            if self._closed or number != self._number or number <= self._stopped:
                raise KeyboardInterrupt  # what a run takes as the wish to end between two steps
            self._progress(number, time / options.until)

        try:
            return Outcome(number, case, simulate(case.mechanism, **keywords, progress=look))
        except ScissordynError as error:
            return Outcome(number, case, None, str(error))
        except KeyboardInterrupt:
            return Outcome(number, case, None, "stopped before the first step")
        except Exception as error:  # a fault of the program must not end the thread silently
            return Outcome(number, case, None, f"{type(error).__name__}: {error}")
