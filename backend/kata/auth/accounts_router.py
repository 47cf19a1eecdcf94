"""Routes for accounts. Only administrators may use them."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Request
from pydantic import Field, StrictBool, StringConstraints

from kata.actor import Role
from kata.auth import access_tokens, accounts, login_session, texts
from kata.auth.login import Authentication, StationName, TheAuthentication, Username, auth_services
from kata.auth.tables import AccountRow
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError, check_version
from kata.pagination import Page
from kata.types import NO_NUL, Moment, Name, Schema

router = APIRouter(prefix="/api/accounts", tags=["accounts"])

Stations = Annotated[
    list[StationName], Field(max_length=50, description="Names of the account's stations; empty: all.")
]

Subject = Annotated[str, StringConstraints(strip_whitespace=True, max_length=255, pattern=NO_NUL)]


class AccountCreate(Schema):
    """A new account."""

    username: Username = Field(description="Unique; case and width make no difference.", examples=["yamada"])
    name: Name = Field(description="The user's name in records.", examples=["Yamada Hanako"])
    role: Role
    stations: Stations = Field(default_factory=list)


class AccountUpdate(Schema):
    """Changed fields of an account. ``updated_at`` is the value that the editor saw. If the account has changed since, nothing is saved."""

    name: Name | None = None
    role: Role | None = Field(None, description="Changing the role signs out all browsers of the account.")
    stations: Stations | None = Field(None, description="Changing the stations signs out all browsers of the account.")
    disabled: StrictBool | None = Field(
        None, description="True disables the account and signs out all its browsers; false enables it again."
    )
    openid: Subject | None = Field(
        None,
        description="Identity at the clinic's OpenID provider (`sub`); empty: none. Changing it signs out all browsers of the "
        "account.",
    )
    updated_at: Moment | None = None


class Account(Schema):
    """An account."""

    id: UUID
    username: str
    name: str
    role: Role
    stations: list[str]
    password: bool = Field(description="True if the account has a password.")
    second_factor: bool = Field(description="True if the account has a second factor.")
    openid: str | None = Field(description="Identity at the clinic's OpenID provider (`sub`); null: none.")
    created_at: Moment
    updated_at: Moment
    disabled_at: Moment | None


class AccountReset(Schema):
    """Resets in addition to the password."""

    second_factor: StrictBool = Field(False, description="True also removes the second factor.")


class OneTimeCode(Schema):
    """A code with which the account's user sets a password. It is shown only once."""

    account: Account
    code: str = Field(examples=["7KQ2M-XW4HT-PR9CD-3NBVF"])
    until: Moment


@router.get("", responses=PROBLEMS.of(401, 403), summary="List all accounts")
def list_accounts(database: TheDatabase, auth: TheAuthentication) -> Page[Account]:
    """Return all accounts ordered by user name, including disabled ones. A clinic has few accounts, so the list has no pages."""
    with database.read() as session:
        rows = accounts.list_all(session)
        return Page[Account].complete(
            [_as_account(auth, row, login_session.stations_of(session, row.id)) for row in rows]
        )


@router.post("", status_code=201, responses=PROBLEMS.of(401, 403, 409, 422), summary="Create an account")
def create_account(database: TheDatabase, auth: TheAuthentication, body: AccountCreate) -> OneTimeCode:
    """Create an account. Its user sets a password with the returned one-time code."""
    now = auth.now()
    with database.write() as session:
        row = accounts.create(session, body.username, body.name, body.role, body.stations, now)
        code = accounts.issue_code(row, now)
        return OneTimeCode(
            account=_as_account(auth, row, sorted(set(body.stations))), code=code, until=now + accounts.CODE_VALIDITY
        )


@router.patch("/{account_id}", responses=PROBLEMS.of(401, 403, 404, 409, 422), summary="Change an account")
def update_account(
    request: Request, database: TheDatabase, auth: TheAuthentication, account_id: UUID, change: AccountUpdate
) -> Account:
    """Change name, role, stations or identity of an account, or disable or enable it. A change of rights ends the account's login sessions
    and access tokens.
    """
    # Use the real clock, because the time is the account's version and must differ between changes.
    now = utc_now()
    with database.write() as session:
        row = accounts.get(session, account_id)
        check_version(row.updated_at, change.updated_at)
        was_administrator = row.role == "administrator" and row.disabled_at is None
        row.name = change.name or row.name
        stations = login_session.stations_of(session, row.id)
        new_stations = stations if change.stations is None else sorted(set(change.stations))
        role = change.role or row.role
        if role != row.role or new_stations != stations:
            row.role = role
            accounts.set_stations(session, row, new_stations)
            login_session.end_all(session, row.id, "role", now)
            access_tokens.revoke_all(session, row.id, now)
        if change.openid is not None:
            accounts.link_subject(session, row, _stored_subject(auth, change.openid), now)
        if change.disabled is not None:
            accounts.disable(session, row, now, disabled=change.disabled)
        if was_administrator and (row.role != "administrator" or row.disabled_at is not None):
            accounts.check_administrators_left(session)
        row.updated_at = now
        session.flush()
        updated = _as_account(auth, row, new_stations)
    auth_services(request).auth_cache.forget_account(account_id)
    auth.revocations.check_now()
    return updated


@router.post(
    "/{account_id}/reset", responses=PROBLEMS.of(401, 403, 404, 422), summary="Issue a new one-time code for an account"
)
def reset_account(
    request: Request, database: TheDatabase, auth: TheAuthentication, account_id: UUID, body: AccountReset
) -> OneTimeCode:
    """Sign out all browsers of an account and return a one-time code, with which its user sets a new password."""
    now = auth.now()
    with database.write() as session:
        row = accounts.get(session, account_id)
        code = accounts.reset(session, row, now, with_second_factor=body.second_factor)
        session.flush()
        one_time_code = OneTimeCode(
            account=_as_account(auth, row, login_session.stations_of(session, row.id)),
            code=code,
            until=now + accounts.CODE_VALIDITY,
        )
    auth_services(request).auth_cache.forget_account(account_id)
    auth.revocations.check_now()
    return one_time_code


def _stored_subject(auth: Authentication, subject: str) -> str | None:
    """Return the stored form of a subject, or None for an empty subject."""
    if not subject:
        return None
    if auth.openid is None:
        raise ProblemError(
            422,
            "no_openid",
            texts.NO_OPENID(),
            texts.SET_OPENID_FIRST(),
            [("#/openid", texts.OPENID_USELESS_FIELD())],
        )
    return auth.openid.stored_subject(subject)


def _as_account(auth: Authentication, row: AccountRow, stations: list[str]) -> Account:
    return Account(
        id=row.id,
        username=row.username,
        name=row.name,
        role=row.role,
        stations=stations,
        password=row.password_hash is not None,
        second_factor=row.totp_confirmed_at is not None,
        openid=auth.openid.subject(row.oidc_subject) if auth.openid else None,
        created_at=row.created_at,
        updated_at=row.updated_at,
        disabled_at=row.disabled_at,
    )
