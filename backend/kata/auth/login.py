"""Parts that the routes for login and accounts share: the signed-in user, beginning and renewing login sessions, types of fields."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Protocol
from uuid import UUID

from fastapi import Depends, Request, Response
from pydantic import Field, StringConstraints
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.requests import HTTPConnection

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, Actor, Role
from kata.audit import entries
from kata.auth import accounts, demonstration, login_session, second_factor, texts
from kata.auth.auth_cache import AuthCache
from kata.auth.demonstration import DemonstrationLinks
from kata.auth.factor_key import FactorKey, read_factor_key
from kata.auth.login_session import Limits, Method
from kata.auth.openid import StateCookies
from kata.auth.passwords import Passwords
from kata.auth.permissions import ROLE_PERMISSIONS, Permission, audit_action
from kata.auth.tables import AccountRow
from kata.auth.throttle import USERNAME_POLICY, Throttle
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.types import LONGEST_NAME, NO_NUL, Schema

if TYPE_CHECKING:
    from kata.auth.openid_provider import Provider

log = logging.getLogger(__name__)

Username = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=64, pattern=NO_NUL)]
Password = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=NO_NUL)]
Secret = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=NO_NUL)]
StationName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=LONGEST_NAME, pattern=NO_NUL)
]
_CHECK_PERIOD_S: Final = 0.5
_WRONG_KEY: Final = (
    "the second factors of %d accounts were encrypted with a key that is not in %s: add the line of that key from a backup or from "
    "another service on this database (KATA_SECOND_FACTOR_KEY), and start again; until then these users need recovery codes"
)


class SessionRevocations:
    """Closes open WebSockets and empties the auth cache when a login session ends. This takes effect at once if this service ended the
    session, and within half a second if another service on the database did.
    """

    def __init__(self, database: Database, limits: Limits, now: Callable[[], datetime]) -> None:
        self._database = database
        self._limits = limits
        self._now = now
        self.operator_under_torque: Callable[[], UUID | None] = lambda: None
        """Returns the login session whose user operates an apparatus with torque. Any thread may call it."""
        self._waiting: dict[UUID, set[asyncio.Event]] = {}
        self._check = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

    def check_now(self) -> None:
        """Check now whether login sessions have ended. Any thread may call this."""
        if self._loop:
            self._loop.call_soon_threadsafe(self._check.set)

    async def until_ended(self, login_session_id: UUID) -> None:
        """Return when this login session has ended."""
        ended_event = asyncio.Event()
        self._waiting.setdefault(login_session_id, set()).add(ended_event)
        # The login session may have ended since it was read.
        self._check.set()
        try:
            await ended_event.wait()
        finally:
            self._waiting[login_session_id].discard(ended_event)
            if not self._waiting[login_session_id]:
                del self._waiting[login_session_id]

    @asynccontextmanager
    async def watched(self, auth_cache: AuthCache) -> AsyncIterator[None]:
        """Watch for ended login sessions while the context lasts."""
        self._loop = asyncio.get_running_loop()
        watching = asyncio.create_task(self._watch(auth_cache), name="session revocations")
        try:
            yield
        finally:
            watching.cancel()

    async def _watch(self, auth_cache: AuthCache) -> None:
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(_CHECK_PERIOD_S):
                    await self._check.wait()
            self._check.clear()
            session_ids = set(self._waiting) | auth_cache.login_sessions()
            if not session_ids:
                continue
            try:
                active = await asyncio.to_thread(self._read_active, session_ids)
            except DatabaseUnavailableError:
                # During an outage, login sessions stay valid, so that a running treatment continues and can be stopped. No new login is
                # possible.
                continue
            except SQLAlchemyError:
                log.exception("the ended login sessions could not be read")
                continue
            auth_cache.forget_login_sessions(session_ids - active)
            for login_session_id in session_ids - active:
                for ended_event in self._waiting.get(login_session_id, ()):
                    ended_event.set()

    def _read_active(self, session_ids: set[UUID]) -> set[UUID]:
        with self._database.read_columns() as connection:
            return login_session.select_active(
                connection, session_ids, self._now(), self._limits, self.operator_under_torque()
            )


@dataclass(frozen=True)
class Authentication:
    """Dependencies of authentication besides the database: passwords, throttle, links, limits and the clock."""

    passwords: Passwords
    links: DemonstrationLinks
    revocations: SessionRevocations
    folder: Path
    """The data folder, which contains the set-up link's file."""
    openid: "Provider | None" = None
    """The clinic's OpenID provider, if it has one."""
    state_cookies: StateCookies = field(default_factory=StateCookies)
    factor_key: FactorKey = field(default_factory=FactorKey)
    """Encrypts second factors."""
    set_up_secret: str = ""
    """Secret of the set-up link, which the service prints; empty if there is an administrator."""
    limits: Limits = field(default_factory=Limits)
    throttle: Throttle = field(default_factory=Throttle)
    now: Callable[[], datetime] = utc_now
    read_time_zone: Callable[[Session], str] = lambda _: ""
    """Reads the clinic's time zone: IANA name, or empty if none is set."""


