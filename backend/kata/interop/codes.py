"""Codes and building blocks of our FHIR resources.

A code is from LOINC or SNOMED CT if they have one, else from our own declared code system. The address of that code system and all other
addresses of ours are OIDs under 2.25, which are UUIDs that need no registration.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, tzinfo
from typing import Any, Final
from uuid import UUID, uuid5

from kata.clinic.assessments.rom import KINDS, MEASURES, measure_of
from kata.clinic.contraindications.kinds import KINDS as CONTRAINDICATIONS
from kata.clinic.episodes.diagnoses import BY_CODE
from kata.clinic.questionnaires.definitions import DEFINITIONS, Definition
from kata.clinic.questionnaires.definitions import SPADI as SPADI_DEFINITION

Resource = dict[str, Any]
"""A resource or a part of one, as JSON."""


def _oid(of: str) -> str:
    return f"urn:oid:2.25.{UUID(of).int}"


NAMESPACE: Final = UUID("0d7cb53c-49d5-4c3c-9f5e-0a0c6a0b9f51")
"""Namespace of ids that are derived from names."""
PATIENT_NUMBERS: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a01")
"""Identifier system of patient numbers, in each clinic that has not set its own."""
LOCAL: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a02")
SPADI: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a03")
STAGE_SINCE: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a04")
"""Extension of a condition's stage: the first day of the stage."""
NAME_REPRESENTATION: Final = "http://hl7.org/fhir/StructureDefinition/iso21090-EN-representation"
LOINC: Final = "http://loinc.org"
ICD10: Final = "http://hl7.org/fhir/sid/icd-10"
SNOMED: Final = "http://snomed.info/sct"
UCUM: Final = "http://unitsofmeasure.org"
HL7: Final = "http://terminology.hl7.org/CodeSystem/"
PAIN: Final = "72514-3"
_JP_CORE: Final = "http://jpfhir.jp/fhir/core/StructureDefinition/"
_JP_CATEGORY: Final = "http://jpfhir.jp/fhir/core/CodeSystem/JP_SimpleObservationCategory_CS"

_ROM_LOCAL: Final = {
    f"rom-{measure.motion.replace('_', '-')}-{kind}": f"{measure.english.partition(',')[0]}, {kind} range of motion"
    for measure in MEASURES
    for kind in KINDS
    if not measure.loinc_of(kind)
}
_SLIP: Final = "not the patient's angle: the arm can slip in its cuff"
LOCAL_CODES: Final[dict[str, str]] = {
    "apparatus": "Shoulder rehabilitation apparatus that plays back what a therapist has taught",
    "simulated-apparatus": "Simulated apparatus: its measured values are invented",
    "session": "Session on the shoulder rehabilitation apparatus",
    "programme-item": "Recording of a programme, played in each session",
    "arm-position": "Position of the arm during the measurement",
    "position-at_side": "Arm at the side",
    "position-abducted_90": "Arm abducted to 90 degrees",
    "position-flexed_90": "Arm flexed to 90 degrees; Kata's form counts from the forearm that points straight up",
    "pain-rest": "Pain at rest",
    "pain-active": "Pain when moving the arm oneself",
    "pain-passive": "Pain when the arm is moved",
    "pain-average": "Average pain over the last week",
    "pain-before": "Pain before the session",
    "pain-during": "Pain during the session",
    "pain-after": "Pain after the session",
    "stage-freezing": "Freezing",
    "stage-frozen": "Frozen",
    "stage-thawing": "Thawing",
    "spadi-total": "Shoulder Pain and Disability Index, total score (0 none, 100 the worst)",
    "assessment-note": "Note of an assessment",
    "closing-note": "Note at the end of an episode of care",
    "run-tracking": "Tracking error of one playback: what was played minus the taught motion with the settings of the run",
    "run-outcome": "How a playback ended",
    "run-repetitions": "Repetitions asked for in a playback",
    "run-repetitions-done": "Completed repetitions of a playback",
    "run-range": "Share of the taught range that was asked for in a playback",
    "run-least-range": "Smallest share of the asked range after the therapist reduced the range during a playback",
    "tracking-peak": "Largest tracking error, without sign",
    "compared-share": "Share of the playing time of which the tracking error is known",
    "clock-offset": "Largest time by which the wall clock is ahead of the clock of the comparison",
    "self-paced-pace": "Mean pace of a self-paced playback, share of the asked speed; waiting for the patient counts as 0",
    "self-paced-work": "Work of the patient along the path of a self-paced playback, estimated from the torque of the drives",
    "self-paced-effort": "Mean torque of the patient along the path of a self-paced playback while the arm moved, estimated as the work",
    "change-by-settings": "Largest change by settings: the taught motion with the settings of the run minus the taught motion",
    "goniometer-reading": "Angle of a basic motion of the shoulder read with a goniometer at a pose",
    "apparatus-angle": f"Apparatus angle of the same motion at that moment; {_SLIP}",
    "goniometer": "Read with a goniometer",
    "end-feel": f"End-feel test of the shoulder: apparatus angle at 60 % of the chosen torque; {_SLIP}",
    "end-feel-test": "Three slow ways out and back along a taught motion by a motor, less a baseline with a test weight; torque from the "
    "motor's current with its nominal factor",
    "end-feel-torque": "Chosen torque between apparatus and shoulder at which the arm is taken back",
    "end-feel-range-interval": "Half width of the 95 % interval of the range over the repetitions",
    "end-feel-onset": f"Apparatus angle at 25 % of the chosen torque, at which resistance begins; {_SLIP}",
    "end-feel-stiffness": "Slope of torque over angle from onset to range, without the cuff's part",
    "end-feel-last-third": "The same slope over the last third of that way",
    "end-feel-hysteresis": "Mean difference of way out and way back from onset to range, without the apparatus' friction",
    "patient-angle": "Patient's angles of a basic motion at the ends of a playback",
    "goniometer-estimate": "Estimated from apparatus angles and goniometer readings at two poses or more of the session",
    "patient-angle-lowest": "Patient's angle at the lowest apparatus angle",
    "patient-angle-lowest-uncertainty": "Half width of the interval that covers it in 95 of 100 cases",
    "patient-angle-highest": "Patient's angle at the highest apparatus angle",
    "patient-angle-highest-uncertainty": "Half width of the interval that covers it in 95 of 100 cases",
    **{f"motion-{number}-rmse": f"Root mean square tracking error of basic motion {number}" for number in range(1, 7)},
    **{
        f"motion-{number}-lowest": f"Lowest apparatus angle of basic motion {number} in a playback; {_SLIP}"
        for number in range(1, 7)
    },
    **{
        f"motion-{number}-highest": f"Highest apparatus angle of basic motion {number} in a playback; {_SLIP}"
        for number in range(1, 7)
    },
    **{
        f"motion-{number}-end-range-{what}": f"End-range time of basic motion {number} in a playback: {meaning}"
        for number in range(3, 7)
        for what, meaning in (
            ("time", "time within the band before the end of the recorded motion, with at least the torque"),
            ("band", "largest angle before the end of the recorded motion that counts"),
            ("torque", "least torque between apparatus and shoulder that counts"),
        )
    },
    **{
        f"motion-{number}-end-range-{period}": f"End-range time of basic motion {number} in a {period}, of the items that prescribe it"
        for number in range(3, 7)
        for period in ("session", "week")
    },
    "end-range-prescribed": "Prescribed end-range time of the same motion and period",
    **_ROM_LOCAL,
    **{f"contraindication-{kind.code}": str(kind.name) for kind in CONTRAINDICATIONS.values()},
}
"""Our own codes and their meaning, except those that :func:`local_codes` adds."""


