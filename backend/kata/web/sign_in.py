"""REST for signing in and out."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Request, Response
from pydantic import Field, StringConstraints
from sqlalchemy.orm import Session
from starlette.requests import HTTPConnection

from kata.access import accounts, demonstration, sign_in
from kata.access.actor import Actor, Role
from kata.access.demonstration import DemonstrationLinks
from kata.access.passwords import Passwords
from kata.access.permissions import OF_ROLE, Permission
from kata.access.sign_in import Limits, Method
from kata.access.tables import AccountRow
from kata.clinic.dependencies import PROBLEMS, TheDatabase
from kata.clinic.fields import NO_NUL, Schema
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.problems import ProblemError

router = APIRouter(tags=["sign-in"])

Username = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=64, pattern=NO_NUL)]
Password = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=NO_NUL)]
Secret = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=NO_NUL)]
_NOT_SIGNED_IN: Final = ("Nobody is signed in at this browser.", "Sign in.")


@dataclass(frozen=True)
class Access:
    """What signing in takes, besides the database; the application's state holds one."""

    passwords: Passwords
    links: DemonstrationLinks
    limits: Limits = field(default_factory=Limits)
    now: Callable[[], datetime] = utc_now


def _access(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


TheAccess = Annotated[Access, Depends(_access)]


def actor_at(connection: HTTPConnection, database: Database) -> Actor | None:
    """Who is signed in at the browser that this request or WebSocket comes from; None where nobody is."""
    access: Access = connection.app.state.access
    with database.read() as session:
        return sign_in.actor_of(session, cookie_of(connection), access.now(), access.limits)


def _signed_in(request: Request, database: TheDatabase) -> Actor:
    actor = actor_at(request, database)
    if actor is None:
        raise ProblemError(401, "not_signed_in", *_NOT_SIGNED_IN)
    return actor


TheActor = Annotated[Actor, Depends(_signed_in)]


class SignIn(Schema):
    """Who somebody is."""

    username: Username = Field(examples=["yamada"])
    password: Password = Field(examples=["correct horse battery staple"])
    code: Secret | None = Field(
        None, description="Of the second factor: six digits, or a recovery code.", examples=["123456"]
    )


class LinkSignIn(Schema):
    """By a link of the demonstration clinic."""

    secret: Secret = Field(description="What stands in the link behind `link=`; good for one sign-in.")


class Me(Schema):
    """Who is signed in at this browser, and what they may do."""

    account_id: str
    username: str
    name: str = Field(description="As it stands in records.")
    role: Role
    language: str = Field(description="Of the page; empty: the browser's.")
    permissions: list[Permission]
    stations: list[str] = Field(description="Names of the stations that this account works at; empty: all.")
    locked: bool = Field(description="The screen is locked: only Stop, unlocking and signing out are allowed.")
    enrolling: bool = Field(description="A second factor has to be set up before anything else is allowed.")
    second_factor: bool = Field(description="Whether there is one.")
    demonstration: bool = Field(description="Signed in by a link of the demonstration clinic.")


@router.post("/api/sign-in", responses=PROBLEMS.of(401, 403, 422, 429))
def sign_in_by_password(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, given: SignIn
) -> Me:
    """Sign in with user name and password, and with the second factor where there is one."""
    with database.read() as session:
        account = accounts.named(session, given.username)
    fits = access.passwords.fits(account.password_hash if account else None, given.password)
    if account is None or account.disabled_at is not None or not fits:
        # One sentence for everything, so that nobody learns which user names there are.
        raise ProblemError(
            401,
            "wrong_password",
            "User name or password is wrong.",
            "Try again, or ask an administrator for a new one.",
        )
    return _let_in(request, response, database, access, account, "password")


@router.post("/api/sign-in/link", responses=PROBLEMS.of(401, 422))
def sign_in_by_link(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, given: LinkSignIn
) -> Me:
    """Sign in to the demonstration clinic by a link that `kata serve --simulate` has printed."""
    role = access.links.take(given.secret) if access.links.allowed else None
    if role is None:
        raise ProblemError(
            401, "link_used", "This link is used up, or none of this clinic's.", "Start Kata anew for new ones."
        )
    with database.read() as session:
        account = demonstration.account_of(session, role)
    return _let_in(request, response, database, access, account, "link")


@router.post("/api/sign-out", status_code=204, responses=PROBLEMS.of(403))
def sign_out(request: Request, response: Response, database: TheDatabase, access: TheAccess) -> None:
    """Nobody is signed in at this browser any more."""
    with database.write() as session:
        _end(request, session, access)
    for name in (sign_in.COOKIE, sign_in.SECURE_COOKIE):
        response.delete_cookie(name, secure=name == sign_in.SECURE_COOKIE, httponly=True, samesite="strict")


@router.get("/api/me", responses=PROBLEMS.of(401))
def get_me(database: TheDatabase, actor: TheActor) -> Me:
    """Who is signed in at this browser."""
    return _me(database, actor)


def _let_in(
    request: Request, response: Response, database: Database, access: Access, account: AccountRow, method: Method
) -> Me:
    now = access.now()
    with database.write() as session:
        # Whoever was signed in at this browser no longer is.
        _end(request, session, access)
        address = request.client.host if request.client else ""
        secret = sign_in.begin(session, account, method, now, address, request.headers.get("user-agent", ""))
    is_secure = request.url.scheme == "https"
    response.set_cookie(
        sign_in.SECURE_COOKIE if is_secure else sign_in.COOKIE,
        secret,
        secure=is_secure,
        httponly=True,
        samesite="strict",
    )
    with database.read() as session:
        actor = sign_in.actor_of(session, secret, now, access.limits)
    if actor is None:
        raise ProblemError(401, "not_signed_in", *_NOT_SIGNED_IN)
    return _me(database, actor)


def _end(request: Request, session: Session, access: Access) -> None:
    actor = sign_in.actor_of(session, cookie_of(request), access.now(), access.limits)
    if actor:
        sign_in.end(session, actor.sign_in_id, "signed_out", access.now())


def cookie_of(connection: HTTPConnection) -> str | None:
    """What the browser's cookie of its sign-in says."""
    name = sign_in.SECURE_COOKIE if connection.url.scheme in ("https", "wss") else sign_in.COOKIE
    return connection.cookies.get(name)


def _me(database: Database, actor: Actor) -> Me:
    with database.read() as session:
        account = session.get_one(AccountRow, actor.account_id)
    return Me(
        account_id=str(account.id),
        username=account.username,
        name=account.name,
        role=actor.role,
        language=account.language,
        permissions=sorted(OF_ROLE[actor.role]),
        stations=sorted(actor.stations),
        locked=actor.locked,
        enrolling=actor.enrolling,
        second_factor=account.totp_confirmed_at is not None,
        demonstration=account.username in {username for username, _ in demonstration.ACCOUNTS.values()},
    )
