"""FHIR resources of sessions, runs and assessments. Each function returns the resources of one row as JSON."""

from collections.abc import Iterator
from datetime import datetime
from uuid import UUID

from kata.clinic.assessments.spadi import ITEMS
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.interop.care import device_key
from kata.interop.codes import (
    HL7,
    LOINC,
    PAIN,
    SPADI,
    Resource,
    annotation,
    concept,
    derived_id,
    fhir_date,
    local_concept,
    quantity,
    reference,
    rom_code,
    shoulder,
    without_empty,
)

_EXAM = concept(f"{HL7}observation-category", "exam", "Exam")
_SURVEY = concept(f"{HL7}observation-category", "survey", "Survey")
_THERAPY = concept(f"{HL7}observation-category", "therapy", "Therapy")
_PAINS = ("rest", "active", "passive", "average")


def procedure(row: SessionRow, side: str | None) -> Resource:
    """Return the Procedure of one session, with its note and addenda."""
    return without_empty(
        {
            "resourceType": "Procedure",
            "id": str(row.id),
            "basedOn": [reference(row.programme_version_id)] if row.programme_version_id else [],
            "status": "completed" if row.ended_at else "in-progress",
            "code": local_concept("session"),
            "subject": reference(row.patient_id),
            "performedPeriod": _period(row),
            "performer": [{"actor": {"display": row.therapist}}] if row.therapist else [],
            "reasonReference": [reference(row.episode_id)] if row.episode_id else [],
            "bodySite": [shoulder(side)] if side else [],
            "usedReference": [reference(device_key(row.station), row.station)] if row.station else [],
            "note": [
                annotation(row.note, row.signed_by or row.therapist, row.signed_at),
                *(annotation(addendum.text, addendum.written_by, addendum.written_at) for addendum in row.addenda),
            ],
        }
    )


def device_use(row: SessionRow, side: str | None) -> Resource:
    """Return the DeviceUseStatement of a session."""
    return without_empty(
        {
            "resourceType": "DeviceUseStatement",
            "id": str(derived_id("device-use", row.id)),
            "status": "completed" if row.ended_at else "active",
            "subject": reference(row.patient_id),
            "derivedFrom": [reference(row.id)],
            "timingPeriod": _period(row),
            "recordedOn": fhir_date(row.started_at),
            "device": reference(device_key(row.station), row.station),
            "reasonReference": [reference(row.episode_id)] if row.episode_id else [],
            "bodySite": shoulder(side) if side else None,
        }
    )


def session_pain(row: SessionRow) -> Iterator[Resource]:
    """Yield the pain scores before, during and after a session."""
    moments = {"before": row.started_at, "during": row.started_at, "after": row.ended_at or row.started_at}
    for context, at in moments.items():
        score: int | None = getattr(row, f"pain_{context}")
        if score is not None:
            observation = _pain(derived_id("pain", context, row.id), row.patient_id, context, score, at)
            yield observation | {"partOf": [reference(row.id)]}


def run_tracking(row: RunRow, patient_id: UUID) -> Resource:
    """Return the tracking error of one run (as in the paper) and its outcome."""
    components = [
        _component("run-outcome", valueString=row.outcome if row.outcome != "loaded" else None),
        _component("run-repetitions", valueInteger=row.repetitions),
        _component("tracking-peak", valueQuantity=quantity(row.worst_peak_deg, "deg")),
    ]
    for motion in row.motions:
        components += [
            _component(f"motion-{motion.motion}-rmse", valueQuantity=quantity(motion.rmse_deg, "deg")),
            _component(f"motion-{motion.motion}-lowest", valueQuantity=quantity(motion.played_min_deg, "deg")),
            _component(f"motion-{motion.motion}-highest", valueQuantity=quantity(motion.played_max_deg, "deg")),
        ]
    value = quantity(row.worst_rmse_deg, "deg")
    unknown = concept(f"{HL7}data-absent-reason", "not-performed", "Not Performed")
    return without_empty(
        {
            "resourceType": "Observation",
            "id": str(row.id),
            "partOf": [reference(row.session_id)],
            "status": "final" if row.ended_at else "preliminary",
            "category": [_THERAPY],
            "code": local_concept("run-tracking")
            | {"text": f"Tracking error (root mean square) of {row.recording.name}"},
            "subject": reference(patient_id),
            "effectivePeriod": without_empty({"start": fhir_date(row.started_at), "end": fhir_date(row.ended_at)}),
            "valueQuantity": value,
            "dataAbsentReason": None if value else unknown,
            "bodySite": shoulder(row.recording.side),
            "component": components,
        }
    )


