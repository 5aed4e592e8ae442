"""The application of the page's server: a new page with a session of its own for everybody who may ask."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from typing import Any

from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.protocol_handler import ProtocolHandler
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from panel.io.application import build_applications
from panel.io.resources import LOCAL_DIST, patch_model_css
from panel.io.server import AutoloadJsHandler, WSHandler
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.routing import Router

from scissordyn.explore.first import FirstRun
from scissordyn.explore.page import Page
from scissordyn.explore.shell import CAREFUL, ELEMENT

MOST_PAGES = 20
"""Pages that are open at the same time: each has a thread, its runs and its undo."""

LARGEST = 2**20
"""Of a message from a page [byte]."""

ALLOWED = {"PATCH-DOC": ("ModelChanged", "MessageSent"), "PULL-DOC-REQ": (), "SERVER-INFO-REQ": ()}
"""Messages of a page, and what a change of its document may be: no page sends or replaces a document."""

REFUSED = "a message that the page does not send"

FULL = """document.getElementById("sd-start").textContent = "%d pages of this case are open: close one, then reload this.";"""


def application(
    name: str, first: FirstRun, built: Callable[[], None], loop: IOLoop, http: HTTPServer, folder: str
) -> tuple[Router, Callable[[], None]]:
    """Make the application."""

    def page() -> None:
        Page(name, first).show()
        loop.add_callback(built)

    applications = build_applications({"/": page}, title=f"{name} - scissordyn")
    applications["/"].add(FunctionHandler(_keep_local))
    inside = BokehTornado(
        applications,
        prefix=folder,
        # only sessions that this server has begun: a page cannot name one of its own or another page's
        sign_sessions=True,
        secret_key=secrets.token_bytes(32),
        include_headers=[],
        include_cookies=[],
        websocket_max_message_size_bytes=LARGEST,
    )
    context = {"application_context": inside._applications["/"], "bokeh_websocket_path": f"{folder}ws"}
    inside.add_handlers(
        r".*",
        [
            (rf"{folder}autoload\.js", Begin, context),
            (rf"{folder}ws", Socket, {**context, "compression_level": None, "mem_level": None}),
        ],
    )
    server = BaseServer(loop, inside, http)
    server.start()
    return inside, server.stop


def _keep_local(document: Document) -> None:
    """Let a page have its style sheets from this server: its library would have the browser ask another one for them."""
    for root in document.roots:
        patch_model_css(root, dist_url=LOCAL_DIST)


class Begin(AutoloadJsHandler):  # type: ignore[misc]
    """The script that begins a session; what else a request asks of it is not looked at."""

    def set_default_headers(self) -> None:
        """Without the leave for other sites to read it that the library gives."""
        for name, value in {**CAREFUL, "Cache-Control": "no-store"}.items():
            self.set_header(name, value)

    def get_argument(self, name: str, default: Any = None, strip: bool = True) -> Any:
        """The page's own arguments."""
        own = {"bokeh-autoload-element": ELEMENT, "bokeh-app-path": self.application.prefix}
        return own.get(name, default)

    async def get(self, *given: Any, **named: Any) -> None:
        """Begin a session, if there are not too many."""
        self.request.headers.pop("Bokeh-Session-Id", None)
        self.request.arguments = {}
        if len(list(self.application_context.sessions)) >= MOST_PAGES:
            self.set_header("Content-Type", "application/javascript")
            self.finish(FULL % MOST_PAGES)
            return
        await super().get(*given, **named)

    async def options(self, *given: Any, **named: Any) -> None:
        """Refuse: no other site may ask."""
        self.set_status(405)
        self.finish()


class Socket(WSHandler):  # type: ignore[misc]
    """What a page and its session say to each other; an answer to what cannot be understood says no more than that."""

    def check_origin(self, origin: str) -> bool:
        """The entrance has compared host and origin of the request."""
        return True

    async def _async_open(self, token: str) -> None:
        await super()._async_open(token)
        self.handler = Protocol()

    def _internal_error(self, message: str) -> None:
        self.close(1011, REFUSED)

    def _protocol_error(self, message: str) -> None:
        self.close(1002, REFUSED)


class Protocol(ProtocolHandler):  # type: ignore[misc]
    """The library's, without traces of this program in answers."""

    async def handle(self, message: Any, connection: Any) -> Any:
        """Answer a message."""
        if not _is_allowed(message):
            return connection.error(message, REFUSED)
        reply = await super().handle(message, connection)
        if getattr(reply, "msgtype", "") == "ERROR":
            # made anew, where no exception is being handled: its trace would be in the answer
            return connection.error(message, REFUSED)
        return reply


def _is_allowed(message: Any) -> bool:
    kinds = ALLOWED.get(message.msgtype)
    if kinds is None:
        return False
    if not kinds:
        return True
    events = message.content.get("events") if isinstance(message.content, dict) else None
    return isinstance(events, list) and all(isinstance(event, dict) and event.get("kind") in kinds for event in events)
