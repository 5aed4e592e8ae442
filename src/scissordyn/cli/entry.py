"""Entry point of the program ``scissordyn``."""

from __future__ import annotations

import signal


def run() -> None:
    """Load the commands and run one; Ctrl-C while they are loaded ends the process without a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from scissordyn.cli.main import run as command

    command()
