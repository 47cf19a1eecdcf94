"""FHIR resources of sessions, runs and assessments. Each function returns the resources of one row as JSON."""

from collections.abc import Iterator
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.programmes.adherence import EndRangeSession, EndRangeTime
from kata.clinic.questionnaires import definitions
from kata.clinic.questionnaires.definitions import DEFINITIONS, SPADI
from kata.clinic.sessions.patient_angles import PatientAngles
from kata.clinic.sessions.tables import MIN_COMPARED_PERCENT, GoniometerReadingRow, RunRow, SessionRow
from kata.interop.codes import (
    HL7,
    Resource,
    annotation,
    concept,
    derived_id,
    fhir_date,
    local_concept,
    pain_code,
    period,
    quantity,
    questionnaire_url,
    reference,
    rom_code,
    shoulder,
    without_empty,
)
from kata.interop.fhir_care import device_key
from kata.motion.axes import BASIC_MOTIONS

_EXAM = concept(f"{HL7}observation-category", "exam", "Exam")
_SURVEY = concept(f"{HL7}observation-category", "survey", "Survey")
_THERAPY = concept(f"{HL7}observation-category", "therapy", "Therapy")
_PARTIAL = f"Less than {MIN_COMPARED_PERCENT:g} % of the playing time or no complete repetition was compared"
_PAINS = ("rest", "active", "passive", "average")
_END_OF: Final = {"completed": "completed", "shortened": "stopped", "stopped": "stopped", "patient_request": "stopped"}
"""Status of a Procedure by the reason why the session ended. The reason "other" does not say whether the session was completed."""


def procedure(row: SessionRow, side: str | None, reason: UUID | None) -> Resource:
    """Return the Procedure of one session, for a Condition, with the session's note and addenda."""
    status = _END_OF.get(row.end_reason or "", "unknown") if row.ended_at else "in-progress"
    return without_empty(
        {
            "resourceType": "Procedure",
            "id": str(row.id),
            "basedOn": [reference(row.programme_version_id)] if row.programme_version_id else [],
            "status": status,
            "statusReason": {"text": row.end_reason}
            if row.ended_at and status != "completed" and row.end_reason
            else None,
            "code": local_concept("session"),
            "subject": reference(row.patient_id),
            "performedPeriod": period(row.started_at, row.ended_at),
            "performer": [{"actor": {"display": row.therapist}}] if row.therapist else [],
            "reasonReference": [reference(reason)] if reason else [],
            "bodySite": [shoulder(side)] if side else [],
            "usedReference": [reference(device_key(row.station, is_simulated=row.simulated), row.station)]
            if row.station
            else [],
            "note": [
                _note(row),
                *(annotation(addendum.text, addendum.written_by, addendum.written_at) for addendum in row.addenda),
            ],
        }
    )


def _note(row: SessionRow) -> Resource | None:
    """Return the session's note. An unsigned note is marked and has no author, because the software may have drafted it."""
    if row.signed_at or not row.note.strip():
        return annotation(row.note, row.signed_by, row.signed_at)
    return annotation(f"Draft, not signed: {row.note}")


def device_use(row: SessionRow, side: str | None, reason: UUID | None) -> Resource:
    """Return the DeviceUseStatement of a session, for a Condition."""
    return without_empty(
        {
            "resourceType": "DeviceUseStatement",
            "id": str(derived_id("device-use", row.id)),
            "status": "completed" if row.ended_at else "active",
            "subject": reference(row.patient_id),
            "derivedFrom": [reference(row.id)],
            "timingPeriod": period(row.started_at, row.ended_at),
            "recordedOn": fhir_date(row.started_at),
            "device": reference(device_key(row.station, is_simulated=row.simulated), row.station),
            "reasonReference": [reference(reason)] if reason else [],
            "bodySite": shoulder(side) if side else None,
        }
    )


