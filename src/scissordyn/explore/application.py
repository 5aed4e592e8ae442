"""The application of the page's server: a new page with a session of its own for everybody who asks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from panel.io.application import build_applications
from panel.io.resources import LOCAL_DIST, patch_model_css
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.routing import Router

from scissordyn.explore.first import FirstRun
from scissordyn.explore.page import Page

__all__ = ["application"]


def application(
    name: str, first: FirstRun, built: Callable[[], None], loop: IOLoop, http: HTTPServer, origins: Sequence[str]
) -> tuple[Router, Callable[[], None]]:
    """Make the application.

    Parameters
    ----------
    name : str
        Of the case.
    first : FirstRun
        The case as it is opened.
    built : callable
        Called when a page has been built.
    loop : IOLoop
    http : HTTPServer
    origins : sequence of str
        Hosts and ports whose pages may talk to the server.

    Returns
    -------
    Router
        What answers requests.
    callable
        Ends it.
    """

    def page() -> None:
        Page(name, first).show()
        loop.add_callback(built)

    applications = build_applications({"/": page}, title=f"{name} - scissordyn")
    applications["/"].add(FunctionHandler(_keep_local))
    inside = BokehTornado(applications, extra_websocket_origins=origins)
    server = BaseServer(loop, inside, http)
    server.start()
    return inside, server.stop


def _keep_local(document: Document) -> None:
    """Let a page have its style sheets from this server: its library would have the browser ask another one for them."""
    for root in document.roots:
        patch_model_css(root, dist_url=LOCAL_DIST)
