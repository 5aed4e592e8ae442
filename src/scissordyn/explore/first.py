"""The case as it was opened and its run: begun before there is a page, and shown by the pages that come."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from scissordyn.errors import ScissordynError
from scissordyn.explore.worker import Outcome, Worker, is_refined

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case


class FirstRun:
    """A case that is read, and a run that begins at once, while pages are on their way to the browser; a saved run is there.

    The first page takes the run over, with its progress and the right to stop it; later pages get its result, or run the case
    themselves while there is none.
    """

    def __init__(self, opened: Callable[[], Case]) -> None:
        self._opened = opened
        self.case: Case | None = None
        self.error: ScissordynError | None = None
        self.known: Outcome | None = None
        self.preview: Outcome | None = None
        self.fine: xr.Dataset | None = None
        self._lock = threading.Lock()
        self._waiting: list[Callable[[], None]] = []
        self._taker: tuple[Callable[[Outcome], None], Callable[[int, float], None]] | None = None
        self._worker = Worker(self._done, self._progress)

    def begin(self) -> None:
        """Read the case and order its run."""
        self.read()
        self.order()

    def order(self) -> None:
        """Order the run of the case, unless it is saved or could not be read, or a page has ordered another one."""
        if self.case is not None and self.case.saved is None and self._worker.number == 0:
            self._worker.order(self.case, staged=True)

    def read(self) -> None:
        """Read the case; one that cannot be read is the `error`."""
        try:
            case = self._opened()
        except ScissordynError as error:
            self.error = error
        else:
            if case.saved is not None:
                self.known = Outcome(1, case, case.saved)
        with self._lock:
            if self.error is None:
                self.case = case
            waiting, self._waiting = self._waiting, []
        for told in waiting:
            told()

    def when_read(self, told: Callable[[], None]) -> None:
        """Have something done once there is a case or an error: now, or later in another thread."""
        with self._lock:
            if self.case is None and self.error is None:
                self._waiting.append(told)
                return
        told()

    def adopt(self, done: Callable[[Outcome], None], progress: Callable[[int, float], None]) -> Worker | None:
        """Take the run over while it is going on."""
        with self._lock:
            if self.known is not None or self._taker is not None:
                return None
            self._taker = done, progress
            return self._worker

    def _done(self, outcome: Outcome) -> None:
        with self._lock:
            taker = self._taker
            # what a page has stopped is not the run of the case
            whole = taker is None if outcome.run is None else outcome.run.attrs["status"] != "interrupted"
            if taker is None and outcome.note:
                self.preview = outcome
                return
            if outcome.fine is not None and self.known is not None and self.known.number == outcome.number:
                self.fine = outcome.fine
            if self.known is None and outcome.case is self.case and not outcome.note and whole:
                self.known = outcome
        if taker is None:
            if outcome.fine is not None or not is_refined(outcome):
                self._worker.close()
        else:
            taker[0](outcome)

    def _progress(self, number: int, fraction: float) -> None:
        taker = self._taker
        if taker is not None:
            taker[1](number, fraction)
