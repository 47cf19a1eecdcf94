"""A patient's complete record as a FHIR R4 transaction.

Every entry is a PUT to a stable id, so a repeated transmission changes nothing. References point to entries of the same bundle. The bundle
is written session by session: a long history is never in memory as a whole.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.sessions.tables import SessionRow
from kata.interop import care, findings
from kata.interop.codes import Resource

MEDIA_TYPE: Final = "application/fhir+json"
_AT_ONCE: Final = 50


def write(session: Session, patient: PatientRow, path: Path) -> None:
    """Write the bundle to a file."""
    with path.open("w", encoding="utf-8") as file:
        file.write('{"resourceType":"Bundle","type":"transaction","entry":[')
        for number, resource in enumerate(resources(session, patient)):
            file.write(",\n" if number else "\n")
            # One entry at a time: encoding the whole bundle at once would block other threads.
            file.write(json.dumps(entry(resource), ensure_ascii=False, allow_nan=False, separators=(",", ":")))
        file.write("\n]}\n")


def entry(resource: Resource) -> Resource:
    """Return the bundle entry of a resource, a PUT to its id."""
    return {
        "fullUrl": f"urn:uuid:{resource['id']}",
        "resource": resource,
        "request": {"method": "PUT", "url": f"{resource['resourceType']}/{resource['id']}"},
    }


def resources(session: Session, patient: PatientRow) -> Iterator[Resource]:
    """Yield all resources. A resource follows those that it refers to."""
    yield care.code_system()
    yield care.questionnaire()
    yield care.patient(patient)
    sides = {episode.id: episode.side for episode in patient.episodes}
    for episode in patient.episodes:
        yield care.condition(episode)
    stations = select(SessionRow.station).where(SessionRow.patient_id == patient.id, SessionRow.station != "")
    for station in session.scalars(stations.distinct().order_by(SessionRow.station)):
        yield care.device(station)
    programmes = select(ProgrammeRow).where(ProgrammeRow.episode_id.in_(sides)).order_by(ProgrammeRow.created_at)
    for programme in session.scalars(programmes):
        for version in programme.versions:
            yield care.care_plan(version, patient.id)
    assessments = select(AssessmentRow).where(AssessmentRow.episode_id.in_(sides))
    for found in session.scalars(assessments.order_by(AssessmentRow.assessed_at, AssessmentRow.id)):
        yield from findings.assessment(found, patient.id)
    for visit in visits(session, patient):
        side = sides.get(visit.episode_id) if visit.episode_id else None
        yield findings.procedure(visit, side)
        if visit.station:
            yield findings.device_use(visit, side)
        yield from findings.session_pain(visit)
        for run in visit.runs:
            yield findings.run_tracking(run, patient.id)


def visits(session: Session, patient: PatientRow) -> Iterator[SessionRow]:
    """Yield a patient's sessions from the first to the last. They are loaded in groups."""
    query = select(SessionRow.id).where(SessionRow.patient_id == patient.id)
    ids = list(session.scalars(query.order_by(SessionRow.started_at, SessionRow.id)))
    for start in range(0, len(ids), _AT_ONCE):
        some = select(SessionRow).where(SessionRow.id.in_(ids[start : start + _AT_ONCE]))
        yield from session.scalars(some.order_by(SessionRow.started_at, SessionRow.id))
