"""The invented clinic: marked, the same every time, and never among real patients."""

import json
import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from inspect import signature
from pathlib import Path
from random import Random
from typing import Any, Literal

import pytest
from sqlalchemy import JSON, String, func, select
from typer.testing import CliRunner

from kata.auth.tables import AccountRow
from kata.cli import seed_course, seed_people
from kata.cli.main import app, seed
from kata.cli.seed import MARK, SeedError, _Invented, fill
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions.tables import MotorTrackingRow, RunRow, SessionRow
from kata.database.base import Base
from kata.database.engine import Database
from kata.device import config, journal
from kata.interop import bundle
from kata.interop.codes import ExportSettings
from kata.messages import CATALOGUE
from kata.motion.builtin import built_in_motions
from tests.support.databases import upgraded_file
from tests.support.paths import ROOT
from tests.support.validators import judge_fhir

NOW = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
PATIENTS = 5


@pytest.fixture(scope="module")
def databases(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Database]]:
    """Return two databases that were filled with the same seed, the second with the first patient only."""
    made = [Database(upgraded_file(tmp_path_factory.mktemp("seed") / "kata.db")) for _ in range(2)]
    for database, patients in zip(made, (PATIENTS, 1), strict=True):
        fill(database, 1, NOW, patients)
    yield made
    for database in made:
        database.close()


def contents(database: Database, patients: int = PATIENTS) -> list[Any]:
    """Return rows of so many patients, beginning with the first."""
    with database.read() as session:
        people = session.execute(
            select(PatientRow.id, PatientRow.name, PatientRow.birth_date)
            .order_by(PatientRow.clinic_number)
            .limit(patients)
        ).all()
        runs = session.execute(
            select(RunRow.id, RunRow.started_at, RunRow.worst_rmse_deg)
            .join(SessionRow)
            .where(SessionRow.patient_id.in_([person.id for person in people]))
            .order_by(RunRow.id)
        )
        return [*map(tuple, runs), *map(tuple, people)]


def test_people_have_months_of_history_and_are_marked_as_invented(databases: list[Database]) -> None:
    with databases[0].read() as session:
        people = session.scalars(select(PatientRow)).all()
        assert len(people) == PATIENTS
        assert all(person.notes == MARK and person.clinic_number.startswith("DEMO-") for person in people)
        visits = session.scalars(select(SessionRow.started_at)).all()
        assert max(visits) < NOW
        assert max(session.scalars(select(AssessmentRow.assessed_at))) < NOW
        assert (max(visits) - min(visits)).days > 80
        assert all(session.scalars(select(SessionRow.signed_at)).all())
        assert set(session.scalars(select(RunRow.outcome))) == {"completed", "stopped"}
        runs = session.scalar(select(func.count()).select_from(RunRow)) or 0
        assert runs > 80
        assert session.scalar(select(func.count()).select_from(MotorTrackingRow)) == 5 * runs
        assert session.scalar(select(func.count()).select_from(AssessmentRow).where(AssessmentRow.spadi_score > 0))
        assert_played_as_planned(session.scalars(select(SessionRow)).all())


def assert_played_as_planned(visits: Sequence[SessionRow]) -> None:
    """Completed playbacks last as long as planned, within two samples. They once had no pauses, and the timer was 30 minutes for 26 s."""
    for visit in visits:
        version = visit.programme_version
        assert version
        assert version.timer_minutes
        durations_s = {item.recording_id: item.duration_s for item in version.items}
        assert -60 < sum(durations_s.values()) - 60 * version.timer_minutes <= 0
        completed = [run for run in visit.runs if run.outcome == "completed"]
        played_s = [run.played_s for run in completed]
        assert played_s == pytest.approx([durations_s[run.recording_id] for run in completed], abs=0.021)


def test_seeded_patients_are_valid_fhir(databases: list[Database], tmp_path: Path) -> None:
    cases = {}
    with databases[0].read() as session:
        for patient in session.scalars(select(PatientRow)):
            bundle.write(session, patient, tmp_path / "bundle.json", ExportSettings())
            cases[patient.clinic_number] = json.loads((tmp_path / "bundle.json").read_text())
    found = judge_fhir(cases)
    assert found == {name: {"medplum": [], "lantana": []} for name in cases}


def test_the_same_number_makes_the_same_clinic(databases: list[Database]) -> None:
    one, other = (contents(database, 1) for database in databases)
    assert len(one) > 10
    assert one == other


def test_every_seeded_patient_is_marked_as_invented(databases: list[Database]) -> None:
    before = contents(databases[0])
    with pytest.raises(SeedError, match="only added to an empty clinic"):
        fill(databases[0], 2, NOW)
    assert contents(databases[0]) == before


