"""The server of the explorer's page, on this machine unless asked otherwise: its files, and one socket for each page.

Whoever knows the page's address, which has a random part, may use it, if he calls this machine by a name of its own. A page of
another site can have its own name lead to this machine (DNS rebinding): its browser then sends requests here, as to the site's
own server, with the site's name as their host. So every request is looked at, whatever it asks for.
"""

from __future__ import annotations

import contextlib
import hmac
import ipaddress
import json
import logging
import secrets
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from html import escape
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection
from websockets.sync.server import serve as listen_for_pages

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.listener import STRANGER_SECONDS, Listener

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.explore.session import Session

log = logging.getLogger(__name__)
quiet = logging.getLogger("scissordyn.explore.connections")
quiet.setLevel(logging.CRITICAL + 1)  # what does not speak the protocol is no fault of this program

LOCAL = ("127.0.0.1", "localhost", "::1")

ELSEWHERE = "open the address that 'scissordyn explore' has printed"

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


def bound_address(listening: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """The address that a socket listens on: of this machine alone (loopback), or of all its networks (unspecified)."""
    return ipaddress.ip_address(str(listening.getsockname()[0]).partition("%")[0])


@dataclass(frozen=True)
class Access:
    """The first part of the path, and the names of this machine; `any_number`: also any address in numbers."""

    token: str
    names: Collection[str]
    any_number: bool = False

    @classmethod
    def to(cls, listening: socket.socket, address: str) -> Access:
        """To a socket that listens on an address, with a new token."""
        bound, host = bound_address(listening), socket.gethostname().lower()
        if bound.is_loopback:
            names = {*LOCAL, str(bound), address.lower()}
        elif bound.is_unspecified:
            names = {*LOCAL, host}
        else:
            names = {str(bound), address.lower(), host}
        return cls(secrets.token_urlsafe(24), frozenset(names), bound.is_unspecified)

    @property
    def folder(self) -> str:
        """The path of the page."""
        return f"/{self.token}/"

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> tuple[int, str] | None:
        """Why a request with these headers is refused: status and one line; None if it is not."""
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return 403, f"no page of this host; {ELSEWHERE}"
        if origins and list(origins) not in ([f"http://{hosts[0]}"], [f"https://{hosts[0]}"]):
            return 403, "no page of another site may talk to this one"
        first = path.split("/", 2)
        has_token = len(first) == 3 and hmac.compare_digest(first[1].encode("utf-8", "replace"), self.token.encode())
        return None if has_token else (404, f"nothing here; {ELSEWHERE}")

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
            return name in self.names or (self.any_number and ipaddress.ip_address(name) is not None)
        except ValueError:
            return False


def listen(address: str, wanted: int) -> Listener:
    """Listen for pages on a port of this machine, 0 for any."""
    if not address.strip():
        raise InputError("--address ''", "an address or a name of this machine", "--address 127.0.0.1")
    try:
        return Listener(socket.create_server((address, wanted), family=socket.AF_INET6 if ":" in address else socket.AF_INET))
    except OSError as error:
        raise InputError(
            f"cannot listen on {address}:{wanted}: {error.strerror or error}", "a free port of this machine", "--port 0"
        ) from None


def serve(
    opened: Callable[[], Case],
    listening: Listener,
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
    host = "127.0.0.1" if bound_address(listening).is_unspecified else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{listening.getsockname()[1]}{access.folder}"
    pages = Pages(name, access, opened, listening)
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as private:
        # threads end with this one: also those of a browser that never says what it connects for
        threading.Thread(target=pages.serve, name="scissordyn explore serves", daemon=True).start()
        threading.Thread(target=pages.read, name="scissordyn explore opens", daemon=True).start()
        said(url)
        if show:
            threading.Thread(target=_show, args=(url, Path(private)), daemon=True).start()
        pages.ended.wait()
    if pages.fault:
        raise ScissordynError(f"the explorer cannot serve its page any more: {pages.fault}")
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


def packed(message: Mapping[str, Any]) -> bytes:
    """A message as page.js unpacks it: the length of a head, the head, and its arrays of 64-bit floats or bytes.

    An array that stands in several places of the message is sent once. What is not finite can stand in arrays only.
    """
    arrays: list[Any] = []
    places: dict[int, int] = {}

    def place(value: Any) -> Any:
        if isinstance(value, np.generic):
            return value.item()
        if not isinstance(value, np.ndarray | bytes):
            raise TypeError(f"{type(value).__name__} in a message of the page")
        if id(value) not in places:
            places[id(value)] = len(arrays)
            arrays.append(value)  # it stays alive: the number of another one could be the same otherwise
        return {"$": places[id(value)]}

    content = json.dumps(message, default=place, allow_nan=False, separators=(",", ":"))
    parts = [value if isinstance(value, bytes) else np.ascontiguousarray(value, "<f8").tobytes() for value in arrays]
    kinds = [["bytes" if isinstance(value, bytes) else "floats", len(part)] for value, part in zip(arrays, parts, strict=True)]
    head = f'{{"arrays":{json.dumps(kinds)},"message":{content}}}'.encode()
    head += b" " * (-(4 + len(head)) % 8)  # floats begin at a multiple of their size
    return b"".join([len(head).to_bytes(4, "little"), head, *(part + bytes(-len(part) % 8) for part in parts)])


class Pages:
    """All pages of a case, and what they are made of; `opened` reads the case."""

    def __init__(self, name: str, access: Access, opened: Callable[[], Case], listener: Listener) -> None:
        self.name, self.access, self._opened, self._listener = name, access, opened, listener
        self.ended = threading.Event()
        self.fault = ""  # Why no page can be served any more
        self._early, self.first = (
            Future[str](),
            Future["Session"](),
        )  # The case as it is declared, and the session of the first page
        self._lock = threading.Lock()
        self._count = 0
        self._taken = False

    def serve(self) -> None:
        """Answer requests until the process ends. Where that fails, the explorer ends with an error."""
        try:
            self._serve()
            self.fault = "its listening socket was closed"
        except Exception as error:
            self.fault = f"{type(error).__name__}: {error}"
        self.ended.set()

    def _serve(self) -> None:
        server = listen_for_pages(
            self._connected,
            sock=self._listener,
            open_timeout=STRANGER_SECONDS,
            process_request=self._answer,
            compression=None,
            max_size=LARGEST,
            server_header=None,
            close_timeout=1.0,
            logger=quiet,
        )
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
        self._listener.admit(connection.socket)
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
