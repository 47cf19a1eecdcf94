"""Assessments on both databases."""

from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest

from kata.clinic.assessments import service
from kata.clinic.assessments.schemas import AssessmentCreate, AssessmentUpdate
from kata.clinic.assessments.tables import RomRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.database.engine import Database
from kata.errors import ProblemError
from tests.support.databases import SQLITE_FIRST

DAY = datetime(2026, 3, 2, 9, 30, tzinfo=UTC)
SPADI = [8, 7, 6, 5, 4, 3, 3, 3, 3, 3, 3, 3, 3]


def rom(angle_deg: float, **given: Any) -> dict[str, Any]:
    return {"side": "left", "motion": "flexion", "kind": "active", "angle_deg": angle_deg} | given


def found(day: int = 0, **given: Any) -> AssessmentCreate:
    body: dict[str, Any] = {"assessed_at": DAY + timedelta(days=day), "assessed_by": "Kimura Jun", "pain_rest": 3}
    return AssessmentCreate(**(body | given))


@pytest.fixture
def episode_id(database: Database) -> UUID:
    with database.write() as session:
        row = patients.create(session, PatientCreate(clinic_number="K-1", name="Yamada Hanako", affected_side="left"))
        assert row.episode
        return row.episode.id


@SQLITE_FIRST
def test_assessment_is_saved_unchanged(database: Database, episode_id: UUID) -> None:
    entries = [
        rom(31.5, motion="external_rotation", position="abducted_90", kind="passive"),
        rom(170, side="right"),
        rom(95),
    ]
    with database.write() as session:
        key = service.create(session, episode_id, found(rom=entries, spadi=SPADI, pain_average=5, note=" Slept. ")).id
    with database.read() as session:
        stored = service.as_assessment(service.get(session, key))
    assert (stored.assessed_at, stored.assessed_by, stored.note) == (DAY, "Kimura Jun", "Slept.")
    assert (stored.pain_rest, stored.pain_active, stored.pain_passive, stored.pain_average) == (3, None, None, 5)
    assert stored.spadi == SPADI
    assert stored.spadi_score
    assert (stored.spadi_score.pain, stored.spadi_score.disability, stored.spadi_score.total) == (60, 30, 45)
    # In the table's order, not in the order of the request.
    assert [(entry.side, entry.motion, entry.position, entry.kind, entry.angle_deg) for entry in stored.rom] == [
        ("left", "flexion", "", "active", 95),
        ("right", "flexion", "", "active", 170),
        ("left", "external_rotation", "abducted_90", "passive", 31.5),
    ]


def test_change_replaces_given_fields_and_keeps_the_rest(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        row = service.create(session, episode_id, found(rom=[rom(95), rom(110, kind="passive")], spadi=SPADI))
    entries = [rom(100), rom(20, motion="extension")]
    change = AssessmentUpdate.model_validate({"updated_at": row.updated_at, "rom": entries, "pain_rest": None})
    with database.write() as session:
        service.change(session, row.id, change)
    with database.read() as session:
        stored = service.as_assessment(service.get(session, row.id))
    assert [(entry.motion, entry.kind, entry.angle_deg) for entry in stored.rom] == [
        ("flexion", "active", 100),
        ("extension", "active", 20),
    ]
    assert (stored.pain_rest, stored.spadi, stored.assessed_by) == (None, SPADI, "Kimura Jun")
    assert stored.updated_at > row.updated_at


def test_second_of_two_editors_is_refused_and_nothing_is_lost(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        row = service.create(session, episode_id, found())
        seen = row.updated_at
    with database.write() as session:
        service.change(session, row.id, AssessmentUpdate(updated_at=seen, note="first"))
    with pytest.raises(ProblemError) as raised, database.write() as session:
        service.change(session, row.id, AssessmentUpdate(updated_at=seen, note="second"))
    assert (raised.value.status, raised.value.code) == (409, "edited_meanwhile")
    with pytest.raises(ProblemError) as raised, database.write() as session:
        service.withdraw(session, row.id, seen)
    assert raised.value.code == "edited_meanwhile"
    with database.read() as session:
        assert service.get(session, row.id).note == "first"


def test_withdrawn_assessment_stays_visible_and_counts_for_nothing(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        first, second, third = (service.create(session, episode_id, found(day)) for day in (0, 7, 14))
    with database.write() as session:
        withdrawn = service.withdraw(session, first.id, first.updated_at)
        at, updated_at = withdrawn.withdrawn_at, withdrawn.updated_at
    with database.write() as session:
        assert service.withdraw(session, first.id, first.updated_at).withdrawn_at == at

    with database.read() as session:
        rows, further, baseline = service.of_episode(session, episode_id, 20, None)
        assert ([row.id for row in rows], further) == ([third.id, second.id, first.id], None)
        assert baseline
        assert baseline.id == second.id
    with pytest.raises(ProblemError) as raised, database.write() as session:
        service.change(session, first.id, AssessmentUpdate(updated_at=updated_at, note="late"))
    assert raised.value.code == "withdrawn"


def test_next_page_continues_where_the_list_ended(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        made = [service.create(session, episode_id, found(day)).id for day in range(5)]
        patient_id = service.episode_of(session, episode_id).patient_id
    with database.read() as session:
        first, further = service.of_patient(session, patient_id, 2, None)
        assert [row.id for row in first] == [made[4], made[3]]
        rows, _, _ = service.of_episode(session, episode_id, 2, further)
        assert [row.id for row in rows] == [made[2], made[1]]


@SQLITE_FIRST
def test_an_assessment_never_becomes_empty(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        row = service.create(session, episode_id, found())
    with pytest.raises(ProblemError) as raised, database.write() as session:
        service.change(session, row.id, AssessmentUpdate(updated_at=row.updated_at, pain_rest=None))
    assert (raised.value.status, raised.value.code) == (422, "nothing_found")
    with database.read() as session:
        assert service.get(session, row.id).pain_rest == 3


@SQLITE_FIRST
def test_unknown_measures_of_another_version_are_tolerated(database: Database, episode_id: UUID) -> None:
    with database.write() as session:
        row = service.create(session, episode_id, found(rom=[rom(95)]))
        unknown = RomRow(side="left", motion="circumduction", kind="active", position="", angle_deg=1)
        wider = RomRow(side="left", motion="extension", kind="active", position="", angle_deg=95)
        row.rom += [unknown, wider]
    with database.read() as session:
        stored = service.as_assessment(service.get(session, row.id))
    assert [(entry.motion, entry.angle_deg) for entry in stored.rom] == [("flexion", 95), ("extension", 95)]


@SQLITE_FIRST
def test_missing_record_is_not_found(database: Database) -> None:
    with pytest.raises(ProblemError) as raised, database.write() as session:
        service.create(session, uuid4(), found())
    assert raised.value.status == 404
