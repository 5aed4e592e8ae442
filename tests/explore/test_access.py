"""Who may use the page, and what is answered to everybody else: a server in a process of its own, messages made at random."""

from __future__ import annotations

import asyncio
import http.client
import json
import os
import random
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

import scissordyn
from scissordyn.cli.main import status_of

pytest.importorskip("panel", reason="the package panel is not installed")

from tornado.httpclient import HTTPRequest
from tornado.httputil import HTTPHeaders, HTTPServerRequest, RequestStartLine
from tornado.websocket import WebSocketClientConnection, WebSocketClosedError, websocket_connect

from scissordyn.explore.access import Access
from scissordyn.explore.application import MOST_PAGES
from scissordyn.explore.serve import listen

from .browser import CASE, served
from .malformed import PATHS, malformed_message, malformed_requests

MALFORMED = 1000

LOCAL_PATHS = (
    str(Path(scissordyn.__file__).parent),
    sys.prefix,
    "site-packages",
    str(Path.home()) + "/",
    "Traceback",
    'File "',
)
"""What no answer may have in it."""


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of the page of a case, whose server is ready."""
    path = tmp_path_factory.mktemp("access") / "case.toml"
    path.write_text(CASE)
    with served(path) as found:
        get(found, "start.js")  # answered when there is a page
        yield found


def ask(url: str, path: str, host: str | None = None, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of an answer; the path begins at the root."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(str(parts.hostname), parts.port, timeout=30)
    connection.putrequest(method, path, skip_host=True)
    if host != "":
        connection.putheader("Host", parts.netloc if host is None else host)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    connection.close()
    return found


def get(url: str, path: str, **more: Any) -> tuple[int, dict[str, str], bytes]:
    """An answer to a request below the page's address."""
    return ask(url, urlsplit(url).path + path, **more)


UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec_WebSocket_Version": "13",
    "Sec_WebSocket_Protocol": "bokeh, token",
}


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example:{port}", "", "[::1", "a@127.0.0.1 b"]
)
def test_other_hosts_are_refused(url: str, path: str, host: str) -> None:
    """Contract: whatever is asked for, a host that is no name of this machine gets one line, also with an equal origin."""
    host = host.format(port=urlsplit(url).port)
    headers = UPGRADE if path == "ws" else {}
    for origin in ({}, {"Origin": f"http://{host}"}):
        status, given, body = get(url, path, host=host, **headers, **origin)
        assert status in (400, 403)
        assert "access-control-allow-origin" not in given
        assert len(body.splitlines()) <= 1


@pytest.mark.parametrize("path", PATHS)
def test_other_origins_are_refused(url: str, path: str) -> None:
    """Contract: a page of another site, or of another server of this machine, gets nothing, not even a session."""
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", f"http://localhost:{urlsplit(url).port}"):
        status, given, _ = get(url, path, Origin=origin, **(UPGRADE if path == "ws" else {}))
        assert status == 403
        assert "access-control-allow-origin" not in given


@pytest.mark.parametrize("path", PATHS)
def test_address_without_its_random_part_leads_nowhere(url: str, path: str) -> None:
    """Contract: without the token, or with another one, there is nothing, whatever is asked for."""
    token = urlsplit(url).path.strip("/")
    assert len(token) >= 32
    other = token[:-1] + ("a" if token[-1] != "a" else "b")
    for start in ("/", f"/{other}/", f"/{token.lower()}x/", "//", "/%2e%2e/"):
        status, given, body = ask(url, start + path, **(UPGRADE if path == "ws" else {}))
        assert status == 404
        assert token.encode() not in body
        assert "access-control-allow-origin" not in given


def test_page_is_served_to_its_own_names(url: str) -> None:
    """Contract: names of this machine, also through a tunnel, get the page; no other site may frame or read it."""
    port = urlsplit(url).port
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", "localhost:9999", f"[::1]:{port}"):
        status, given, body = get(url, "", host=host)
        assert status == 200
        assert given["x-frame-options"] == "DENY"
        assert given["referrer-policy"] == "no-referrer"
        assert b"autoload" not in body
    status, given, body = get(url, "autoload.js", Origin=url.rstrip("/").rpartition("/")[0])
    assert status == 200
    assert "access-control-allow-origin" not in given
    assert given["cross-origin-resource-policy"] == "same-origin"
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
        assert get(url, "autoload.js", method=method)[0] == 405