def local_codes() -> dict[str, str]:
    """Return every code of our own with its meaning. The codes of totals depend on the clinic's questionnaires."""
    return LOCAL_CODES | {
        f"{definition.code}-total": f"{definition.title}, {_total(definition)}, {definition.better} is better)"
        for definition in DEFINITIONS.values()
        if definition is not SPADI_DEFINITION
    }


def _total(definition: Definition) -> str:
    if definition.total == "t_score":
        return "T-score (50 is the mean of the reference population, 10 its standard deviation"
    return f"total score (0 to {definition.highest_total:g}"


_TEST_DATA: Final = {"system": f"{HL7}v3-ActReason", "code": "HTEST", "display": "test health data"}
"""FHIR R4's security label for data that do not concern a real treatment."""


def simulated(resource: Resource) -> Resource:
    """Return the resource with the security label of values from a simulated apparatus."""
    return resource | {"meta": {"security": [_TEST_DATA]}}


@dataclass(frozen=True)
class ExportSettings:
    """What a clinic sets for its exports and imports."""

    identifier_system: str = PATIENT_NUMBERS
    """FHIR identifier system of the clinic's patient numbers."""
    profiles: Mapping[str, str] = field(default_factory=dict)
    """By type of resource, the canonical address of the profile that the resource claims to follow."""
    zone: tzinfo = UTC
    """Time zone of days in texts, and in which weeks begin on Monday."""

    def profiled(self, resource: Resource) -> Resource:
        """Return the resource with the profile of its type, if there is one, and with what that profile demands."""
        profile = self.profiles.get(resource["resourceType"])
        if not profile:
            return resource
        profiled = resource | {"meta": resource.get("meta", {}) | {"profile": [profile]}}
        if profile.startswith(_JP_CORE) and "category" in resource and resource["resourceType"] == "Observation":
            # JP Core repeats HL7's categories in a system of its own, and every observation must have one of it.
            category_codings = [
                coding | {"system": _JP_CATEGORY} for category in resource["category"] for coding in category["coding"]
            ]
            profiled["category"] = [*resource["category"], *({"coding": [coding]} for coding in category_codings)]
        return profiled


def local_concept(code: str) -> Resource:
    """Return a CodeableConcept of our own declared code."""
    return concept(LOCAL, code, LOCAL_CODES.get(code) or local_codes()[code])


