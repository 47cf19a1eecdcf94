"""The service's requests through a pooler that shares its server connections between transactions."""

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DBAPIError

from kata.backups.schedule import daily_backup_lock
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.database.database_copy import copy
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.pooler import SERVER_CONNECTIONS, transaction_pooler

log = logging.getLogger(__name__)

ANSWER_S = 4.0
SERVER_LIMIT = "3200ms"
CLIENTS = 12
ROUNDS = 15


@pytest.fixture
def pooled(services_url: str) -> Iterator[Database]:
    """Return a database whose pooler is the server itself."""
    with closing(Database(services_url)) as made:
        upgrade(made)
    with closing(Database(services_url, answer_s=ANSWER_S, pooler_url=services_url)) as made:
        yield made


@pytest.fixture
def behind_pooler(services_url: str) -> Iterator[tuple[Database, str]]:
    """Return a database behind PgBouncer, and the pooler's URL."""
    with closing(Database(services_url)) as made:
        upgrade(made)
    with (
        transaction_pooler(services_url) as pooler_url,
        closing(Database(services_url, answer_s=ANSWER_S, pooler_url=pooler_url)) as made,
    ):
        yield made, pooler_url


def test_limits_hold_in_each_transaction_and_not_on_the_connection(pooled: Database) -> None:
    with pooled.read() as session:
        assert session.scalar(text("SHOW statement_timeout")) == SERVER_LIMIT
        assert session.scalar(text("SHOW jit")) == "off"
        raw = session.connection().connection.driver_connection
        assert raw is not None
        session.rollback()
        assert raw.execute("SHOW statement_timeout").fetchone() == ("0",)


def test_limits_of_the_direct_connection_last_as_long_as_it(pooled: Database) -> None:
    with pooled.direct.connect() as connection:
        connection.rollback()
        assert connection.scalar(text("SHOW statement_timeout")) == SERVER_LIMIT


def test_no_statement_is_prepared_on_a_connection_of_the_pooler(pooled: Database, services_url: str) -> None:
    count = text("SELECT count(*) FROM pg_prepared_statements")
    repeated = text("SELECT 1 WHERE 1 = :one")
    with closing(Database(services_url, answer_s=ANSWER_S)) as direct, direct.read() as session:
        for _ in range(ROUNDS):
            session.execute(repeated, {"one": 1})
        assert session.scalar(count), "without a pooler the driver prepares repeated statements"
    with pooled.read() as session:
        for _ in range(ROUNDS):
            session.execute(repeated, {"one": 1})
        assert session.scalar(count) == 0


def test_nightly_lock_is_taken_on_a_direct_connection(pooled: Database) -> None:
    lock = daily_backup_lock(pooled)
    assert lock is not None
    with lock:
        assert daily_backup_lock(pooled) is None
    again = daily_backup_lock(pooled)
    assert again is not None
    again.close()


@pytest.mark.campaign
def test_many_clients_share_few_server_connections(behind_pooler: tuple[Database, str], services_url: str) -> None:
    """More clients than server connections write and read; each sees what it has written."""
    _, pooler_url = behind_pooler

    def work(client: int) -> int:
        # A transaction waits for a server connection as long as the others take, which on a busy computer exceeds the service's limit.
        with closing(Database(services_url, answer_s=60.0, pooler_url=pooler_url)) as database:
            for number in range(ROUNDS):
                name = f"P{client:02}-{number:02}"
                with database.write() as session:
                    patients.create(session, PatientCreate(clinic_number=name, name=name, affected_side="left"))
                with database.read() as session:
                    rows, _ = patients.find(session, search=name, archived=False, limit=5, after=None)
                    assert [row.name for row in rows] == [name]
            return ROUNDS

    with ThreadPoolExecutor(CLIENTS) as threads:
        written = sum(threads.map(work, range(CLIENTS)))
    with closing(Database(services_url)) as database, database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM patients")) == written == CLIENTS * ROUNDS
        used = session.scalar(text("SELECT count(*) FROM pg_stat_activity WHERE backend_type = 'client backend'"))
    log.info("%d clients with %d transactions used %d server connections", CLIENTS, 2 * written, used)
    # The connection that counts is not the pooler's.
    assert used - 1 <= SERVER_CONNECTIONS


@pytest.mark.campaign
def test_statement_that_takes_too_long_is_ended_behind_the_pooler(behind_pooler: tuple[Database, str]) -> None:
    database, _ = behind_pooler
    with pytest.raises(DBAPIError, match="statement timeout"), database.read() as session:
        session.execute(text("SELECT pg_sleep(10)"))
    with database.read() as session:
        assert session.scalar(text("SELECT 1")) == 1


@pytest.mark.campaign
def test_connection_without_the_setting_fails_behind_the_pooler(behind_pooler: tuple[Database, str]) -> None:
    """Shows why KATA_DATABASE_URL must not name the pooler: the driver's prepared statements are on another server connection."""
    _, pooler_url = behind_pooler

    def work(_: int) -> None:
        with closing(Database(pooler_url, answer_s=ANSWER_S)) as database:
            for _ in range(ROUNDS):
                # The driver forgets its statements at each rollback, which ends a reading session. It keeps them at a commit.
                with database.write() as session:
                    session.execute(text("SELECT 1 WHERE 1 = :one"), {"one": 1})

    with ThreadPoolExecutor(CLIENTS) as threads, pytest.raises(DBAPIError, match="prepared statement"):
        list(threads.map(work, range(CLIENTS)))


@pytest.mark.campaign
def test_notifications_do_not_arrive_through_the_pooler(behind_pooler: tuple[Database, str], services_url: str) -> None:
    """The stations' overview therefore keeps its direct connections. Its NOTIFY alone could use the pooler."""
    _, pooler_url = behind_pooler

    async def heard(listen_url: str) -> int:
        async with (
            await connected(listen_url) as listener,
            await connected(pooler_url) as other,
        ):
            await listener.execute("LISTEN kata_stations")
            # Other transactions get the listener's server connection.
            await other.execute("SELECT 1")
            await other.execute("SELECT pg_notify('kata_stations', 'state')")
            return len([notice async for notice in listener.notifies(timeout=2.0, stop_after=1)])

    async def connected(url: str) -> psycopg.AsyncConnection:
        query = make_url(url).query
        return await psycopg.AsyncConnection.connect(
            host=str(query["host"]), port=str(query.get("port", "5432")), user="kata", dbname="postgres",
            autocommit=True, prepare_threshold=None,
        )  # fmt: skip

    assert asyncio.run(heard(services_url)) == 1
    assert asyncio.run(heard(pooler_url)) == 0


@pytest.mark.campaign
def test_backup_reads_the_server_itself(behind_pooler: tuple[Database, str], services_url: str, tmp_path: Path) -> None:
    database, _ = behind_pooler
    with database.write() as session:
        patients.create(session, PatientCreate(clinic_number="K-1", name="Aoki", affected_side="left"))
    with closing(Database(services_url)) as direct:
        _, tables = copy(direct, tmp_path / "copy")
    assert tables["patients"].rows == 1
