"""Login sessions: the user to whom a browser's cookie belongs, and how long the cookie is valid."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final, Literal
from uuid import UUID, uuid4

from sqlalchemy import ColumnElement, Connection, and_, bindparam, or_, select, update
from sqlalchemy.orm import Session

from kata.actor import Actor, Role
from kata.auth import secrets, texts
from kata.auth.tables import AccountRow, AccountStationRow, LoginSessionRow
from kata.errors import ProblemError
from kata.settings import Settings

COOKIE: Final = "kata_sign_in"
SECURE_COOKIE: Final = "__Host-kata_sign_in"
"""Name of the cookie over HTTPS. A browser accepts a cookie with this name only from this host and only with Secure."""
Method = Literal["password", "totp", "recovery", "oidc", "oidc_two", "link"]
"""``oidc``: by the clinic's OpenID provider; ``oidc_two``: by the provider and a second factor, which the provider or Kata checked."""
EndReason = Literal["signed_out", "disabled", "role", "password", "reset", "openid", "no_demonstration"]
_CLOCK_TOLERANCE: Final = timedelta(minutes=1)
_RECENT: Final = timedelta(minutes=10)
_FORMER_SECRET_VALIDITY: Final = timedelta(seconds=10)
"""Time for which a replaced secret stays valid, because a browser may send several requests at once, and one may be a Stop."""
_ACTIVITY_PERIOD: Final = timedelta(seconds=30)
"""Shortest time between two stored user activities."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a login session, and the roles that need a second factor."""

    idle: timedelta = timedelta(minutes=Settings.model_fields["idle_minutes"].default)
    """The screen locks after this time without user activity."""
    longest: timedelta = timedelta(hours=Settings.model_fields["login_session_hours"].default)
    """The login session ends after this time even with activity, except for :attr:`extension`."""
    extension: timedelta = timedelta(hours=1)
    """Additional time while the user operates an apparatus whose motors move or hold an arm."""
    second_factor_roles: frozenset[Role] = frozenset({"administrator"})


def begin(session: Session, account: AccountRow, method: Method, now: datetime, address: str, agent: str) -> str:
    """Begin a login session and return the secret for the browser's cookie. Only its hash is stored.

    The caller records the login in the audit trail.
    """
    secret = secrets.new_secret()
    session.add(
        LoginSessionRow(
            id=uuid4(),
            account_id=account.id,
            secret_hash=secrets.hash_secret(secret),
            began_at=now,
            seen_at=now,
            proved_at=now,
            method=method,
            address=address[:64],
            agent=agent[:200],
            locked_at=None,
            ended_at=None,
        )
    )
    return secret


def find_actor(
    session: Session,
    cookie: str | None,
    now: datetime,
    limits: Limits = Limits(),
    operator_under_torque: UUID | None = None,
) -> Actor | None:
    """Return the user of this cookie, or None if the login session has ended or never existed.

    :param operator_under_torque: the login session whose user operates an apparatus with torque.
    """
    if not cookie:
        return None
    hashed = secrets.hash_secret(cookie)
    is_former_secret = and_(
        LoginSessionRow.before_hash == hashed, LoginSessionRow.proved_at > now - _FORMER_SECRET_VALIDITY
    )
    actor = _find_actor(session, LoginSessionRow.secret_hash == hashed, now, limits, operator_under_torque)
    return actor or _find_actor(session, is_former_secret, now, limits, operator_under_torque)


def find_actor_by_id(session: Session, login_session_id: UUID, now: datetime, limits: Limits) -> Actor | None:
    """Return the user of a login session, or None if it has ended."""
    return _find_actor(session, LoginSessionRow.id == login_session_id, now, limits)


def stations_of(session: Session, account_id: UUID) -> list[str]:
    """Return the names of an account's stations. An empty list means all stations."""
    of_account = AccountStationRow.account_id == account_id
    return list(
        session.scalars(select(AccountStationRow.station).where(of_account).order_by(AccountStationRow.station))
    )


def _find_actor(
    session: Session,
    condition: ColumnElement[bool],
    now: datetime,
    limits: Limits,
    operator_under_torque: UUID | None = None,
) -> Actor | None:
    session_and_account = session.execute(
        select(LoginSessionRow, AccountRow)
        .join(AccountRow, AccountRow.id == LoginSessionRow.account_id)
        .where(condition, LoginSessionRow.ended_at.is_(None))
    ).one_or_none()
    if session_and_account is None:
        return None
    row, account = session_and_account
    age = now - row.began_at
    longest = limits.longest + (limits.extension if row.id == operator_under_torque else timedelta())
    # Setting the clock back does not extend the login session.
    if account.disabled_at is not None or not -_CLOCK_TOLERANCE <= age < longest:
        return None
    return Actor(
        account_id=account.id,
        login_session_id=row.id,
        name=account.name,
        role=account.role,
        stations=frozenset(stations_of(session, account.id)),
        locked=_is_locked(row, now, limits),
        enrolling=(
            account.role in limits.second_factor_roles
            and account.totp_confirmed_at is None
            # Demonstration accounts belong to no person. A provider counts only if it explicitly states a second factor.
            and row.method not in ("link", "oidc_two")
        ),
    )


