"""FHIR exports of deliberately empty, odd and contradictory rows: valid for two validators, and without rules of FHIR that both leave out."""

import re
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime, timedelta
from typing import Any, Final
from uuid import UUID, uuid4

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.sessions.tables import SessionRow
from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.fhir_bundle import Json, everything, exported, judged, of_kind
from tests.support.fhir_patient import treated

AT: Final = datetime(2026, 5, 1, 9, 0, tzinfo=UTC)
HOUR: Final = timedelta(hours=1)
PASTED: Final = "Fell\x0bon the arm\x07\x1b, twice\nSlept badly"
"""A text pasted from a word processor, with control characters."""


def _episode(session: Session, patient_id: UUID) -> EpisodeRow:
    return session.scalars(select(EpisodeRow).filter_by(patient_id=patient_id)).one()


def _sessions(session: Session, patient_id: UUID) -> Iterator[SessionRow]:
    yield from session.scalars(select(SessionRow).filter_by(patient_id=patient_id))


def _assessments(session: Session, patient_id: UUID) -> Iterator[AssessmentRow]:
    yield from session.scalars(select(AssessmentRow).filter_by(episode_id=_episode(session, patient_id).id))


def _write(session: Session, patient_id: UUID, text: str) -> None:
    """Put a text into every field of a patient's record that the export states."""
    patient, episode = session.get_one(PatientRow, patient_id), _episode(session, patient_id)
    patient.name = patient.kana = text
    episode.diagnosis = episode.contraindications = episode.limits_by = episode.closing_note = text
    for visit in _sessions(session, patient_id):
        visit.therapist = visit.note = visit.signed_by = text
        for addendum in visit.addenda:
            addendum.text = addendum.written_by = text
        for reading in visit.goniometer_readings:
            reading.read_by = text
    for assessment in _assessments(session, patient_id):
        assessment.assessed_by = assessment.note = text
    for programme in session.scalars(select(ProgrammeRow).filter_by(episode_id=episode.id)):
        programme.name = text
        for version in programme.versions:
            version.made_by = version.note = text
    _warn(session, patient_id, note=text, noted_by=text, signed_off_at=AT, signed_off_by=text)
    _warn(session, patient_id, resolved_at=AT, resolved_by=text, resolution=text)


def _warn(session: Session, patient_id: UUID, **columns: Any) -> None:
    given = {"noted_at": AT, "noted_by": "", "code": "pacemaker"} | columns
    session.add(ContraindicationRow(id=uuid4(), patient_id=patient_id, episode_id=None, **given))


def _end_before_begin(session: Session, patient_id: UUID) -> None:
    """Let everything end before it began, as after a change of the computer's clock."""
    episode = _episode(session, patient_id)
    episode.closed_at = episode.opened_at - HOUR
    for visit in _sessions(session, patient_id):
        visit.ended_at = visit.started_at - HOUR
        for run in visit.runs:
            run.ended_at = run.started_at - HOUR
    for programme in session.scalars(select(ProgrammeRow).filter_by(episode_id=episode.id)):
        for version in programme.versions:
            version.made_at = AT - version.number * HOUR
    _warn(session, patient_id, resolved_at=AT - HOUR, resolved_by="Sato Mai", resolution="United.")


def _answer_nothing(session: Session, patient_id: UUID) -> None:
    for assessment in _assessments(session, patient_id):
        assessment.spadi = [None] * 13
        assessment.questionnaires = {"quickdash": [None] * 11, "of_tomorrow": [1, 2]}
        assessment.rom, assessment.note = [], ""
        assessment.pain_rest = assessment.pain_active = assessment.pain_passive = assessment.pain_average = None


def _contradict(session: Session, patient_id: UUID) -> None:
    """Record a birth after the treatment, an infinite error, a lowest angle above the highest, and a completed session whose playbacks have not ended."""
    session.get_one(PatientRow, patient_id).birth_date = date(2999, 1, 1)
    for visit in _sessions(session, patient_id):
        for run in visit.runs:
            run.ended_at, run.worst_rmse_deg, run.repetitions_done = None, float("inf"), 99
            for motion in run.motions:
                motion.played_min_deg, motion.played_max_deg = 80.0, 10.0


ODD: Final[dict[str, Callable[[Session, UUID], None]]] = {
    "control characters": lambda session, patient_id: _write(session, patient_id, PASTED),
    "blanks": lambda session, patient_id: _write(session, patient_id, " \u3000"),
    "nothing": lambda session, patient_id: _write(session, patient_id, ""),
    "very long": lambda session, patient_id: _write(session, patient_id, "長" * 2_000),
    "ends before begins": _end_before_begin,
    "no answer": _answer_nothing,
    "contradictions": _contradict,
}


@pytest.fixture(scope="module")
def odd_bundles(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Json]:
    """Return the bundle of each odd record, by its name."""
    folder = tmp_path_factory.mktemp("odd")
    database = Database(upgraded_file(folder / "kata.db"))
    bundles = {}
    for number, (name, change) in enumerate(ODD.items()):
        patient_id = treated(database, sessions=2, number=f"K-{number}")
        with database.write() as session:
            change(session, patient_id)
        bundles[name] = exported(database, patient_id, folder / "bundle.json")
    database.close()
    return bundles


def test_odd_rows_are_valid_for_both_validators(odd_bundles: dict[str, Json]) -> None:
    assert judged(odd_bundles) == {name: [] for name in ODD}


@pytest.mark.parametrize("name", ODD)
def test_odd_rows_have_no_empty_text_and_no_control_character(odd_bundles: dict[str, Json], name: str) -> None:
    """FHIR R4, string: no character below U+0020 except tab and line ends, and at least one that is no space."""
    for part in everything(odd_bundles[name]):
        for element, value in part.items():
            assert value not in (None, "", [], {}), part
            for text in value if isinstance(value, list) else [value]:
                if isinstance(text, str):
                    assert text.strip(), (element, part)
                    assert not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", text), (element, part)


def test_control_characters_become_spaces(odd_bundles: dict[str, Json]) -> None:
    """Two words stay two words, and line ends stay."""
    (condition,) = of_kind(odd_bundles["control characters"], "Condition")
    assert condition["code"] == {"text": "Fell on the arm  , twice\nSlept badly"}


def test_no_period_ends_before_it_begins(odd_bundles: dict[str, Json]) -> None:
    """FHIR R4, Period, per-1. The start is stated, and that the end is known to be wrong."""
    periods = [part for part in everything(odd_bundles["ends before begins"]) if "start" in part]
    assert len(periods) > 8
    assert [period for period in periods if period.get("end", period["start"]) < period["start"]] == []
    wrong = [period for period in periods if "_end" in period]
    assert len(wrong) == len(periods)
    assert {extension["valueCode"] for period in wrong for extension in period["_end"]["extension"]} == {"error"}


def test_a_permission_without_a_name_has_no_empty_place(odd_bundles: dict[str, Json]) -> None:
    said = [flag["code"]["text"] for flag in of_kind(odd_bundles["nothing"], "Flag") if "period" in flag]
    assert said == [
        "Pacemaker or other active implant. Treatment allowed, 2026-05-01.",
        "Pacemaker or other active implant. No longer applies (2026-05-01).",
    ]
