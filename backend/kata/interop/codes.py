"""Codes and building blocks of our FHIR resources.

LOINC and SNOMED CT are used if they have a code, else our own declared code system. Its address and all other addresses of ours are OIDs
under 2.25: a UUID that needs no registration.
"""

import math
from datetime import date, datetime
from typing import Any, Final
from uuid import UUID, uuid5

from kata.clinic.assessments.rom import KINDS, MEASURES, measure_of

Resource = dict[str, Any]
"""A resource or a part of one, as JSON."""


def _oid(of: str) -> str:
    return f"urn:oid:2.25.{UUID(of).int}"


NAMESPACE: Final = UUID("0d7cb53c-49d5-4c3c-9f5e-0a0c6a0b9f51")
"""Namespace of ids that are derived from names."""
CLINIC_NUMBER: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a01")
LOCAL: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a02")
SPADI: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a03")
STAGE_SINCE: Final = _oid("6e0f2a6f-2f5b-4f6a-8d0f-6b9e0e1c1a04")
"""Extension of a condition's stage: its first day."""
NAME_REPRESENTATION: Final = "http://hl7.org/fhir/StructureDefinition/iso21090-EN-representation"
LOINC: Final = "http://loinc.org"
SNOMED: Final = "http://snomed.info/sct"
UCUM: Final = "http://unitsofmeasure.org"
HL7: Final = "http://terminology.hl7.org/CodeSystem/"
PAIN: Final = "72514-3"

_ROM_LOCAL: Final = {
    f"rom-{measure.motion.replace('_', '-')}-{kind}": f"{measure.english.partition(',')[0]}, {kind} range of motion"
    for measure in MEASURES
    if measure.loinc is None
    for kind in KINDS
}
LOCAL_CODES: Final[dict[str, str]] = {
    "apparatus": "Shoulder rehabilitation apparatus that plays back what a therapist has taught",
    "session": "Session on the shoulder rehabilitation apparatus",
    "arm-position": "Position of the arm during the measurement",
    "position-at_side": "Arm at the side",
    "position-abducted_90": "Arm abducted to 90 degrees",
    "position-flexed_90": "Arm flexed to 90 degrees",
    "pain-context": "When the pain was felt",
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
    "run-tracking": "Tracking error of one playback: what was played minus what was taught",
    "run-outcome": "How a playback ended",
    "run-repetitions": "Repetitions asked for in a playback",
    "tracking-peak": "Largest tracking error, without sign",
    **{f"motion-{number}-rmse": f"Root mean square tracking error of basic motion {number}" for number in range(1, 7)},
    **{f"motion-{number}-lowest": f"Lowest angle of basic motion {number} in a playback" for number in range(1, 7)},
    **{f"motion-{number}-highest": f"Highest angle of basic motion {number} in a playback" for number in range(1, 7)},
    **_ROM_LOCAL,
}
"""Our own codes with their meaning."""


def local_concept(code: str) -> Resource:
    """Return a CodeableConcept of our own declared code."""
    return concept(LOCAL, code, LOCAL_CODES[code])


def concept(system: str, code: str, display: str, text: str = "") -> Resource:
    """Return a CodeableConcept of one code."""
    return without_empty({"coding": [{"system": system, "code": code, "display": display}], "text": text})


def rom_code(motion: str, position: str, kind: str) -> Resource:
    """Return the code of a measure: LOINC if it has one, our own code, or text for a measure that only an older version knew."""
    measure = measure_of(motion, position)
    if measure is None:
        return {"text": f"{motion.replace('_', ' ')}, {kind} range of motion"}
    if measure.loinc is None:
        return local_concept(f"rom-{motion.replace('_', '-')}-{kind}")
    code = measure.loinc.active if kind == "active" else measure.loinc.passive
    name = f"Shoulder {measure.english.partition(',')[0]} {kind.capitalize()} Range of Motion Quantitative"
    return concept(LOINC, code, name)


def shoulder(side: str) -> Resource:
    """Return a body site."""
    if side == "left":
        return concept(SNOMED, "91775009", "Structure of left shoulder")
    return concept(SNOMED, "91774008", "Structure of right shoulder")


def quantity(value: float | None, unit: str) -> Resource | None:
    """Return a measured value, None if there is none."""
    if value is None or not math.isfinite(value):
        return None
    return {"value": round(value, 4), "unit": unit, "system": UCUM, "code": unit}


def reference(to: UUID, display: str = "") -> Resource:
    """Return a reference to an entry of the same bundle."""
    return without_empty({"reference": f"urn:uuid:{to}", "display": display})


def derived_id(*names: object) -> UUID:
    """Return an id that is derived from names. It is the same every time."""
    return uuid5(NAMESPACE, "/".join(str(name) for name in names))


def fhir_date(moment: datetime | date | None) -> str | None:
    """Return a dateTime or date."""
    return moment.isoformat() if moment else None


def annotation(text: str, by: str = "", at: datetime | None = None) -> Resource | None:
    """Return an Annotation, None without text."""
    return without_empty({"authorString": by, "time": fhir_date(at), "text": text}) if text.strip() else None


def without_empty(resource: Resource) -> Resource:
    """Return the resource without empty values, which FHIR does not allow."""
    return {
        name: [element for element in value if element] if isinstance(value, list) else value
        for name, value in resource.items()
        if value not in (None, "", [], {}) and not (isinstance(value, list) and not any(value))
    }
