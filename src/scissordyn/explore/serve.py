"""The server of the explorer's page, on this machine unless asked otherwise."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from typing import Any

import panel as pn

from scissordyn.errors import InputError
from scissordyn.explore.case import Case
from scissordyn.explore.page import STYLE, Page
from scissordyn.explore.worker import Outcome, Worker

__all__ = ["LOCAL", "free_port", "serve"]

LOCAL = ("127.0.0.1", "localhost", "::1")


def free_port(address: str, wanted: int) -> int:
    """A port that can be listened on.

    Parameters
    ----------
    address : str
    wanted : int
        0 for any.

    Returns
    -------
    int

    Raises
    ------
    InputError
        If the port is taken, or the address is not one of this machine.
    """
    try:
        with socket.create_server((address, wanted)) as probe:
            return int(probe.getsockname()[1])
    except OSError as error:
        raise InputError(
            f"cannot listen on {address}:{wanted}: {error.strerror or error}", "a free port of this machine", "--port 0"
        ) from None


def serve(case: Case, *, address: str, port: int, show: bool, said: Callable[[str], None]) -> None:
    """Serve the page of a case until Ctrl-C.

    Parameters
    ----------
    case : Case
    address : str
    port : int
        That is free.
    show : bool
        Whether to open a browser.
    said : callable
        Called with the address of the page.
    """
    first = _First(case)
    pn.config.raw_css = [STYLE]

    def page() -> Any:
        pn.state.curdoc.title = f"{case.name} - scissordyn"
        return Page(case, first.known).layout()

    # a page of another origin must not be able to talk to this server
    here = f"localhost:{port}" if address in LOCAL else ""
    origins = [f"{address}:{port}", *([here, f"127.0.0.1:{port}"] if here else [])] if address != "0.0.0.0" else ["*"]
    url = f"http://{'127.0.0.1' if address == '0.0.0.0' else address}:{port}/"
    server = pn.serve(
        page,
        address=address,
        port=port,
        websocket_origin=sorted(set(origins)),
        show=False,
        start=False,
        title=f"{case.name} - scissordyn",
        verbose=False,
    )
    server.start()
    said(url)
    if show:
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    try:
        server.io_loop.start()
    except KeyboardInterrupt:
        pass
    finally:
        server.stop()


class _First:
    """The run of the case as it was opened, computed once, while the first page is loaded."""

    def __init__(self, case: Case) -> None:
        self.known: Outcome | None = None
        self._worker = Worker(self._take, lambda number, fraction: None)
        self._worker.order(case)

    def _take(self, outcome: Outcome) -> None:
        self.known = outcome
        self._worker.close()
