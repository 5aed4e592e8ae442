"""Provide the explorer's listening socket, which bounds connections without the token and survives a lack of descriptors."""

from __future__ import annotations

import contextlib
import errno
import socket
import threading
import time
from typing import Any

STRANGERS_MAX = 32  # Largest number of connections without the token; a browser opens 6 to one server

TRANSIENT = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM, errno.ECONNABORTED, errno.EPERM, errno.EPROTO)
"""Errors of `accept` that do not concern the listening socket: lack of resources, or a connection that is already closed."""


def max_strangers() -> int:
    """Return how many connections without the token may be open at the same time."""
    fraction = 0.25  # of the process's descriptors for connections without the token
    per_stranger = 2  # descriptors of a connection: its socket, and its thread's wait
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return STRANGERS_MAX
    descriptors = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if descriptors == resource.RLIM_INFINITY:
        return STRANGERS_MAX
    return max(1, min(STRANGERS_MAX, int(fraction * descriptors / per_stranger)))


class Listener(socket.socket):
    """Listening socket whose `accept` drops the oldest stranger when there are too many or descriptors run out."""

    def __init__(self, listening: socket.socket) -> None:
        super().__init__(listening.family, listening.type, listening.proto, listening.detach())
        self._lock = threading.Lock()
        self._most = max_strangers()
        self._strangers: dict[int, socket.socket] = {}  # Connections without the token by identity, the oldest first

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection and its address."""
        retry = 0.05  # pause before the next attempt when the system has no descriptor left [s]
        while True:
            try:
                connection, address = super().accept()
            except OSError as error:
                if error.errno not in TRANSIENT:
                    raise
                self._drop_down_to(0)
                time.sleep(retry)
                continue
            self._drop_down_to(self._most - 1)
            with self._lock:
                self._strangers[id(connection)] = connection
            return connection, address

    def admit(self, connection: socket.socket) -> None:
        """Stop counting a connection as a stranger after it has shown the token."""
        with self._lock:
            self._strangers.pop(id(connection), None)

    def _drop_down_to(self, count: int) -> None:
        """Drop connections without the token: closed ones, and the oldest ones until at most `count` are left."""
        with self._lock:
            self._strangers = {key: other for key, other in self._strangers.items() if other.fileno() >= 0}
            oldest = list(self._strangers)[: max(len(self._strangers) - count, 0)]
            dropped = [self._strangers.pop(key) for key in oldest]
        for connection in dropped:
            with contextlib.suppress(OSError):  # its thread sees the end of the stream and closes it
                connection.shutdown(socket.SHUT_RDWR)
