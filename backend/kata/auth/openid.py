"""State of a login by the clinic's OpenID provider, which the browser carries. :mod:`kata.auth.openid_provider` talks to the provider."""

import hmac
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

import msgspec
from cryptography.fernet import Fernet, InvalidToken

LOGIN_STATE_VALIDITY: Final = timedelta(minutes=10)
"""Time limit of a login at the provider."""


class OpenIdError(Exception):
    """The settings of the provider cannot be used. The message says why."""


class OidcLoginState(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A login that has begun at one browser. The browser's cookie contains it, encrypted."""

    state: str
    nonce: str
    verifier: str
    redirect: str
    """Address to which the provider sends the browser back."""
    to: str
    """The screen to show after the login."""
    at: datetime


class PendingMfa(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A login that the provider has confirmed and that still needs the account's second factor."""

    account_id: UUID
    to: str


class StateCookies:
    """Encrypts the state of a login for a cookie, so that the browser can neither read nor change it. A cookie is valid for ten minutes
    and until the service ends.
    """

    def __init__(self) -> None:
        self._fernet = Fernet(Fernet.generate_key())

    def encrypt(self, content: OidcLoginState | PendingMfa, now: datetime) -> str:
        """Return the value of a cookie."""
        return self._fernet.encrypt_at_time(msgspec.json.encode(content), int(now.timestamp())).decode()

    def decrypt(self, cookie: str | None, now: datetime) -> OidcLoginState | PendingMfa | None:
        """Return the content of a cookie, or None if it is invalid or too old."""
        try:
            content = self._fernet.decrypt_at_time(
                cookie or "", int(LOGIN_STATE_VALIDITY.total_seconds()), int(now.timestamp())
            )
        except InvalidToken:
            return None
        return msgspec.json.decode(content, type=OidcLoginState | PendingMfa)


class IdTokenClaims(msgspec.Struct, frozen=True):
    """The provider's claims about a user."""

    subject: str
    """Identifies the user. It is unique at the provider and never reassigned."""
    two_factors: bool
    """True if the provider states a second factor by one of the values in the settings."""


def login_state_of(login_state: OidcLoginState | PendingMfa | None, state: str) -> OidcLoginState | None:
    """Return the login that this browser has begun if its state matches the provider's answer, else None."""
    if isinstance(login_state, OidcLoginState) and hmac.compare_digest(login_state.state.encode(), state.encode()):
        return login_state
    return None
