"""Attack the explorer's page as another user of the machine: silent connections, half requests, and a flood."""

from __future__ import annotations

import http.client
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import SplitResult, urlsplit

from websockets.sync.client import ClientConnection, connect

from benchmarks.attacks.report import Attack, command

__all__ = ["attack"]

CASE = Path(__file__).parents[2] / "examples" / "four_bar.toml"

IDLE = (325, 2000)  # Numbers of connections that are opened and kept open

DESCRIPTORS = (64, 1024)  # Limits of file descriptors of the explorer; 1024 is the limit of most systems

FLOOD_SECONDS, PATIENCE = 5.0, 10.0  # Duration of the flood, and time that the user waits for the page [s]

ABOUT = (
    "The explorer runs with a limit of open descriptors; the attacker has none, and does not know the token. Survived: "
    f"meanwhile and afterwards the page is served within {PATIENCE:g} s, and a page that was open before still answers. "
    "During the flood a browser's request is sent again and again."
)


@contextmanager
def explorer(descriptors: int) -> Iterator[SplitResult]:
    """Start an explorer with at most `descriptors` file descriptors, and yield the address of its page."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors))

    typed = [sys.executable, "-m", "scissordyn.cli.main", "explore", str(CASE), "--no-browser"]
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(typed, stdout=subprocess.PIPE, stderr=errors, text=True, preexec_fn=limit)
        assert process.stdout is not None
        try:
            url = urlsplit(process.stdout.readline().split()[0])
            assert served(url, PATIENCE), "not served before the attack"
            yield url
        finally:
            process.kill()
            process.communicate()


def served(url: SplitResult, patience: float) -> bool:
    """Return whether the page comes in time; a dropped connection is retried, as browsers do."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        connection = http.client.HTTPConnection(str(url.hostname), url.port, timeout=max(until - time.monotonic(), 0.1))
        try:
            connection.request("GET", f"{url.path}page.js")
            answer = connection.getresponse()
            if answer.status == 200 and answer.read():
                return True
        except (OSError, http.client.HTTPException):
            time.sleep(0.05)
        finally:
            connection.close()
    return False


def connections(url: SplitResult, count: int, sent: bytes) -> list[socket.socket]:
    """Open connections that send some bytes and then nothing."""
    opened = []
    for _ in range(count):
        try:
            opened.append(socket.create_connection((str(url.hostname), url.port), timeout=0.5))
            opened[-1].sendall(sent)
        except OSError:  # the server accepts no more, or has dropped it
            continue
    return opened


def held(url: SplitResult, count: int, sent: bytes) -> bool:
    """Return whether the page is served while connections are held, and after they are closed."""
    opened = connections(url, count, sent)
    during = served(url, PATIENCE)
    for connection in opened:
        connection.close()
    return during and served(url, PATIENCE)


@contextmanager
def page(url: SplitResult) -> Iterator[ClientConnection]:
    """Open a page, and yield its connection once the case is read and the first pictures have come."""
    address = f"ws://{url.netloc}{url.path}ws"
    with connect(address, origin=f"http://{url.netloc}", max_size=None) as opened:  # type: ignore[arg-type]
        opened.recv(120.0)
        while not quiet(opened):
            pass
        yield opened


def quiet(opened: ClientConnection) -> bool:
    """Return whether nothing comes for a second."""
    try:
        opened.recv(1.0)
    except TimeoutError:
        return True
    return False


def answers(opened: ClientConnection) -> bool:
    """Return whether a page answers an invalid message."""
    try:
        opened.send("{}")
        return bool(opened.recv(PATIENCE))
    except Exception:  # closed in any way
        return False


def flooded(url: SplitResult) -> tuple[int, int, float, bool]:
    """Return connections in a flood, requests of the page meanwhile, longest wait [s], and whether it is served afterwards."""
    end, opened = time.monotonic() + FLOOD_SECONDS, 0

    def flood() -> None:
        nonlocal opened
        kept: list[socket.socket] = []
        while time.monotonic() < end:
            kept += connections(url, 1, b"GET / HTTP/1.1\r\n")
            opened += 1
            if len(kept) > 200:
                kept.pop(0).close()
        for one in kept:
            one.close()

    thread = threading.Thread(target=flood)
    thread.start()
    requests, longest = 0, 0.0
    while time.monotonic() < end:
        began = time.monotonic()
        served(url, FLOOD_SECONDS + PATIENCE)
        longest = max(longest, time.monotonic() - began)
        requests += 1
    thread.join()
    return opened, requests, longest, served(url, PATIENCE)


def attack(quick: bool = False) -> Sequence[Attack]:
    """Return the rows of the table."""
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    rows = []
    for descriptors in DESCRIPTORS[-1:] if quick else DESCRIPTORS:
        for count in IDLE[:1] if quick else IDLE:
            for what, sent in (("idle connections", b""), ("connections with half a request", b"GET /x HTTP/1.1\r\nHost: ")):
                with explorer(descriptors) as url, page(url) as opened:
                    alive = held(url, count, sent) and answers(opened)
                result = "the page is served meanwhile and afterwards" if alive else "the page is gone"
                rows.append(Attack(f"{count} {what}, {descriptors} descriptors", 1, int(alive), result))
    with explorer(DESCRIPTORS[-1]) as url, page(url) as opened:
        count, requests, longest, alive = flooded(url)
        alive = alive and answers(opened)
    result = f"{count} connections in {FLOOD_SECONDS:g} s; {requests} requests of the page, the longest took {longest:.2g} s"
    return [*rows, Attack("flood of connections", 1, int(alive), result)]


if __name__ == "__main__":
    command("explorer", "The explorer's door", attack, ABOUT)