def assessment(row: AssessmentRow, patient_id: UUID) -> Iterator[Resource]:
    """Yield the findings of one assessment. A withdrawn assessment corrects what was sent before."""
    status = "entered-in-error" if row.withdrawn_at else "final"
    who = without_empty({"performer": [{"display": row.assessed_by}] if row.assessed_by else []})
    for measured in row.rom:
        yield _rom(measured, row, patient_id) | {"status": status} | who
    for context in _PAINS:
        score: int | None = getattr(row, f"pain_{context}")
        if score is not None:
            observation = _pain(derived_id("pain", context, row.id), patient_id, context, score, row.assessed_at)
            yield observation | {"status": status} | who
    if row.spadi is not None:
        yield _answers(row, row.spadi, patient_id)
        if score_percent := quantity(row.spadi_score, "{score}"):
            yield (
                _observation(derived_id("spadi", row.id), patient_id, row.assessed_at, _SURVEY)
                | {
                    "status": status,
                    "code": local_concept("spadi-total"),
                    "valueQuantity": score_percent,
                    "derivedFrom": [reference(row.id)],
                }
                | who
            )
    if row.note.strip():
        yield (
            _observation(derived_id("assessment-note", row.id), patient_id, row.assessed_at, _EXAM)
            | {
                "status": status,
                "code": local_concept("assessment-note"),
                "valueString": row.note,
            }
            | who
        )


def _rom(measured: RomRow, row: AssessmentRow, patient_id: UUID) -> Resource:
    names = (measured.side, measured.motion, measured.kind, measured.position)
    at = None
    if measured.position:
        at = _component("arm-position", valueCodeableConcept=local_concept(f"position-{measured.position}"))
    return without_empty(
        _observation(derived_id("rom", row.id, *names), patient_id, row.assessed_at, _EXAM)
        | {
            "code": rom_code(measured.motion, measured.position, measured.kind),
            "bodySite": shoulder(measured.side),
            "valueQuantity": quantity(measured.angle_deg, "deg"),
            "component": [at],
        }
    )


def _answers(row: AssessmentRow, answers: list[int | None], patient_id: UUID) -> Resource:
    return {
        "resourceType": "QuestionnaireResponse",
        "id": str(row.id),
        "questionnaire": SPADI,
        "status": "entered-in-error" if row.withdrawn_at else "completed",
        "subject": reference(patient_id),
        "authored": fhir_date(row.assessed_at),
        "item": [
            without_empty(
                {
                    "linkId": str(number),
                    "text": f"{item.subscale.capitalize()}: {item.english}",
                    "answer": [] if answer is None else [{"valueInteger": answer}],
                }
            )
            for number, (item, answer) in enumerate(zip(ITEMS, answers, strict=True), start=1)
        ],
    }


def _pain(identity: UUID, patient_id: UUID, context: str, score: int, at: datetime) -> Resource:
    return _observation(identity, patient_id, at, _SURVEY) | {
        "code": concept(LOINC, PAIN, "Pain severity - 0-10 verbal numeric rating [Score] - Reported"),
        "valueQuantity": quantity(score, "{score}"),
        "component": [_component("pain-context", valueCodeableConcept=local_concept(f"pain-{context}"))],
    }


def _observation(identity: UUID, patient_id: UUID, at: datetime, category: Resource) -> Resource:
    return {
        "resourceType": "Observation",
        "id": str(identity),
        "status": "final",
        "category": [category],
        "subject": reference(patient_id),
        "effectiveDateTime": fhir_date(at),
    }


def _component(code: str, **value: object) -> Resource | None:
    """Return a component, None without a value."""
    (given,) = value.values()
    return None if given is None else {"code": local_concept(code), **value}


def _period(row: SessionRow) -> Resource:
    return without_empty({"start": fhir_date(row.started_at), "end": fhir_date(row.ended_at)})
