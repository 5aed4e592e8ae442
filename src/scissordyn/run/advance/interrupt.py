"""Ctrl-C inside a part of a larger computation."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

_STOP: ContextVar[threading.Event | None] = ContextVar("_STOP", default=None)
"""Python tells the main thread alone of Ctrl-C; what other threads look at instead."""


@contextmanager
def stopped_by(event: threading.Event) -> Iterator[None]:
    """Interrupt the runs of this thread once an event is set, as Ctrl-C interrupts those of the main thread."""
    token = _STOP.set(event)
    try:
        yield
    finally:
        _STOP.reset(token)


def look() -> None:
    """Raise `KeyboardInterrupt` if this thread is to stop."""
    event = _STOP.get()
    if event is not None and event.is_set():
        raise KeyboardInterrupt


def pass_on(part: xr.Dataset) -> xr.Dataset:
    """Raise `KeyboardInterrupt` again if a run was interrupted that is only a part of what was asked for.

    A run that is interrupted returns what it has. Where that is of no use by itself, the whole computation has to end.
    """
    if part.attrs["status"] == "interrupted":
        raise KeyboardInterrupt
    return part
