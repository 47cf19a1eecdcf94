"""Signs a benchmark in to the service with an account of its own."""

from typing import Final
from uuid import uuid4

from kata.actor import Role
from kata.auth import login_session
from kata.auth.tables import AccountRow
from kata.database.base import utc_now
from kata.database.engine import Database

ACTIVE_HEADER: Final = {"X-Kata-Active": "1"}
"""Header of every request. It keeps a long benchmark from being logged out as inactive."""


def sign_in_cookie(database: Database, role: Role = "therapist", name: str = "Benchmark") -> str:
    """Create an account. Return the ``Cookie`` header of a login session of the account, second factor included."""
    now, account_id = utc_now(), uuid4()
    with database.write() as session:
        account = AccountRow(
            id=account_id,
            username=f"benchmark-{account_id.hex[:8]}",
            name=name,
            role=role,
            totp_confirmed_at=now,
            created_at=now,
            updated_at=now,
        )
        session.add(account)
        session.flush()
        secret = login_session.begin(session, account, "totp", now, "127.0.0.1", "kata bench")
    return f"{login_session.COOKIE}={secret}"
