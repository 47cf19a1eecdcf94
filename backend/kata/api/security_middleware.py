"""What is looked at before anything else: by which name the service is addressed, from whose page, and how much is sent.

It stands around the whole application, its error pages included. What it refuses has reached no route, no cookie has been read.
"""

import re
import socket
from collections.abc import Iterable
from ipaddress import ip_address
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kata.api import errors, texts
from kata.messages import NO_TEXT, Text
from kata.settings import Settings

LARGEST_BODY: Final = 1 << 20
"""Bytes of a request in JSON: a hundred times the longest note."""
LARGEST_FILE: Final = 1 << 26
"""Bytes of a file: an hour's motion as CSV, a FHIR bundle."""
_FILES: Final = ("text/csv", "application/fhir+json")
_LOOPBACK: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})
_HOST: Final = re.compile(
    r"(?P<name>[A-Za-z0-9](?:[A-Za-z0-9.-]{0,252}[A-Za-z0-9])?|\[[0-9A-Fa-f:.]{2,45}\])(?::[0-9]{1,5})?"
)
_SAFE_METHODS: Final = ("GET", "HEAD")

_POLICY: Final = (
    "default-src 'none'; script-src 'self'; {styles}; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; "
    "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_NO_STYLES: Final = "style-src 'self'"
_EMPTY: Final = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"
_HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=(), display-capture=(), usb=(), serial=(), payment=()",
    "Content-Security-Policy": _POLICY.format(styles=_NO_STYLES),
}
_HSTS: Final = "max-age=31536000; includeSubDomains"


DOCUMENTATION_POLICY: Final = _POLICY.format(styles=_NO_STYLES).replace("form-action 'none'", "form-action 'self'")
"""The Content-Security-Policy of the documentation: its search is a form that leads to its own search page."""


def page_policy(nonce: str) -> str:
    """The Content-Security-Policy of the page itself.

    Scripts only from files of this service. Mantine puts its variables into a style element, which carries ``nonce``; Plotly
    makes an empty one and fills it by script, which the hash of nothing allows. Nobody's text can become a style.
    """
    return _POLICY.format(styles=f"style-src 'self' 'nonce-{nonce}' {_EMPTY}")


def allowed_hosts(settings: Settings) -> frozenset[str]:
    """The names that a request may address: loopback's, this computer's where others can reach it, and those in the settings."""
    own = set() if settings.is_on_loopback else {name.lower() for name in (socket.gethostname(), socket.getfqdn())}
    return _LOOPBACK | {name for name in own if _HOST.fullmatch(name)} | settings.named_hosts


class SecurityMiddleware:
    """Refuses strange hosts, changes and WebSockets that another site's page asks for, and bodies that are too long."""

    def __init__(self, app: ASGIApp, hosts: Iterable[str]) -> None:
        """``hosts``: see :func:`allowed_hosts`. The address at which a connection has arrived is allowed as well."""
        self._app = app
        self._hosts = frozenset(hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Look, and let through."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self.refusal(scope)
        if scope["type"] == "websocket" and refused:
            # Before it has been accepted this is a 403, and no upgrade.
            await send({"type": "websocket.close", "code": 1008, "reason": refused[1]})
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        elif refused:
            await errors.document(*refused)(scope, receive, _headed(send, scope))
        else:
            await self._app(scope, _measured(receive, _limit(Headers(scope=scope))), _headed(send, scope))

    def refusal(self, scope: Scope) -> tuple[int, str, Text, Text] | None:
        """Status, code, sentence and next step of what is wrong with a request's headers; None where nothing is."""
        headers = Headers(scope=scope)
        host = _only(headers, "host")
        found = _HOST.fullmatch(host) if host else None
        if not (host and found and self._is_own(found["name"].lower(), scope)):
            return (
                400,
                "unknown_host",
                texts.UNKNOWN_HOST(),
                texts.USE_PRINTED_ADDRESS(),
            )
        if _is_foreign(scope, headers, f"{'https' if _encrypted(scope) else 'http'}://{host}".lower()):
            return 403, "foreign_origin", texts.FOREIGN_ORIGIN(), texts.OPEN_OWN_PAGE()
        length = headers.get("content-length", "0")
        if scope["type"] == "http" and (not length.isdecimal() or int(length) > _limit(headers)):
            return 413, "content_too_large", texts.TOO_MUCH_SENT(limit=_limit(headers)), NO_TEXT
        return None

    def _is_own(self, name: str, scope: Scope) -> bool:
        if name in self._hosts:
            return True
        # Another site can have its own name lead here (DNS rebinding), but no page of it has this address as its host.
        try:
            return scope["server"] is not None and ip_address(name.strip("[]")) == ip_address(scope["server"][0])
        except ValueError:
            return False


def _is_foreign(scope: Scope, headers: Headers, own: str) -> bool:
    """Whether a browser says that another site's page asks; who is no browser says nothing, and has no one else's cookies."""
    site, origin = _only(headers, "sec-fetch-site"), _only(headers, "origin")
    if origin is None or site is None:
        return True
    if scope["type"] == "http" and scope["method"] in _SAFE_METHODS:
        # A link from elsewhere may open the page; nothing of it may be embedded or read.
        opened = headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"
        return site not in ("", "same-origin", "none") and not opened
    return site not in ("", "same-origin") or origin.lower() not in ("", own)


def _only(headers: Headers, name: str) -> str | None:
    """A header's value, empty when it is missing or says nothing; None when it stands there twice."""
    values = headers.getlist(name)
    return None if len(values) > 1 else "".join(values)


def _limit(headers: Headers) -> int:
    """Bytes."""
    return LARGEST_FILE if headers.get("content-type", "").split(";")[0].strip().lower() in _FILES else LARGEST_BODY


def _measured(receive: Receive, limit: int) -> Receive:
    """A body that does not say how long it is, is counted while it comes."""
    taken = 0

    async def counting() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > limit:
            raise HTTPException(413, texts.TOO_MUCH_SENT(limit=limit))
        return message

    return counting


def _encrypted(scope: Scope) -> bool:
    return scope["scheme"] in ("https", "wss")


def _headed(send: Send, scope: Scope) -> Send:
    """What every answer says to the browser, where it does not say something stricter of its own."""

    async def heading(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
            # Files of the page name how long they may be kept; what the API tells is a patient's, and kept by nobody.
            headers.setdefault("Cache-Control", "no-store")
            if _encrypted(scope):
                headers.setdefault("Strict-Transport-Security", _HSTS)
        await send(message)

    return heading
