"""FHIR resources of patient, condition, device and care plan. Each function returns one resource as JSON."""

from uuid import UUID

from kata.clinic.assessments.spadi import ITEMS
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeVersionRow
from kata.interop.codes import (
    CLINIC_NUMBER,
    HL7,
    LOCAL,
    LOCAL_CODES,
    NAME_REPRESENTATION,
    SNOMED,
    SPADI,
    STAGE_SINCE,
    Resource,
    annotation,
    concept,
    derived_id,
    fhir_date,
    local_concept,
    reference,
    shoulder,
    without_empty,
)
from kata.motion.axes import BASIC_MOTIONS


def patient(row: PatientRow) -> Resource:
    """Return the Patient. An erased patient is not exported."""
    if row.erased_at:
        raise ValueError("an erased patient is not exported")
    return without_empty(
        {
            "resourceType": "Patient",
            "id": str(row.id),
            "identifier": [
                {
                    "use": "usual",
                    "type": concept(f"{HL7}v2-0203", "MR", "Medical record number"),
                    "system": CLINIC_NUMBER,
                    "value": row.clinic_number,
                }
            ],
            "active": row.archived_at is None,
            "name": [_name(row.name, "ABC" if row.name.isascii() else "IDE"), _name(row.kana, "SYL")],
            "gender": row.sex,
            "birthDate": fhir_date(row.birth_date),
        }
    )


def _name(text: str | None, representation: str) -> Resource | None:
    """Return a HumanName. Kanji or letters and their reading are distinguished as in JP Core."""
    if not text:
        return None
    return {
        "extension": [{"url": NAME_REPRESENTATION, "valueCode": representation}],
        "use": "official",
        "text": text,
    }


def condition(row: EpisodeRow) -> Resource:
    """Return the Condition. It is coded as frozen shoulder unless there is another diagnosis and no stage; then it is text only."""
    closed = row.closed_at is not None
    code: Resource = {"text": row.diagnosis}
    if row.stages or not row.diagnosis:
        code = concept(SNOMED, "399114005", "Adhesive capsulitis of shoulder", row.diagnosis)
    return without_empty(
        {
            "resourceType": "Condition",
            "id": str(row.id),
            "clinicalStatus": concept(
                f"{HL7}condition-clinical", "inactive" if closed else "active", "Inactive" if closed else "Active"
            ),
            "verificationStatus": concept(f"{HL7}condition-ver-status", "confirmed", "Confirmed"),
            "category": [concept(f"{HL7}condition-category", "problem-list-item", "Problem List Item")],
            "code": code,
            "bodySite": [shoulder(row.side)],
            "subject": reference(row.patient_id),
            "onsetDateTime": fhir_date(row.onset_on),
            "abatementDateTime": fhir_date(row.closed_at),
            "recordedDate": fhir_date(row.opened_at),
            "stage": [
                {
                    "extension": [{"url": STAGE_SINCE, "valueDate": fhir_date(stage.since)}],
                    "summary": local_concept(f"stage-{stage.stage}"),
                }
                for stage in row.stages
            ],
            "note": [
                annotation(f"Contraindications: {row.contraindications}" if row.contraindications else ""),
                annotation(_limits(row), row.limits_by),
                annotation(row.closing_note, at=row.closed_at),
            ],
        }
    )


def _limits(row: EpisodeRow) -> str:
    limits = [
        f"{BASIC_MOTIONS[limit['motion'] - 1].name}: {_bound(limit.get('lowest_deg'))} to {_bound(limit.get('highest_deg'))}"
        for limit in row.limits
    ]
    if row.max_load_level is not None:
        limits.append(f"load level at most {row.max_load_level}")
    if row.max_speed_deg_s is not None:
        limits.append(f"speed at most {row.max_speed_deg_s:g} deg/s")
    return f"Limits set by the doctor: {'; '.join(limits)}." if limits else ""


def _bound(angle_deg: float | None) -> str:
    return "as far as it goes" if angle_deg is None else f"{angle_deg:g} deg"


def care_plan(row: ProgrammeVersionRow, patient_id: UUID) -> Resource:
    """Return one version of a programme. The newest is active, an older one was replaced by the next."""
    versions = {version.number: version for version in row.programme.versions}
    before, after = versions.get(row.number - 1), versions.get(row.number + 1)
    ended_at = after.made_at if after else row.programme.archived_at
    status = "revoked" if after else "completed" if row.programme.archived_at else "active"
    return without_empty(
        {
            "resourceType": "CarePlan",
            "id": str(row.id),
            "replaces": [reference(before.id)] if before else [],
            "status": status,
            "intent": "plan",
            "title": f"{row.programme.name}, version {row.number}",
            "subject": reference(patient_id),
            "period": without_empty({"start": fhir_date(row.made_at), "end": fhir_date(ended_at)}),
            "created": fhir_date(row.made_at),
            "addresses": [reference(row.programme.episode_id)],
            "activity": [_activity(item, status) for item in row.items],
            "note": [
                annotation(
                    row.note or f"Made by {row.made_by}." if row.made_by else row.note, row.made_by, row.made_at
                ),
                annotation(f"Nothing new is begun after {row.timer_minutes:g} minutes." if row.timer_minutes else ""),
            ],
        }
    )


def _activity(item: ProgrammeItemRow, status: str) -> Resource:
    description = (
        f"{item.recording.name}: {item.repetitions} times, {item.speed_percent:g} % speed, {item.range_percent:g} % range, "
        f"pause {item.pause_s:g} s, load level {item.load_level}, {item.method}"
    )
    return {
        "detail": {
            "code": local_concept("session"),
            "status": "in-progress" if status == "active" else "completed" if status == "completed" else "stopped",
            "doNotPerform": False,
            "quantity": {"value": item.repetitions},
            "description": description,
        }
    }


def device(station: str) -> Resource:
    """Return the Device of a station."""
    return {
        "resourceType": "Device",
        "id": str(device_key(station)),
        "identifier": [{"system": LOCAL, "value": station}],
        "status": "active",
        "deviceName": [{"name": station, "type": "user-friendly-name"}],
        "type": local_concept("apparatus"),
    }


def device_key(station: str) -> UUID:
    """Return the id that is derived from a station's name."""
    return derived_id("device", station)


def code_system() -> Resource:
    """Return the declaration of our own codes."""
    return {
        "resourceType": "CodeSystem",
        "id": str(derived_id("code-system")),
        "url": LOCAL,
        "version": "1",
        "name": "KataCodes",
        "title": "Codes of Kata where LOINC and SNOMED CT have none",
        "status": "active",
        "caseSensitive": True,
        "content": "complete",
        "count": len(LOCAL_CODES),
        "concept": [{"code": code, "display": display} for code, display in LOCAL_CODES.items()],
    }


def questionnaire() -> Resource:
    """Return the Questionnaire with the items of the Shoulder Pain and Disability Index, numbered as in a response."""
    return {
        "resourceType": "Questionnaire",
        "id": str(derived_id("spadi")),
        "url": SPADI,
        "version": "1",
        "name": "SPADI",
        "title": "Shoulder Pain and Disability Index",
        "status": "active",
        "subjectType": ["Patient"],
        "item": [
            {"linkId": str(number), "text": f"{item.subscale.capitalize()}: {item.english}", "type": "integer"}
            for number, item in enumerate(ITEMS, start=1)
        ],
    }
