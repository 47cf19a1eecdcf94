"""A test OpenID Connect provider: a real HTTP server with a real RSA key, whose answers a test can change."""

import base64
import hashlib
import hmac
import json
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

from joserfc import jwt
from joserfc.jwk import RSAKey

from kata.database.base import utc_now

CLIENT, SECRET = "kata", "of the client: not to be guessed"


@dataclass
class Provider:
    """Every user is `subject`, unless a test changes it."""

    issuer: str = ""
    subject: str = "hanako-7"
    now: Callable[[], datetime] = utc_now
    claims: dict[str, Any] = field(default_factory=dict)
    """Claims to replace; None: left out."""
    metadata: dict[str, Any] = field(default_factory=dict)
    key: RSAKey = field(default_factory=lambda: RSAKey.generate_key(2048, {"kid": "one", "use": "sig"}))
    signs_with: RSAKey | None = None
    """Sign with a key that is not published."""
    header: dict[str, Any] = field(default_factory=dict)
    forged: str = ""
    """Forge the signature with the public key: `none` or HS256."""
    status: int = 200
    """Status of every answer."""
    moved: str = ""
    """Redirect target of every answer."""
    hangs: threading.Event | None = None
    """Answers wait until it is set."""
    asked: list[dict[str, str]] = field(default_factory=list)
    """Parameters of the browsers' requests."""
    _codes: dict[str, dict[str, str]] = field(default_factory=dict)

    def authorize(self, address: str) -> dict[str, str]:
        """Sign in like a browser that is sent to ``address``; return the parameters of the callback."""
        given = dict(parse_qsl(urlsplit(address).query))
        self.asked.append(given)
        code = secrets.token_urlsafe(8)
        self._codes[code] = given | {"auth_time": str(self.now().timestamp())}
        return {"code": code, "state": given["state"], "iss": self.issuer}

    def answer(self, method: str, path: str, headers: Any, body: bytes) -> tuple[int, dict[str, str], bytes]:
        """Return the HTTP request handler."""
        if self.hangs:
            self.hangs.wait(60)
        if self.moved:
            return 307, {"Location": self.moved}, b""
        if self.status != 200:
            return self.status, {}, b"{}"
        split = urlsplit(path)
        if split.path == "/.well-known/openid-configuration":
            metadata: dict[str, Any] = {
                "issuer": self.issuer,
                "authorization_endpoint": f"{self.issuer}/authorize",
                "token_endpoint": f"{self.issuer}/token",
                "jwks_uri": f"{self.issuer}/keys",
            }
            return 200, {}, json.dumps(metadata | self.metadata).encode()
        if split.path == "/keys":
            return 200, {}, json.dumps({"keys": [self.key.as_dict(private=False)]}).encode()
        if split.path == "/authorize":
            # A browser is redirected back at once: its user is signed in.
            back = self.authorize(path)
            redirect = dict(parse_qsl(split.query))["redirect_uri"]
            return 303, {"Location": f"{redirect}?{urlencode(back)}"}, b""
        if split.path == "/token" and method == "POST":
            return self._token(headers, {name: values[0] for name, values in parse_qs(body.decode()).items()})
        return 404, {}, b"{}"

    def _token(self, headers: Any, given: dict[str, str]) -> tuple[int, dict[str, str], bytes]:
        wanted = "Basic " + base64.b64encode(f"{CLIENT}:{SECRET}".encode()).decode()
        if headers["authorization"] != wanted:
            return 401, {}, b'{"error": "invalid_client"}'
        asked = self._codes.pop(given.get("code", ""), None)
        proof = base64.urlsafe_b64encode(hashlib.sha256(given.get("code_verifier", "").encode()).digest()).rstrip(b"=")
        if (
            asked is None
            or asked["redirect_uri"] != given["redirect_uri"]
            or asked["code_challenge"] != proof.decode()
            or asked["code_challenge_method"] != "S256"
        ):
            return 400, {}, b'{"error": "invalid_grant"}'
        now = int(self.now().timestamp())
        claims: dict[str, Any] = {
            "iss": self.issuer,
            "sub": self.subject,
            "aud": CLIENT,
            "iat": now,
            "exp": now + 300,
            "nonce": asked["nonce"],
            "auth_time": int(float(asked["auth_time"])),
        } | self.claims
        claims = {name: value for name, value in claims.items() if value is not None}
        header = {"alg": "RS256", "kid": "one"} | self.header
        signed = self._forged(claims) if self.forged else jwt.encode(header, claims, self.signs_with or self.key)
        tokens = {"access_token": secrets.token_urlsafe(8), "token_type": "Bearer", "id_token": signed}
        return 200, {}, json.dumps(tokens).encode()

    def _forged(self, claims: dict[str, Any]) -> str:
        header = {"alg": self.forged, "kid": "one"}
        parts = [json.dumps(part).encode() for part in (header, claims)]
        content = b".".join(base64.urlsafe_b64encode(part).rstrip(b"=") for part in parts)
        signature = hmac.digest(self.key.as_pem(private=False), content, "sha256") if self.forged == "HS256" else b""
        return (content + b"." + base64.urlsafe_b64encode(signature).rstrip(b"=")).decode()


@contextmanager
def provider(host: str = "127.0.0.1") -> Iterator[Provider]:
    """Run the provider during the context; ``host``: the name in its addresses."""
    made = Provider()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self._answer(b"")

        def do_POST(self) -> None:
            self._answer(self.rfile.read(int(self.headers["content-length"])))

        def _answer(self, body: bytes) -> None:
            status, headers, content = made.answer(self.command, self.path, self.headers, body)
            self.send_response(status)
            for name, value in {"Content-Type": "application/json", **headers}.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        made.issuer = f"http://{host}:{server.server_port}"
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield made
        finally:
            if made.hangs:
                made.hangs.set()
            server.shutdown()
            thread.join()