def load_factor_key(file: Path, database: Database) -> FactorKey:
    """Return the key of the second factors. Log an error if it cannot decrypt some of the second factors.

    :raises FactorKeyError: when the key cannot be used.
    """
    key = read_factor_key(file)
    with database.read() as session:
        if count := second_factor.count_undecryptable(session, key):
            log.error(_WRONG_KEY, count, file)
    return key


class AuthServices(Protocol):
    """The services that this package uses. ``kata.api.services.Services`` provides them."""

    @property
    def auth(self) -> Authentication:
        """Return what authentication needs besides the database."""

    @property
    def auth_cache(self) -> AuthCache:
        """Return the auth cache."""


def auth_services(connection: HTTPConnection) -> AuthServices:
    """Return the services of the application that received this request or WebSocket."""
    services: AuthServices = connection.app.state.services
    return services


def _authentication(request: Request) -> Authentication:
    return auth_services(request).auth


TheAuthentication = Annotated[Authentication, Depends(_authentication)]


def authenticate(connection: HTTPConnection, database: Database) -> Actor | None:
    """Return the user who is signed in at the browser of this request or WebSocket, or None."""
    auth = auth_services(connection).auth
    with database.read() as session:
        operator_under_torque = auth.revocations.operator_under_torque()
        return login_session.find_actor(session, cookie_of(connection), auth.now(), auth.limits, operator_under_torque)


def not_signed_in() -> ProblemError:
    """Return the problem of a request without a login: status 401."""
    return ProblemError(401, "not_signed_in", texts.NOBODY_SIGNED_IN(), texts.SIGN_IN())


async def _require_actor() -> Actor:
    actor = CURRENT_ACTOR.get()
    if actor is None:
        raise not_signed_in()
    return actor


TheActor = Annotated[Actor, Depends(_require_actor)]


class Me(Schema):
    """The user of this browser, with permissions."""

    account_id: UUID
    username: str
    name: str = Field(description="The user's name in records.")
    role: Role
    language: str = Field(description="Language of the page; empty: the browser's.")
    permissions: list[Permission]
    stations: list[str] = Field(description="Names of the stations at which this account works; empty: all.")
    locked: bool = Field(description="The screen is locked: only Stop, unlocking and signing out are allowed.")
    enrolling: bool = Field(description="A second factor must be set up before anything else is allowed.")
    second_factor: bool = Field(description="True if the account has a second factor.")
    password: bool = Field(
        description="True if the account has a password. Accounts without a password sign in by OpenID Connect or a link."
    )
    openid: str | None = Field(
        description="Name of the clinic's OpenID provider if this account is linked with it, else null."
    )
    demonstration: bool = Field(description="True if the user signed in by a link of the demonstration clinic.")
    idle_s: float = Field(ge=0, description="The screen locks after this many seconds without user activity.")
    time_zone: str = Field(
        description="Time zone of the clinic, in which the page shows days and times: IANA name; empty: none is set, and the page shows UTC."
    )


def address_of(connection: HTTPConnection) -> str:
    """Return the browser's address."""
    return connection.client.host if connection.client else ""


def start_login_session(
    request: Request, response: Response, session: Session, auth: Authentication, account: AccountRow, method: Method
) -> Me:
    """Authenticate the browser: end its former login session, begin a new one, and record the login in the audit trail."""
    now = auth.now()
    end_browser_session(request, session, auth)
    secret = login_session.begin(
        session, account, method, now, address_of(request), request.headers.get("user-agent", "")
    )
    session.flush()
    actor = login_session.find_actor(session, secret, now, auth.limits)
    if actor is None:
        raise not_signed_in()
    entries.add_entry(
        session, entries.entry(audit_action(request.scope["route"].name), actor=actor, detail={"method": method})
    )
    _set_cookie(request, response, secret)
    auth.throttle.succeeded(f"name {account.username}")
    return describe_user(session, actor, auth)


