"""Requests and messages that the explorer's page does not send, made at random."""

from __future__ import annotations

import json
import random
import string
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

__all__ = ["PATHS", "malformed_message", "malformed_requests"]

PATHS = (
    "",
    "start.js",
    "autoload.js",
    "static/js/bokeh.min.js",
    "static/extensions/panel/panel.min.js",
    "ws",
    "metadata",
    "nothing",
)
"""What the server has, below the page's address."""


def _junk(chance: random.Random, depth: int = 0) -> Any:
    """Any JSON, some of it with names that the library knows."""
    kind = chance.randrange(9 if depth < 4 else 6)
    words = (
        "type",
        "ref",
        "id",
        "kind",
        "ModelChanged",
        "map",
        "ndarray",
        "entries",
        "object",
        "p1001",
        "events",
        "../../etc/passwd",
    )
    if kind == 0:
        return chance.choice([None, True, False, 0, -1, 1e308, 2**70, float("1e-320")])
    if kind in (1, 2):
        return chance.choice(words)
    if kind in (3, 4, 5):
        return "".join(chance.choices(string.printable, k=chance.randrange(30)))
    if kind == 6:
        return [_junk(chance, depth + 1) for _ in range(chance.randrange(5))]
    return {chance.choice(words): _junk(chance, depth + 1) for _ in range(chance.randrange(6))}


def _own_message(chance: random.Random, models: dict[str, str]) -> dict[str, Any]:
    """A message of one of the page's parts with wrong content."""
    words = (
        "film",
        "pin",
        "drag",
        "drawn",
        "horizon",
        "theme",
        "start",
        "move",
        "end",
        "undo",
        "stop",
        "python",
        "length",
        "unit 1/upper",
    )
    data = {
        name: chance.choice([_junk(chance), chance.choice(words)])
        for name in chance.sample(
            ["type", "key", "text", "final", "phase", "kind", "name", "dx", "dy", "run", "time", "wanted"], 5
        )
    }
    event = {
        "type": "event",
        "name": "data_event",
        "values": {"type": "map", "entries": [["model", {"id": _any(chance, models)}], ["data", _encoded(data)]]},
    }
    return {"events": [{"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": event}]}


def _any(chance: random.Random, models: dict[str, str]) -> str:
    return chance.choice([*models.values(), "p0"])


def _encoded(value: Any) -> Any:
    """JSON as the library writes it."""
    if isinstance(value, dict):
        return {"type": "map", "entries": [[key, _encoded(inner)] for key, inner in value.items()]}
    return [_encoded(inner) for inner in value] if isinstance(value, list) else value


def malformed_message(chance: random.Random, models: dict[str, str]) -> list[str | bytes]:
    """The fragments of one message."""
    kind = chance.choice([0, 1, *range(2, 7), *range(2, 7), *range(3, 7), *range(3, 7)])
    header = {
        "msgid": "1",
        "msgtype": chance.choice(["PATCH-DOC", "PUSH-DOC", "PULL-DOC-REQ", "OK", "ERROR", "ACK", "nothing"]),
    }
    if kind == 0:  # no message at all
        return [
            chance.choice([b"\x00\xff", "", "{", "[]", "null", json.dumps(_junk(chance))])
            for _ in range(chance.randrange(1, 5))
        ]
    if kind == 1:
        return [json.dumps(_junk(chance)), "{}", json.dumps(_junk(chance))]
    if kind == 2:
        return [json.dumps(header), "{}", json.dumps(_junk(chance))]
    header["msgtype"] = "PATCH-DOC"
    if kind == 3:
        content: Any = _own_message(chance, models)
    elif kind == 4:
        content = {"events": [_junk(chance) for _ in range(chance.randrange(3))]}
    else:
        changed = {"kind": chance.choice(["ModelChanged", "MessageSent", "RootAdded", "ColumnDataChanged", "TitleChanged"])}
        content = {
            "events": [
                {
                    **changed,
                    "model": {"id": _any(chance, models)},
                    "attr": chance.choice(["tags", "data", "name", "selected", "x"]),
                    "new": _junk(chance),
                }
            ]
        }
    return [json.dumps(header), "{}", json.dumps(content)]


def malformed_requests(chance: random.Random, url: str) -> Iterator[bytes]:
    """Malformed requests, as bytes."""
    parts = urlsplit(url)
    while True:
        method = chance.choice(["GET", "GET", "GET", "POST", "OPTIONS", "HEAD", "G\0T", "", "PRI"])
        below = chance.choice(
            [
                *PATHS,
                "../../../../etc/passwd",
                "static/js/../../../../etc/passwd",
                "static/js/%2e%2e/%2e%2e/x",
                "static/js//etc/passwd",
            ]
        )
        noise = "".join(chance.choices(string.printable.replace("\n", "").replace("\r", ""), k=chance.randrange(40)))
        path = chance.choice(
            [
                parts.path + below,
                parts.path + below + noise,
                f"/{noise}",
                f"{parts.path}{below}?bokeh-token={noise}&resources=%ff&bokeh-session-id=x",
            ]
        )
        lines = [f"{method} {path} HTTP/1.{chance.choice('1102')}"]
        for _ in range(chance.randrange(4)):
            name = chance.choice(
                [
                    "Host",
                    "Origin",
                    "Cookie",
                    "Upgrade",
                    "Connection",
                    "Content-Length",
                    "Bokeh-Session-Id",
                    "Range",
                    noise[:9] or "X",
                    "Sec-WebSocket-Protocol",
                ]
            )
            value = chance.choice(
                [
                    parts.netloc,
                    "websocket",
                    "Upgrade",
                    noise,
                    "-1",
                    "99999999999",
                    "bytes=9-1",
                    "bokeh, x.y.z",
                    "bokeh, eyJ4IjoxfQ.AAAA",
                ]
            )
            lines.append(f"{name}: {value}")
        if chance.random() < 0.8:
            lines.insert(1, f"Host: {parts.netloc}")
        yield ("\r\n".join(lines) + "\r\n\r\n" + noise * chance.randrange(2)).encode("latin-1", "replace")
