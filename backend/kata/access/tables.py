"""Tables of accounts, sign-ins, audit and backups."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, ForeignKey, Index, Integer, LargeBinary, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.access.actor import Role
from kata.database.base import Base, UtcDateTime


class AccountRow(Base):
    """Somebody who may sign in; disabled, never deleted: the audit trail names it."""

    __tablename__ = "accounts"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    username: Mapped[str] = mapped_column(String(64), unique=True)
    """Folded (NFKC, lower case)."""
    name: Mapped[str] = mapped_column(String(100))
    role: Mapped[Role] = mapped_column(String(16))
    language: Mapped[str] = mapped_column(String(8), default="")
    """Of the page; empty: the browser's."""
    password_hash: Mapped[str | None] = mapped_column(String(200))
    """argon2id, with its parameters; None where only OpenID Connect or a code lets in."""
    password_changed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    totp_sealed: Mapped[str | None] = mapped_column(String(160))
    """What its codes are made of, sealed with a key that is not in the database."""
    totp_confirmed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    totp_last_step: Mapped[int | None] = mapped_column(BigInteger)
    """The last time step a code was taken of: none is taken twice."""
    code_hash: Mapped[str | None] = mapped_column(String(64))
    """SHA-256 of a one-time code with which a password may be set."""
    code_until: Mapped[datetime | None] = mapped_column(UtcDateTime)
    oidc_subject: Mapped[str | None] = mapped_column(String(512), unique=True)
    """Issuer and subject at the clinic's OpenID provider, with a blank between; an administrator has put it here."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    disabled_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class AccountStationRow(Base):
    """A station that an account works at; an account without any works at all of them."""

    __tablename__ = "account_stations"

    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)
    station: Mapped[str] = mapped_column(String(100), primary_key=True)


class RecoveryCodeRow(Base):
    """Stands in for the second factor, once."""

    __tablename__ = "recovery_codes"

    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)
    code_hash: Mapped[str] = mapped_column(String(64), primary_key=True)
    used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class SignInRow(Base):
    """A browser that somebody signed in at; its cookie holds a secret of which only the hash is here."""

    __tablename__ = "sign_ins"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), index=True)
    secret_hash: Mapped[str] = mapped_column(String(64), unique=True)
    """SHA-256 of the cookie's secret."""
    before_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    """Of the one before: good for some seconds from ``proved_at``, for what was on its way."""
    began_at: Mapped[datetime] = mapped_column(UtcDateTime)
    seen_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """When its user last did something; what a page asks for by itself does not count."""
    proved_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """When password or second factor were last given."""
    method: Mapped[str] = mapped_column(String(16))
    """password, totp, recovery, oidc, oidc_two, link."""
    address: Mapped[str] = mapped_column(String(64))
    agent: Mapped[str] = mapped_column(String(200))
    locked_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """The screen is locked: its user has to give the password again; Stop still works."""
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    end_reason: Mapped[str] = mapped_column(String(16), default="")


class CareTeamRow(Base):
    """Of a patient whose record is restricted: who may see it without breaking the glass."""

    __tablename__ = "care_team"
    __table_args__ = (Index("ix_care_team_account_id_patient_id", "account_id", "patient_id"),)

    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), primary_key=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)


class BrokenGlassRow(Base):
    """Access to a restricted record that somebody took in an emergency, for some hours."""

    __tablename__ = "broken_glass"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), index=True)
    reason: Mapped[str] = mapped_column(Text)
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    until: Mapped[datetime] = mapped_column(UtcDateTime)
    reviewed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    reviewed_by: Mapped[str] = mapped_column(String(100), default="")


class AuditRow(Base):
    """One link of the chain: what somebody did, saw, or tried in vain. Only ever added."""

    __tablename__ = "audit"
    __table_args__ = (
        *(
            Index(f"ix_audit_{name}_at", name, "at", "number")
            for name in ("account_id", "patient_id", "action", "outcome", "station")
        ),
        Index("ix_audit_at", "at", "number"),
    )

    number: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    """From 1, without gaps. What an outage kept back got its number later than what was done after it."""
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    account_id: Mapped[UUID | None]
    """No foreign key, as below: the trail outlives what it speaks of."""
    who: Mapped[str] = mapped_column(String(100))
    """The name, as it was; the program's own where nobody asked."""
    role: Mapped[str] = mapped_column(String(16))
    sign_in_id: Mapped[UUID | None]
    address: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(64))
    """The route's operation id, or what the program did."""
    outcome: Mapped[str] = mapped_column(String(8))
    """done, refused or failed."""
    patient_id: Mapped[UUID | None]
    subject: Mapped[str] = mapped_column(String(100))
    """What else it was done to: kind and id."""
    station: Mapped[str] = mapped_column(String(100))
    detail: Mapped[str] = mapped_column(Text)
    """JSON: which fields changed, why it was refused. Never a secret, never what a field said of a patient."""
    anchor: Mapped[str] = mapped_column(String(32))
    """Which file outside the database the writing service anchors the chain in."""
    anchored: Mapped[int] = mapped_column(BigInteger)
    """How many lines that file was known to hold."""
    hash: Mapped[bytes] = mapped_column(LargeBinary(32))
    """SHA-256 over the link before and all of this row."""


class BackupRow(Base):
    """A backup that was made, and whether it has been restored to see that it can be."""

    __tablename__ = "backups"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    kind: Mapped[str] = mapped_column(String(8))
    """nightly or asked."""
    file: Mapped[str] = mapped_column(String(300))
    bytes: Mapped[int] = mapped_column(BigInteger)
    problem: Mapped[str] = mapped_column(Text, default="")
    tested_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    test_problem: Mapped[str] = mapped_column(Text, default="")
    """Empty where the restored copy was whole and equal."""
    audit_rows: Mapped[int | None] = mapped_column(BigInteger)
    """Of the audit trail, verified when it was tried; None where it was not."""
    audit_problem: Mapped[str] = mapped_column(Text, default="")
    """Where that trail was not whole."""
