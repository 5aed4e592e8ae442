"""A process that works for another one: it leaves signals to it, and ends when it ends."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path

from scissordyn.cache.folder import adopt_folder

__all__ = ["begin", "kill", "signals_blocked"]

PR_SET_PDEATHSIG = 1
"""Linux, prctl(2): the signal that a process gets when its parent ends."""


def begin(lifeline: Connection, kernels: Path) -> None:
    """What a worker does first.

    Parameters
    ----------
    lifeline : Connection
        The reading end of a pipe whose other end only the parent has.
    kernels : Path
        Where the parent keeps machine code.
    """
    # Ctrl-C reaches every process of a terminal; the one that handed out the work decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        # a thread is no help while a kernel or the compiler holds the interpreter
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    threading.Thread(target=_end_with, args=(lifeline,), name="lifeline", daemon=True).start()
    adopt_folder(kernels)


def _end_with(lifeline: Connection) -> None:
    """Nothing is ever sent through the pipe: reading from it ends when the parent does, however that ends."""
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv_bytes()
    os._exit(1)


@contextlib.contextmanager
def signals_blocked() -> Iterator[None]:
    """Hold back Ctrl-C in this thread; processes and threads started meanwhile never get it.

    A process that is still starting would otherwise die of a Ctrl-C with a traceback, before `begin` can ignore it.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def kill(pool: ProcessPoolExecutor) -> None:
    """End the processes of a pool, and no other, in the middle of whatever they do.

    Parameters
    ----------
    pool : ProcessPoolExecutor
    """
    if sys.version_info >= (3, 14):
        pool.kill_workers()
        return
    for process in list((pool._processes or {}).values()):
        process.kill()
