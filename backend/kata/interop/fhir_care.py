"""FHIR resources of patient, episode, diagnosis, contraindications, questionnaires, device and programme (a CarePlan). Each function returns
one resource as JSON.
"""

from collections.abc import Iterator
from datetime import tzinfo
from typing import Final
from uuid import UUID

from kata.clinic.contraindications.kinds import KINDS
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeVersionRow
from kata.clinic.questionnaires.definitions import SPADI as SPADI_DEFINITION
from kata.clinic.questionnaires.definitions import Definition
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.interop.codes import (
    HL7,
    LOCAL,
    NAME_REPRESENTATION,
    STAGE_SINCE,
    Resource,
    annotation,
    concept,
    derived_id,
    diagnosis_code,
    fhir_date,
    local_codes,
    local_concept,
    period,
    quantity,
    questionnaire_url,
    reference,
    shoulder,
    shoulder_text,
    without_empty,
)
from kata.motion.axes import BASIC_MOTIONS

_CALCULATED: Final = "http://hl7.org/fhir/uv/sdc/StructureDefinition/sdc-questionnaire-calculatedExpression"


def patient(row: PatientRow, identifier_system: str) -> Resource:
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
                    "system": identifier_system,
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
    """Return a HumanName. Its representation (kanji or letters, or their reading) is marked as in JP Core."""
    if not text:
        return None
    return {
        "extension": [{"url": NAME_REPRESENTATION, "valueCode": representation}],
        "use": "official",
        "text": text,
    }


def condition(row: EpisodeRow) -> Resource | None:
    """Return the Condition as it was entered, or None if nothing that was entered states one.

    The Condition has a code only if the clinician chose one, and a verification status only if the clinician stated one (0..1 in FHIR R4).
    A closed episode has no clinical status, because the end of an episode does not say that the condition has abated.
    """
    code = diagnosis_code(row.diagnosis_code, row.diagnosis)
    if not (code or row.stages or row.onset_on):
        return None
    certain = row.verification if code else ""
    return without_empty(
        {
            "resourceType": "Condition",
            "id": str(row.id),
            "clinicalStatus": None if row.closed_at else concept(f"{HL7}condition-clinical", "active", "Active"),
            "verificationStatus": concept(f"{HL7}condition-ver-status", certain, certain.capitalize())
            if certain
            else None,
            "code": code,
            "bodySite": [shoulder(row.side)],
            "subject": reference(row.patient_id),
            "onsetDateTime": fhir_date(row.onset_on),
            "recordedDate": fhir_date(row.opened_at),
            "stage": [
                {
                    "extension": [{"url": STAGE_SINCE, "valueDate": fhir_date(stage.since)}],
                    "summary": local_concept(f"stage-{stage.stage}"),
                }
                for stage in row.stages
            ],
        }
    )


def episode(row: EpisodeRow, *, has_condition: bool) -> Iterator[Resource]:
    """Yield an episode of care: the EpisodeOfCare, the contraindications and limits as Flags, and the closing note."""
    yield without_empty(
        {
            "resourceType": "EpisodeOfCare",
            "id": str(derived_id("episode-of-care", row.id)),
            "status": "finished" if row.closed_at else "active",
            "type": [{"text": f"Care of the {row.side} shoulder"}],
            "diagnosis": [{"condition": reference(row.id)}] if has_condition else [],
            "patient": reference(row.patient_id),
            "period": period(row.opened_at, row.closed_at),
        }
    )
    if row.contraindications.strip():
        yield _flag(row, "contraindications", f"Contraindications: {row.contraindications}")
    if limits := _limits(row):
        yield _flag(row, "limits", limits) | {"author": {"display": row.limits_by}}
    if row.closing_note.strip():
        yield {
            "resourceType": "Observation",
            "id": str(derived_id("closing-note", row.id)),
            "status": "final",
            "code": local_concept("closing-note"),
            "subject": reference(row.patient_id),
            "effectiveDateTime": fhir_date(row.closed_at or row.updated_at),
            "bodySite": shoulder(row.side),
            "valueString": row.closing_note,
        }


def _flag(row: EpisodeRow, kind: str, text: str) -> Resource:
    return {
        "resourceType": "Flag",
        "id": str(derived_id(kind, row.id)),
        "status": "inactive" if row.closed_at else "active",
        "category": [concept(f"{HL7}flag-category", "safety", "Safety")],
        "code": {"text": shoulder_text(row.side, text)},
        "subject": reference(row.patient_id),
    }