def renew_login_session(
    request: Request,
    response: Response,
    session: Session,
    auth: Authentication,
    actor: Actor,
    method: Method | None = None,
) -> Actor:
    """Unlock the screen after a reauthentication and renew the cookie. ``method``: as in ``login_session.renew``.

    :raises ProblemError: 401 when the login session has ended in the meantime.
    """
    now = auth.now()
    _set_cookie(request, response, login_session.renew(session, actor.login_session_id, now, method))
    session.flush()
    renewed = login_session.find_actor_by_id(session, actor.login_session_id, now, auth.limits)
    if renewed is None:
        raise ProblemError(401, "not_signed_in", texts.LOGIN_SESSION_ENDED(), texts.SIGN_IN())
    return renewed


def _set_cookie(request: Request, response: Response, secret: str) -> None:
    """Set the cookie of the login session. It ends with the browser."""
    is_secure = request.url.scheme == "https"
    response.set_cookie(
        login_session.SECURE_COOKIE if is_secure else login_session.COOKIE,
        secret,
        secure=is_secure,
        httponly=True,
        samesite="strict",
    )


def end_browser_session(request: Request, session: Session, auth: Authentication) -> Actor | None:
    """End the login session of this browser, and return its user."""
    actor = login_session.find_actor(session, cookie_of(request), auth.now(), auth.limits)
    if actor:
        login_session.end(session, actor.login_session_id, "signed_out", auth.now())
        auth_services(request).auth_cache.forget(cookie_of(request) or "")
    return actor


def describe_user(session: Session, actor: Actor, auth: Authentication) -> Me:
    """Return the user's account and permissions for the page."""
    account = session.get_one(AccountRow, actor.account_id)
    return Me(
        account_id=account.id,
        username=account.username,
        name=account.name,
        role=actor.role,
        language=account.language,
        permissions=sorted(ROLE_PERMISSIONS[actor.role]),
        stations=sorted(actor.stations),
        locked=actor.locked,
        enrolling=actor.enrolling,
        second_factor=account.totp_confirmed_at is not None,
        password=account.password_hash is not None,
        openid=auth.openid.name if auth.openid and auth.openid.subject(account.oidc_subject) else None,
        demonstration=account.username in demonstration.USERNAMES,
        idle_s=auth.limits.idle.total_seconds(),
        time_zone=auth.read_time_zone(session),
    )


def require_reauthentication(
    database: Database, auth: Authentication, actor: Actor, password: str | None, *, password_always: bool = False
) -> None:
    """Reauthenticate before an action that another person at an unlocked screen must not take. No password is needed soon after an
    authentication.

    :param password_always: if True, a recent authentication is enough only for an account without a password.
    :raises ProblemError: 403 ``password_needed``, ``openid_needed`` or ``wrong_password``; 429 after too many attempts.
    """
    with database.read() as session:
        account = session.get_one(AccountRow, actor.account_id)
        is_recent = login_session.has_recent_authentication(session, actor.login_session_id, auth.now())
        if password is None and is_recent and not (password_always and account.password_hash):
            return
        if password is None and account.password_hash is None and auth.openid:
            raise ProblemError(
                403, "openid_needed", texts.OPENID_NEEDED(provider=auth.openid.name), texts.SIGN_IN_THERE_FIRST()
            )
        if password is None:
            raise ProblemError(403, "password_needed", texts.PASSWORD_NEEDED(), texts.GIVE_PASSWORD())
    key = f"sign-in {actor.login_session_id}"
    auth.throttle.begin((key, USERNAME_POLICY))
    if not auth.passwords.verify(account.password_hash, password):
        raise ProblemError(403, "wrong_password", texts.WRONG_PASSWORD(), texts.TRY_AGAIN())
    auth.throttle.succeeded(key)


def set_audited_account(account_id: UUID) -> None:
    """Set the account of an attempted login in the request's audit context."""
    if context := REQUEST_CONTEXT.get():
        context.account_id = account_id


def throttle_key(username: str) -> str:
    """Return the throttle's key of a user name, which need not exist."""
    return f"name {accounts.fold_username(username)}"


def cookie_of(connection: HTTPConnection) -> str | None:
    """Return the cookie of the browser's login session."""
    name = login_session.SECURE_COOKIE if connection.url.scheme in ("https", "wss") else login_session.COOKIE
    return connection.cookies.get(name)
