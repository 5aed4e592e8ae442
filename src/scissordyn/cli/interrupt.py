"""Ctrl-C and SIGTERM: the first ends a command in good order and soon, the second at once.

Python looks at signals between two of its instructions, on the main thread: a compiler pass or a slice of a simulation has to
end first, and what a callback from C or of a weak reference raises is lost. So a thread beside it gets every signal from the
operating system, raises again what was lost, and ends the process if nothing else has.
"""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

from scissordyn.run.interrupt import advances

__all__ = ["install", "received", "tell_where"]

SIGNALS = (signal.SIGINT, signal.SIGTERM)

PATIENCE = 1.3
"""Seconds after which a command is ended that does not end by itself: two, less what a compiler pass may delay this."""

LONGEST = 60.0
"""Seconds for which a command may go on that is writing down what it has computed."""

_received: list[int] = []
_delivered = threading.Event()
_lost = threading.Event()
_where: list[Callable[[], str] | str] = [""]


def install() -> None:
    """Watch for signals until the process ends; on the main thread of a process that is a command."""
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(ours, theirs), name="signals", daemon=True).start()
    for number in SIGNALS:
        signal.signal(number, _interrupt)


def received() -> int:
    """The first signal that came, 0 if none has."""
    return _received[0] if _received else 0


def tell_where(text: str | Callable[[], str]) -> None:
    """Say what an interrupted command leaves, should it be ended before it can say so itself.

    Parameters
    ----------
    text : str, or function that returns it
        Follows "interrupted; ".
    """
    _where[0] = text


def _interrupt(number: int, _: FrameType | None) -> None:
    """The first signal becomes a KeyboardInterrupt; from now on the operating system acts on a second one by itself."""
    if not _received:
        _received.append(number)
    for other in SIGNALS:
        signal.signal(other, signal.SIG_DFL)
    sys.unraisablehook = _notice
    _delivered.set()
    _show_cursor()
    raise KeyboardInterrupt


def _notice(unraisable: sys.UnraisableHookArgs) -> None:
    """Notice that the interrupt was lost; of other errors of what is half made and cannot be deleted nobody need know."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt) and threading.current_thread() is threading.main_thread():
        _lost.set()


def _raise_again() -> None:
    """Raise the interrupt in the main thread, between two of its instructions; the operating system keeps the signals."""
    main = ctypes.c_ulong(threading.main_thread().ident or 0)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(main, ctypes.py_object(KeyboardInterrupt))


def _watch(ours: socket.socket, theirs: socket.socket) -> None:
    """Wait for a signal, then for the end of the process."""
    first = b"\0"
    while first[0] not in SIGNALS:
        first = ours.recv(1)
    began = time.monotonic()
    if not _received:
        _received.append(first[0])
    ours.settimeout(0.05)
    while True:
        try:
            again = ours.recv(1)
        except TimeoutError:
            again = b""
        if _lost.is_set():
            _lost.clear()
            _raise_again()
        waited = time.monotonic() - began
        if again or (waited > PATIENCE and not _is_finishing()) or waited > LONGEST:
            _end(again[0] if again else _received[0])


def _is_finishing() -> bool:
    """Whether the main thread has taken notice of the signal and simulates nothing, and no thread compiles.

    Other threads that simulate end after the slice that they are in; a pass of the compiler may take a minute.
    """
    return _delivered.is_set() and not advances(threading.main_thread().ident) and not _compiles()


def _compiles() -> bool:
    """Whether a thread compiles: it has numba's lock then. What has not been imported compiles nothing."""
    compiler = sys.modules.get("numba.core.compiler_lock")
    lock = None if compiler is None else getattr(compiler, "global_compiler_lock", None)
    if lock is None:
        return False
    free = lock._lock.acquire(blocking=False)
    if free:
        lock._lock.release()
    return not free


def _end(number: int) -> None:
    """End this process without a word to the main thread, which may hold any lock."""
    _show_cursor()
    where = _where[0] if isinstance(_where[0], str) else _where[0]()
    text = "scissordyn: interrupted" + (f"; {where}" if where else "")
    os.write(2, text.encode("utf-8", "backslashreplace") + b"\n")
    os._exit(128 + number)


def _show_cursor() -> None:
    """A progress bar hides the cursor of the terminal."""
    if os.isatty(2):
        os.write(2, b"\x1b[?25h")
