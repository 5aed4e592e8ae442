"""The server of the explorer's page, on this machine unless asked otherwise."""

from __future__ import annotations

import gc
import logging
import signal
import socket
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.routing import Router

from scissordyn.errors import InputError
from scissordyn.explore.access import Access, is_everywhere
from scissordyn.explore.first import FirstRun
from scissordyn.explore.shell import Entrance

if TYPE_CHECKING:
    from scissordyn.explore.case import Case

log = logging.getLogger(__name__)

LAST_WORDS = 0.5
"""Time for open pages to show why the case cannot be read, before the server ends [s]."""

LARGEST = 2**16
"""Of a request [byte]: the page only asks."""

REDIRECT = """<!DOCTYPE html><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={url}"><title>scissordyn</title><a href="{url}">the page</a>
"""

PATIENCE = 1.0
"""The run is ordered when the page that somebody asked for has been built, or after this time [s]."""


def listen(address: str, wanted: int) -> socket.socket:
    """Listen for pages."""
    if not address.strip():
        raise InputError("--address ''", "an address or a name of this machine", "--address 127.0.0.1")
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
    """Serve the page of a case until Ctrl-C, which ends it as a `KeyboardInterrupt`.

    The browser gets the frame of the page and its scripts at once; the mechanism in its place when the case has been read; its
    ideal motion, while the libraries of the page are imported; then the page with its numbers; and the run when it is there.
    """
    port = int(listening.getsockname()[1])
    first, access, loop = FirstRun(opened), Access.to(listening, address), IOLoop.current()
    entrance = Entrance(name, access)
    http = HTTPServer(entrance, max_body_size=LARGEST, max_header_size=LARGEST)
    http.add_sockets([listening])
    host = "127.0.0.1" if is_everywhere(listening) else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{port}{access.folder}"
    preparation = _Preparation(name, first, entrance, loop, http)
    interrupted = threading.Event()

    def end(*_: object) -> None:
        interrupted.set()
        loop.add_callback_from_signal(loop.stop)

    before = signal.signal(signal.SIGINT, end)
    threading.Thread(target=preparation.run, name="scissordyn explore opens", daemon=True).start()
    said(url)
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as private:
        if show:
            threading.Thread(target=_show, args=(url, Path(private)), daemon=True).start()
        try:
            loop.start()
        finally:
            signal.signal(signal.SIGINT, before)
            preparation.stop()
            http.stop()
    error = first.error or preparation.error
    if error is not None:
        raise error
    if interrupted.is_set():
        raise KeyboardInterrupt


def _show(url: str, private: Path) -> None:
    """Open the page in a browser by a file that only its user can read: the command of a browser is seen by all users."""
    import webbrowser

    redirect = private / "explore.html"
    redirect.write_text(REDIRECT.format(url=url), encoding="utf-8")
    webbrowser.open(redirect.as_uri())


class _Preparation:
    """The import of the page's libraries and the reading of the case, in a thread beside the server's."""

    def __init__(self, name: str, first: FirstRun, entrance: Entrance, loop: IOLoop, http: HTTPServer) -> None:
        self.error: BaseException | None = None
        self._name, self._first, self._entrance, self._loop, self._http = name, first, entrance, loop, http
        self._built = threading.Event()
        self._stop: Callable[[], None] | None = None

    def run(self) -> None:
        """Read the case and have it drawn, import the libraries of the page, and order the run when the page is there."""
        gc.disable()  # to look for garbage among what the libraries set up is a tenth of the time to import them
        try:
            self._first.read()
            self._draw()
            if self._first.error is None or self._entrance.asked:
                from scissordyn.explore.application import application  # with the libraries of the page

                self._loop.add_callback(self._admit, application)
                if self._entrance.asked:
                    self._built.wait(PATIENCE)
            self._first.order()
        except BaseException as error:
            self.error = error
            self._loop.add_callback(self._loop.stop)
            return
        finally:
            gc.freeze()
            gc.enable()
        if self._first.error is not None:
            self._loop.add_callback(self._loop.call_later, LAST_WORDS if self._entrance.asked else 0.0, self._loop.stop)

    def _draw(self) -> None:
        """Hand the first drawing to the entrance: the mechanism as it is declared, and its motion when it has been computed."""
        case = self._first.case
        if case is None:
            self._loop.add_callback(self._entrance.draw, "")
            self._loop.add_callback(self._entrance.move, "")
            return
        from scissordyn.explore.early import early_motion, early_script

        self._loop.add_callback(self._entrance.draw, early_script(case))

        def move() -> None:
            try:
                motion = early_motion(case)
            except Exception:  # the page and its run do not depend on it
                log.exception("no early motion")
                motion = ""
            self._loop.add_callback(self._entrance.move, motion)

        threading.Thread(target=move, name="scissordyn explore moves", daemon=True).start()

    def _admit(self, application: Callable[..., tuple[Router, Callable[[], None]]]) -> None:
        folder = self._entrance.access.folder
        inside, self._stop = application(self._name, self._first, self._built.set, self._loop, self._http, folder)
        self._entrance.admit(inside)

    def stop(self) -> None:
        """Stop the application, if there is one."""
        if self._stop is not None:
            self._stop()
