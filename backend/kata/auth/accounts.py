"""Create, change and disable accounts. The user of an account sets the password. The caller commits."""

import unicodedata
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import delete, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from kata.actor import Role
from kata.auth import access_tokens, demonstration, login_session, second_factor, secrets, texts
from kata.auth.tables import AccountRow, AccountStationRow
from kata.errors import ProblemError, not_found

CODE_VALIDITY: Final = timedelta(hours=24)


def fold_username(username: str) -> str:
    """Return a user name in its stored form, in which width and case make no difference."""
    return unicodedata.normalize("NFKC", username).strip().lower()


def find_by_username(session: Session, username: str, *, to_change: bool = False) -> AccountRow | None:
    """Return the account with this user name, even if it is disabled. ``to_change``: lock the row until the commit."""
    query = select(AccountRow).where(AccountRow.username == fold_username(username))
    return session.scalar(query.with_for_update() if to_change else query)


def find_by_subject(session: Session, subject: str) -> AccountRow | None:
    """Return the account that is linked with an OpenID subject, even if it is disabled. ``subject`` includes the issuer."""
    return session.scalar(select(AccountRow).where(AccountRow.oidc_subject == subject))


def get(session: Session, account_id: UUID) -> AccountRow:
    """Return an account and lock its row until the commit.

    :raises ProblemError: 404.
    """
    row = session.get(AccountRow, account_id, with_for_update=True)
    if row is None:
        raise not_found(texts.ACCOUNT_NOT_FOUND)
    return row


def list_all(session: Session) -> Sequence[AccountRow]:
    """Return all accounts, ordered by user name."""
    return session.scalars(select(AccountRow).order_by(AccountRow.username)).all()


def create(
    session: Session, username: str, name: str, role: Role, stations: Iterable[str], now: datetime
) -> AccountRow:
    """Create an account without a password.

    :raises ProblemError: 409 when the user name is taken.
    """
    row = AccountRow(id=uuid4(), username=fold_username(username), name=name, role=role, created_at=now, updated_at=now)
    session.add(row)
    name_taken = ProblemError(409, "username_taken", texts.USERNAME_TAKEN(), texts.CHOOSE_ANOTHER_USERNAME())
    if row.username in demonstration.USERNAMES:
        raise name_taken
    try:
        session.flush()
    except IntegrityError as error:
        raise name_taken from error
    set_stations(session, row, stations)
    return row


def set_stations(session: Session, row: AccountRow, stations: Iterable[str]) -> None:
    """Set the stations of an account. No station means all stations."""
    session.execute(delete(AccountStationRow).where(AccountStationRow.account_id == row.id))
    session.add_all(AccountStationRow(account_id=row.id, station=station) for station in sorted(set(stations)))


def link_subject(session: Session, row: AccountRow, subject: str | None, now: datetime) -> None:
    """Link an account with an OpenID subject, which replaces the former one. None removes the link.

    :raises ProblemError: 409 when another account has this subject, or for a demonstration account.
    """
    if subject == row.oidc_subject:
        return
    subject_taken = ProblemError(409, "openid_taken", texts.OPENID_TAKEN(), texts.UNLINK_OPENID_FIRST())
    if row.username in demonstration.USERNAMES or (subject and find_by_subject(session, subject)):
        raise subject_taken
    if row.oidc_subject:
        login_session.end_all(session, row.id, "openid", now)
    row.oidc_subject = subject
    try:
        session.flush()
    except IntegrityError as error:
        raise subject_taken from error


def issue_code(row: AccountRow, now: datetime) -> str:
    """Return a new one-time code for setting a password. Earlier codes become invalid."""
    code = secrets.new_code()
    row.code_hash, row.code_until = secrets.hash_secret(code), now + CODE_VALIDITY
    return code


def reset(session: Session, row: AccountRow, now: datetime, *, with_second_factor: bool) -> str:
    """Remove the password, all login sessions and access tokens and, if ``with_second_factor``, the second factor. Return a one-time code
    for setting a new password.
    """
    row.password_hash = None
    row.updated_at = now
    if with_second_factor:
        second_factor.remove(session, row)
    login_session.end_all(session, row.id, "reset", now)
    access_tokens.revoke_all(session, row.id, now)
    return issue_code(row, now)


def code_is_valid(row: AccountRow | None, code: str, now: datetime) -> bool:
    """Return whether the code is the account's valid one-time code."""
    if row is None or row.disabled_at or row.code_hash is None or row.code_until is None:
        return False
    return secrets.matches(secrets.normalize_code(code), row.code_hash) and now < row.code_until


def set_password(
    session: Session, row: AccountRow, password_hash: str, now: datetime, except_session: UUID | None = None
) -> None:
    """Set the password, and end all login sessions of the account except ``except_session``."""
    row.password_hash = password_hash
    row.password_changed_at = row.updated_at = now
    row.code_hash = row.code_until = None
    login_session.end_all(session, row.id, "password", now, except_session)


def disable(session: Session, row: AccountRow, now: datetime, *, disabled: bool) -> None:
    """Disable the account, end its login sessions and revoke its access tokens; or enable it again. Enabling brings none of them back."""
    row.disabled_at = (row.disabled_at or now) if disabled else None
    if disabled:
        row.code_hash = row.code_until = None
        login_session.end_all(session, row.id, "disabled", now)
        access_tokens.revoke_all(session, row.id, now)


def check_administrators_left(session: Session) -> None:
    """Check that an enabled administrator remains.

    :raises ProblemError: 409 when no enabled administrator would remain.
    """
    session.flush()
    if not count_administrators(session):
        raise ProblemError(
            409,
            "last_administrator",
            texts.LAST_ADMINISTRATOR(),
            texts.APPOINT_ADMINISTRATOR_FIRST(),
        )


def count_administrators(session: Session) -> int:
    """Return the number of enabled administrators, without the demonstration account."""
    counted = select(func.count()).where(
        AccountRow.role == "administrator",
        AccountRow.disabled_at.is_(None),
        AccountRow.username.not_in(demonstration.USERNAMES),
    )
    return session.scalar(counted) or 0
