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
    first = FirstRun(opened)
    loop = IOLoop.current()
    entrance = Entrance(name)
    http = HTTPServer(entrance)
    http.add_sockets([listening])
    host = "127.0.0.1" if address in EVERYWHERE else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{port}/"
    # a page of another origin must not be able to talk to this server
    origins = {f"{host}:{port}"} | ({f"localhost:{port}", f"127.0.0.1:{port}"} if address in LOCAL else set())
    stops: list[Callable[[], None]] = []
    fault: list[BaseException] = []
    built = threading.Event()

    def prepare() -> None:
        gc.disable()  # to look for garbage among what the libraries set up is a tenth of the time to import them
        try:
            from scissordyn.explore.application import application  # with the libraries of the page

            loop.add_callback(admit, application)
            if entrance.asked:
                built.wait(PATIENCE)
            first.begin()
        except BaseException as error:
            fault.append(error)
            loop.add_callback(loop.stop)
            return
        finally:
            gc.freeze()
            gc.enable()
        if first.error is not None:
            loop.add_callback(loop.call_later, LAST_WORDS if entrance.asked else 0.0, loop.stop)

    def admit(application: Callable[..., tuple[Router, Callable[[], None]]]) -> None:
        inside, stop = application(name, first, built.set, loop, http, ["*"] if address in EVERYWHERE else sorted(origins))
        stops.append(stop)
        entrance.admit(inside)

    before = signal.signal(signal.SIGINT, lambda *_: loop.add_callback_from_signal(loop.stop))
    threading.Thread(target=prepare, name="scissordyn explore opens", daemon=True).start()
    said(url)
    if show:
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    try:
        loop.start()
    finally:
        signal.signal(signal.SIGINT, before)
        for stop in stops:
            stop()
        http.stop()
    if first.error is not None:
        raise first.error
    if fault:
        raise fault[0]
