"""Locks on open files, which the operating system lifts when a process ends in whatever way."""

from __future__ import annotations

import sys

LOCKS = sys.platform != "win32"  # Whether there are any. On Windows an open file cannot be deleted, which protects it as well


def hold(handle: int, *, shared: bool = False) -> bool:
    """Lock an open file until it is closed or the process ends; does not wait."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
