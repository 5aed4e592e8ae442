"""Who may use the page: whoever knows its address, which has a random part, and calls this machine by a name of its own.

A page of another site can have its own name lead to this machine (DNS rebinding): its browser then sends requests here, as to
the site's own server, with the site's name as their host. So every request is looked at, whatever it asks for.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

LOCAL = ("127.0.0.1", "localhost", "::1")

ELSEWHERE = "open the address that 'scissordyn explore' has printed"


def _bound(listening: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    return ipaddress.ip_address(str(listening.getsockname()[0]).partition("%")[0])


def is_local(listening: socket.socket) -> bool:
    """Whether only this machine reaches a socket."""
    return _bound(listening).is_loopback


def is_everywhere(listening: socket.socket) -> bool:
    """Whether a socket listens on all addresses of this machine."""
    return _bound(listening).is_unspecified


@dataclass(frozen=True)
class Access:
    """The first part of the path, and the names of this machine; `any_number`: also any address in numbers."""

    token: str
    names: Collection[str]
    any_number: bool = False

    @classmethod
    def to(cls, listening: socket.socket, address: str) -> Access:
        """To a socket that listens on an address, with a new token."""
        bound, host = _bound(listening), socket.gethostname().lower()
        if bound.is_loopback:
            names = {*LOCAL, str(bound), address.lower()}
        elif bound.is_unspecified:
            names = {*LOCAL, host}
        else:
            names = {str(bound), address.lower(), host}
        return cls(secrets.token_urlsafe(24), frozenset(names), bound.is_unspecified)

    @property
    def folder(self) -> str:
        """The path of the page."""
        return f"/{self.token}/"

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> tuple[int, str] | None:
        """Why a request with these headers is refused: status and one line; None if it is not."""
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return 403, f"no page of this host; {ELSEWHERE}"
        if origins and list(origins) not in ([f"http://{hosts[0]}"], [f"https://{hosts[0]}"]):
            return 403, "no page of another site may talk to this one"
        first = path.split("/", 2)
        has_token = len(first) == 3 and hmac.compare_digest(first[1].encode("utf-8", "replace"), self.token.encode())
        return None if has_token else (404, f"nothing here; {ELSEWHERE}")

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
            return name in self.names or (self.any_number and ipaddress.ip_address(name) is not None)
        except ValueError:
            return False
