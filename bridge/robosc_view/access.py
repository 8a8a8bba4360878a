"""Access rules of the page: names of this server, origins, and the token.

A page of another site, shown by a browser on this machine, can send requests to this server. It is kept out in three
ways: the header `Host` must be a name of this server, so that a foreign name that resolves to this machine is of no use
(DNS rebinding); a WebSocket must come from a page of this server (`Origin`); and requests that move the robot need a
token that changes with each start, and that only a page has which was opened with it.
"""

import ipaddress
import secrets
import socket
from collections.abc import Iterable

from robosc_api.security import is_loopback_host, joined
from robosc_api.security.addresses import split_address

MAXIMUM_TOKEN = 200
"""Characters of a token that a page shows."""


class Access:
    """The rules of one server.

    Args:
        host: Host on which it listens.
        port: Port on which it listens.
        is_secure: True if it speaks TLS.
        names: Further names by which it is reached.

    Attributes:
        token: Token that commands need; another one for each start.
    """

    def __init__(self, host: str, port: int, *, is_secure: bool, names: Iterable[str] = ()) -> None:
        self.token = secrets.token_urlsafe(32)
        self._host = host.strip("[]").lower()
        self._port = port
        self._is_loopback = is_loopback_host(self._host)
        self._scheme = "https" if is_secure else "http"
        known = {self._host, *(name.strip("[]").lower() for name in names)}
        self._names = known | {"localhost"} if self._is_loopback else known | {socket.gethostname().lower()}

    @property
    def address(self) -> str:
        """Address to open in a browser on this machine, with the token."""
        return f"{self._scheme}://{joined(self._shown_host(), self._port)}/?token={self.token}"

    def is_ours(self, host: str | None) -> bool:
        """Return True if a header `Host` names this server, or is an IP address, which needs no name service."""
        try:
            name, port = split_address(
                host if host and ":" in host.rpartition("]")[2] else f"{host}:{self._default_port()}"
            )
        except ValueError:
            return False
        if port != self._port:
            return False
        if name.lower() in self._names:
            return True
        try:
            number = ipaddress.ip_address(name)
        except ValueError:
            return False
        return number.is_loopback or not self._is_loopback

    def is_own_page(self, origin: str | None, host: str | None) -> bool:
        """Return True if a header `Origin` names a page of this server, under the name of the request."""
        return bool(host) and origin == f"{self._scheme}://{host}"

    def is_token(self, text: object) -> bool:
        """Return True if a text is the token."""
        if not isinstance(text, str) or not text.isascii() or len(text) > MAXIMUM_TOKEN:
            return False
        return secrets.compare_digest(text, self.token)

    def _default_port(self) -> int:
        return 443 if self._scheme == "https" else 80

    def _shown_host(self) -> str:
        return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self._host, self._host)  # noqa: S104  # compared, not bound