def contraindication(row: ContraindicationRow, side: str | None, zone: tzinfo) -> Resource:
    """Return a contraindication as a Flag with the list's entry, the note, the permission and the end, as they were entered.

    It is a Flag because an entry of the list is a warning, whereas a Condition would state a diagnosis. ``side``: None if it concerns the
    whole patient. ``zone``: time zone of the days in its text.
    """
    kind = KINDS.get(row.code)
    words = [f"{kind.name if kind else row.code}."]
    if row.note.strip():
        words.append(f"Note: {row.note}")
    if row.signed_off_at:
        by = f" by {row.signed_off_by}" if row.signed_off_by.strip() else ""
        words.append(f"Treatment allowed{by}, {row.signed_off_at.astimezone(zone).date()}.")
    if row.resolved_at:
        by = f"{row.resolved_by}, " if row.resolved_by.strip() else ""
        reason = f": {row.resolution}" if row.resolution.strip() else "."
        words.append(f"No longer applies ({by}{row.resolved_at.astimezone(zone).date()}){reason}")
    return without_empty(
        {
            "resourceType": "Flag",
            "id": str(row.id),
            "status": "inactive" if row.resolved_at else "active",
            "category": [concept(f"{HL7}flag-category", "safety", "Safety")],
            "code": (local_concept(f"contraindication-{row.code}") if kind else {})
            | {"text": shoulder_text(side, " ".join(words))},
            "subject": reference(row.patient_id),
            "period": period(row.noted_at, row.resolved_at),
            "author": {"display": row.noted_by} if row.noted_by else None,
        }
    )


def _limits(row: EpisodeRow) -> str:
    limits = [
        f"{BASIC_MOTIONS[limit['motion'] - 1].name}: {_bound(limit.get('lowest_deg'))} to {_bound(limit.get('highest_deg'))}"
        for limit in row.limits
    ]
    if row.max_resistance_level is not None:
        limits.append(f"resistance level at most {row.max_resistance_level} of {RESISTANCE_LEVELS}")
    if row.max_speed_deg_s is not None:
        limits.append(f"speed at most {row.max_speed_deg_s:g} deg/s")
    return f"Limits set by the doctor: {'; '.join(limits)}." if limits else ""


def _bound(angle_deg: float | None) -> str:
    return "as far as it goes" if angle_deg is None else f"{angle_deg:g} deg"


def care_plan(row: ProgrammeVersionRow, patient_id: UUID, reason: UUID | None) -> Resource:
    """Return one version of a programme, for a Condition. The newest version is active until programme or episode end; the next version
    has replaced each older one.
    """
    versions = {version.number: version for version in row.programme.versions}
    before, after = versions.get(row.number - 1), versions.get(row.number + 1)
    ends = [end for end in (row.programme.archived_at, row.programme.episode.closed_at) if end]
    ended_at = after.made_at if after else min(ends, default=None)
    status = "revoked" if after else "completed" if ends else "active"
    return without_empty(
        {
            "resourceType": "CarePlan",
            "id": str(row.id),
            "replaces": [reference(before.id)] if before else [],
            "status": status,
            "intent": "plan",
            "title": f"{row.programme.name}, version {row.number}",
            "subject": reference(patient_id),
            "period": period(row.made_at, ended_at),
            "created": fhir_date(row.made_at),
            "addresses": [reference(reason)] if reason else [],
            "supportingInfo": [reference(derived_id("episode-of-care", row.programme.episode_id))],
            "activity": [_activity(item, status, row.sessions_per_week) for item in row.items],
            "note": [
                annotation(
                    row.note or f"Made by {row.made_by}." if row.made_by else row.note, row.made_by, row.made_at
                ),
                annotation(f"Nothing new is begun after {row.timer_minutes:g} minutes." if row.timer_minutes else ""),
            ],
        }
    )


def _activity(item: ProgrammeItemRow, status: str, sessions_per_week: int | None) -> Resource:
    """Return an item of a programme. Each session plays every item, so that the prescribed sessions per week are the item's timing."""
    description = (
        f"{item.recording.name}: {item.repetitions} times, {item.speed_percent:g} % speed, {item.range_percent:g} % range, "
        f"pause {item.pause_s:g} s, resistance level {item.resistance_level} of {RESISTANCE_LEVELS}, {item.method}"
    )
    if item.self_paced:
        description += ", pace set by the patient"
    if item.end_range:
        prescribed = EndRangePrescription.model_validate(item.end_range)
        description += (
            f"; end-range time of {BASIC_MOTIONS[prescribed.motion - 1].name}: {prescribed.minutes:g} min a session, last {prescribed.band_deg:g} deg "
            f"with at least {prescribed.torque_nm:g} Nm between apparatus and shoulder"
        )
    timing = {"repeat": {"frequency": sessions_per_week, "period": 1, "periodUnit": "wk"}}
    return {
        "detail": {
            "code": local_concept("programme-item"),
            "status": "in-progress" if status == "active" else "completed" if status == "completed" else "stopped",
            "doNotPerform": False,
            **({} if sessions_per_week is None else {"scheduledTiming": timing}),
            "quantity": quantity(item.repetitions, "{repetition}"),
            "description": description,
        }
    }


