"""Requests and messages that the explorer's page does not send, made at random."""

from __future__ import annotations

import json
import random
import string
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

PATHS = ("", "page.js", "page.css", "canvas.js", "ws", "metadata", "nothing")
"""What the server has, below the page's address, and what it has not."""

KINDS = (
    "change",
    "select",
    "drawn",
    "horizon",
    "magnify",
    "drag",
    "pin",
    "unpin",
    "undo",
    "redo",
    "stop",
    "python",
    "curves",
    "open",
)
NAMES = ("type", "key", "text", "final", "phase", "kind", "name", "dx", "dy", "run", "time", "wanted", "factor", "case")
WORDS = (
    *KINDS,
    "pin",
    "length",
    "start",
    "move",
    "end",
    "unit 1/upper",
    "A",
    "drive.speed",
    "120 rpm",
    "auto",
    "../../etc/passwd",
)


def _junk(chance: random.Random, depth: int = 0) -> Any:
    """Any JSON, some of it with names that the page knows."""
    kind = chance.randrange(9 if depth < 4 else 6)
    if kind == 0:
        return chance.choice([None, True, False, 0, -1, 1e308, 2**70, float("1e-320"), float("nan"), float("inf")])
    if kind in (1, 2):
        return chance.choice(WORDS)
    if kind in (3, 4, 5):
        return "".join(chance.choices(string.printable, k=chance.randrange(30)))
    if kind == 6:
        return [_junk(chance, depth + 1) for _ in range(chance.randrange(5))]
    return {chance.choice(NAMES): _junk(chance, depth + 1) for _ in range(chance.randrange(6))}


def malformed_message(chance: random.Random) -> str | bytes:
    """A message that is none, or one of the page with wrong content."""
    kind = chance.randrange(6)
    if kind == 0:
        return chance.choice([b"\x00\xff", "", "{", "[]", "null", "[" * 5000, b"{}", '{"type": {}}', '{"type": "__init__"}'])
    if kind == 1:
        return json.dumps(_junk(chance))
    message = {
        name: chance.choice([_junk(chance), chance.choice(WORDS), chance.uniform(-1e3, 1e3)])
        for name in chance.sample(NAMES, 6)
    }
    return json.dumps(message | {"type": chance.choice(KINDS)})


def malformed_requests(chance: random.Random, url: str) -> Iterator[bytes]:
    """Malformed requests, as bytes."""
    parts = urlsplit(url)
    names = (
        "Host",
        "Origin",
        "Cookie",
        "Upgrade",
        "Connection",
        "Content-Length",
        "Range",
        "Sec-WebSocket-Key",
        "Sec-WebSocket-Version",
    )
    below = (
        *PATHS,
        "../../../../etc/passwd",
        "%2e%2e/%2e%2e/x",
        "//etc/passwd",
        "page.html",
        "../message.py",
        "page.js/../../page.py",
    )
    while True:
        method = chance.choice(["GET", "GET", "GET", "POST", "OPTIONS", "HEAD", "G\0T", "", "PRI"])
        noise = "".join(chance.choices(string.printable.replace("\n", "").replace("\r", ""), k=chance.randrange(40)))
        asked = chance.choice(below)
        path = chance.choice(
            [parts.path + asked, parts.path + asked + noise, f"/{noise}", f"{parts.path}{asked}?x={noise}&y=%ff"]
        )
        lines = [f"{method} {path} HTTP/1.{chance.choice('1102')}"]
        for _ in range(chance.randrange(4)):
            value = chance.choice([parts.netloc, "websocket", "Upgrade", noise, "-1", "99999999999", "bytes=9-1", "13"])
            lines.append(f"{chance.choice([*names, noise[:9] or 'X'])}: {value}")
        if chance.random() < 0.8:
            lines.insert(1, f"Host: {parts.netloc}")
        yield ("\r\n".join(lines) + "\r\n\r\n" + noise * chance.randrange(2)).encode("latin-1", "replace")
