"""Listening socket of the explorer with a limit on connections that have not shown the access token."""

from __future__ import annotations

import contextlib
import errno
import socket
import threading
import time
from typing import Any

# Largest number of connections that have not sent the page's token; a browser opens 6 connections to a server
STRANGERS_MAX = 32

TRANSIENT_ERRORS = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM, errno.ECONNABORTED, errno.EPERM, errno.EPROTO)
"""Errors of the socket function `accept` after which it is repeated: too few file descriptors, or a closed connection."""


def max_strangers() -> int:
    """Return the largest number of open connections that have not shown the token; it depends on the limit of descriptors."""
    fraction = 0.25  # fraction of the process's file descriptors for these connections
    per_stranger = 2  # number of descriptors per connection: for its socket and for its thread
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return STRANGERS_MAX
    descriptors = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if descriptors == resource.RLIM_INFINITY:
        return STRANGERS_MAX
    return max(1, min(STRANGERS_MAX, int(fraction * descriptors / per_stranger)))


class Listener(socket.socket):
    """Listening socket that limits strangers: connections that have not shown the access token.

    If there are too many strangers, or no file descriptor is left, `accept` closes the oldest stranger.
    """

    def __init__(self, listening: socket.socket) -> None:
        super().__init__(listening.family, listening.type, listening.proto, listening.detach())
        self._lock = threading.Lock()
        self._most = max_strangers()
        self._strangers: dict[int, socket.socket] = {}  # Strangers by identity, oldest first

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection and its address."""
        retry = 0.05  # pause before the next attempt if no descriptor is left [s]
        while True:
            try:
                connection, address = super().accept()
            except OSError as error:
                if error.errno not in TRANSIENT_ERRORS:
                    raise
                self._drop_down_to(0)
                time.sleep(retry)
                continue
            self._drop_down_to(self._most - 1)
            with self._lock:
                self._strangers[id(connection)] = connection
            return connection, address

    def admit(self, connection: socket.socket) -> None:
        """Remove a connection from the strangers, because it has shown the token."""
        with self._lock:
            self._strangers.pop(id(connection), None)

    def _drop_down_to(self, count: int) -> None:
        """Close the oldest strangers until at most `count` are left; forget those that are already closed."""
        with self._lock:
            self._strangers = {key: other for key, other in self._strangers.items() if other.fileno() >= 0}
            oldest = list(self._strangers)[: max(len(self._strangers) - count, 0)]
            dropped = [self._strangers.pop(key) for key in oldest]
        for connection in dropped:
            with contextlib.suppress(
                OSError
            ):  # the thread of the connection notices the end of the stream and closes the socket
                connection.shutdown(socket.SHUT_RDWR)
