"""Each station with its own configuration and calibration, recordings and corrections, on one database."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from uuid import UUID

import msgspec
import pytest
from sqlalchemy import select

from kata.clinic.importer import Importer
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import runs, stored_corrections
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.tables import RunCorrectionRow
from kata.clinic.stations import service
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import JournalEnd
from kata.errors import ProblemError
from tests.support.databases import SQLITE_FIRST
from tests.support.imported_runs import Clinic, pose

NOW = datetime(2026, 3, 1, 9, 0, tzinfo=UTC)


def calibrated(config: StationConfig, lag_s: float) -> StationConfig:
    axes = tuple(msgspec.structs.replace(axis, lag_s=lag_s) for axis in config.axes)
    return msgspec.structs.replace(config, axes=axes)


def test_configuration_and_calibration_have_a_version_of_each_station_own(database: Database) -> None:
    one, two = StationConfig(name="Station 1"), StationConfig(name="Station 2", rate_hz=10)
    starts = (one, two, one, calibrated(one, 0.1), calibrated(one, 0.1), one)
    for day, config in enumerate(starts):
        with database.write() as session:
            service.register(session, config, f"0.{day}", NOW + timedelta(days=day), simulated=False)
    with database.read() as session:
        listed = [(row.name, number, row.registered_at, row.started_at) for row, number in service.registered(session)]
        assert listed == [
            ("Station 1", 3, NOW, NOW + timedelta(days=5)),
            ("Station 2", 1, NOW + timedelta(days=1), NOW + timedelta(days=1)),
        ]
        rows = service.versions(session, "Station 1")
        assert [(row.number, row.software, row.since) for row in rows] == [
            (3, "0.5", NOW + timedelta(days=5)),
            (2, "0.3", NOW + timedelta(days=3)),
            (1, "0.0", NOW),
        ]
        assert [msgspec.toml.decode(row.config, type=StationConfig).axes[0].lag_s for row in rows] == [0.0, 0.1, 0.0]
        assert msgspec.toml.decode(service.versions(session, "Station 2")[0].config)["rate_hz"] == 10
        with pytest.raises(ProblemError):
            service.versions(session, "Station 3")


def test_side_and_pseudo_terminal_make_no_new_configuration_version(database: Database) -> None:
    config = StationConfig(port="/dev/pts/3")
    for other in (config, msgspec.structs.replace(config, port="/dev/pts/9", side="left")):
        with database.write() as session:
            service.register(session, other, "0.1", NOW, simulated=True)
    with database.write() as session:
        assert [number for _, number in service.registered(session)] == [1]
        service.register(session, config, "0.1", NOW, simulated=False)
        assert [number for _, number in service.registered(session)] == [2], "a real one's port is its configuration"


def test_recording_knows_its_station_and_learning_belongs_to_it(database: Database, tmp_path: Path) -> None:
    clinic = Clinic(tmp_path, database)
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=JournalEnd(reason="finished"))
    clinic.importer.run()
    recording_id = clinic.saved[-1].id
    learned_from = clinic.begin_run(recording_id, method="learned")
    clinic.journal("run", learned_from, [4.0], at=pose, error_deg=-1.0, end=JournalEnd(reason="completed"))
    clinic.importer.run()

    with database.read() as session:
        assert session.get_one(RecordingRow, recording_id).station == "Station 1"
        assert session.scalars(select(RunCorrectionRow.station)).one() == "Station 1"
    with database.write() as session:
        visit = sessions.begin(session, clinic.patient_id)
        at = {
            station: runs.begin(
                session, runs.RunRequest(visit.id, recording_id, method="learned"), station
            ).corrected_by
            for station in ("Station 1", "Station 2")
        }
        assert at == {"Station 1": learned_from, "Station 2": None}
        assert stored_corrections.correction(session, at["Station 1"]) is not None


@SQLITE_FIRST
def test_starting_station_interrupts_no_run_of_another_station(database: Database, tmp_path: Path) -> None:
    clinic, run_id = _with_a_run(database, tmp_path)
    Importer(database, tmp_path, StationConfig(name="Station 1"), clinic.saved.append).run_at_start()
    with database.read() as session:
        assert runs.get(session, run_id).outcome == "loaded"
    Importer(database, tmp_path, StationConfig(name="Station 2"), clinic.saved.append).run_at_start()
    with database.read() as session:
        assert runs.get(session, run_id).outcome == "interrupted"


@SQLITE_FIRST
def test_interrupted_run_is_completed_by_a_journal_found_later(database: Database, tmp_path: Path) -> None:
    """A session continues at another station while its first station restarts."""
    clinic, run_id = _with_a_run(database, tmp_path)
    with database.write() as session:
        assert runs.mark_unended_interrupted(session, "Station 2", utc_now()) == 1
    for _ in range(2):
        clinic.journal("run", run_id, [2.0], end=JournalEnd(reason="completed"))
        clinic.importer.run()
    with database.read() as session:
        row = runs.get(session, run_id)
        assert (row.outcome, row.samples) == ("completed", 201)
        assert len(runs.samples(session, run_id)["time_s"]) == 201


def _with_a_run(database: Database, folder: Path) -> tuple[Clinic, UUID]:
    """A clinic, and a run of a session that was begun at Station 2."""
    clinic = Clinic(folder, database)
    recording_id = clinic.recording()
    with database.write() as session:
        visit = sessions.begin(session, clinic.patient_id, station="Station 2")
        return clinic, runs.begin(session, runs.RunRequest(visit.id, recording_id), "Station 2").id