def test_each_start_has_its_own_address(tmp_path: Path) -> None:
    """Contract: two servers have two tokens."""
    with listen("127.0.0.1", 0) as one, listen("127.0.0.1", 0) as two:
        assert Access.to(one, "127.0.0.1").token != Access.to(two, "127.0.0.1").token


@pytest.mark.parametrize(
    ("address", "host", "admitted"),
    [
        ("0.0.0.0", "192.0.2.7:{port}", True),
        ("0.0.0.0", "localhost:{port}", True),
        ("0.0.0.0", "evil.example:{port}", False),
        ("0", "evil.example:{port}", False),
        ("0", "[2001:db8::1]:{port}", True),
        ("127.0.0.2", "127.0.0.2:{port}", True),
        ("127.0.0.2", "192.0.2.7:{port}", False),
    ],
)
def test_hosts_of_an_address(address: str, host: str, admitted: bool) -> None:
    """Contract: listening everywhere admits addresses in numbers and names of this machine, no other name or origin."""
    with listen(address, 0) as listening:
        access = Access.to(listening, address)
        named = host.format(port=listening.getsockname()[1])
        connection: Any = type("Connection", (), {"context": None})()

        def refusal(**headers: str) -> tuple[int, str] | None:
            given, line = HTTPHeaders({"Host": named, **headers}), RequestStartLine("GET", access.folder, "HTTP/1.1")
            return access.refusal(HTTPServerRequest(start_line=line, headers=given, connection=connection))

        assert (refusal() is None) == admitted
        assert (refusal(Origin=f"http://{named}") is None) == admitted
        assert refusal(Origin="http://evil.example") is not None


def test_empty_address_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Contract: no address is an error of one line, and nothing listens anywhere."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    for address in ("", " "):
        assert status_of(["explore", str(path), "--no-browser", "--address", address]) == 2
        said = capsys.readouterr()
        assert len(said.err.splitlines()) == 1
        assert "--address 127.0.0.1" in said.err
        assert said.out == ""