def session_pain(row: SessionRow, side: str | None) -> Iterator[Resource]:
    """Yield the pain scores before, during and after a session."""
    # The time of an answer is unknown during a session, and after a session that has not ended.
    during: Resource = {"effectivePeriod": period(row.started_at, row.ended_at)}
    moments: dict[str, Resource] = {
        "before": {"effectiveDateTime": fhir_date(row.started_at)},
        "during": during,
        "after": {"effectiveDateTime": fhir_date(row.ended_at)} if row.ended_at else during,
    }
    for context, effective in moments.items():
        score: int | None = getattr(row, f"pain_{context}")
        if score is not None:
            pain = _pain(derived_id("pain", context, row.id), row.patient_id, context, score, side)
            yield pain | effective | {"partOf": [reference(row.id)], "status": _status_in(row)}


def run_tracking(row: RunRow, patient_id: UUID) -> Resource:
    """Return the tracking error of one run, how the settings changed the motion, and the run's outcome.

    The ends of a motion are apparatus angles. The requested and the smallest range tell whether a part of the taught range was left out. The tracking error of a partial run does not cover the whole playback; the compared share tells how much it covers.
    """
    components = [
        _component("run-outcome", valueString=row.outcome if row.outcome != "loaded" else None),
        _component("run-repetitions", valueInteger=row.repetitions),
        _component("run-repetitions-done", valueInteger=row.repetitions_done),
        _component("run-range", valueQuantity=quantity(row.range_percent, "%")),
        _component("run-least-range", valueQuantity=quantity(row.least_range_percent, "%")),
        _component("tracking-peak", valueQuantity=quantity(row.worst_peak_deg, "deg")),
        _component("compared-share", valueQuantity=quantity(row.compared_percent, "%")),
        _component("clock-offset", valueQuantity=quantity(row.clock_offset_s, "s")),
        _component("self-paced-pace", valueQuantity=quantity(row.mean_pace_percent, "%")),
        _component("self-paced-work", valueQuantity=quantity(row.work_j, "J")),
        _component("self-paced-effort", valueQuantity=quantity(row.mean_effort_nm, "N.m")),
        _component("change-by-settings", valueQuantity=quantity(row.change_deg, "deg")),
    ]
    for motion in row.motions:
        components += [
            _component(
                f"motion-{motion.motion}-rmse", valueQuantity=quantity(None if row.partial else motion.rmse_deg, "deg")
            ),
            _component(f"motion-{motion.motion}-lowest", valueQuantity=quantity(motion.played_min_deg, "deg")),
            _component(f"motion-{motion.motion}-highest", valueQuantity=quantity(motion.played_max_deg, "deg")),
        ]
        if motion.end_range_s is not None:
            counted = (
                ("time", motion.end_range_s, "s"),
                ("band", motion.end_range_band_deg, "deg"),
                ("torque", motion.end_range_torque_nm, "N.m"),
            )
            components += [
                _component(f"motion-{motion.motion}-end-range-{what}", valueQuantity=quantity(value, unit))
                for what, value, unit in counted
            ]
    value = quantity(row.worst_rmse_deg, "deg")
    absent = ("unknown", "Unknown") if row.partial else ("not-performed", "Not Performed")
    if row.ended_at is None:
        absent = ("temp-unknown", "Temporarily Unknown")
    why = _PARTIAL if row.partial else ""
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
            "effectivePeriod": period(row.started_at, row.ended_at),
            "valueQuantity": value,
            "dataAbsentReason": None if value else concept(f"{HL7}data-absent-reason", *absent, why),
            "bodySite": shoulder(row.recording.side),
            "component": components,
        }
    )


def end_range(time: EndRangeTime, episode: EpisodeRow) -> Resource:
    """Return the Observation of a motion's end-range time in one session or week, with the prescribed time.

    It is preliminary until the session or the week has ended.
    """
    done = time.done
    if isinstance(time.period, EndRangeSession):
        of_session = time.period
        return _end_range(time, "session", episode) | {
            "id": str(derived_id("end-range-session", of_session.session_id, done.motion)),
            "partOf": [reference(of_session.session_id)],
            "effectiveDateTime": fhir_date(of_session.started_at),
        }
    begins_on = time.period.begins_on
    return _end_range(time, "week", episode) | {
        "id": str(derived_id("end-range-week", episode.id, begins_on, done.motion)),
        "effectivePeriod": {"start": fhir_date(begins_on), "end": fhir_date(begins_on + timedelta(days=6))},
    }


