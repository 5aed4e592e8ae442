"""``scissordyn explore``: change the numbers of a case in the browser and watch its run follow."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.errors import InputError, command

if TYPE_CHECKING:
    from scissordyn.explore.case import Case

NEEDED = ("websockets", "tomlkit")


def explore(
    case: Annotated[Path, typer.Argument(help="A case file, a saved run, a study (study.db), or a bifurcation diagram.")],
    port: Annotated[int, typer.Option(help="Port of the page; 0 for any free one.", min=0, max=65535)] = 0,
    address: Annotated[
        str, typer.Option(help="Address to listen on; other machines can open the page unless it is local.")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Whether to open a browser.")] = True,
    allow: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="A file that the case names, which may be read, and executed if it is Python. Repeatable."
        ),
    ] = None,
) -> int:
    """Open a page in the browser with the fields of a case, its animation and its curves; end it with Ctrl-C."""
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(f"the explorer needs {', '.join(missing)}", "the extra 'explore'", "pip install 'scissordyn[explore]'")
    if not case.exists():
        raise InputError(
            f"cannot read '{case}': no such file",
            "a case file or a saved run",
            f"scissordyn new scissor > {command(case)}" if case.suffix in ("", ".toml") else "",
        )
    from scissordyn.explore.access import is_local
    from scissordyn.explore.serve import listen, serve

    listening = listen(address, port)
    if not is_local(listening):
        print(
            f"Warning: with --address {address} everyone who can reach this machine and has the address below can change the "
            f"numbers of '{case.name}', keep the processor busy and download the case and its runs. Nothing is encrypted: "
            "whoever can read the network's traffic reads the address too. No other file of this machine can be read or "
            "written through it.",
            file=sys.stderr,
        )

    def opened() -> Case:
        from scissordyn.explore.case import open_case

        return open_case(case, allow or [])

    try:
        serve(
            opened,
            listening,
            name=case.name,
            address=address,
            show=browser,
            said=lambda url: print(f"{url}  (Ctrl-C ends it)", flush=True),
        )
    finally:
        listening.close()
    return 0
