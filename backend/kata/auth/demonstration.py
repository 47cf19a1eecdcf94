"""The demonstration clinic: on loopback, with a simulated apparatus, links sign in without a password. Nowhere else."""

from datetime import datetime
from threading import Lock
from typing import Final, Literal
from uuid import UUID, uuid5

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from kata.auth import login_session, secrets
from kata.auth.tables import AccountRow, LoginSessionRow

DemonstrationRole = Literal["therapist", "administrator"]
ACCOUNTS: Final[dict[DemonstrationRole, tuple[str, str]]] = {
    "therapist": ("demonstration-therapist", "Demonstration therapist"),
    "administrator": ("demonstration-administrator", "Demonstration administrator"),
}
"""By role: user name and name. Nobody else can have these user names."""
USERNAMES: Final = frozenset(username for username, _ in ACCOUNTS.values())
_SPACE: Final = UUID("6a5b3a52-6d05-4c0a-9f0c-5d0f4f6a1f57")


class DemonstrationLinks:
    """A secret for each role, good for one sign-in each, until the service ends."""

    def __init__(self, *, allowed: bool) -> None:
        """``allowed``: on loopback, and the apparatus is simulated. Without, there are none."""
        self.allowed = allowed
        self.secrets: dict[DemonstrationRole, str] = {role: secrets.fresh() for role in ACCOUNTS} if allowed else {}
        """As they stand in the links."""
        self._unused = dict(self.secrets)
        self._lock = Lock()

    def take(self, secret: str) -> DemonstrationRole | None:
        """Of whom this link is, once; None for any other."""
        with self._lock:
            for role, kept in self._unused.items():
                if secrets.fits(secret, secrets.hashed(kept)):
                    del self._unused[role]
                    return role
        return None


def prepare(session: Session, now: datetime, *, allowed: bool) -> None:
    """Make the two accounts, or, where there is no demonstration, shut them and whoever came in by a link out."""
    for role, (username, name) in ACCOUNTS.items():
        row = session.scalar(select(AccountRow).where(AccountRow.username == username))
        if row is None and allowed:
            session.add(
                AccountRow(
                    id=uuid5(_SPACE, username),
                    username=username,
                    name=name,
                    role=role,
                    created_at=now,
                    updated_at=now,
                )
            )
        elif row is not None:
            row.disabled_at = None if allowed else row.disabled_at or now
            if not allowed:
                login_session.end_all(session, row.id, "no_demonstration", now)
    if not allowed:
        session.execute(
            update(LoginSessionRow)
            .where(LoginSessionRow.method == "link", LoginSessionRow.ended_at.is_(None))
            .values(ended_at=now, end_reason="no_demonstration")
        )


def account_of(session: Session, role: DemonstrationRole) -> AccountRow:
    """The account that its link signs in to."""
    return session.scalars(select(AccountRow).where(AccountRow.username == ACCOUNTS[role][0])).one()
