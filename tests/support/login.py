"""Login sessions written directly to the database."""

from pathlib import Path
from uuid import uuid4

from kata.actor import Role
from kata.auth import login_session
from kata.auth.tables import AccountRow, AccountStationRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.databases import upgraded_file


def signed_in(database: Database, role: Role = "administrator", *, stations: tuple[str, ...] = ()) -> str:
    """Of a new account of this role, with its second factor given: the value of its browser's cookie.

    ``stations``: names of those that it works at; without any, at all of them.
    """
    now, id_ = utc_now(), uuid4()
    with database.write() as session:
        account = AccountRow(
            id=id_,
            username=f"{role}-{id_.hex[:8]}",
            name=f"Test {role}",
            role=role,
            totp_confirmed_at=now,
            created_at=now,
            updated_at=now,
        )
        session.add(account)
        session.flush()
        session.add_all(AccountStationRow(account_id=id_, station=station) for station in stations)
        return login_session.begin(session, account, "totp", now, "testclient", "tests")


def signed_in_at(folder: Path, role: Role = "administrator", *, database_url: str = "") -> str:
    """The same, for a service that is going to be started on this folder: nobody else writes while a service does.

    ``database_url``: of its database, unless that is a file in the folder.
    """
    file = folder / "kata.db"
    if not database_url and not file.exists():
        upgraded_file(file)
    database = Database(database_url or f"sqlite:///{file}")
    try:
        upgrade(database)
        return signed_in(database, role)
    finally:
        database.close()
