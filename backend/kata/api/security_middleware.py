"""Check host, origin and size of every request before anything else, and add security headers to every answer.

The middleware wraps the whole application including its error answers. It reads no cookie.
"""

import re
import socket
from collections.abc import Iterable
from ipaddress import ip_address
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kata.api import errors, texts
from kata.api.body_limits import LARGEST_FILE, limited_body
from kata.messages import NO_TEXT, Text
from kata.settings import Settings

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
"""The Content-Security-Policy of the documentation. The documentation may submit a form, because its search is a form that opens its own
search page.
"""


def page_policy(nonce: str) -> str:
    """Return the Content-Security-Policy of the page.

    It allows scripts only from files of this service. Mantine's style element carries ``nonce``. Plotly creates an empty style element and
    fills it by script; the hash of an empty text allows this. Text of a record can never become a style.
    """
    return _POLICY.format(styles=f"style-src 'self' 'nonce-{nonce}' {_EMPTY}")


def allowed_hosts(settings: Settings) -> frozenset[str]:
    """Return the allowed host names: loopback, this computer's names if other computers can reach it, and those of the settings."""
    names = set() if settings.is_on_loopback else {name.lower() for name in (socket.gethostname(), socket.getfqdn())}
    return _LOOPBACK | {name for name in names if _HOST.fullmatch(name)} | settings.named_hosts


class SecurityMiddleware:
    """Refuses unknown hosts, changes and WebSockets that another site's page sends, and bodies that are too large."""

    def __init__(self, app: ASGIApp, hosts: Iterable[str]) -> None:
        """``hosts``: see :func:`allowed_hosts`. The address at which a connection arrived is also allowed."""
        self._app = app
        self._hosts = frozenset(hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse the request or pass it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self.refusal(scope)
        if scope["type"] == "websocket" and refused:
            # Before acceptance, this message answers 403 without an upgrade.
            await send({"type": "websocket.close", "code": 1008, "reason": refused[1]})
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        elif refused:
            await errors.document(*refused)(scope, receive, _with_security_headers(send, scope))
        else:
            await self._app(scope, limited_body(scope, receive), _with_security_headers(send, scope))

    def refusal(self, scope: Scope) -> tuple[int, str, Text, Text] | None:
        """Return status, code, message and next step if the request must be refused, else None."""
        headers = Headers(scope=scope)
        host = _single_value(headers, "host")
        host_match = _HOST.fullmatch(host) if host else None
        if not (host and host_match and self._is_own(host_match["name"].lower(), scope)):
            return (
                400,
                "unknown_host",
                texts.UNKNOWN_HOST(),
                texts.USE_PRINTED_ADDRESS(),
            )
        if _is_foreign(scope, headers, f"{'https' if _encrypted(scope) else 'http'}://{host}".lower()):
            return 403, "foreign_origin", texts.FOREIGN_ORIGIN(), texts.OPEN_OWN_PAGE()
        length = headers.get("content-length", "0")
        if scope["type"] == "http" and (not length.isdecimal() or int(length) > LARGEST_FILE):
            return 413, "content_too_large", texts.TOO_MUCH_SENT(limit=LARGEST_FILE), NO_TEXT
        return None

    def _is_own(self, name: str, scope: Scope) -> bool:
        if name in self._hosts:
            return True
        # Another site's name can resolve to this address (DNS rebinding), but its page then sends that name as the host.
        try:
            return scope["server"] is not None and ip_address(name.strip("[]")) == ip_address(scope["server"][0])
        except ValueError:
            return False


def _is_foreign(scope: Scope, headers: Headers, own_origin: str) -> bool:
    """Return whether a browser names another site's page as the origin. Other clients send neither these headers nor a browser's
    cookies.
    """
    site, origin = _single_value(headers, "sec-fetch-site"), _single_value(headers, "origin")
    if origin is None or site is None:
        return True
    if scope["type"] == "http" and scope["method"] in _SAFE_METHODS:
        # Another site may link to the page, but not embed or read it.
        opened = headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"
        return site not in ("", "same-origin", "none") and not opened
    return site not in ("", "same-origin") or origin.lower() not in ("", own_origin)


def _single_value(headers: Headers, name: str) -> str | None:
    """Return the value of a header, an empty text if the header is missing, or None if it occurs twice."""
    values = headers.getlist(name)
    return None if len(values) > 1 else "".join(values)


def _encrypted(scope: Scope) -> bool:
    return scope["scheme"] in ("https", "wss")


def _with_security_headers(send: Send, scope: Scope) -> Send:
    """Add the security headers that an answer does not set itself."""

    async def heading(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
            # Static files set their own cache time. Answers of the API contain patients' data and are never cached.
            headers.setdefault("Cache-Control", "no-store")
            if _encrypted(scope):
                headers.setdefault("Strict-Transport-Security", _HSTS)
        await send(message)

    return heading
