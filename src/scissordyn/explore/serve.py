"""Serve the files of the explorer's page and one WebSocket for each page, by default for this machine only.

Access requires the page's address, which has a random part, and a known name of this machine as host. The host check is against
DNS rebinding: another site can map its name to this machine, so that a browser sends requests here with that site's name.
Therefore every request is checked.
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
from scissordyn.explore.listener import Listener

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.explore.session import Session

log = logging.getLogger(__name__)
quiet = logging.getLogger("scissordyn.explore.connections")
quiet.setLevel(logging.CRITICAL + 1)  # clients that violate the protocol are not errors of this program

LOCAL_ADDRESSES = ("127.0.0.1", "localhost", "::1")  # Addresses of this computer, which other computers cannot reach

ADDRESS_HINT = "open the address printed by 'scissordyn explore'"  # Hint in the answer to a request without the page's token

MESSAGE_BYTES_MAX = 2**16  # Largest size of a message from a page to the explorer [bytes]
PAGES_MAX = 20  # Largest number of open explorer pages; each has a thread, its runs and its undo history

SECURITY_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:",
    "Cache-Control": "no-store",
}
"""HTTP response headers: no other site may show the page in a frame, read its data, or learn its address."""

# HTML template of a page that opens the address of the explorer
REDIRECT_PAGE = """<!DOCTYPE html><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={url}"><title>scissordyn</title><a href="{url}">the page</a>
"""

ASSETS = Path(__file__).parent / "assets"  # Folder with the files of the explorer's page

# MIME types of the page's files, by file name ending
MIME_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}

PAGE_FILES = frozenset({path.name for path in ASSETS.glob("*.*") if path.suffix in MIME_TYPES} | {"canvas.js"})
"""Names of the files of the explorer's page; canvas.js is also used by films."""


def bound_address(listening: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """Return the address on which a socket listens; an unspecified address means all networks of this machine."""
    return ipaddress.ip_address(str(listening.getsockname()[0]).partition("%")[0])


@dataclass(frozen=True)
class Access:
    """Access token and host names that requests may have; with `any_number`, any numeric address is accepted too."""

    token: str
    names: Collection[str]
    any_number: bool = False

    @classmethod
    def for_socket(cls, listening: socket.socket, address: str) -> Access:
        """Return the access data for a socket that listens on an address, with a new token."""
        bound, host = bound_address(listening), socket.gethostname().lower()
        if bound.is_loopback:
            names = {*LOCAL_ADDRESSES, str(bound), address.lower()}
        elif bound.is_unspecified:
            names = {*LOCAL_ADDRESSES, host}
        else:
            names = {str(bound), address.lower(), host}
        return cls(secrets.token_urlsafe(24), frozenset(names), bound.is_unspecified)

    @property
    def folder(self) -> str:
        """Path of the page's folder in its URL, which contains the token."""
        return f"/{self.token}/"

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> tuple[int, str] | None:
        """Return status and reason for rejecting a request with these headers; None if it is accepted."""
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return 403, f"this host has no page; {ADDRESS_HINT}"
        if origins and list(origins) not in ([f"http://{hosts[0]}"], [f"https://{hosts[0]}"]):
            return 403, "requests from other sites are not allowed"
        first = path.split("/", 2)
        has_token = len(first) == 3 and hmac.compare_digest(first[1].encode("utf-8", "replace"), self.token.encode())
        return None if has_token else (404, f"not found; {ADDRESS_HINT}")

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
            return name in self.names or (self.any_number and ipaddress.ip_address(name) is not None)
        except ValueError:
            return False


def listen(address: str, wanted: int) -> Listener:
    """Listen on a port of this machine; port 0 means any free port."""
    if not address.strip():
        raise InputError("--address is empty", "an address or a name of this machine", "--address 127.0.0.1")
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
    announce: Callable[[str], None],
) -> None:
    """Serve the page of a case until Ctrl-C, which raises `KeyboardInterrupt`; raise the error of a case that cannot be read.

    `opened` returns the case; it is called in a separate thread, while the browser already loads the page. `announce` is called
    with the address of the page, whose random part grants access.
    """
    access = Access.for_socket(listening, address)
    host = "127.0.0.1" if bound_address(listening).is_unspecified else f"[{address}]" if ":" in address else address
    url = f"http://{host}:{listening.getsockname()[1]}{access.folder}"
    pages = Pages(name, access, opened, listening)
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as private:
        # daemon threads end with this one, including those of browsers that never send a request
        threading.Thread(target=pages.serve, name="scissordyn explore serves", daemon=True).start()
        threading.Thread(target=pages.read, name="scissordyn explore opens", daemon=True).start()
        announce(url)
        if show:
            threading.Thread(target=_show, args=(url, Path(private)), daemon=True).start()
        pages.ended.wait()
    if pages.fault:
        raise ScissordynError(f"the explorer stopped serving its page: {pages.fault}")
    pages.first.result()


