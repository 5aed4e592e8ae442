"""Access to the page: a server in its own process, foreign requests, and random messages."""

import http.client
import json
import random
import select
import socket
import string
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import pytest

import scissordyn

pytest.importorskip("websockets", reason="the package websockets is not installed")

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from scissordyn.explore.listener import STRANGERS_MAX
from scissordyn.explore.serve import MESSAGE_BYTES_MAX, PAGE_FILES, PAGES_MAX, Access, listen

from .browser import CASE, served

PATHS = ("", "page.js", "page.css", "canvas.js", "ws", "metadata", "nothing")
"""Paths below the address of the page; some of them do not exist on the server."""

# Types of the messages that a page sends to the server
MESSAGE_TYPES = (
    *("change", "select", "drawn", "horizon", "magnify", "drag", "pin", "unpin", "undo", "redo", "stop", "python"),
    *("curves", "open"),
)
# Keys of these messages
NAMES = ("type", "key", "text", "final", "phase", "kind", "name", "dx", "dy", "run", "time", "wanted", "factor", "case")
# Texts that random messages contain
WORDS = (
    *MESSAGE_TYPES,
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

MALFORMED = [200, pytest.param(1000, marks=pytest.mark.slow)]  # Number of malformed messages in quick and slow tests
ANSWERING = 0.3  # [s] Longest time until an answer begins; a longer wait means that the server considers a request incomplete

LOCAL_PATHS = (
    *(str(Path(scissordyn.__file__).parent), sys.prefix, "site-packages", f"{Path.home()}/"),
    *("Traceback", 'File "'),
)
"""Paths of this machine, which no answer of the server may contain."""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    """Yield the address of the page of a case, whose server is ready."""
    path = tmp_path_factory.mktemp("access") / "case.toml"
    path.write_text(CASE)
    with served(path) as found:
        yield found


def ask(url, path, host=None, method="GET", **headers):
    """Request a path that begins at the root; return status, headers and body of the answer."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(str(parts.hostname), parts.port, timeout=30)
    connection.putrequest(method, path, skip_host=True)
    if host != "":
        connection.putheader("Host", parts.netloc if host is None else host)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    try:
        answer = connection.getresponse()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    except http.client.RemoteDisconnected:  # nothing at all is answered
        return 400, {}, b""
    finally:
        connection.close()


def get(url, path, **more):
    """Request a path below the page's address; return status, headers and body of the answer."""
    return ask(url, urlsplit(url).path + path, **more)


# Headers of a request for a WebSocket
UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec_WebSocket_Version": "13",
}


