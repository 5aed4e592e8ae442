"""The run of the case as it was opened: begun before there is a page, and shown by the pages that come."""

from __future__ import annotations

import threading
from collections.abc import Callable

from scissordyn.explore.case import Case
from scissordyn.explore.worker import Outcome, Worker

__all__ = ["FirstRun"]


class FirstRun:
    """A run that begins at once, while the libraries of the page are loaded.

    The first page takes it over, with its progress and the right to stop it; later pages get its result, or run the case
    themselves while there is none.

    Parameters
    ----------
    case : Case
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        self.known: Outcome | None = None
        self._lock = threading.Lock()
        self._taker: tuple[Callable[[Outcome], None], Callable[[int, float], None]] | None = None
        self._worker = Worker(self._done, self._progress)
        self._worker.order(case)

    def adopt(self, done: Callable[[Outcome], None], progress: Callable[[int, float], None]) -> Worker | None:
        """Take the run over while it is going on.

        Parameters
        ----------
        done, progress : callable
            See `Worker`; they get all further outcomes of the worker too.

        Returns
        -------
        Worker or None
            None if the run has ended, or is another page's.
        """
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
            if self.known is None and outcome.number == 1 and whole:
                self.known = outcome
        if taker is None:
            self._worker.close()
        else:
            taker[0](outcome)

    def _progress(self, number: int, fraction: float) -> None:
        taker = self._taker
        if taker is not None:
            taker[1](number, fraction)
