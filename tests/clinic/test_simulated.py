"""Values of a simulated apparatus are marked in every answer, export and report."""

import io
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from arro3.io import read_parquet

from kata.clinic.patients import service as patients
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.derive import derive
from kata.clinic.recordings.edits import Trim
from kata.clinic.sessions import lists, runs, stored_corrections
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.lists import SessionFilter
from kata.clinic.stations import service as stations
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import JournalEnd
from kata.interop import bundle, sample_file, service
from kata.interop.codes import ExportSettings
from kata.interop.motion_csv import parse_motion
from kata.reporting import session as session_report
from kata.reporting.rendering import session_page
from tests.support.databases import SQLITE_FIRST
from tests.support.imported_runs import Clinic, pose
from tests.support.reports import print_options

LONG_AGO = datetime(2020, 1, 1, tzinfo=UTC)
STATION = StationConfig(name="Station 1")


def started(database: Database, at: datetime, *, simulated: bool) -> None:
    """Start the service of the station."""
    with database.write() as session:
        stations.register(session, STATION, "1", at, simulated=simulated)


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    """Return a clinic whose station has always been simulated."""
    made = Clinic(tmp_path, database)
    started(database, LONG_AGO, simulated=True)
    return made


def taught(clinic: Clinic) -> UUID:
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], end=JournalEnd(reason="finished"), at=pose)
    clinic.importer.run()
    return clinic.saved[-1].id


def played(clinic: Clinic, recording_id: UUID) -> tuple[UUID, UUID]:
    """Play a recording; return the session and the run."""
    with clinic.database.write() as session:
        visit = sessions.begin(session, clinic.patient_id, station="Station 1").id
        run_id = runs.begin(session, runs.RunRequest(visit, recording_id, method="learned"), "Station 1").id
    clinic.journal("run", run_id, [4.0], end=JournalEnd(reason="completed"), at=pose)
    clinic.importer.run()
    return visit, run_id


def marks(clinic: Clinic, recording_id: UUID) -> bool:
    with clinic.database.read() as session:
        return recordings.get(session, recording_id).simulated


@SQLITE_FIRST
def test_derived_recording_keeps_the_mark_on_a_real_station(clinic: Clinic) -> None:
    parent = taught(clinic)
    started(clinic.database, utc_now(), simulated=False)
    with clinic.database.write() as session:
        trim = Trim(do="trim", start_s=0.5, end_s=3.5)
        made = derive(recordings.source(session, parent, trim), trim, STATION)
        child = recordings.store_derived(session, parent, made, None, "Station 1").id
    assert (marks(clinic, parent), marks(clinic, child)) == (True, True)


@SQLITE_FIRST
@pytest.mark.parametrize("simulated", [True, pytest.param(False, marks=pytest.mark.campaign)])
def test_session_run_report_and_bundle_have_the_mark(clinic: Clinic, tmp_path: Path, simulated: bool) -> None:
    recording_id = taught(clinic)
    started(clinic.database, utc_now(), simulated=simulated)
    visit, run_id = played(clinic, recording_id)
    with clinic.database.read() as session:
        assert sessions.as_session(sessions.get(session, visit)).simulated is simulated
        (row,), _ = lists.find(session, SessionFilter(), 10, None)
        assert row.simulated is simulated
        page = session_page(session_report.read_content(session, visit, UTC), print_options()).html
        assert ("SIMULATED APPARATUS" in page) is simulated
        bundle.write(
            session,
            patients.get(session, clinic.patient_id),
            tmp_path / "bundle.json",
            ExportSettings(profiles={"Procedure": "urn:x"}),
        )
        _, origin = service.of_run(session, run_id)
        assert origin.simulated is simulated
    resources = [entry["resource"] for entry in json.loads((tmp_path / "bundle.json").read_text())["entry"]]
    by_kind: dict[str, list[Any]] = {}
    for resource in resources:
        by_kind.setdefault(resource["resourceType"], []).append(
            resource.get("meta", {}).get("security", [{}])[0].get("code")
        )
    wanted = ["HTEST" if simulated else None]
    assert (
        by_kind["Procedure"] == by_kind["DeviceUseStatement"] == by_kind["Observation"] == by_kind["Device"] == wanted
    )
    assert by_kind["Patient"] == [None]
    (procedure,) = [resource for resource in resources if resource["resourceType"] == "Procedure"]
    assert procedure["meta"]["profile"] == ["urn:x"]
    (device,) = [resource for resource in resources if resource["resourceType"] == "Device"]
    assert device["type"]["coding"][0]["code"] == ("simulated-apparatus" if simulated else "apparatus")


@SQLITE_FIRST
def test_files_of_samples_have_the_mark_and_keep_it(clinic: Clinic, tmp_path: Path) -> None:
    recording_id = taught(clinic)
    with clinic.database.read() as session:
        series, origin = service.of_recording(session, recording_id)
    assert origin.marked_id == f"{recording_id}-simulated"
    csv, parquet = tmp_path / "a.csv", tmp_path / "a.parquet"
    sample_file.write(series, origin, "csv", csv)
    sample_file.write(series, origin, "parquet", parquet)
    lines = csv.read_text().splitlines()
    assert lines[0].endswith(",simulated")
    assert {line.rpartition(",")[2] for line in lines[1:]} == {"1"}
    stored = read_parquet(io.BytesIO(parquet.read_bytes())).read_all()
    assert stored.schema.metadata_str["simulated"].startswith("yes")

    again = parse_motion(csv.read_bytes(), "right", STATION)
    assert (again.simulated, again.left_alone) == (True, ())
    with clinic.database.write() as session:
        row = service.store_imported_motion(
            session, clinic.patient_id, again, name="Again", taught_by="", station="Station 1"
        )
        assert row.simulated


@SQLITE_FIRST
def test_real_samples_have_no_mark(database: Database, tmp_path: Path) -> None:
    clinic = Clinic(tmp_path, database)
    started(database, LONG_AGO, simulated=False)
    with database.read() as session:
        series, origin = service.of_recording(session, taught(clinic))
    sample_file.write(series, origin, "csv", tmp_path / "a.csv")
    assert "simulated" not in (tmp_path / "a.csv").read_text()
    assert not parse_motion((tmp_path / "a.csv").read_bytes(), "right", STATION).simulated


@SQLITE_FIRST
def test_correction_of_a_simulated_apparatus_is_not_played_really(clinic: Clinic) -> None:
    recording_id = taught(clinic)
    visit, run_id = played(clinic, recording_id)
    with clinic.database.write() as session:
        assert stored_corrections.correction(session, run_id) is not None
        like = runs.prepare(session, runs.RunRequest(visit, recording_id, method="learned"), "Station 1")
        assert like.corrected_by == run_id
    started(clinic.database, utc_now(), simulated=False)
    with clinic.database.write() as session:
        like = runs.prepare(session, runs.RunRequest(visit, recording_id, method="learned"), "Station 1")
        assert like.corrected_by is None