def _end_range(time: EndRangeTime, period: str, episode: EpisodeRow) -> Resource:
    done = time.done
    counted = quantity(done.counted_s, "s")
    return without_empty(
        {
            "resourceType": "Observation",
            "status": "final" if time.is_complete else "preliminary",
            "category": [_THERAPY],
            "code": local_concept(f"motion-{done.motion}-end-range-{period}"),
            "subject": reference(episode.patient_id),
            "valueQuantity": counted,
            "dataAbsentReason": None
            if counted
            else concept(f"{HL7}data-absent-reason", "not-performed", "Not Performed"),
            "bodySite": shoulder(episode.side),
            "component": [_component("end-range-prescribed", valueQuantity=quantity(done.prescribed_s, "s"))]
            if done.prescribed_s
            else [],
        }
    )


def end_feel(row: RunRow, patient_id: UUID) -> Resource:
    """Return the Observation of one end-feel test with its figures, or why there are none."""
    test = row.end_feel
    assert test is not None
    value = quantity(None if test.range_deg is None else test.outward * test.range_deg, "deg")
    onset_deg = None if test.onset_deg is None else test.outward * test.onset_deg
    return without_empty(
        {
            "resourceType": "Observation",
            "id": str(row.id),
            "partOf": [reference(row.session_id)],
            "status": "final" if row.ended_at else "preliminary",
            "category": [_EXAM],
            "code": local_concept("end-feel") | {"text": f"End-feel: {_motion_name(test.motion)}"},
            "subject": reference(patient_id),
            "effectivePeriod": period(row.started_at, row.ended_at),
            "valueQuantity": value,
            "dataAbsentReason": None
            if value
            else concept(f"{HL7}data-absent-reason", "unknown", "Unknown", test.unmeasured or ""),
            "bodySite": shoulder(row.recording.side),
            "method": local_concept("end-feel-test"),
            "component": [
                _component("run-outcome", valueString=row.outcome if row.outcome != "loaded" else None),
                _component("end-feel-torque", valueQuantity=quantity(test.torque_nm, "N.m")),
                _component("end-feel-range-interval", valueQuantity=quantity(test.interval_range_deg, "deg")),
                _component("end-feel-onset", valueQuantity=quantity(onset_deg, "deg")),
                _component("end-feel-stiffness", valueQuantity=quantity(test.stiffness_nm_deg, "N.m/deg")),
                _component("end-feel-last-third", valueQuantity=quantity(test.last_third_nm_deg, "N.m/deg")),
                _component("end-feel-hysteresis", valueQuantity=quantity(test.hysteresis_nm, "N.m")),
            ],
        }
    )


def goniometer_reading(row: GoniometerReadingRow, clinic_session: SessionRow) -> Resource:
    """Return the Observation of one goniometer reading, which also contains the apparatus angle."""
    side = clinic_session.side
    return without_empty(
        _observation(row.id, clinic_session.patient_id, row.read_at, _EXAM)
        | {
            "partOf": [reference(row.session_id)],
            "status": _status_in(clinic_session),
            "code": local_concept("goniometer-reading") | {"text": f"Goniometer: {_motion_name(row.motion)}"},
            "performer": [{"display": row.read_by}] if row.read_by else [],
            "valueQuantity": quantity(row.patient_deg, "deg"),
            "bodySite": shoulder(side) if side else None,
            "method": local_concept("goniometer"),
            "component": [_component("apparatus-angle", valueQuantity=quantity(row.apparatus_deg, "deg"))],
        }
    )


def patient_angles(row: RunRow, clinic_session: SessionRow, angles: PatientAngles) -> Iterator[Resource]:
    """Yield an Observation for each motion of a run whose patient's angles are estimated, with their uncertainty."""
    for motion in row.motions:
        ends = angles.of_run(row, motion)
        if ends is None:
            continue
        components = []
        for end, end_angle in zip(("lowest", "highest"), ends, strict=True):
            name = f"patient-angle-{end}"
            components += [
                _component(name, valueQuantity=quantity(end_angle.angle_deg, "deg")),
                _component(f"{name}-uncertainty", valueQuantity=quantity(end_angle.uncertainty_deg, "deg")),
            ]
        reading_ids = [reading.id for reading in clinic_session.goniometer_readings if reading.motion == motion.motion]
        yield without_empty(
            _observation(
                derived_id("patient-angle", row.id, motion.motion), clinic_session.patient_id, row.started_at, _THERAPY
            )
            | {
                "partOf": [reference(clinic_session.id)],
                "status": _status_in(clinic_session),
                "code": local_concept("patient-angle") | {"text": f"Patient's angles: {_motion_name(motion.motion)}"},
                "bodySite": shoulder(row.recording.side),
                "method": local_concept("goniometer-estimate"),
                "derivedFrom": [reference(row.id), *(reference(id_) for id_ in reading_ids)],
                "component": components,
            }
        )


