"""The server of the explorer's page, on this machine unless asked otherwise."""

from __future__ import annotations

import gc
import signal
import socket
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.routing import Router

from scissordyn.errors import InputError
from scissordyn.explore.first import FirstRun
from scissordyn.explore.shell import Entrance

if TYPE_CHECKING:
    from scissordyn.explore.case import Case

__all__ = ["LOCAL", "listen", "serve"]

LOCAL = ("127.0.0.1", "localhost", "::1")

EVERYWHERE = ("0.0.0.0", "::")

LAST_WORDS = 0.5
"""Time for open pages to show why the case cannot be read, before the server ends [s]."""

PATIENCE = 1.0
"""The case is read when the page that somebody asked for has been built, or after this time [s]."""


def listen(address: str, wanted: int) -> socket.socket:
    """Listen for pages.

    Parameters
    ----------
    address : str
    wanted : int
        The port; 0 for any.

    Returns
    -------
    socket

    Raises
    ------
    InputError
        If the port is taken, or the address is not one of this machine.
    """
    try:
        made = socket.create_server((address, wanted), family=socket.AF_INET6 if ":" in address else socket.AF_INET)
    except OSError as error:
        raise InputError(
            f"cannot listen on {address}:{wanted}: {error.strerror or error}", "a free port of this machine", "--port 0"
        ) from None
    made.setblocking(False)
    return made


def serve(
    opened: Callable[[], Case],
    listening: socket.socket,
    *,
    name: str,
    address: str,
    show: bool,
    said: Callable[[str], None],
) -> None:
    """Serve the page of a case until Ctrl-C.

    The browser gets the frame of the page and its scripts at once, while the libraries of the page are imported; the page
    then, while those that read and simulate the case are; and the numbers and the run of the case when they are there.

    Parameters
    ----------
    opened : callable
        Reads the case.
    listening : socket
    name : str
        Of the case.
    address : str
    show : bool
        Whether to open a browser.
    said : callable
        Called with the address of the page.

    Raises
    ------
    ScissordynError
        If the case cannot be read.
    """
    port = int(listening.getsockname()[1])
    first, entrance, loop = FirstRun(opened), Entrance(name), IOLoop.current()
    http = HTTPServer(entrance)
    http.add_sockets([listening])
    host = "127.0.0.1" if address in EVERYWHERE else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{port}/"
    # a page of another origin must not be able to talk to this server
    origins = {f"{host}:{port}"} | ({f"localhost:{port}", f"127.0.0.1:{port}"} if address in LOCAL else set())
    preparation = _Preparation(name, first, entrance, loop, http, ["*"] if address in EVERYWHERE else sorted(origins))
    before = signal.signal(signal.SIGINT, lambda *_: loop.add_callback_from_signal(loop.stop))
    threading.Thread(target=preparation.run, name="scissordyn explore opens", daemon=True).start()
    said(url)
    if show:
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    try:
        loop.start()
    finally:
        signal.signal(signal.SIGINT, before)
        preparation.stop()
        http.stop()
    error = first.error or preparation.error
    if error is not None:
        raise error


class _Preparation:
    """The import of the page's libraries and the reading of the case, in a thread beside the server's.

    Parameters
    ----------
    name : str
        Of the case.
    first : FirstRun
    entrance : Entrance
    loop : IOLoop
        Of the server; stopped if there is an error.
    http : HTTPServer
    origins : list of str
        Hosts and ports whose pages may talk to the server.
    """

    def __init__(
        self, name: str, first: FirstRun, entrance: Entrance, loop: IOLoop, http: HTTPServer, origins: list[str]
    ) -> None:
        self.error: BaseException | None = None
        self._name, self._first, self._entrance, self._loop, self._http = name, first, entrance, loop, http
        self._origins = origins
        self._built = threading.Event()
        self._stop: Callable[[], None] | None = None

    def run(self) -> None:
        """Import, then read the case when the page that somebody asked for is there."""
        gc.disable()  # to look for garbage among what the libraries set up is a tenth of the time to import them
        try:
            from scissordyn.explore.application import application  # with the libraries of the page

            self._loop.add_callback(self._admit, application)
            if self._entrance.asked:
                self._built.wait(PATIENCE)
            self._first.begin()
        except BaseException as error:
            self.error = error
            self._loop.add_callback(self._loop.stop)
            return
        finally:
            gc.freeze()
            gc.enable()
        if self._first.error is not None:
            self._loop.add_callback(self._loop.call_later, LAST_WORDS if self._entrance.asked else 0.0, self._loop.stop)

    def _admit(self, application: Callable[..., tuple[Router, Callable[[], None]]]) -> None:
        inside, self._stop = application(self._name, self._first, self._built.set, self._loop, self._http, self._origins)
        self._entrance.admit(inside)

    def stop(self) -> None:
        """Stop the application, if there is one."""
        if self._stop is not None:
            self._stop()
