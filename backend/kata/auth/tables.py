"""Tables of accounts, login sessions and access tokens."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from kata.actor import Role
from kata.database.base import Base, UtcDateTime


class AccountRow(Base):
    """An account. It can be disabled but is never deleted, because the audit trail names it."""

    __tablename__ = "accounts"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    username: Mapped[str] = mapped_column(String(64), unique=True)
    """Normalized (NFKC, lower case)."""
    name: Mapped[str] = mapped_column(String(100))
    role: Mapped[Role] = mapped_column(String(16))
    language: Mapped[str] = mapped_column(String(8), default="")
    """Language of the page; empty: the browser's."""
    password_hash: Mapped[str | None] = mapped_column(String(200))
    """argon2id with its parameters; None if the account signs in by OpenID Connect, or no password has been set yet."""
    password_changed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    totp_sealed: Mapped[str | None] = mapped_column(String(160))
    """Secret of the second factor, encrypted with a key outside the database."""
    totp_confirmed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    totp_last_step: Mapped[int | None] = mapped_column(BigInteger)
    """Time step of the last accepted code. No code is accepted twice."""
    code_hash: Mapped[str | None] = mapped_column(String(64))
    """SHA-256 of the one-time code for setting a password."""
    code_until: Mapped[datetime | None] = mapped_column(UtcDateTime)
    oidc_subject: Mapped[str | None] = mapped_column(String(512), unique=True)
    """Issuer and subject at the clinic's OpenID provider, separated by a blank. An administrator sets it."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    disabled_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class AccountStationRow(Base):
    """A station at which an account works. An account without rows works at all stations."""

    __tablename__ = "account_stations"

    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)
    station: Mapped[str] = mapped_column(String(100), primary_key=True)


class RecoveryCodeRow(Base):
    """A code that replaces the second factor once."""

    __tablename__ = "recovery_codes"

    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)
    code_hash: Mapped[str] = mapped_column(String(64), primary_key=True)
    used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class ReadNotificationRow(Base):
    """A notification that an account has read. The row is deleted when the notification is no longer listed."""

    __tablename__ = "read_notifications"

    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)
    notification_id: Mapped[UUID] = mapped_column(primary_key=True)


class AccessTokenRow(Base):
    """A token with which a program reads for its owner. It can be revoked but is never deleted, because the audit trail names it."""

    __tablename__ = "access_tokens"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), index=True)
    name: Mapped[str] = mapped_column(String(100))
    secret_hash: Mapped[str] = mapped_column(String(64), unique=True)
    """SHA-256 of the token."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    last_used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    revoked_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class LoginSessionRow(Base):
    """A login session of one browser. Its cookie holds a secret; only the secret's hash is stored."""

    __tablename__ = "sign_ins"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), index=True)
    secret_hash: Mapped[str] = mapped_column(String(64), unique=True)
    """SHA-256 of the cookie's secret."""
    before_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    """Hash of the previous secret, which stays valid for some seconds after ``proved_at`` for requests in flight."""
    began_at: Mapped[datetime] = mapped_column(UtcDateTime)
    seen_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """Time of the last user activity. Automatic requests of the page do not count."""
    proved_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """Time of the last authentication."""
    method: Mapped[str] = mapped_column(String(16))
    """password, totp, recovery, oidc, oidc_two, link."""
    address: Mapped[str] = mapped_column(String(64))
    agent: Mapped[str] = mapped_column(String(200))
    locked_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """Time since which the screen is locked; None if it is not. The user must then give the password again. Stop still works."""
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    end_reason: Mapped[str] = mapped_column(String(16), default="")
