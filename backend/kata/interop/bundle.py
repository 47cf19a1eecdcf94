"""A patient's complete record as a FHIR R4 transaction.

Every entry is a PUT to a stable id, so a repeated transmission changes nothing. References point to entries of the same bundle. The bundle
is written session by session, so that a long history is never completely in memory.
"""

import json
from collections.abc import Iterator, Mapping
from datetime import tzinfo
from pathlib import Path
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes import adherence
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.questionnaires.definitions import DEFINITIONS, SPADI
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow
from kata.clinic.sessions import patient_angles
from kata.clinic.sessions.tables import SessionRow
from kata.database.engine import Database
from kata.interop import exported_statements, fhir_care, fhir_observations, service
from kata.interop.codes import ExportSettings, Resource, simulated, with_valid_texts
from kata.interop.exported_statements import Statement

MEDIA_TYPE: Final = "application/fhir+json"
_AT_ONCE: Final = 50


def export(database: Database, patient_id: UUID, path: Path, clinic: ExportSettings) -> None:
    """Write a patient's bundle to a file, and store what it states.

    :raises ProblemError: 404; 409 when the record was erased.
    """
    with database.read() as session:
        new = write(session, service.identified_patient(session, patient_id), path, clinic)
    if new:
        with database.write() as session:
            # The lock prevents an erasure, and a second export, in the meantime.
            patients.get(session, patient_id, to_change=True)
            service.identified_patient(session, patient_id)
            exported_statements.store(session, patient_id, new)


def write(session: Session, patient: PatientRow, path: Path, clinic: ExportSettings) -> dict[UUID, Statement]:
    """Write the bundle to a file. Return the statements that are new or changed since the last export, by id. The caller stores them."""
    before = exported_statements.stored(session, patient.id)
    now: dict[UUID, Statement] = {}
    with path.open("w", encoding="utf-8") as file:
        file.write('{"resourceType":"Bundle","type":"transaction","entry":[')
        for number, plain in enumerate(_compared(resources(session, patient, clinic), before, now)):
            resource = with_valid_texts(clinic.profiled(plain))
            file.write(",\n" if number else "\n")
            # One entry at a time, because encoding the whole bundle at once would block other threads.
            file.write(json.dumps(entry(resource), ensure_ascii=False, allow_nan=False, separators=(",", ":")))
        file.write("\n]}\n")
    return {id_: statement for id_, statement in now.items() if before.get(id_) != statement}


def _compared(
    stating: Iterator[Resource], before: Mapping[UUID, Statement], now: dict[UUID, Statement]
) -> Iterator[Resource]:
    """Yield all resources, then a withdrawal for each statement that only an earlier export made.

    A resource that has changed since the last export gets the status amended. Each statement is added to ``now``.
    """
    for resource in stating:
        id_ = UUID(resource["id"])
        if statement := exported_statements.compare(resource, before.get(id_)):
            now[id_] = statement
            yield exported_statements.with_status(resource, statement)
        else:
            yield resource
    for id_, statement in before.items():
        if id_ not in now:
            now[id_] = exported_statements.withdrawn(statement)
            yield statement.withdrawal


def entry(resource: Resource) -> Resource:
    """Return the bundle entry of a resource, a PUT to its id."""
    return {
        "fullUrl": f"urn:uuid:{resource['id']}",
        "resource": resource,
        "request": {"method": "PUT", "url": f"{resource['resourceType']}/{resource['id']}"},
    }