def _motion_name(number: int) -> str:
    return f"basic motion {number}, {BASIC_MOTIONS[number - 1].name}"


def assessment(row: AssessmentRow, patient_id: UUID, side: str) -> Iterator[Resource]:
    """Yield the findings of one assessment of a shoulder. For a withdrawn assessment, they mark what was sent before as an error."""
    status = "entered-in-error" if row.withdrawn_at else "final"
    performer = without_empty({"performer": [{"display": row.assessed_by}] if row.assessed_by else []})
    for measured in row.rom:
        yield _rom(measured, row, patient_id) | {"status": status} | performer
    for context in _PAINS:
        score: int | None = getattr(row, f"pain_{context}")
        if score is not None:
            pain = _pain(derived_id("pain", context, row.id), patient_id, context, score, side)
            yield pain | {"effectiveDateTime": fhir_date(row.assessed_at), "status": status} | performer
    for code, answers in _questionnaires(row):
        answered_id = row.id if code == SPADI.code else derived_id("answers", code, row.id)
        yield _answers(row, answered_id, code, answers, patient_id)
        definition = DEFINITIONS.get(code)
        total = definitions.score(definition, answers).total if definition and definition.fits(answers) else None
        if total is not None:
            yield (
                _observation(derived_id(code, row.id), patient_id, row.assessed_at, _SURVEY)
                | {
                    "status": status,
                    "code": local_concept(f"{code}-total"),
                    "valueQuantity": quantity(total, "{score}"),
                    "bodySite": shoulder(side),
                    "derivedFrom": [reference(answered_id)],
                }
                | performer
            )
    if row.note.strip():
        yield (
            _observation(derived_id("assessment-note", row.id), patient_id, row.assessed_at, _EXAM)
            | {
                "status": status,
                "code": local_concept("assessment-note"),
                "bodySite": shoulder(side),
                "valueString": row.note,
            }
            | performer
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


def _questionnaires(row: AssessmentRow) -> Iterator[tuple[str, list[int | None]]]:
    """Yield the answered questionnaires by code."""
    if row.spadi is not None:
        yield SPADI.code, row.spadi
    yield from row.questionnaires.items()


def _answers(row: AssessmentRow, identity: UUID, code: str, answers: list[int | None], patient_id: UUID) -> Resource:
    return {
        "resourceType": "QuestionnaireResponse",
        "id": str(identity),
        "questionnaire": questionnaire_url(code),
        "status": "entered-in-error" if row.withdrawn_at else "completed",
        "subject": reference(patient_id),
        "authored": fhir_date(row.assessed_at),
        "item": [
            without_empty(
                {
                    "linkId": str(number),
                    "answer": [] if answer is None else [{"valueInteger": answer}],
                }
            )
            for number, answer in enumerate(answers, start=1)
        ],
    }


def _pain(identity: UUID, patient_id: UUID, context: str, score: int, side: str | None) -> Resource:
    """Return a pain score without a time."""
    return without_empty(
        {
            "resourceType": "Observation",
            "id": str(identity),
            "status": "final",
            "category": [_SURVEY],
            "code": pain_code(context),
            "subject": reference(patient_id),
            "bodySite": shoulder(side) if side else None,
            "valueQuantity": quantity(score, "{score}"),
        }
    )


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
    """Return a component, or None if it has no value."""
    (component_value,) = value.values()
    return None if component_value is None else {"code": local_concept(code), **value}


def _status_in(row: SessionRow) -> str:
    """Return the status of a value of a session. Before the session has ended, the therapist still enters and corrects values."""
    return "final" if row.ended_at else "preliminary"
