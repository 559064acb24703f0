"""Access to the live page: by its address, which ends with a token."""

from __future__ import annotations

import functools
import ipaddress
import os
import re
import secrets
import socket
from typing import TYPE_CHECKING

from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from tornado.httputil import HTTPServerRequest

TOKEN_VARIABLE = "SPHSHELL_PIN_TOKEN"  # as JUPYTER_TOKEN: the address of the next run is the same

_HEADERS = {
    "Cache-Control": "no-cache",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_NO_TOKEN = (
    "open the page at the whole address that was printed (in Python: live.url), with its token"
)
_NO_NAME = "open the page by an IP address of its machine, or by the name that host was set to"
_NO_ORIGIN = "pages of other sites may not connect"


@functools.cache
def process_token() -> str:
    """Return the token of this process: that of the environment, else a random one."""
    given = os.environ.get(TOKEN_VARIABLE)
    if not given:
        return secrets.token_urlsafe(24)
    if not re.fullmatch(r"[\w-]{16,200}", given, re.ASCII):
        raise InvalidParameter(
            TOKEN_VARIABLE, "(not shown)", "must be 16 to 200 letters, digits, '-' and '_'"
        )
    return given


class Access:
    """The rules of one server: its token, names of this machine, headers.

    No cookie takes part: browsers send cookies to every port of a machine, and a page that is
    opened without its address has no rights. The page's own files and its websocket lie in a
    folder named as the token.
    """

    def __init__(self, host: str, address: str) -> None:
        self.token = process_token()
        self.is_open = not ipaddress.ip_address(address.partition("%")[0]).is_loopback
        self._names = {"localhost", host.lower(), socket.gethostname().lower()} - {""}

    def check(self, request: HTTPServerRequest) -> str:
        """Return the file that `request` names.

        Raises PermissionError, whose text is one sentence for the user.
        """
        host = request.headers.get("Host", "").lower()
        if not self.is_own(host):
            raise PermissionError(_NO_NAME)
        origin = request.headers.get("Origin", f"http://{host}").lower()
        if origin not in (f"http://{host}", f"https://{host}"):
            raise PermissionError(_NO_ORIGIN)
        name = request.path[1:]
        given = request.query_arguments.get("token", [b""])[0]
        if not given and "/" in name:
            folder, _, name = name.partition("/")
            given = folder.encode()
        if not secrets.compare_digest(given, self.token.encode()):
            raise PermissionError(_NO_TOKEN)
        return name

    def is_own(self, host: str) -> bool:
        """Tell whether `host`, of a request's header, is a name of this server.

        Another name that leads here was made to, by a page that wants to listen in; an IP
        address cannot be. The port may differ: a tunnel ends at one of its own.
        """
        from tornado.httputil import split_host_and_port

        name = split_host_and_port(host.lower())[0]
        name = name[1:-1] if name.startswith("[") else name
        if name in self._names:
            return True
        try:
            literal = ipaddress.ip_address(name)
        except ValueError:
            return False
        return "%" not in name and (self.is_open or literal.is_loopback)

    def headers(self, host: str = "") -> dict[str, str]:
        """Return the headers of an answer to a request for `host`, which was checked."""
        # Not all browsers count websockets as 'self'.
        sockets = f" ws://{host} wss://{host}" if host else ""
        policy = [
            "default-src 'none'",
            "script-src 'self' 'unsafe-eval'",  # meshcat's own bundle evaluates
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            f"connect-src 'self' data: blob:{sockets}",
            "frame-src 'none'",
            "frame-ancestors 'none'",
            "base-uri 'self'",
            "form-action 'none'",
        ]
        return _HEADERS | {"Content-Security-Policy": "; ".join(policy)}