def device(station: str, *, is_simulated: bool) -> Resource:
    """Return the Device of a station."""
    return {
        "resourceType": "Device",
        "id": str(device_key(station, is_simulated=is_simulated)),
        "identifier": [{"system": LOCAL, "value": station}],
        "status": "active",
        "deviceName": [{"name": station, "type": "user-friendly-name"}],
        "type": local_concept("simulated-apparatus" if is_simulated else "apparatus"),
    }


def device_key(station: str, *, is_simulated: bool) -> UUID:
    """Return an id that is derived from a station's name. The simulated and the real apparatus of a station have different ids."""
    return derived_id("simulated-device" if is_simulated else "device", station)


def code_system() -> Resource:
    """Return the declaration of our own codes."""
    codes = local_codes()
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
        "count": len(codes),
        "concept": [{"code": code, "display": display} for code, display in codes.items()],
    }


def questionnaire(definition: Definition, words: QuestionnaireTextsRow | None) -> Resource:
    """Return the Questionnaire to which the answers refer. Its items are identified by number; those of the scores calculate themselves.

    ``words``: the licensed texts, if the licence allows passing them on. Without them the Questionnaire has no texts, because our own
    reminders for the person who types the answers are not the wording of the SPADI.
    """
    items = []
    for number, scale in enumerate(definition.item_scales, start=1):
        bounds = [
            {"url": f"http://hl7.org/fhir/StructureDefinition/{name}", "valueInteger": value}
            for name, value in (("minValue", scale.lowest), ("maxValue", scale.highest))
        ]
        text = words.items[number - 1]["text"] if words else None
        items.append(without_empty({"extension": bounds, "linkId": str(number), "text": text, "type": "integer"}))
    is_spadi = definition is SPADI_DEFINITION
    without = "" if words else ", items by number, without their texts"
    return without_empty(
        {
            "resourceType": "Questionnaire",
            "id": str(derived_id("spadi") if is_spadi else derived_id("questionnaire", definition.code)),
            "language": words.language if words else None,
            "url": questionnaire_url(definition.code),
            "version": "3",
            "name": f"{definition.code.capitalize()}Items",
            "title": words.title if words else f"{definition.title}{without}",
            "status": "active",
            "subjectType": ["Patient"],
            "copyright": words.copyright if words else definition.copyright,
            "item": items + _calculated_items(definition),
        }
    )


def _calculated_items(definition: Definition) -> list[Resource]:
    """Return the items of the scores, each with the expression that calculates it (Structured Data Capture, calculatedExpression).

    There are none for a T-score, because its table belongs to the owner of the questionnaire.
    """
    if definition.total == "t_score":
        return []
    scales, first = [], 1
    for scale in definition.scales:
        scales.append(
            (scale, [f"%resource.item.where(linkId = '{first + n}').answer.value" for n in range(scale.items)])
        )
        first += scale.items
    everything = [answer for _, answers in scales for answer in answers]
    # The function sum() is newer than FHIRPath's first version, and not every program has it.
    enough = f"({_count(everything)}) >= {len(everything) - definition.most_unanswered}"
    valid = " and ".join([enough, *(f"({_count(answers)}) > 0" for _, answers in scales)])
    formulas = {
        scale.code: f"{scale.factor} * ({_sum(answers)}) / ({_count(answers)}) + ({scale.constant})"
        for scale, answers in scales
    }
    total = " + ".join(f"({formula})" for formula in formulas.values())
    formulas["total"] = f"({total}) / {len(formulas)}" if definition.total == "mean" else total
    return [
        {
            "extension": [
                {
                    "url": _CALCULATED,
                    "valueExpression": {"language": "text/fhirpath", "expression": f"iif({valid}, {formula}, {{}})"},
                }
            ],
            "linkId": f"score-{name}",
            "type": "decimal",
            "readOnly": True,
        }
        for name, formula in formulas.items()
    ]


def _count(answers: list[str]) -> str:
    return " + ".join(f"{answer}.count()" for answer in answers)


def _sum(answers: list[str]) -> str:
    return " + ".join(f"iif({answer}.exists(), {answer}, 0)" for answer in answers)
