"""Ctrl-C and SIGTERM: the first ends a command in good order, after the present slice of steps; the second ends it at once."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_received: list[int] = []


def install() -> None:
    """Take signals from now on; on the main thread of a process that is a command."""
    for number in SIGNALS:
        signal.signal(number, _interrupt)


def received() -> int:
    """The first signal that came, 0 if none has."""
    return _received[0] if _received else 0


def _interrupt(number: int, _: FrameType | None) -> None:
    """Raise KeyboardInterrupt; the operating system acts on a second signal by itself."""
    _received.append(number)
    sys.unraisablehook = _raise_again
    for other in SIGNALS:
        signal.signal(other, signal.SIG_DFL)
    if os.isatty(2):  # a progress bar hides the cursor of the terminal
        os.write(2, b"\x1b[?25h")
    raise KeyboardInterrupt


def _raise_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Raise an interrupt again that Python has dropped, as in the callback of a weak reference."""
    main = threading.main_thread()
    if issubclass(unraisable.exc_type, KeyboardInterrupt) and threading.current_thread() is main:
        # not at once: what is raised while this function runs would be dropped as well
        target = ctypes.c_ulong(main.ident or 0), ctypes.py_object(KeyboardInterrupt)
        threading.Timer(0.02, ctypes.pythonapi.PyThreadState_SetAsyncExc, target).start()
