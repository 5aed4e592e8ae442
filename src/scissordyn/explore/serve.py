"""The server of the explorer's page, on this machine unless asked otherwise."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from typing import Any

import panel as pn

from scissordyn.errors import InputError
from scissordyn.explore.first import FirstRun
from scissordyn.explore.page import STYLE, Page

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


def serve(first: FirstRun, *, address: str, port: int, show: bool, said: Callable[[str], None]) -> None:
    """Serve the page of a case until Ctrl-C.

    Parameters
    ----------
    first : FirstRun
        The run of the case.
    address : str
    port : int
        That is free.
    show : bool
        Whether to open a browser.
    said : callable
        Called with the address of the page.
    """
    pn.config.raw_css = [STYLE]

    def page() -> Any:
        pn.state.curdoc.title = f"{first.case.name} - scissordyn"
        return Page(first.case, first).layout()

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
        title=f"{first.case.name} - scissordyn",
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
