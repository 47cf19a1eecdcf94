"""REST for accounts, for administrators."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Request
from pydantic import Field, StrictBool, StringConstraints

from kata.actor import Role
from kata.auth import accounts, login_session, texts
from kata.auth.login import Access, StationName, TheAccess, Username, auth_services
from kata.auth.tables import AccountRow
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError, check_version
from kata.pagination import Page
from kata.types import NO_NUL, Moment, Name, Schema

router = APIRouter(prefix="/api/accounts", tags=["accounts"])

Stations = Annotated[
    list[StationName], Field(max_length=50, description="Names of the stations that it works at; empty: all.")
]

Subject = Annotated[str, StringConstraints(strip_whitespace=True, max_length=255, pattern=NO_NUL)]


class AccountCreate(Schema):
    """Somebody who may sign in."""

    username: Username = Field(description="Unique; case and width make no difference.", examples=["yamada"])
    name: Name = Field(description="As it stands in records.", examples=["Yamada Hanako"])
    role: Role
    stations: Stations = Field(default_factory=list)


class AccountUpdate(Schema):
    """Any part of it. ``updated_at`` is the one the editor saw; if it has changed since, nothing is saved."""

    name: Name | None = None
    role: Role | None = Field(None, description="Another role signs every browser of the account out.")
    stations: Stations | None = Field(None, description="Other stations sign every browser of the account out.")
    disabled: StrictBool | None = Field(
        None, description="True shuts it and signs every browser of it out, false opens it again."
    )
    openid: Subject | None = Field(
        None,
        description="Who this is at the clinic's OpenID provider (`sub`); empty: no longer anybody. Another one than before signs every "
        "browser of the account out.",
    )
    updated_at: Moment | None = None


class Account(Schema):
    """An account."""

    id: UUID
    username: str
    name: str
    role: Role
    stations: list[str]
    password: bool = Field(description="Whether there is one.")
    second_factor: bool = Field(description="Whether there is one.")
    openid: str | None = Field(description="Who this is at the clinic's OpenID provider (`sub`); null: nobody there.")
    created_at: Moment
    updated_at: Moment
    disabled_at: Moment | None


class Reset(Schema):
    """What is good no longer."""

    second_factor: StrictBool = Field(False, description="Also the second factor, where that was lost.")


class OneTimeCode(Schema):
    """For its owner, to set a password with; shown this one time."""

    account: Account
    code: str = Field(examples=["7KQ2M-XW4HT-PR9CD-3NBVF"])
    until: Moment


@router.get("", responses=PROBLEMS.of(401, 403), summary="List all accounts")
def list_accounts(database: TheDatabase, access: TheAccess) -> Page[Account]:
    """Return every account by user name, including disabled ones. A clinic has few, so the list has no pages."""
    with database.read() as session:
        rows = accounts.every(session)
        return Page[Account].complete([_told(access, row, accounts.stations_of(session, row.id)) for row in rows])


@router.post("", status_code=201, responses=PROBLEMS.of(401, 403, 409, 422), summary="Create an account")
def create_account(database: TheDatabase, access: TheAccess, given: AccountCreate) -> OneTimeCode:
    """Create an account. Its owner sets a password with the returned one-time code."""
    now = access.now()
    with database.write() as session:
        row = accounts.create(session, given.username, given.name, given.role, given.stations, now)
        code = accounts.give_code(row, now)
        return OneTimeCode(
            account=_told(access, row, sorted(set(given.stations))), code=code, until=now + accounts.CODE_LASTS
        )


@router.patch("/{account_id}", responses=PROBLEMS.of(401, 403, 404, 409, 422), summary="Change an account")
def update_account(
    request: Request, database: TheDatabase, access: TheAccess, account_id: UUID, change: AccountUpdate
) -> Account:
    """Change name, role or stations; disable it or open it again. What is signed in with it ends where its rights change."""
    # Not the movable clock: what is written down is the account's version, and differs from change to change.
    now = utc_now()
    with database.write() as session:
        row = accounts.get(session, account_id)
        check_version(row.updated_at, change.updated_at)
        lets_others_in = row.role == "administrator" and row.disabled_at is None
        row.name = change.name or row.name
        stations = accounts.stations_of(session, row.id)
        wanted = stations if change.stations is None else sorted(set(change.stations))
        role = change.role or row.role
        if role != row.role or wanted != stations:
            row.role = role
            accounts.work_at(session, row, wanted)
            login_session.end_all(session, row.id, "role", now)
        if change.openid is not None:
            accounts.link(session, row, _linked(access, change.openid), now)
        if change.disabled is not None:
            accounts.disable(session, row, now, disabled=change.disabled)
        if lets_others_in and (row.role != "administrator" or row.disabled_at is not None):
            accounts.check_administrators_left(session)
        row.updated_at = now
        session.flush()
        told = _told(access, row, wanted)
    auth_services(request).auth_cache.forget_account(account_id)
    access.revocations.notice()
    return told


@router.post(
    "/{account_id}/reset", responses=PROBLEMS.of(401, 403, 404, 422), summary="Issue a new one-time code for an account"
)
def reset_account(
    request: Request, database: TheDatabase, access: TheAccess, account_id: UUID, given: Reset
) -> OneTimeCode:
    """Sign every browser of an account out; its owner sets a new password with the code that is answered."""
    now = access.now()
    with database.write() as session:
        row = accounts.get(session, account_id)
        code = accounts.reset(session, row, now, with_second_factor=given.second_factor)
        session.flush()
        told = OneTimeCode(
            account=_told(access, row, accounts.stations_of(session, row.id)),
            code=code,
            until=now + accounts.CODE_LASTS,
        )
    auth_services(request).auth_cache.forget_account(account_id)
    access.revocations.notice()
    return told


def _linked(access: Access, subject: str) -> str | None:
    """As it is kept."""
    if not subject:
        return None
    if access.openid is None:
        raise ProblemError(
            422,
            "no_openid",
            texts.NO_OPENID(),
            texts.SET_OPENID_FIRST(),
            [("#/openid", texts.OPENID_USELESS_FIELD())],
        )
    return access.openid.linked(subject)


def _told(access: Access, row: AccountRow, stations: list[str]) -> Account:
    return Account(
        id=row.id,
        username=row.username,
        name=row.name,
        role=row.role,
        stations=stations,
        password=row.password_hash is not None,
        second_factor=row.totp_confirmed_at is not None,
        openid=access.openid.subject(row.oidc_subject) if access.openid else None,
        created_at=row.created_at,
        updated_at=row.updated_at,
        disabled_at=row.disabled_at,
    )
