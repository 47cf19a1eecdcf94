"""Login sessions written directly to the database."""

from datetime import timedelta
from pathlib import Path
from uuid import uuid4

from kata.actor import Actor, Role
from kata.auth import access_tokens, login_session
from kata.auth.tables import AccountRow, AccountStationRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.databases import upgraded_file


def signed_in(
    database: Database, role: Role = "administrator", *, stations: tuple[str, ...] = (), name: str = ""
) -> str:
    """Create an account of this role and return the cookie value of a login session with a second factor.

    ``stations``: names of the account's stations; without any, all stations. ``name``: the user's name; without one, the role's.
    """
    now, id_ = utc_now(), uuid4()
    with database.write() as session:
        account = AccountRow(
            id=id_,
            username=f"{role}-{id_.hex[:8]}",
            name=name or f"Test {role}",
            role=role,
            totp_confirmed_at=now,
            created_at=now,
            updated_at=now,
        )
        session.add(account)
        session.flush()
        session.add_all(AccountStationRow(account_id=id_, station=station) for station in stations)
        return login_session.begin(session, account, "totp", now, "testclient", "tests")


def with_token(database: Database, role: Role = "viewer", *, revoked: bool = False) -> str:
    """Create an account of this role and return one of its access tokens."""
    owner = signed_in_actor(database, role)
    with database.write() as session:
        row, token = access_tokens.create(session, owner.account_id, "Tests", timedelta(days=1), utc_now())
        row.revoked_at = utc_now() if revoked else None
        return token


def signed_in_actor(database: Database, role: Role) -> Actor:
    """Create an account of this role with a login session, and return its user as the service sees it."""
    cookie = signed_in(database, role)
    with database.read() as session:
        found = login_session.find_actor(session, cookie, utc_now())
    assert found
    return found


def signed_in_at(folder: Path, role: Role = "administrator", *, database_url: str = "", name: str = "") -> str:
    """Do the same in the folder of a service that is started later; only one process may write.

    Without ``database_url``, the database is a file in the folder.
    """
    file = folder / "kata.db"
    if not database_url and not file.exists():
        upgraded_file(file)
    database = Database(database_url or f"sqlite:///{file}")
    try:
        upgrade(database)
        return signed_in(database, role, name=name)
    finally:
        database.close()
