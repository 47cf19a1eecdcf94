"""The copy for an outage has what each method of playback needs."""

from pathlib import Path
from typing import get_args
from uuid import UUID

import pytest

from kata.clinic.programmes import service as programmes
from kata.clinic.programmes.schemas import ProgrammeCreate, ProgrammeItemRequest
from kata.clinic.sessions import prefetch
from kata.clinic.sessions.prefetch import CachedPatient
from kata.clinic.stations import service as stations
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import JournalEnd
from kata.motion.edit import AS_TAUGHT
from kata.motion.method import Method
from tests.support.databases import SQLITE_FIRST
from tests.support.imported_runs import Clinic, pose


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


@pytest.fixture
def recording_id(clinic: Clinic) -> UUID:
    return clinic.recording(4.0, pose)


def planned(clinic: Clinic, recording_id: UUID, method: Method) -> None:
    """Prescribe the recording by this method."""
    wanted = ProgrammeCreate(
        name="Morning", items=[ProgrammeItemRequest(recording_id=recording_id, resistance_level=25, method=method)]
    )
    with clinic.database.write() as session:
        programmes.create(session, clinic.patient_id, wanted, [4.0])


def played(clinic: Clinic, recording_id: UUID) -> UUID:
    run_id = clinic.begin_run(recording_id, method="learned")
    clinic.journal("run", run_id, [4.0], at=pose, error_deg=-0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()
    return run_id


def fetched(clinic: Clinic) -> CachedPatient:
    with clinic.database.read() as session:
        return prefetch.fetch(session, "Station 1", [clinic.patient_id], utc_now().date(), {})[clinic.patient_id]


@SQLITE_FIRST
@pytest.mark.parametrize("method", get_args(Method))
def test_copy_has_the_correction_that_a_method_needs(clinic: Clinic, recording_id: UUID, method: Method) -> None:
    run_id = played(clinic, recording_id)
    planned(clinic, recording_id, method)
    learned = fetched(clinic).recordings[recording_id].learned
    assert {asked: newest for asked, (newest, _) in learned.items()} == (
        {AS_TAUGHT: run_id} if method == "learned" else {}
    )


@SQLITE_FIRST
def test_simulated_correction_is_not_copied_to_a_real_apparatus(clinic: Clinic, recording_id: UUID) -> None:
    with clinic.database.write() as session:
        stations.register(session, StationConfig(name="Station 1"), "1", utc_now(), simulated=True)
    played(clinic, recording_id)
    with clinic.database.write() as session:
        stations.register(session, StationConfig(name="Station 1"), "1", utc_now(), simulated=False)
    planned(clinic, recording_id, "learned")
    assert fetched(clinic).recordings[recording_id].learned == {}