def _show(url: str, private: Path) -> None:
    """Open the page through a file that only this user can read; all users can read the command line of a browser."""
    import webbrowser

    redirect = private / "explore.html"
    try:
        redirect.write_text(REDIRECT_PAGE.format(url=url), encoding="utf-8")
    except FileNotFoundError:  # the explorer has already ended
        return
    webbrowser.open(redirect.as_uri())


def pack_message(message: Mapping[str, Any]) -> bytes:
    """Return a message in the format that page.js unpacks: head length, head, and arrays of 64-bit floats or bytes.

    An array that occurs several times is sent once. Values that are not finite may occur only in arrays.
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
            arrays.append(value)  # keep the array alive, otherwise another array may get the same `id`
        return {"$": places[id(value)]}

    content = json.dumps(message, default=place, allow_nan=False, separators=(",", ":"))
    parts = [value if isinstance(value, bytes) else np.ascontiguousarray(value, "<f8").tobytes() for value in arrays]
    kinds = [["bytes" if isinstance(value, bytes) else "floats", len(part)] for value, part in zip(arrays, parts, strict=True)]
    head = f'{{"arrays":{json.dumps(kinds)},"message":{content}}}'.encode()
    head += b" " * (-(4 + len(head)) % 8)  # padding: floats begin at a multiple of 8 bytes
    return b"".join([len(head).to_bytes(4, "little"), head, *(part + bytes(-len(part) % 8) for part in parts)])


class Pages:
    """Server of all pages of a case, with their shared resources; `opened` reads the case."""

    def __init__(self, name: str, access: Access, opened: Callable[[], Case], listener: Listener) -> None:
        self.name, self.access, self._opened, self._listener = name, access, opened, listener
        self.ended = threading.Event()
        self.fault = ""  # Reason why the server stopped
        self._early, self.first = (
            Future[str](),
            Future["Session"](),
        )  # The case as it is declared, and the session of the first page
        self._lock = threading.Lock()
        self._count = 0
        self._taken = False

    def serve(self) -> None:
        """Answer requests until the process ends; a failure ends the explorer with an error."""
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
            open_timeout=5.0,  # a browser shows its token immediately
            process_request=self._answer,
            compression=None,
            max_size=MESSAGE_BYTES_MAX,
            server_header=None,
            close_timeout=1.0,
            logger=quiet,
        )
        server.serve_forever()

    def read(self) -> None:
        """Read the case, draw it as declared, and start its run before a page connects."""
        last_words = 0.5  # time for open pages to show an error before the server ends [s]
        try:
            case = self._opened()
            from scissordyn.plot.canvas import declared_scene

            self._early.set_result(declared_scene(case.mechanism))
            # all imports are in one thread, because concurrent imports of modules that import each other can deadlock
            import scissordyn.explore.page
            import scissordyn.run.simulate  # noqa: F401
            from scissordyn.explore.session import Session

            self.first.set_result(Session(case, lambda what: None))
        except BaseException as error:
            if not self._early.done():
                self._early.set_result("")
            self.first.set_exception(error)
            time.sleep(last_words if self._count else 0.0)
            self.ended.set()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a request; None accepts a WebSocket."""
        headers = request.headers
        refusal = self.access.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
        if refusal is not None:
            return _response(refusal[0], f"{refusal[1]}\n".encode())
        self._listener.admit(connection.socket)
        if getattr(request, "method", "GET") not in ("GET", "HEAD"):
            return _response(405, b"only GET is allowed\n")
        name = request.path.partition("?")[0].removeprefix(self.access.folder) or "page.html"
        if name == "ws":
            return None
        if name not in PAGE_FILES:
            return _response(404, b"not found\n")
        if name == "canvas.js":
            from scissordyn.plot.canvas import CANVAS_SCRIPT

            content = CANVAS_SCRIPT.encode()
        else:
            content = (ASSETS / name).read_bytes()
        if name == "page.html":
            content = content.replace(b"{name}", escape(self.name).encode())
        return _response(200, content, Path(name).suffix)

    def _connected(self, connection: ServerConnection) -> None:
        """Exchange messages with one page in its thread until it is closed."""

        def send(message: Any) -> None:
            with contextlib.suppress(ConnectionClosed):  # the receiving loop notices the closed connection
                connection.send(pack_message(message))

        with self._lock:
            self._count += 1
            full = self._count > PAGES_MAX
        try:
            words = f"{PAGES_MAX} pages of this case are open: close one, then reload this page" if full else ""
            if not full:
                if early := self._early.result():
                    send({"type": "early", "scene": early})
                if error := self.first.exception():
                    words = str(error) if isinstance(error, ScissordynError) else "internal error: see the terminal"
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
        """Return the session for a page: the prepared one for the first page, a new one for other pages."""
        from scissordyn.explore.session import Session

        first = self.first.result()
        with self._lock:
            if not self._taken:
                self._taken = True
                return first
            return Session(first.opened, lambda what: None, first.first)


def _response(status: int, content: bytes, ending: str = "") -> Response:
    kind = f"{MIME_TYPES.get(ending, 'text/plain')}; charset=utf-8"
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(content)), "Connection": "close", **SECURITY_HEADERS})
    return Response(status, HTTPStatus(status).phrase, headers, content)
