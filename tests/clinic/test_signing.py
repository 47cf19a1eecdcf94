"""A note is signed only when the record holds all that was played."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from kata.clinic.sessions import runs, service, signing
from kata.clinic.sessions.schemas import SessionSign
from kata.clinic.sessions.tables import RunRow
from kata.database.engine import Database
from kata.errors import ProblemError
from tests.support.databases import upgraded_file
from tests.support.treatment import treat


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    yield database
    database.close()


def test_signing_waits_for_the_result_of_every_run(database: Database) -> None:
    """A run played while the database was unavailable ends in its journal, which may be imported after the session's end."""
    given = SessionSign(signed_by="Sato Ken", note="Went well.")
    with database.write() as session:
        session_id = treat(session, signed=False).session_ids[0]
        last = service.get(session, session_id).runs[-1]
        last.outcome, last.ended_at = "loaded", None
        run_id = last.id
    with database.write() as session, pytest.raises(ProblemError, match="has not arrived") as refused:
        signing.sign(session, session_id, given)
    assert (refused.value.status, refused.value.code) == (409, "run_not_arrived")

    with database.write() as session:
        runs.mark_interrupted(session, run_id)
    with database.write() as session:
        signed = signing.sign(session, session_id, given)
        assert (signed.signed_by, session.get_one(RunRow, run_id).outcome) == ("Sato Ken", "interrupted")
