"""Accounts: who they are, and what of them is looked up to sign in."""

import unicodedata

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.access.tables import AccountRow


def folded(username: str) -> str:
    """A user name as it is kept: width and case make no difference."""
    return unicodedata.normalize("NFKC", username).strip().lower()


def named(session: Session, username: str) -> AccountRow | None:
    """The account with this user name, disabled or not."""
    return session.scalar(select(AccountRow).where(AccountRow.username == folded(username)))
