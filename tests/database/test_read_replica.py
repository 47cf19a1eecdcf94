"""What a read replica could take over from the primary (docs/explanation/many-clinics.md), with two servers of which one replicates the other."""

from collections.abc import Iterator
from contextlib import closing

import psycopg
import pytest
from sqlalchemy import text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DBAPIError

from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.failover import Pair, pair


@pytest.fixture(scope="module")
def servers() -> Iterator[Pair]:
    with pair() as made, closing(Database(made.primary_url)) as database:
        upgrade(database)
        with database.write() as session:
            for name in ("Aoki", "Baba", "Chiba"):
                patients.create(session, PatientCreate(clinic_number=f"R-{name}", name=name, affected_side="right"))
        made.until_replayed()
        yield made


@pytest.fixture
def replica(servers: Pair) -> Iterator[Database]:
    with closing(Database(servers.replica_url)) as database:
        yield database


def names(database: Database) -> list[str]:
    with database.read() as session:
        rows, _ = patients.find(session, search="", archived=False, limit=50, after=None)
        return [row.name for row in rows]


def test_lists_of_the_replica_are_those_of_the_primary(servers: Pair, replica: Database) -> None:
    with closing(Database(servers.primary_url)) as primary:
        assert names(replica) == names(primary) == ["Aoki", "Baba", "Chiba"]


def test_replica_says_how_old_its_newest_change_is(replica: Database) -> None:
    """A list that reads a replica must show its age."""
    with replica.read() as session:
        age_s = session.scalar(text("SELECT extract(epoch FROM now() - pg_last_xact_replay_timestamp())"))
    assert age_s is not None
    assert 0 <= age_s < 600


def test_replica_refuses_changes(replica: Database) -> None:
    """Everything that starts or ends a session therefore needs the primary."""
    with pytest.raises(DBAPIError, match="read-only"), replica.write() as session:
        patients.create(session, PatientCreate(clinic_number="R-Doi", name="Doi", affected_side="right"))


def test_replica_refuses_listen(servers: Pair) -> None:
    """The stations' overview therefore needs the primary."""
    host = str(make_url(servers.replica_url).query["host"])
    with (
        psycopg.connect(host=host, user="kata", dbname="postgres", autocommit=True) as connection,
        pytest.raises(psycopg.Error, match="recovery"),
    ):
        connection.execute("LISTEN kata_stations")