def _is_locked(row: LoginSessionRow, now: datetime, limits: Limits) -> bool:
    """Return whether the screen is locked. The screen of a demonstration account never is, because the account has no password to unlock
    it.
    """
    return row.method != "link" and (row.locked_at is not None or now - row.seen_at >= limits.idle)


def lock(session: Session, login_session_id: UUID, now: datetime) -> None:
    """Lock the screen. A running treatment stays visible and can be stopped; everything else needs the password again.

    :raises ProblemError: 409 for a demonstration account, which has no password.
    """
    row = session.get_one(LoginSessionRow, login_session_id)
    if row.method == "link":
        raise ProblemError(409, "no_password", texts.DEMONSTRATION_CANNOT_UNLOCK(), texts.SIGN_OUT_INSTEAD())
    row.locked_at = row.locked_at or now


def renew(session: Session, login_session_id: UUID, now: datetime, method: Method | None = None) -> str:
    """Record a reauthentication: unlock the screen, and return a new secret for the cookie.

    ``method``: the login session's new method, if it changes.
    """
    row = session.get_one(LoginSessionRow, login_session_id)
    secret = secrets.new_secret()
    row.before_hash, row.secret_hash = row.secret_hash, secrets.hash_secret(secret)
    row.locked_at = None
    row.seen_at = row.proved_at = now
    row.method = method or row.method
    return secret


def has_recent_authentication(session: Session, login_session_id: UUID, now: datetime) -> bool:
    """Return whether the user authenticated within the last ten minutes."""
    return now - session.get_one(LoginSessionRow, login_session_id).proved_at < _RECENT


def list_active(session: Session, account_id: UUID, now: datetime, limits: Limits) -> Sequence[LoginSessionRow]:
    """Return the active login sessions of an account, newest first."""
    of_account = select(LoginSessionRow).where(
        LoginSessionRow.account_id == account_id, LoginSessionRow.ended_at.is_(None)
    )
    return session.scalars(
        of_account.where(LoginSessionRow.began_at > now - limits.longest).order_by(LoginSessionRow.began_at.desc())
    ).all()


_ACTIVE: Final = (
    select(LoginSessionRow.id)
    .join(AccountRow, AccountRow.id == LoginSessionRow.account_id)
    .where(
        LoginSessionRow.id.in_(bindparam("session_ids", expanding=True)),
        LoginSessionRow.ended_at.is_(None),
        or_(
            LoginSessionRow.began_at > bindparam("began_after"),
            and_(
                LoginSessionRow.id == bindparam("operator_under_torque"),
                LoginSessionRow.began_at > bindparam("operator_began_after"),
            ),
        ),
        AccountRow.disabled_at.is_(None),
    )
)
"""The query of :func:`select_active`, built once: a service runs it twice a second, and building it takes longer than running it."""


def select_active(
    connection: Connection,
    session_ids: Collection[UUID],
    now: datetime,
    limits: Limits,
    operator_under_torque: UUID | None = None,
) -> set[UUID]:
    """Return those of the given login sessions that are still active. ``operator_under_torque``: as in :func:`find_actor`."""
    began_after = now - limits.longest
    parameters = {
        "session_ids": session_ids,
        "began_after": began_after,
        "operator_under_torque": operator_under_torque,
        "operator_began_after": began_after - limits.extension,
    }
    return set(connection.scalars(_ACTIVE, parameters))


def record_activity(session: Session, actor: Actor, now: datetime) -> None:
    """Record user activity, which restarts the idle time. A locked screen stays locked."""
    if not actor.locked:
        session.execute(
            update(LoginSessionRow)
            .where(LoginSessionRow.id == actor.login_session_id, LoginSessionRow.seen_at < now - _ACTIVITY_PERIOD)
            .values(seen_at=now)
        )


def end(session: Session, login_session_id: UUID, reason: EndReason, now: datetime) -> None:
    """End one login session."""
    session.execute(
        update(LoginSessionRow)
        .where(LoginSessionRow.id == login_session_id, LoginSessionRow.ended_at.is_(None))
        .values(ended_at=now, end_reason=reason)
    )


def end_all(
    session: Session, account_id: UUID, reason: EndReason, now: datetime, except_session: UUID | None = None
) -> None:
    """End all login sessions of an account except ``except_session``."""
    ending = update(LoginSessionRow).where(LoginSessionRow.account_id == account_id, LoginSessionRow.ended_at.is_(None))
    if except_session is not None:
        ending = ending.where(LoginSessionRow.id != except_session)
    session.execute(ending.values(ended_at=now, end_reason=reason))
