"""Links that sign in to the demonstration clinic without a password. They exist only on loopback and with a simulated apparatus."""

from datetime import datetime
from threading import Lock
from typing import Final, Literal
from uuid import UUID, uuid5

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from kata.auth import access_tokens, login_session, secrets
from kata.auth.tables import AccountRow, LoginSessionRow

DemonstrationRole = Literal["therapist", "administrator"]
ACCOUNTS: Final[dict[DemonstrationRole, tuple[str, str]]] = {
    "therapist": ("demonstration-therapist", "Demonstration therapist"),
    "administrator": ("demonstration-administrator", "Demonstration administrator"),
}
"""User name and name by role. Other accounts cannot have these user names."""
JAPANESE_NAMES: Final[dict[DemonstrationRole, str]] = {"therapist": "デモ 療法士", "administrator": "デモ 管理者"}
"""Names of the accounts in a Japanese clinic of ``kata seed``."""
USERNAMES: Final = frozenset(username for username, _ in ACCOUNTS.values())
_NAMESPACE: Final = UUID("6a5b3a52-6d05-4c0a-9f0c-5d0f4f6a1f57")


class DemonstrationLinks:
    """One secret per role. Each is valid for one login, until the service ends."""

    def __init__(self, *, allowed: bool) -> None:
        """``allowed``: the service is on loopback and the apparatus is simulated. Otherwise there are no links."""
        self.allowed = allowed
        self.secrets: dict[DemonstrationRole, str] = (
            {role: secrets.new_secret() for role in ACCOUNTS} if allowed else {}
        )
        """The secrets in the links."""
        self._unused = dict(self.secrets)
        self._lock = Lock()

    def take(self, secret: str) -> DemonstrationRole | None:
        """Use up a secret and return its role, or None if the secret is unknown or used."""
        with self._lock:
            for role, unused in self._unused.items():
                if secrets.matches(secret, secrets.hash_secret(unused)):
                    del self._unused[role]
                    return role
        return None


def prepare(session: Session, now: datetime, *, allowed: bool) -> None:
    """Create the two demonstration accounts. If ``allowed`` is False, disable them and end all their login sessions."""
    for role, (username, name) in ACCOUNTS.items():
        row = session.scalar(select(AccountRow).where(AccountRow.username == username))
        if row is None and allowed:
            session.add(_account(role, name, now))
        elif row is not None:
            row.disabled_at = None if allowed else row.disabled_at or now
            if not allowed:
                login_session.end_all(session, row.id, "no_demonstration", now)
                access_tokens.revoke_all(session, row.id, now)
    if not allowed:
        session.execute(
            update(LoginSessionRow)
            .where(LoginSessionRow.method == "link", LoginSessionRow.ended_at.is_(None))
            .values(ended_at=now, end_reason="no_demonstration")
        )


def name_in_japanese(session: Session, now: datetime) -> None:
    """Create both accounts with Japanese names in a clinic without accounts. They are disabled until a service allows the links."""
    for role, name in JAPANESE_NAMES.items():
        account = _account(role, name, now)
        account.disabled_at = now
        session.add(account)


def _account(role: DemonstrationRole, name: str, now: datetime) -> AccountRow:
    username = ACCOUNTS[role][0]
    return AccountRow(
        id=uuid5(_NAMESPACE, username), username=username, name=name, role=role, created_at=now, updated_at=now
    )


def account_of(session: Session, role: DemonstrationRole) -> AccountRow:
    """Return the demonstration account of a role."""
    return session.scalars(select(AccountRow).where(AccountRow.username == ACCOUNTS[role][0])).one()
