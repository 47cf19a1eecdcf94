"""A run that never reached the apparatus is removed, also after an uncertain commit."""

from pathlib import Path

from kata.audit import chain
from kata.audit.entries import entry
from kata.clinic.event_spool import EventSpool
from kata.clinic.sessions import runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.tables import RunRow
from kata.database.engine import Database
from tests.support.imported_runs import Clinic


def test_run_whose_abandoned_commit_succeeded_is_deleted(database: Database, tmp_path: Path) -> None:
    """A hanging server has the commit in its socket. When it continues, it may answer other connections first."""
    clinic = Clinic(tmp_path, database)
    recording_id = clinic.recording()
    with database.write() as session:
        visit_id = sessions.begin(session, clinic.patient_id).id
    event_spool = EventSpool(database, "Station 1", tmp_path / "spool")
    try:
        with database.write() as session:
            run = runs.begin(session, runs.RunRequest(visit_id, recording_id))
            # Every writing session of a service does this last.
            chain.append(session, [entry("load", "done")], "", 0)
            event_spool.put_not_begun("run", run.id)
            assert not event_spool.until_taken(1.0)
        assert event_spool.until_taken(30.0)
        with database.read() as session:
            assert session.get(RunRow, run.id) is None
    finally:
        event_spool.close()
