"""Page of the explorer without a browser, which records the messages that it sends."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

from scissordyn.explore.page import Page
from scissordyn.explore.serve import pack_message
from scissordyn.explore.session import Session

PATIENCE = 600.0  # [s] Longest wait for a thread, which may first compile all kernels on a busy machine


def until(condition):
    """Wait until a condition holds, which a thread makes true."""
    ends = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < ends, f"it did not happen within {PATIENCE:g} s"
        time.sleep(0.02)


class Heard:
    """Page of a case with the messages that it has sent; it confirms each run as drawn unless `blind`."""

    def __init__(self, case):
        self.messages: list[Mapping[str, Any]] = []
        self.blind = False
        self.page = Page(Session(case, lambda what: None), self.send)
        self.page.begin()

    def send(self, message):
        """Record a message of the page."""
        pack_message(message)
        self.messages.append(message)

    def say(self, kind, **more):
        """Send a message to the page."""
        self.page.hear(json.dumps({"type": kind, **more}))

    def of(self, kind):
        """Return the messages of a kind."""
        return [message for message in self.messages if message["type"] == kind]

    def until_run(self, number):
        """Wait for a run of the case with a number above `number`; return its message."""

        def is_there() -> bool:
            runs = self.of("run")
            if runs and not self.blind:
                self.say("drawn", run=runs[-1]["run"])
            return self._later(number) != [] and not self.of("state")[-1]["computing"]

        until(is_there)
        run = self._later(number)[-1]
        self.say("drawn", run=run["run"])
        return run

    def _later(self, number):
        return [run for run in self.of("run") if run["run"] > number and not run["bar"]["note"]]
