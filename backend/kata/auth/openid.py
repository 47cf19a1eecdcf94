"""The clinic's own identity provider, by OpenID Connect: authorization code with PKCE; who somebody is there, and nothing else of them.

The provider says who is there. Who may do what, and that there is such an account at all, stays the clinic's: a subject that no
administrator has linked with an account is let in nowhere. Browsers here are shared, so the provider is told to ask anew each time, and has
to say when it did (``auth_time``): its own sign-in that somebody has left open lets the next one in nowhere.
"""

import hmac
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import Any, Final
from uuid import UUID

import msgspec
from anyio import CapacityLimiter
from authlib.integrations.base_client import OAuthError
from authlib.integrations.requests_client import OAuth2Session
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from cryptography.fernet import Fernet, InvalidToken
from joserfc import jwt
from joserfc.errors import InvalidClaimError, JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry
from requests import RequestException

from kata.auth import secrets, texts
from kata.errors import ProblemError
from kata.settings import Settings, is_safe

log = logging.getLogger(__name__)

LASTS: Final = timedelta(minutes=10)
"""So long somebody may take at the provider."""
_CONNECT_S: Final = 3.0
_ANSWER_S: Final = 5.0
_AT_ONCE: Final = 4
_KEPT_S: Final = 600.0
"""So long what the provider says of itself is believed; its keys are asked for at each sign-in."""
_CLOCKS_APART_S: Final = 60
_ALGORITHMS: Final = (
    "RS256",
    "RS384",
    "RS512",
    "PS256",
    "PS384",
    "PS512",
    "ES256",
    "ES384",
    "ES512",
    "Ed25519",
    "EdDSA",
)
"""Signatures by a key that only the provider has; never ``none``, never one by a shared secret."""
_LONGEST_SUBJECT: Final = 255


class OpenIdError(Exception):
    """What the settings say of the provider cannot be used; the message says why."""


