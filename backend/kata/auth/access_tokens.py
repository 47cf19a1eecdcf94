"""Access tokens, with which a user's program reads with the user's permissions and changes nothing. The caller commits.

A token is a secret of 256 bits after a prefix, by which scanners of published code recognize it. Only its hash is stored.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from kata.actor import REQUEST_CONTEXT, Actor
from kata.auth import login_session, secrets, texts
from kata.auth.tables import AccessTokenRow, AccountRow
from kata.errors import ProblemError, not_found

PREFIX: Final = "kata_"
MAX_TOKENS: Final = 20
"""Maximum number of valid tokens of one account."""


def create(
    session: Session, account_id: UUID, name: str, validity: timedelta, now: datetime
) -> tuple[AccessTokenRow, str]:
    """Create a token and return its row and the token itself.

    :raises ProblemError: 409 when the account has too many valid tokens.
    """
    if len(list_valid(session, now, account_id)) >= MAX_TOKENS:
        raise ProblemError(409, "too_many_tokens", texts.TOO_MANY_TOKENS(most=MAX_TOKENS), texts.REVOKE_UNUSED_TOKENS())
    token = PREFIX + secrets.new_secret()
    row = AccessTokenRow(
        id=uuid4(),
        account_id=account_id,
        name=name,
        secret_hash=secrets.hash_secret(token),
        created_at=now,
        expires_at=now + validity,
    )
    session.add(row)
    session.flush()
    return row, token


def list_valid(session: Session, now: datetime, account_id: UUID | None = None) -> Sequence[AccessTokenRow]:
    """Return the tokens that are valid now, newest first. ``account_id``: return only those of this account."""
    query = select(AccessTokenRow).where(AccessTokenRow.revoked_at.is_(None), AccessTokenRow.expires_at > now)
    if account_id is not None:
        query = query.where(AccessTokenRow.account_id == account_id)
    return session.scalars(query.order_by(AccessTokenRow.created_at.desc(), AccessTokenRow.id)).all()


def revoke(session: Session, token_id: UUID, now: datetime, owner_id: UUID | None = None) -> None:
    """Revoke a token.

    :param owner_id: account to which the token must belong.
    :raises ProblemError: 404 when there is no such token.
    """
    row = session.get(AccessTokenRow, token_id)
    if row is None or owner_id not in (None, row.account_id):
        raise not_found(texts.ACCESS_TOKEN_NOT_FOUND)
    row.revoked_at = row.revoked_at or now


def revoke_all(session: Session, account_id: UUID, now: datetime) -> None:
    """Revoke all tokens of an account."""
    session.execute(
        update(AccessTokenRow)
        .where(AccessTokenRow.account_id == account_id, AccessTokenRow.revoked_at.is_(None))
        .values(revoked_at=now)
    )


def find_actor(session: Session, token: str, now: datetime) -> Actor | None:
    """Return the owner of a token, limited to reading, or None for a token that never existed.

    :raises ProblemError: 401 when the token has expired or was revoked, or its owner's account is disabled.
    """
    token_and_account = session.execute(
        select(AccessTokenRow, AccountRow)
        .join(AccountRow, AccountRow.id == AccessTokenRow.account_id)
        .where(AccessTokenRow.secret_hash == secrets.hash_secret(token))
    ).one_or_none()
    if token_and_account is None:
        return None
    row, account = token_and_account
    if row.revoked_at is not None or row.expires_at <= now or account.disabled_at is not None:
        if context := REQUEST_CONTEXT.get():
            context.account_id = account.id
        raise ProblemError(401, "token_ended", texts.TOKEN_ENDED(), texts.CREATE_ANOTHER_TOKEN())
    return Actor(
        account_id=account.id,
        login_session_id=row.id,
        name=account.name,
        role=account.role,
        stations=frozenset(login_session.stations_of(session, account.id)),
        by_token=True,
    )


def record_use(session: Session, token_id: UUID, now: datetime) -> None:
    """Record that a token was used."""
    session.get_one(AccessTokenRow, token_id).last_used_at = now