def concept(system: str, code: str, display: str, text: str = "") -> Resource:
    """Return a CodeableConcept with one code."""
    return without_empty({"coding": [{"system": system, "code": code, "display": display}], "text": text})


def rom_code(motion: str, position: str, kind: str) -> Resource:
    """Return the code of a measure: LOINC's if there is one, else our own. For a measure that only an older version knew, return a text."""
    measure = measure_of(motion, position)
    if measure is None:
        return {"text": f"{motion.replace('_', ' ')}, {kind} range of motion"}
    code = measure.loinc_of(kind)
    if not code:
        return local_concept(f"rom-{motion.replace('_', '-')}-{kind}")
    english = "Horizontal adduction" if motion == "horizontal_flexion" else measure.english.partition(",")[0]
    name = f"Shoulder {english} {kind.capitalize()} Range of Motion Quantitative"
    return concept(LOINC, code, name)


def pain_code(context: str) -> Resource:
    """Return the code of a pain score: LOINC's code of the scale, and our own code of the situation in which the pain was felt.

    A CodeableConcept may hold codings "of slightly different granularity" (FHIR R4, CodeableConcept.coding). We have not verified a LOINC
    code for pain at rest, on movement, or around a session.
    """
    own_code = local_concept(f"pain-{context}")
    loinc = concept(LOINC, PAIN, "Pain severity - 0-10 verbal numeric rating [Score] - Reported")
    return {"coding": [*loinc["coding"], *own_code["coding"]], "text": LOCAL_CODES[f"pain-{context}"]}


def diagnosis_code(code: str, text: str) -> Resource:
    """Return a diagnosis as it was chosen and written. Without a chosen code it is only a text; it is empty if there is neither."""
    chosen = BY_CODE.get(code)
    codings = []
    if chosen:
        codings.append({"system": ICD10, "code": chosen.icd10, "display": chosen.english})
    if chosen and chosen.snomed:
        codings.append({"system": SNOMED, "code": chosen.snomed, "display": chosen.english})
    return without_empty({"coding": codings, "text": text})


def shoulder(side: str) -> Resource:
    """Return the body site of a shoulder."""
    if side == "left":
        return concept(SNOMED, "91775009", "Structure of left shoulder")
    return concept(SNOMED, "91774008", "Structure of right shoulder")


def quantity(value: float | None, unit: str) -> Resource | None:
    """Return a measured value as a Quantity, or None if there is no finite value."""
    if value is None or not math.isfinite(value):
        return None
    return {"value": round(value, 4), "unit": unit, "system": UCUM, "code": unit}


def shoulder_text(side: str | None, text: str) -> str:
    """Return a text with the shoulder's side before it. A text without a side concerns both shoulders."""
    return f"{side.capitalize()} shoulder. {text}" if side else text


def reference(to: UUID, display: str = "") -> Resource:
    """Return a reference to an entry of the same bundle."""
    return without_empty({"reference": f"urn:uuid:{to}", "display": display})


def questionnaire_url(code: str) -> str:
    """Return the canonical address of a questionnaire."""
    return SPADI if code == SPADI_DEFINITION.code else f"urn:uuid:{derived_id('questionnaire', code)}"


def derived_id(*names: object) -> UUID:
    """Return an id that is derived from names. The same names always give the same id."""
    return uuid5(NAMESPACE, "/".join(str(name) for name in names))


def fhir_date(moment: datetime | date | None) -> str | None:
    """Return a dateTime or date."""
    return moment.isoformat() if moment else None


def period(start: datetime | date, end: datetime | date | None) -> Resource:
    """Return a Period. An end before the start is left out and marked as an error, because FHIR R4 forbids it (Period, per-1).

    Such an end is stored after a change of the computer's clock.
    """
    if end is not None and end < start:
        error = {"url": "http://hl7.org/fhir/StructureDefinition/data-absent-reason", "valueCode": "error"}
        return {"start": fhir_date(start), "_end": {"extension": [error]}}
    return without_empty({"start": fhir_date(start), "end": fhir_date(end)})


def annotation(text: str, by: str = "", at: datetime | None = None) -> Resource | None:
    """Return an Annotation, or None if the text is empty."""
    return without_empty({"authorString": by, "time": fhir_date(at), "text": text}) if text.strip() else None


_CONTROL: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def with_valid_texts(part: Any) -> Any:
    """Return a part of a resource with the texts that FHIR R4 allows. A control character becomes a space, a blank text is left out."""
    if isinstance(part, str):
        text = _CONTROL.sub(" ", part)
        return text if text.strip() else None
    if isinstance(part, list):
        return [element for element in map(with_valid_texts, part) if element not in (None, {}, [])]
    if isinstance(part, dict):
        return without_empty({name: with_valid_texts(value) for name, value in part.items()})
    return part


def without_empty(resource: Resource) -> Resource:
    """Return the resource without empty values, which FHIR does not allow."""
    return {
        name: [element for element in value if element] if isinstance(value, list) else value
        for name, value in resource.items()
        if value not in (None, "", [], {}) and not (isinstance(value, list) and not any(value))
    }