def test_pages_are_counted(tmp_path: Path) -> None:
    """Limit: beyond the largest number of sessions no further one is begun; the answer says so."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    with served(path) as url:
        get(url, "start.js")

        async def fill() -> list[bytes]:
            kept = [await _open(url, *_token(url)) for _ in range(MOST_PAGES)]
            answers = [get(url, "autoload.js")[2] for _ in range(5)]
            for connection in kept:
                connection.close()
                while await asyncio.wait_for(connection.read_message(), 30.0) is not None:
                    pass  # what the server had sent before: the end comes after it
            return answers

        for answer in asyncio.run(fill()):
            assert answer.startswith(b"document.getElementById")
            assert f"{MOST_PAGES} pages of this case".encode() in answer


def _token(url: str) -> tuple[str, str]:
    """The token of a new session, and the address of its socket."""
    body = get(url, "autoload.js")[2].decode()
    token = body.partition('"token":"')[2].partition('"')[0] or body.partition('token\\":\\"')[2].partition('\\"')[0]
    assert token
    parts = urlsplit(url)
    return token, f"ws://{parts.netloc}{parts.path}ws"


async def _open(url: str, token: str, address: str) -> WebSocketClientConnection:
    request = HTTPRequest(address, headers={"Origin": "http://" + urlsplit(url).netloc})
    return await websocket_connect(request, subprotocols=["bokeh", token])


async def _talk(url: str, chance: random.Random, count: int) -> list[str]:
    """Send malformed messages, on a new connection of one session whenever the server has closed one; what was answered."""
    answers: list[str] = []
    sent, (token, address) = 0, _token(url)
    models: dict[str, str] = {}
    while sent < count:
        connection = await _open(url, token, address)
        for _ in range(3):  # the server says that it is there
            await connection.read_message()
        if not models:
            models = {str(k): each["id"] for k, each in enumerate(_objects(await _document(connection)))}
            assert len(models) > 50
        while sent < count and connection.close_code is None:
            sent += 1
            try:
                for fragment in malformed_message(chance, models):
                    await connection.write_message(fragment, binary=isinstance(fragment, bytes))
            except WebSocketClosedError:
                pass
            answers += await _answers(connection, 0.005)
        answers.append(str(connection.close_reason))
        connection.close()
    return answers


async def _document(connection: WebSocketClientConnection) -> Any:
    """The document of a session."""
    for part in ({"msgid": "0", "msgtype": "PULL-DOC-REQ"}, {}, {}):
        await connection.write_message(json.dumps(part))
    while True:
        answer = await asyncio.wait_for(connection.read_message(), 30.0)
        assert answer is not None
        if isinstance(answer, str) and '"roots"' in answer:
            return json.loads(answer)


async def _answers(connection: WebSocketClientConnection, patience: float) -> list[str]:
    """What has come, as texts."""
    found: list[str] = []
    while True:
        try:
            answer = await asyncio.wait_for(connection.read_message(), patience)
        except TimeoutError:
            return found
        if answer is None:
            return found
        found.append(answer if isinstance(answer, str) else answer.decode("latin-1"))


def _objects(value: Any) -> Iterator[dict[str, Any]]:
    """All models of a document."""
    if isinstance(value, dict):
        if "id" in value and "name" in value:
            yield value
        for inner in value.values():
            yield from _objects(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _objects(inner)


def _exchange(url: str, request: bytes) -> bytes:
    """What comes back until the server has nothing more to say."""
    parts = urlsplit(url)
    found = b""
    with socket.create_connection((str(parts.hostname), parts.port), timeout=5.0) as connection:
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        try:
            while part := connection.recv(65536):
                found += part
                if len(found) > 2**18:  # a file of a library
                    break
        except (TimeoutError, ConnectionError):
            pass
    return found


def _clean(answer: str) -> None:
    """Whether an answer says nothing of this program's files."""
    for path in LOCAL_PATHS:
        assert path not in answer, answer[:2000]


def test_malformed_requests_get_no_more_than_a_line(url: str) -> None:
    """Limit: of a thousand malformed requests none gets a trace, a path of this machine or a file that is not the page's."""
    chance = random.Random(11)
    statuses = set()
    for request, _ in zip(malformed_requests(chance, url), range(MALFORMED), strict=False):
        answer = _exchange(url, request).decode("latin-1")
        head = answer.partition("\r\n\r\n")[0]
        statuses.add(head[9:12])
        if "javascript" not in head:
            _clean(answer)
        assert "root:" not in answer
        assert not head.startswith("HTTP/1.1 500"), request
    assert {"200", "400", "403", "404", "405"} <= statuses
    assert get(url, "")[0] == 200


def test_malformed_messages_get_no_more_than_a_line(tmp_path: Path) -> None:
    """Limit: of a thousand malformed messages none is answered with a trace or a path, and the server goes on."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    command = [sys.executable, "-m", "scissordyn.cli.main", "explore", str(path), "--no-browser"]
    with (tmp_path / "said").open("w+") as said:  # a pipe would be full of what the library logs
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True)
        assert process.stdout is not None
        try:
            url = process.stdout.readline().split()[0]
            get(url, "start.js")
            answers = asyncio.run(_talk(url, random.Random(5), MALFORMED))
            for answer in answers:
                _clean(answer)
            assert any("a message that the page does not send" in answer for answer in answers)
            assert process.poll() is None
            assert get(url, "")[0] == 200
            time.sleep(0.1)
            threads = len(os.listdir(f"/proc/{process.pid}/task")) if Path("/proc/self/task").exists() else 0
            assert threads < 100
        finally:
            process.terminate()
            process.communicate(timeout=20)
        assert threading.active_count() < 50