def test_command_refuses_while_a_service_runs_there(tmp_path: Path) -> None:
    with journal.claimed(tmp_path, 0.0):
        result = CliRunner().invoke(app, ["seed", "--data", str(tmp_path)])
    assert result.exit_code == 1


def test_the_clinic_has_two_years_of_all_kinds_of_courses() -> None:
    courses = [seed_course.course(Random(f"1 {place}"), place, NOW) for place in range(seed_people.MOST)]
    assert {course.first_stage for course in courses} == {"freezing", "frozen", "thawing"}
    assert {course.station for course in courses} == set(range(seed_course.STATIONS))
    assert {course.therapist for course in courses} == set(range(5))
    assert NOW - timedelta(days=730) < min(course.first for course in courses) < NOW - timedelta(days=600)
    assert max(course.visits[-1] for course in courses) < NOW
    assert sum(course.left for course in courses) >= 3
    gains = [course.gain for course in courses]
    assert min(gains) < 0.2 < 0.8 < max(gains)
    for language in ("en", "ja"):
        assert len({seed_people.person(place, language).name for place in range(seed_people.MOST)}) == seed_people.MOST


CODED = {
    "clinic_number", "code", "config", "device", "dominant_side", "end_reason", "fixtures", "kind", "limits", "measure", "method",
    "motion", "outcome", "position", "role", "sex", "side", "stage", "stop_code", "username", "verification", "version", "checks",
    "search_text", "sort_key", "revision", "oldest",
    # The page translates these messages by the keys beside them.
    "message", "message_key", "stop_key", "stop_message",
}  # fmt: skip
"""Columns whose texts the program writes."""


def test_every_typed_text_of_a_japanese_clinic_is_japanese(tmp_path: Path) -> None:
    """Stations, recordings and the demonstration's therapist once had English names."""
    database = Database(upgraded_file(tmp_path / "kata.db"))
    fill(database, 1, NOW, 1, "ja")
    english = set()
    with database.read() as session:
        for table in Base.metadata.sorted_tables:
            for column in table.columns:
                if isinstance(column.type, String | JSON) and column.name not in CODED:
                    values = session.scalars(select(column).distinct())
                    english |= {(column.name, value) for value in values if re.search("[A-Za-z]{2}", str(value or ""))}
        names = set(session.scalars(select(AccountRow.name)))
    database.close()
    assert english == set()
    words = seed_people.INVENTED_TEXTS["ja"]
    assert words.therapists[-1] in names
    written = json.dumps([list(texts.values()) if isinstance(texts, dict) else texts for texts in vars(words).values()])
    assert not re.search("[A-Za-z]{2}", re.sub(r"\\u....", "", written))


@pytest.mark.parametrize("language", ["en", "ja"])
def test_taught_motions_are_called_as_on_the_page(language: Literal["en", "ja"]) -> None:
    words = CATALOGUE if language == "en" else json.loads((ROOT / "frontend/src/locales/ja/server.json").read_text())
    for number, name in seed_people.INVENTED_TEXTS[language].motions.items():
        word = words[f"motion_{number}"]
        assert name == (word if isinstance(word, str) else word.english)


@pytest.mark.parametrize("language", ["en", "ja"])
def test_service_shows_the_clinic_at_its_first_station(tmp_path: Path, language: Literal["en", "ja"]) -> None:
    result = CliRunner().invoke(app, ["seed", "--data", str(tmp_path), "--patients", "1", "--language", language])
    assert f"kata serve --simulate --station {tmp_path / 'station.toml'}" in result.output.replace("\n", "")
    station = config.read(tmp_path / "station.toml")
    assert station.name == seed_people.INVENTED_TEXTS[language].stations[0]
    assert station.arm is not None


def test_older_playbacks_of_later_patients_have_figures_alone(tmp_path: Path) -> None:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    with database.write() as session:
        place = next(
            place for place in range(12, 60) if len(seed_course.course(Random(f"1 {place}"), place, NOW).visits) < 9
        )
        _Invented(session, Random(f"1 {place}"), place, NOW, built_in_motions()).write("ja")
    with database.read() as session:
        assert session.scalars(select(PatientRow.notes)).all() == [seed_people.INVENTED_TEXTS["ja"].mark]
        visits = session.scalars(select(SessionRow).order_by(SessionRow.started_at)).all()
        *older, newest = visits
        assert all(run.samples is None and run.played_s for visit in older for run in visit.runs)
        assert all(run.samples for run in newest.runs if run.outcome == "completed")
        assert_played_as_planned(visits)
    database.close()


def test_seed_accepts_any_number_up_to_the_available_patients(tmp_path: Path) -> None:
    most = signature(fill).parameters["patients"].default
    assert signature(seed).parameters["patients"].default == most
    refused = CliRunner().invoke(app, ["seed", "--data", str(tmp_path), "--patients", str(most + 1)])
    assert refused.exit_code == 2
