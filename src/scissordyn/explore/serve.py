"""The server of the explorer's page, on this machine unless asked otherwise: its files, and one socket for each page."""

from __future__ import annotations

import contextlib
import logging
import socket
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from html import escape
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Any

from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection
from websockets.sync.server import serve as listen_for_pages

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.access import Access, is_everywhere
from scissordyn.explore.message import packed

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.explore.session import Session

log = logging.getLogger(__name__)
quiet = logging.getLogger("scissordyn.explore.connections")
quiet.setLevel(logging.CRITICAL + 1)  # what does not speak the protocol is no fault of this program

LAST_WORDS = 0.5  # Time for open pages to show why the case cannot be read, before the server ends [s]
LARGEST = 2**16  # Of a message from a page [byte]
MOST_PAGES = 20  # Pages that are open at the same time: each has a thread, its runs and its undo

CAREFUL = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:",
    "Cache-Control": "no-store",
}
"""For browsers: no other site may show the page in a frame, read what it has, or learn its address."""

REDIRECT = """<!DOCTYPE html><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={url}"><title>scissordyn</title><a href="{url}">the page</a>
"""

ASSETS = Path(__file__).parent / "assets"

KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}

FILES = frozenset({path.name for path in ASSETS.glob("*.*") if path.suffix in KINDS} | {"canvas.js"})
"""Files of the page, below its address; canvas.js is that of films."""


def listen(address: str, wanted: int) -> socket.socket:
    """Listen for pages on a port of this machine, 0 for any."""
    if not address.strip():
        raise InputError("--address ''", "an address or a name of this machine", "--address 127.0.0.1")
    try:
        return socket.create_server((address, wanted), family=socket.AF_INET6 if ":" in address else socket.AF_INET)
    except OSError as error:
        raise InputError(
            f"cannot listen on {address}:{wanted}: {error.strerror or error}", "a free port of this machine", "--port 0"
        ) from None


def serve(
    opened: Callable[[], Case],
    listening: socket.socket,
    *,
    name: str,
    address: str,
    show: bool,
    said: Callable[[str], None],
) -> None:
    """Serve the page of a case until Ctrl-C, which ends it as a `KeyboardInterrupt`; raise what is wrong with the case.

    `opened` reads the case, in a thread of its own: the browser gets the page meanwhile. `said` is called with the address of
    the page, which has a random part: whoever has it may use the page.
    """
    access = Access.to(listening, address)
    host = "127.0.0.1" if is_everywhere(listening) else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{listening.getsockname()[1]}{access.folder}"
    pages = Pages(name, access, opened)
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as private:
        # threads end with this one: also those of a browser that never says what it connects for
        threading.Thread(target=pages.serve, args=(listening,), name="scissordyn explore serves", daemon=True).start()
        threading.Thread(target=pages.read, name="scissordyn explore opens", daemon=True).start()
        said(url)
        if show:
            threading.Thread(target=_show, args=(url, Path(private)), daemon=True).start()
        pages.ended.wait()
    pages.first.result()


def _show(url: str, private: Path) -> None:
    """Open the page in a browser by a file that only its user can read: the command of a browser is seen by all users."""
    import webbrowser

    redirect = private / "explore.html"
    try:
        redirect.write_text(REDIRECT.format(url=url), encoding="utf-8")
    except FileNotFoundError:  # the explorer has ended meanwhile
        return
    webbrowser.open(redirect.as_uri())


class Pages:
    """All pages of a case, and what they are made of; `opened` reads the case."""

    def __init__(self, name: str, access: Access, opened: Callable[[], Case]) -> None:
        self.name, self.access, self._opened = name, access, opened
        self.ended = threading.Event()
        self._early, self.first = (
            Future[str](),
            Future["Session"](),
        )  # The case as it is declared, and the session of the first page
        self._lock = threading.Lock()
        self._count = 0
        self._taken = False

    def serve(self, listening: socket.socket) -> None:
        """Answer requests, for ever."""
        with listen_for_pages(
            self._connected,
            sock=listening,
            process_request=self._answer,
            compression=None,
            max_size=LARGEST,
            server_header=None,
            close_timeout=1.0,
            logger=quiet,
        ) as server:
            server.serve_forever()

    def read(self) -> None:
        """Read the case, draw it as it is declared, and begin its run before there is a page."""
        try:
            case = self._opened()
            from scissordyn.plot.canvas import declared_scene

            self._early.set_result(declared_scene(case.mechanism))
            # all that a page and its run need, in one thread: modules that import each other must not be imported by two
            import scissordyn.explore.page
            import scissordyn.run.simulate  # noqa: F401
            from scissordyn.explore.session import Session

            self.first.set_result(Session(case, lambda what: None))
        except BaseException as error:
            if not self._early.done():
                self._early.set_result("")
            self.first.set_exception(error)
            time.sleep(LAST_WORDS if self._count else 0.0)
            self.ended.set()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The answer to a request; None for a socket, which may open."""
        headers = request.headers
        refusal = self.access.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
        if refusal is not None:
            return _response(refusal[0], f"{refusal[1]}\n".encode())
        if getattr(request, "method", "GET") not in ("GET", "HEAD"):
            return _response(405, b"the page only answers GET\n")
        name = request.path.partition("?")[0].removeprefix(self.access.folder) or "page.html"
        if name == "ws":
            return None
        if name not in FILES:
            return _response(404, b"nothing here\n")
        if name == "canvas.js":
            from scissordyn.plot.canvas import CANVAS

            content = CANVAS.encode()
        else:
            content = (ASSETS / name).read_bytes()
        if name == "page.html":
            content = content.replace(b"{name}", escape(self.name).encode())
        return _response(200, content, Path(name).suffix)

    def _connected(self, connection: ServerConnection) -> None:
        """Talk to one page, in its own thread, until it is closed."""

        def send(message: Any) -> None:
            with contextlib.suppress(ConnectionClosed):  # its thread ends by itself
                connection.send(packed(message))

        with self._lock:
            self._count += 1
            full = self._count > MOST_PAGES
        try:
            words = f"{MOST_PAGES} pages of this case are open: close one, then reload this" if full else ""
            if not full:
                if early := self._early.result():
                    send({"type": "early", "scene": early})
                if error := self.first.exception():
                    words = str(error) if isinstance(error, ScissordynError) else "a fault: see the terminal"
            if words:
                send({"type": "said", "text": words})
                return
            from scissordyn.explore.page import Page

            page = Page(self._session(), send)
            try:
                page.begin()
                for message in connection:
                    page.hear(message)
            finally:
                page.close()
        except ConnectionClosed:
            pass
        except Exception:
            log.exception("a page has ended")
        finally:
            with self._lock:
                self._count -= 1

    def _session(self) -> Session:
        """The session whose run has begun already, for the first page; a new one, with that run if it is there, for others."""
        from scissordyn.explore.session import Session

        first = self.first.result()
        with self._lock:
            if not self._taken:
                self._taken = True
                return first
            return Session(first.opened, lambda what: None, first.first)


def _response(status: int, content: bytes, ending: str = "") -> Response:
    kind = f"{KINDS.get(ending, 'text/plain')}; charset=utf-8"
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(content)), "Connection": "close", **CAREFUL})
    return Response(status, HTTPStatus(status).phrase, headers, content)
