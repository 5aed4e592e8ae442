"""Ctrl-C in threads and in parts of a larger computation."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from scissordyn.record.results import Run

AnyRun = TypeVar("AnyRun", bound=Run)

_STOP: ContextVar[threading.Event | None] = ContextVar("_STOP", default=None)
"""Event that ends the runs of the current thread; Python delivers Ctrl-C to the main thread only."""


@contextmanager
def interrupted_by(event: threading.Event) -> Iterator[None]:
    """Interrupt the runs of this thread once an event is set, as Ctrl-C interrupts those of the main thread."""
    token = _STOP.set(event)
    try:
        yield
    finally:
        _STOP.reset(token)


def check_interrupt() -> None:
    """Raise `KeyboardInterrupt` if this thread must stop."""
    event = _STOP.get()
    if event is not None and event.is_set():
        raise KeyboardInterrupt


def raise_if_interrupted(part: AnyRun) -> AnyRun:
    """Raise `KeyboardInterrupt` if a partial run was interrupted; else return the run.

    An interrupted run returns what it has. If that is useless by itself, the whole computation must end.
    """
    if part.attrs["status"] == "interrupted":
        raise KeyboardInterrupt
    return part
