"""Login by the clinic's OpenID Connect provider: authorization code with PKCE. Kata uses only the subject, no other data of the user.

The provider authenticates the user; Kata's accounts decide what the user may do. A subject that no administrator has linked with an account
cannot sign in. Several users share a browser, so the provider must ask for credentials at each login and state the time (``auth_time``); an
open session at the provider is not enough.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import Any, Final

from anyio import CapacityLimiter
from authlib.integrations.base_client import OAuthError
from authlib.integrations.requests_client import OAuth2Session
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from joserfc import jwt
from joserfc.errors import InvalidClaimError, JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry
from requests import RequestException

from kata.auth import secrets, texts
from kata.auth.openid import IdTokenClaims, OidcLoginState, OpenIdError
from kata.errors import ProblemError
from kata.settings import Settings, is_safe

log = logging.getLogger(__name__)

_CONNECT_S: Final = 3.0
_ANSWER_S: Final = 5.0
_MAX_THREADS: Final = 4
_METADATA_VALID_S: Final = 600.0
"""Time for which the provider's metadata are cached. The provider's keys are fetched at each login."""
_CLOCK_TOLERANCE_S: Final = 60
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
"""Accepted signatures. All are asymmetric; neither ``none`` nor a shared secret is accepted."""
_LONGEST_SUBJECT: Final = 255


class Provider:
    """The client of the provider. Methods with network access block for seconds if the provider does not answer: call them from a worker
    thread.
    """

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.monotonic) -> None:
        """``settings`` must name an issuer. ``clock`` returns seconds.

        :raises OpenIdError: when the client's secret cannot be used.
        """
        self.name = settings.openid_name
        """Name on the login button."""
        self._issuer = settings.openid_issuer
        self._client = settings.openid_client_id
        self._secret = _secret(settings)
        self._factors = frozenset(part.strip() for part in settings.openid_second_factor.split(",") if part.strip())
        self.limiter = CapacityLimiter(_MAX_THREADS)
        """Limits the threads that wait for the provider, so that threads remain for other requests."""
        self._clock = clock
        self._lock = threading.Lock()
        self._cached: tuple[float, dict[str, Any]] | None = None

    def stored_subject(self, subject: str) -> str:
        """Return issuer and subject in the form stored with an account. The same subject at another provider is another person."""
        return f"{self._issuer} {subject}"

    def subject(self, stored_subject: str | None) -> str | None:
        """Return the subject of a stored link, or None if the link belongs to another provider."""
        issuer, _, subject = (stored_subject or "").partition(" ")
        return subject if issuer == self._issuer else None

    def begin(self, redirect: str, to: str, now: datetime) -> tuple[str, OidcLoginState]:
        """Begin a login. Return the address of the provider's login page, and the state for the browser's cookie.

        :raises ProblemError: 503 when the provider does not answer.
        """
        login_state = OidcLoginState(
            state=secrets.new_secret(),
            nonce=secrets.new_secret(),
            verifier=secrets.new_secret(),
            redirect=redirect,
            to=to,
            at=now,
        )
        with self._provider_errors():
            metadata = self._metadata()
            with self._session(metadata) as session:
                address, _ = session.create_authorization_url(
                    metadata["authorization_endpoint"],
                    state=login_state.state,
                    code_verifier=login_state.verifier,
                    nonce=login_state.nonce,
                    redirect_uri=redirect,
                    prompt="login",
                    max_age=0,
                )
        return str(address), login_state

    def confirm(self, login_state: OidcLoginState, code: str, now: datetime) -> IdTokenClaims:
        """Exchange the code that the browser brought back from the provider for the claims about its user.

        :raises ProblemError: 401 when the provider refuses the code or the provider's answer is invalid; 503 when the provider does not
            answer.
        """
        with self._provider_errors():
            metadata = self._metadata()
            with self._session(metadata) as session:
                token = session.fetch_token(
                    metadata["token_endpoint"],
                    grant_type="authorization_code",
                    code=code,
                    redirect_uri=login_state.redirect,
                    code_verifier=login_state.verifier,
                    allow_redirects=False,
                )
                keys = KeySet.import_key_set(self._fetch_json(session, metadata["jwks_uri"]))  # type: ignore[arg-type]
            claims = self._claims(token, keys, login_state, now)
        amr = claims.get("amr") or []
        values = {value for value in (claims.get("acr"), *amr) if isinstance(value, str)}
        return IdTokenClaims(str(claims["sub"]), two_factors=bool(values & self._factors))

    def count_keys(self) -> int:
        """Fetch the provider's keys and return their number, as a check that the provider answers.

        :raises ProblemError: 503 when the provider does not answer.
        """
        self._cached = None
        with self._provider_errors():
            metadata = self._metadata()
            with self._session(metadata) as session:
                return len(self._fetch_json(session, metadata["jwks_uri"])["keys"])

    def is_issuer(self, issuer: str | None) -> bool:
        """Return whether the issuer named in an answer is this provider. True if the answer names none."""
        return issuer is None or issuer == self._issuer

    def refusal(self) -> ProblemError:
        """Return the problem of a login that the provider did not confirm: status 401."""
        return ProblemError(
            401, "openid_refused", texts.OPENID_REFUSED(provider=self.name), texts.BEGIN_AGAIN_OR_ASK_ADMINISTRATOR()
        )

    def unavailable(self) -> ProblemError:
        """Return the problem of a provider that does not answer: status 503."""
        return ProblemError(
            503,
            "provider_down",
            texts.OPENID_UNAVAILABLE(provider=self.name),
            texts.SIGN_IN_WITH_PASSWORD_MEANWHILE(),
        )

    @contextmanager
    def _provider_errors(self) -> Iterator[None]:
        try:
            yield
        except (JoseError, OAuthError) as error:
            # The error contains names of claims and error codes, but no values.
            log.warning("the OpenID provider's answer was refused: %s", error)
            raise self.refusal() from error
        except (RequestException, ValueError, KeyError, TypeError) as error:
            log.error("the OpenID provider %s does not answer correctly: %s", self._issuer, error)
            raise self.unavailable() from error

    def _metadata(self) -> dict[str, Any]:
        """Return the provider's metadata, cached."""
        with self._lock:
            cached, now_s = self._cached, self._clock()
        if cached and now_s - cached[0] < _METADATA_VALID_S:
            return cached[1]
        with self._session({}) as session:
            metadata = self._fetch_json(session, get_well_known_url(self._issuer, external=True))
        if metadata["issuer"] != self._issuer:
            raise ValueError(f"its metadata names the issuer {metadata['issuer']!r}")
        for name in ("authorization_endpoint", "token_endpoint", "jwks_uri"):
            if not is_safe(metadata[name]):
                raise ValueError(f"its {name} does not use TLS")
        with self._lock:
            self._cached = now_s, metadata
        return metadata

    def _session(self, metadata: dict[str, Any]) -> Any:
        """Return an HTTP session for the requests of one login. Only one thread may use it."""
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

    def _fetch_json(self, session: Any, url: str) -> dict[str, Any]:
        """Return the JSON object at a URL, without following redirects."""
        answer = session.request("GET", url, withhold_token=True, allow_redirects=False)
        if answer.status_code != 200:
            raise ValueError(f"{url} answers with status {answer.status_code}")
        content = answer.json()
        if not isinstance(content, dict):
            raise TypeError(f"{url} does not answer with a JSON object")
        return content

    def _claims(self, token: dict[str, Any], keys: KeySet, login_state: OidcLoginState, now: datetime) -> Any:
        """Return the claims of the ID token after checking signature, issuer, audience, nonce and times.

        :raises JoseError: when a check fails.
        """
        signed = token.get("id_token")
        if not isinstance(signed, str):
            raise InvalidClaimError("id_token")
        token_parts = jwt.decode(
            signed, keys, registry=JWSRegistry(algorithms=list(_ALGORITHMS), strict_check_header=False)
        )
        claims = CodeIDToken(
            token_parts.claims,
            token_parts.header,
            {
                "iss": {"essential": True, "value": self._issuer},
                "aud": {"essential": True, "value": self._client},
                "sub": {"essential": True},
            },
            {"nonce": login_state.nonce, "client_id": self._client, "access_token": token.get("access_token")},
        )
        claims.validate(now=int(now.timestamp()), leeway=_CLOCK_TOLERANCE_S)
        authenticated_at = claims.get("auth_time")
        if (
            not isinstance(authenticated_at, int | float)
            or authenticated_at < login_state.at.timestamp() - _CLOCK_TOLERANCE_S
        ):
            # Another user may have signed in at the provider before, in the same browser.
            raise InvalidClaimError("auth_time")
        if not 0 < len(claims["sub"]) <= _LONGEST_SUBJECT:
            raise InvalidClaimError("sub")
        return claims


def _secret(settings: Settings) -> str | None:
    """Return the client secret, or None for a public client."""
    file = settings.openid_secret_file
    if file is None:
        return None
    try:
        if file.stat().st_mode & 0o007:
            raise OpenIdError(
                f"Other users of this computer can read {file}, the secret of OpenID Connect: chmod 600 {file}"
            )
        secret = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise OpenIdError(f"The secret of OpenID Connect cannot be read from {file}: {error}") from error
    if not secret:
        raise OpenIdError(f"{file} must contain the secret of OpenID Connect, but is empty.")
    return secret