def resources(session: Session, patient: PatientRow, clinic: ExportSettings) -> Iterator[Resource]:
    """Yield all resources. A resource comes after the resources to which it refers."""
    yield fhir_care.code_system()
    yield from _questionnaires(session, patient)
    yield fhir_care.patient(patient, clinic.identifier_system)
    sides = {episode.id: episode.side for episode in patient.episodes}
    # A Condition has the id of its episode.
    conditions: dict[UUID, UUID] = {}
    for episode in patient.episodes:
        if condition := fhir_care.condition(episode):
            conditions[episode.id] = episode.id
            yield condition
        yield from fhir_care.episode(episode, has_condition=condition is not None)
    warnings = select(ContraindicationRow).where(ContraindicationRow.patient_id == patient.id)
    for warning in session.scalars(warnings.order_by(ContraindicationRow.noted_at)):
        side = sides[warning.episode_id] if warning.episode_id else None
        yield fhir_care.contraindication(warning, side, clinic.zone)
    stations = select(SessionRow.station, SessionRow.simulated)
    stations = stations.where(SessionRow.patient_id == patient.id, SessionRow.station != "").distinct()
    for station, is_simulated in session.execute(stations.order_by(SessionRow.station)):
        device = fhir_care.device(station, is_simulated=is_simulated)
        yield simulated(device) if is_simulated else device
    programmes = select(ProgrammeRow).where(ProgrammeRow.episode_id.in_(sides)).order_by(ProgrammeRow.created_at)
    for programme in session.scalars(programmes):
        for version in programme.versions:
            yield fhir_care.care_plan(version, patient.id, conditions.get(programme.episode_id))
    assessments = select(AssessmentRow).where(AssessmentRow.episode_id.in_(sides))
    for assessment_row in session.scalars(assessments.order_by(AssessmentRow.assessed_at, AssessmentRow.id)):
        yield from fhir_observations.assessment(assessment_row, patient.id, sides[assessment_row.episode_id])
    for clinic_session in clinic_sessions(session, patient):
        reason = conditions.get(clinic_session.episode_id) if clinic_session.episode_id else None
        for resource in _clinic_session(clinic_session, clinic_session.side, reason):
            yield simulated(resource) if clinic_session.simulated else resource
    for episode in patient.episodes:
        yield from _end_range_times(session, episode, clinic.zone)


def _end_range_times(session: Session, episode: EpisodeRow, zone: tzinfo) -> Iterator[Resource]:
    for time in adherence.end_range_times(session, episode.id, zone):
        resource = fhir_observations.end_range(time, episode)
        yield simulated(resource) if time.is_simulated else resource


def _questionnaires(session: Session, patient: PatientRow) -> Iterator[Resource]:
    """Yield the SPADI and every other questionnaire that the patient has answered, with its texts if their licence allows it."""
    episodes = [episode.id for episode in patient.episodes]
    stored = session.scalars(select(AssessmentRow.questionnaires).where(AssessmentRow.episode_id.in_(episodes)))
    codes = {SPADI.code, *(code for answers in stored for code in answers)}
    words = select(QuestionnaireTextsRow).where(QuestionnaireTextsRow.may_be_exported)
    free = {row.questionnaire: row for row in session.scalars(words.order_by(QuestionnaireTextsRow.language))}
    for code, definition in DEFINITIONS.items():
        if code in codes:
            yield fhir_care.questionnaire(definition, free.get(code))


def _clinic_session(clinic_session: SessionRow, side: str | None, reason: UUID | None) -> Iterator[Resource]:
    yield fhir_observations.procedure(clinic_session, side, reason)
    if clinic_session.station:
        yield fhir_observations.device_use(clinic_session, side, reason)
    yield from fhir_observations.session_pain(clinic_session, side)
    for reading in clinic_session.goniometer_readings:
        yield fhir_observations.goniometer_reading(reading, clinic_session)
    angles = patient_angles.of_session(clinic_session)
    for run in clinic_session.runs:
        if run.end_feel:
            # A baseline is of the apparatus, not of the patient.
            if run.end_feel.kind == "test":
                yield fhir_observations.end_feel(run, clinic_session.patient_id)
            continue
        yield fhir_observations.run_tracking(run, clinic_session.patient_id)
        yield from fhir_observations.patient_angles(run, clinic_session, angles)


def clinic_sessions(session: Session, patient: PatientRow) -> Iterator[SessionRow]:
    """Yield a patient's sessions from the first to the last. The sessions are loaded in groups."""
    query = select(SessionRow.id).where(SessionRow.patient_id == patient.id)
    ids = list(session.scalars(query.order_by(SessionRow.started_at, SessionRow.id)))
    for start in range(0, len(ids), _AT_ONCE):
        some = select(SessionRow).where(SessionRow.id.in_(ids[start : start + _AT_ONCE]))
        yield from session.scalars(some.order_by(SessionRow.started_at, SessionRow.id))