class OidcLoginState(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A sign-in that has begun at one browser, whose cookie holds this, sealed."""

    state: str
    nonce: str
    verifier: str
    redirect: str
    """Where the provider sends the browser back to."""
    to: str
    """Where its user wants to go afterwards: a screen of the page."""
    at: datetime


class PendingMfa(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The provider has said who is at this browser; the code of the account's own second factor is still to come."""

    account_id: UUID
    to: str


class Sealed:
    """What a browser keeps for us between two requests, and can neither read nor change. Good for ten minutes, and until the service ends."""

    def __init__(self) -> None:
        self._fernet = Fernet(Fernet.generate_key())

    def close(self, content: OidcLoginState | PendingMfa, now: datetime) -> str:
        """For a cookie."""
        return self._fernet.encrypt_at_time(msgspec.json.encode(content), int(now.timestamp())).decode()

    def open(self, cookie: str | None, now: datetime) -> OidcLoginState | PendingMfa | None:
        """What is in it; None where it is not ours, or too old."""
        try:
            told = self._fernet.decrypt_at_time(cookie or "", int(LASTS.total_seconds()), int(now.timestamp()))
        except InvalidToken:
            return None
        return msgspec.json.decode(told, type=OidcLoginState | PendingMfa)


class IdTokenClaims(msgspec.Struct, frozen=True):
    """What the provider says of whoever is there."""

    subject: str
    """Never given to anybody else there."""
    two_factors: bool
    """It says that more than one was asked for, in the words that the settings take for that."""


class Provider:
    """Speaks with it. Every method but the constructor blocks, for seconds where it does not answer: call them from a worker thread."""

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.monotonic) -> None:
        """``settings``: with an issuer. ``clock``: seconds.

        :raises OpenIdError: when the client's secret cannot be used.
        """
        self.name = settings.openid_name
        """On the button."""
        self._issuer = settings.openid_issuer
        self._client = settings.openid_client_id
        self._secret = _secret(settings)
        self._factors = frozenset(part.strip() for part in settings.openid_second_factor.split(",") if part.strip())
        self.room = CapacityLimiter(_AT_ONCE)
        """For the threads that wait for it; all others are the clinic's."""
        self._clock = clock
        self._lock = threading.Lock()
        self._known: tuple[float, dict[str, Any]] | None = None

    def linked(self, subject: str) -> str:
        """As it is kept with an account: of another provider the same subject is somebody else."""
        return f"{self._issuer} {subject}"

    def subject(self, linked: str | None) -> str | None:
        """The other way round; None where that account is none of this provider's."""
        issuer, _, subject = (linked or "").partition(" ")
        return subject if issuer == self._issuer else None

    def begin(self, redirect: str, to: str, now: datetime) -> tuple[str, OidcLoginState]:
        """Where to send the browser, and what it is to keep meanwhile.

        :raises ProblemError: 503 when the provider does not answer.
        """
        begun = OidcLoginState(
            state=secrets.fresh(), nonce=secrets.fresh(), verifier=secrets.fresh(), redirect=redirect, to=to, at=now
        )
        with self._speaking():
            metadata = self._metadata()
            with self._session(metadata) as session:
                address, _ = session.create_authorization_url(
                    metadata["authorization_endpoint"],
                    state=begun.state,
                    code_verifier=begun.verifier,
                    nonce=begun.nonce,
                    redirect_uri=redirect,
                    prompt="login",
                    max_age=0,
                )
        return str(address), begun

    def confirm(self, begun: OidcLoginState, code: str, now: datetime) -> IdTokenClaims:
        """Who is there, for the code that the browser came back with.

        :raises ProblemError: 401 when the provider knows no such code, or what it says is not to be believed; 503 when it does not answer.
        """
        with self._speaking():
            metadata = self._metadata()
            with self._session(metadata) as session:
                token = session.fetch_token(
                    metadata["token_endpoint"],
                    grant_type="authorization_code",
                    code=code,
                    redirect_uri=begun.redirect,
                    code_verifier=begun.verifier,
                    allow_redirects=False,
                )
                keys = KeySet.import_key_set(self._fetched(session, metadata["jwks_uri"]))  # type: ignore[arg-type]
            claims = self._claims(token, keys, begun, now)
        amr = claims.get("amr") or []
        told = {one for one in (claims.get("acr"), *amr) if isinstance(one, str)}
        return IdTokenClaims(str(claims["sub"]), two_factors=bool(told & self._factors))

    def look(self) -> int:
        """How many keys it signs with, asked anew: for whoever wants to know whether it answers.

        :raises ProblemError: 503 when it does not.
        """
        self._known = None
        with self._speaking():
            metadata = self._metadata()
            with self._session(metadata) as session:
                return len(self._fetched(session, metadata["jwks_uri"])["keys"])

    def is_itself(self, issuer: str | None) -> bool:
        """Whether an answer is this provider's, as far as it says whose it is."""
        return issuer is None or issuer == self._issuer

    def refused(self) -> ProblemError:
        """401: somebody was not let in by the provider's word."""
        return ProblemError(
            401, "openid_refused", texts.OPENID_REFUSED(provider=self.name), texts.BEGIN_AGAIN_OR_ASK_ADMINISTRATOR()
        )

    def down(self) -> ProblemError:
        """503."""
        return ProblemError(
            503,
            "provider_down",
            texts.OPENID_UNAVAILABLE(provider=self.name),
            texts.SIGN_IN_WITH_PASSWORD_MEANWHILE(),
        )

    @contextmanager
    def _speaking(self) -> Iterator[None]:
        try:
            yield
        except (JoseError, OAuthError) as error:
            # Names of claims and codes of errors; nothing of what was signed.
            log.warning("the OpenID provider's word was not taken: %s", error)
            raise self.refused() from error
        except (RequestException, ValueError, KeyError, TypeError) as error:
            log.error("the OpenID provider %s does not answer as it should: %s", self._issuer, error)
            raise self.down() from error

    def _metadata(self) -> dict[str, Any]:
        """What the provider says of itself."""
        with self._lock:
            known, now_s = self._known, self._clock()
        if known and now_s - known[0] < _KEPT_S:
            return known[1]
        with self._session({}) as session:
            told = self._fetched(session, get_well_known_url(self._issuer, external=True))
        if told["issuer"] != self._issuer:
            raise ValueError(f"it calls itself {told['issuer']!r}")
        for name in ("authorization_endpoint", "token_endpoint", "jwks_uri"):
            if not is_safe(told[name]):
                raise ValueError(f"its {name} is not reached by TLS")
        with self._lock:
            self._known = now_s, told
        return told

    def _session(self, metadata: dict[str, Any]) -> Any:
        """Of one thread and one conversation."""
        methods = metadata.get("token_endpoint_auth_methods_supported", ["client_secret_basic"])
        method = "client_secret_basic" if "client_secret_basic" in methods else "client_secret_post"
        return OAuth2Session(
            self._client,
            self._secret,
            token_endpoint_auth_method=method if self._secret else "none",
            scope="openid",
            code_challenge_method="S256",
            default_timeout=(_CONNECT_S, _ANSWER_S),
        )

    def _fetched(self, session: Any, url: str) -> dict[str, Any]:
        """A JSON object, from there and from nowhere else."""
        answer = session.request("GET", url, withhold_token=True, allow_redirects=False)
        if answer.status_code != 200:
            raise ValueError(f"{url} answers with status {answer.status_code}")
        told = answer.json()
        if not isinstance(told, dict):
            raise TypeError(f"{url} answers with something else")
        return told

    def _claims(self, token: dict[str, Any], keys: KeySet, begun: OidcLoginState, now: datetime) -> Any:
        """Of the ID token: signed by the provider, for us, for this sign-in, now.

        :raises JoseError: when it is not.
        """
        signed = token.get("id_token")
        if not isinstance(signed, str):
            raise InvalidClaimError("id_token")
        told = jwt.decode(signed, keys, registry=JWSRegistry(algorithms=list(_ALGORITHMS), strict_check_header=False))
        claims = CodeIDToken(
            told.claims,
            told.header,
            {
                "iss": {"essential": True, "value": self._issuer},
                "aud": {"essential": True, "value": self._client},
                "sub": {"essential": True},
            },
            {"nonce": begun.nonce, "client_id": self._client, "access_token": token.get("access_token")},
        )
        claims.validate(now=int(now.timestamp()), leeway=_CLOCKS_APART_S)
        asked_at = claims.get("auth_time")
        if not isinstance(asked_at, int | float) or asked_at < begun.at.timestamp() - _CLOCKS_APART_S:
            # Somebody else may have signed in there before, at this very browser.
            raise InvalidClaimError("auth_time")
        if not 0 < len(claims["sub"]) <= _LONGEST_SUBJECT:
            raise InvalidClaimError("sub")
        return claims


def login_state_of(begun: OidcLoginState | PendingMfa | None, state: str) -> OidcLoginState | None:
    """What was begun at this browser, if it is what the provider answers to; None for anything else."""
    if isinstance(begun, OidcLoginState) and hmac.compare_digest(begun.state.encode(), state.encode()):
        return begun
    return None


def _secret(settings: Settings) -> str | None:
    """Of this client; None for one that the provider gave none."""
    file = settings.openid_secret_file
    if file is None:
        return None
    try:
        if file.stat().st_mode & 0o007:
            raise OpenIdError(
                f"Others on this computer can read {file}, the secret of OpenID Connect: chmod 600 {file}"
            )
        secret = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise OpenIdError(f"The secret of OpenID Connect cannot be read from {file}: {error}") from error
    if not secret:
        raise OpenIdError(f"{file} is to hold the secret of OpenID Connect, and is empty.")
    return secret