# Values of the header `Host` that the server rejects
WRONG_HOSTS = ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example:{port}", "", "[::1", "a@127.0.0.1 b"]
# Values of the header `Origin` that the server rejects
WRONG_ORIGINS = ["http://evil.example", "null", "http://127.0.0.1:1", "http://localhost:{port}"]
WRONG_PATHS = ["/", "/{other}/", "/{lower}x/", "//", "/%2e%2e/"]  # Beginnings of paths without the secret token of the server


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize(
    ("start", "host", "origin", "statuses"),
    [
        *(("/{token}/", host, None, {400, 403}) for host in WRONG_HOSTS),
        *(("/{token}/", host, f"http://{host}", {400, 403}) for host in WRONG_HOSTS),
        *(("/{token}/", None, origin, {403}) for origin in WRONG_ORIGINS),
        *((start, None, None, {404}) for start in WRONG_PATHS),
    ],
)
def test_strangers_are_refused(url, path, start, host, origin, statuses):
    """Contract: other hosts, pages of other sites, and addresses without the token get one line at most for anything."""
    token, port = urlsplit(url).path.strip("/"), urlsplit(url).port
    assert len(token) >= 32
    names = {"port": port, "token": token, "lower": token.lower(), "other": token[:-1] + ("a" if token[-1] != "a" else "b")}
    headers = (UPGRADE if path == "ws" else {}) | ({} if origin is None else {"Origin": origin.format(**names)})
    status, given, body = ask(url, start.format(**names) + path, None if host is None else host.format(**names), **headers)
    assert status in statuses
    assert "access-control-allow-origin" not in given
    assert len(body.splitlines()) <= 1
    assert token.encode() not in body


def test_page_is_served_to_its_own_names(url):
    """Contract: names of this machine, also through a tunnel, get the page; no other site may frame or read it."""
    port = urlsplit(url).port
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", "localhost:9999", f"[::1]:{port}"):
        status, given, body = get(url, "", host=host)
        assert status == 200
        assert given["x-frame-options"] == "DENY"
        assert given["referrer-policy"] == "no-referrer"
        assert b"page.js" in body
    for name in PAGE_FILES:
        status, given, body = get(url, name, Origin=url.rstrip("/").rpartition("/")[0])
        assert status == 200
        assert "access-control-allow-origin" not in given
        assert given["cross-origin-resource-policy"] == "same-origin"
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
        assert get(url, "page.js", method=method)[0] == 405


def test_each_start_has_its_own_address():
    """Contract: two servers have two tokens."""
    with listen("127.0.0.1", 0) as one, listen("127.0.0.1", 0) as two:
        assert Access.for_socket(one, "127.0.0.1").token != Access.for_socket(two, "127.0.0.1").token


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
def test_hosts_of_an_address(address, host, admitted):
    """Contract: listening everywhere admits addresses in numbers and names of this machine, no other name or origin."""
    with listen(address, 0) as listening:
        access = Access.for_socket(listening, address)
        named = host.format(port=listening.getsockname()[1])
        assert (access.refusal(access.folder, [named], []) is None) == admitted
        assert (access.refusal(access.folder, [named], [f"http://{named}"]) is None) == admitted
        assert access.refusal(access.folder, [named], ["http://evil.example"]) is not None
        assert access.refusal(access.folder, [named, named], []) is not None


def opened(url):
    """Return the socket of a new page, as a browser opens it."""
    parts = urlsplit(url)
    return connect(f"ws://{parts.netloc}{parts.path}ws", origin=f"http://{parts.netloc}", max_size=None)


def test_pages_are_counted(url):
    """Limit: beyond the largest number of pages no further one is begun; the answer says so; one that is closed leaves room."""
    with ExitStack() as pages:
        for _ in range(PAGES_MAX):
            pages.enter_context(opened(url)).recv(30.0)
        with opened(url) as further:
            assert f"{PAGES_MAX} pages of this case".encode() in further.recv(30.0)
    time.sleep(0.5)
    with opened(url) as later:
        assert b'"early"' in later.recv(30.0)


def test_message_that_is_too_long_ends_its_page(url):
    """Limit: a message of more than the largest size closes the connection; the server goes on."""
    with opened(url) as page:
        page.send("x" * (MESSAGE_BYTES_MAX + 1))
        with pytest.raises(ConnectionClosed):
            list(iter(lambda: page.recv(30.0), None))
    assert get(url, "")[0] == 200


def _junk(chance, depth=0):
    """Return random JSON data, some with names that the page knows."""
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


def malformed_message(chance):
    """Return a random message that is not valid, or that has wrong content."""
    kind = chance.randrange(6)
    if kind == 0:
        return chance.choice([b"\x00\xff", "", "{", "[]", "null", "[" * 5000, b"{}", '{"type": {}}', '{"type": "__init__"}'])
    if kind == 1:
        return json.dumps(_junk(chance))
    message = {
        name: chance.choice([_junk(chance), chance.choice(WORDS), chance.uniform(-1e3, 1e3)])
        for name in chance.sample(NAMES, 6)
    }
    return json.dumps(message | {"type": chance.choice(MESSAGE_TYPES)})


def malformed_requests(chance, url):
    """Yield malformed requests as bytes."""
    parts = urlsplit(url)
    names = (
        *("Host", "Origin", "Cookie", "Upgrade", "Connection", "Content-Length", "Range"),
        *("Sec-WebSocket-Key", "Sec-WebSocket-Version"),
    )
    other = ("../../../../etc/passwd", "%2e%2e/%2e%2e/x", "//etc/passwd", "page.html", "../serve.py", "page.js/../../page.py")
    while True:
        method = chance.choice(["GET", "GET", "GET", "POST", "OPTIONS", "HEAD", "G\0T", "", "PRI"])
        noise = "".join(chance.choices(string.printable.replace("\n", "").replace("\r", ""), k=chance.randrange(40)))
        asked = chance.choice([*PATHS, *other])
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


def _talk(url, chance, count):
    """Send malformed messages, on a new connection if the server has closed the last one; return the answers."""
    answers = []
    sent = 0
    while sent < count:
        with opened(url) as page:
            try:
                answers.append(page.recv(60.0))  # the case has been read
                while sent < count:
                    sent += 1
                    page.send(malformed_message(chance))
                    answers += _answers(page, 0.001)
                answers += _answers(page, 1.0)
            except ConnectionClosed as closed:
                answers.append(str(closed).encode())
    return answers


def _answers(page, patience):
    """Return the messages that have arrived."""
    answers = []
    while True:
        try:
            answer = page.recv(patience)
        except TimeoutError:
            return answers
        answers.append(answer if isinstance(answer, bytes) else answer.encode())


def _exchange(url, request):
    """Return the answer to a request, until the server closes the connection."""
    parts = urlsplit(url)
    found = b""
    with socket.create_connection((str(parts.hostname), parts.port), timeout=5.0) as connection:
        connection.sendall(request)
        # a server that sees the end before it has read the request need not answer it
        if not select.select([connection], [], [], ANSWERING)[0]:
            connection.shutdown(socket.SHUT_WR)
        try:
            while part := connection.recv(65536):
                found += part
                if len(found) > 2**18:  # a file of a library
                    break
        except (TimeoutError, ConnectionError):
            pass
    return found


def _clean(answer):
    """Check that an answer does not name files of this program."""
    for path in LOCAL_PATHS:
        assert path not in answer, answer[:2000]


@pytest.mark.parametrize("count", MALFORMED)
def test_malformed_requests_get_no_more_than_a_line(url, count):
    """Limit: no malformed request gets a traceback, a path of this machine or a file that is not part of the page."""
    chance = random.Random(11)
    statuses = set()
    for request, _ in zip(malformed_requests(chance, url), range(count), strict=False):
        answer = _exchange(url, request).decode("latin-1")
        head = answer.partition("\r\n\r\n")[0]
        statuses.add(head[9:12])
        if "javascript" not in head:
            _clean(answer)
        assert "root:" not in answer
        assert not head.startswith("HTTP/1.1 500"), request
    assert {"200", "403", "404"} <= statuses
    assert get(url, "")[0] == 200


@pytest.mark.parametrize("count", MALFORMED)
def test_malformed_messages_get_no_more_than_a_line(url, count):
    """Limit: no malformed message is answered with a traceback or a path, and the server goes on."""
    answers = _talk(url, random.Random(5), count)
    for answer in answers:
        _clean(answer.decode("latin-1"))
    assert any(b"unknown message" in answer for answer in answers)
    assert get(url, "")[0] == 200


def test_connections_without_the_token_are_few(url):
    """Limit: of those that send nothing the oldest are dropped; pages are served meanwhile, and an open page goes on."""
    with opened(url) as page, ExitStack() as strangers:
        page.recv(60.0)
        parts = urlsplit(url)
        silent = [
            strangers.enter_context(socket.create_connection((str(parts.hostname), parts.port), timeout=5.0))
            for _ in range(2 * STRANGERS_MAX)
        ]
        assert get(url, "")[0] == 200
        assert silent[0].recv(1) == b""
        silent[-1].setblocking(False)
        with pytest.raises(BlockingIOError):
            silent[-1].recv(1)
        page.send("{}")
        assert page.recv(60.0)


def test_a_lack_of_descriptors_is_outlived():
    """Contract: `accept` drops who has not shown the token, tries again, and returns the next connection."""
    resource = pytest.importorskip("resource", reason="no limit of descriptors")
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    with listen("127.0.0.1", 0) as listener, ExitStack() as ends:
        address = listener.getsockname()
        first, second = (ends.enter_context(socket.create_connection(address, timeout=5.0)) for _ in range(2))
        stranger = ends.enter_context(listener.accept()[0])
        resource.setrlimit(resource.RLIMIT_NOFILE, (stranger.fileno() + 1, limits[1]))
        waiting = threading.Timer(0.2, lambda: resource.setrlimit(resource.RLIMIT_NOFILE, limits))
        waiting.start()
        try:
            ends.enter_context(listener.accept()[0]).sendall(b"x")
        finally:
            waiting.join()
        assert first.recv(1) == b""
        assert second.recv(1) == b"x"
