"""Import patients from FHIR R4. Elements that are not stored are listed. Elements that are not understood are refused with their path."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date
from typing import Any, Final

from pydantic import ValidationError

from kata import i18n
from kata.clinic.patients.schemas import PatientCreate
from kata.interop import texts
from kata.interop.codes import NAME_REPRESENTATION, PATIENT_NUMBERS
from kata.types import Side

MOST_PATIENTS: Final = 500
MOST_PARTS: Final = 1_000_000
"""Maximum number of commas and opening brackets in a file, which limits its values: about 2,000 for each patient."""
MOST_PLACES: Final = 200
"""Maximum number of places of each kind that an answer names."""
_NOT_KEPT: Final = {
    "telecom", "address", "maritalStatus", "multipleBirthBoolean", "multipleBirthInteger", "photo", "contact",
    "communication", "generalPractitioner", "managingOrganization", "text", "contained", "extension", "meta", "language",
}  # fmt: skip
_UNDERSTOOD: Final = {"resourceType", "id", "identifier", "active", "name", "gender", "birthDate"}
_CHANGES_MEANING: Final = {
    "modifierExtension": texts.FHIR_MAY_CHANGE_MEANING(),
    "implicitRules": texts.FHIR_MAY_CHANGE_MEANING(),
    "link": texts.FHIR_OTHER_LINK(),
    "deceasedDateTime": texts.FHIR_DECEASED(),
}
_NOT_A_NAME: Final = {"old", "nickname", "maiden", "anonymous", "temp"}
_GENDERS: Final = ("female", "male", "other", "unknown")
_PREFERENCE: Final = ("official", "usual")


class FhirImportError(ValueError):
    """The resource cannot be imported. ``places`` has each path and its problem."""

    def __init__(self, places: list[tuple[str, str]]) -> None:
        # The worker process sends an exception as its arguments.
        super().__init__(places)
        self.texts = [texts.PLACE_PROBLEM(place=path, problem=problem) for path, problem in places]
        """The problems, one text per place."""
        self.places = tuple(places)

    def __str__(self) -> str:
        return "; ".join(f"{path} {problem}" for path, problem in self.places)


class UnreadableFhirError(ValueError):
    """The file is not a JSON object within the limits. The exception's argument is the Text with the reason."""


@dataclass(frozen=True)
class ImportedPatient:
    """A patient to be registered. ``path`` is the place in the resource."""

    path: str
    patient: PatientCreate


@dataclass
class _Reading:
    wrong: list[tuple[str, str]] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    systems: frozenset[str] = frozenset({PATIENT_NUMBERS})
    """Systems that identify our clinic numbers: the clinic's own, and the one of an export from a clinic without one."""


def read_file(
    content: bytes, affected_side: Side, identifier_system: str = PATIENT_NUMBERS
) -> tuple[list[ImportedPatient], list[str], int]:
    """Return the patients of a file, the paths of the first elements that are not stored, and the number of further such elements.

    Run it in the worker process, because parsing holds the interpreter's lock.

    :raises UnreadableFhirError: when the file is not a JSON object, or exceeds a limit.
    :raises FhirImportError: as :func:`read_patients`.
    """
    if sum(map(content.count, (b",", b"[", b"{"))) > MOST_PARTS:
        raise UnreadableFhirError(texts.FHIR_TOO_MANY_PARTS(limit=MOST_PARTS))
    try:
        resource = json.loads(content.decode(), object_pairs_hook=_object, parse_constant=_no_constant, parse_int=_int)
        if not isinstance(resource, dict):
            raise UnreadableFhirError(texts.FHIR_UNREADABLE())
        patients, left_out = read_patients(resource, affected_side, identifier_system)
        return patients, left_out[:MOST_PLACES], max(0, len(left_out) - MOST_PLACES)
    except RecursionError as error:
        raise UnreadableFhirError(texts.FHIR_TOO_DEEP()) from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise UnreadableFhirError(texts.FHIR_UNREADABLE()) from error


def read_patients(
    resource: dict[str, Any], affected_side: Side, identifier_system: str = PATIENT_NUMBERS
) -> tuple[list[ImportedPatient], list[str]]:
    """Return the patients of a Patient or a Bundle, and the paths of the elements that are not stored.

    :raises FhirImportError: with every path that cannot be imported. No patient is then imported.
    """
    reading = _Reading(systems=frozenset({PATIENT_NUMBERS, identifier_system}))
    patients = [
        ImportedPatient(path, patient)
        for path, patient_resource in _patients(resource, reading)
        if (patient := _patient(patient_resource, path, affected_side, reading))
    ]
    if reading.wrong:
        raise FhirImportError(reading.wrong[:MOST_PLACES])
    return patients, reading.left_out


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        # The object has a name twice, and another program could read the other value.
        raise UnreadableFhirError(texts.FHIR_NAME_TWICE())
    return members


def _int(digits: str) -> int:
    try:
        return int(digits)
    except ValueError as error:
        raise UnreadableFhirError(texts.FHIR_NOT_A_NUMBER()) from error


def _no_constant(name: str) -> None:
    raise UnreadableFhirError(texts.FHIR_NOT_A_NUMBER())


def _patients(resource: dict[str, Any], reading: _Reading) -> Iterator[tuple[str, dict[str, Any]]]:
    kind = resource.get("resourceType")
    if kind == "Patient":
        yield "Patient", resource
        return
    if kind != "Bundle":
        reading.wrong.append(("resourceType", texts.FHIR_NOT_PATIENT()))
        return
    entries = [
        (f"Bundle.entry[{place}].resource", entry["resource"])
        for place, entry in enumerate(_objects(resource, "entry", "Bundle", reading))
        if isinstance(entry.get("resource"), dict)
    ]
    patients = [(path, resource) for path, resource in entries if resource.get("resourceType") == "Patient"]
    if not 0 < len(patients) <= MOST_PATIENTS:
        reading.wrong.append(("Bundle.entry", texts.FHIR_PATIENT_COUNT(most=MOST_PATIENTS)))
        return
    reading.left_out += [
        f"{path} ({_shortened(str(resource.get('resourceType')))})"
        for path, resource in entries
        if resource.get("resourceType") != "Patient"
    ]
    yield from patients


def _patient(resource: dict[str, Any], path: str, affected_side: Side, reading: _Reading) -> PatientCreate | None:
    wrong_before = len(reading.wrong)
    _elements(resource, path, reading)
    number_path, number = _number(resource, path, reading)
    name_path, name, kana = _names(resource, path, reading)
    gender = resource.get("gender", "unknown")
    if gender not in _GENDERS:
        reading.wrong.append((f"{path}.gender", texts.FHIR_ONE_OF(choices=", ".join(_GENDERS))))
    born = _birth_date(resource, path, reading)
    if len(reading.wrong) > wrong_before:
        return None
    try:
        return PatientCreate(
            clinic_number=number, name=name, kana=kana, birth_date=born, sex=gender, affected_side=affected_side
        )
    except ValidationError as error:
        paths = {"clinic_number": number_path, "name": name_path, "kana": name_path, "birth_date": f"{path}.birthDate"}
        for complaint in error.errors():
            place = paths.get(str(complaint["loc"][0]) if complaint["loc"] else "", path)
            reading.wrong.append((place, i18n.sentence(complaint["type"], complaint["msg"], complaint.get("ctx", {}))))
        return None


def _elements(resource: dict[str, Any], path: str, reading: _Reading) -> None:
    for name, value in resource.items():
        element_path = f"{path}.{_shortened(name)}"
        if len(reading.wrong) > MOST_PLACES:
            return
        if name == "meta" and isinstance(value, dict) and set(value) == {"profile"}:
            # A claimed profile says nothing about the patient.
            continue
        if name in _CHANGES_MEANING:
            reading.wrong.append((element_path, _CHANGES_MEANING[name]))
        elif name == "deceasedBoolean":
            if value is not False:
                reading.wrong.append((element_path, texts.FHIR_DECEASED()))
        elif name == "active" and value is not True:
            reading.wrong.append((element_path, texts.FHIR_INACTIVE()))
        elif name in _NOT_KEPT or (name.removeprefix("_") in _UNDERSTOOD | _NOT_KEPT and name.startswith("_")):
            reading.left_out.append(element_path)
        elif name not in _UNDERSTOOD:
            reading.wrong.append((element_path, texts.FHIR_UNKNOWN_ELEMENT()))


def _number(patient: dict[str, Any], path: str, reading: _Reading) -> tuple[str, str]:
    """Return the clinic number and its path: the identifier of our system, else a medical record number, else the only identifier."""
    wrong_before = len(reading.wrong)
    candidates = [
        (f"{path}.identifier[{place}]", identifier)
        for place, identifier in enumerate(_objects(patient, "identifier", path, reading))
        if identifier.get("use") != "old"
    ]
    ours = [candidate for candidate in candidates if candidate[1].get("system") in reading.systems]
    numbers = ours or [candidate for candidate in candidates if "MR" in _codes(candidate[1].get("type"))] or candidates
    if len(reading.wrong) > wrong_before:
        return "", ""
    if len(numbers) != 1:
        several = texts.FHIR_NUMBER_AMBIGUOUS()
        reading.wrong.append((f"{path}.identifier", several if numbers else texts.FHIR_CLINIC_NUMBER_NEEDED()))
        return "", ""
    ((chosen_path, identifier),) = numbers
    value = identifier.get("value")
    if not isinstance(value, str):
        reading.wrong.append((f"{chosen_path}.value", texts.FHIR_NOT_TEXT()))
        return chosen_path, ""
    reading.left_out += [path_of for path_of, _ in candidates if path_of != chosen_path]
    return f"{chosen_path}.value", value


def _codes(concept: Any) -> set[str]:
    codings = concept.get("coding") if isinstance(concept, dict) else None
    return (
        {str(coding.get("code")) for coding in codings if isinstance(coding, dict)}
        if isinstance(codings, list)
        else set()
    )


def _names(patient: dict[str, Any], path: str, reading: _Reading) -> tuple[str, str, str | None]:
    """Return the path of the name, the name and its reading (representation SYL)."""
    wrong_before = len(reading.wrong)
    spoken: list[tuple[int, str, str]] = []
    written: list[tuple[int, str, str]] = []
    for place, name in enumerate(_objects(patient, "name", path, reading)):
        name_path = f"{path}.name[{place}]"
        text = _text(name, name_path, reading)
        use = str(name.get("use"))
        if use in _NOT_A_NAME or not text:
            reading.left_out.append(name_path)
            continue
        rank = _PREFERENCE.index(use) if use in _PREFERENCE else len(_PREFERENCE)
        (spoken if _representation(name) == "SYL" else written).append((rank, name_path, text))
    if len(reading.wrong) > wrong_before:
        return "", "", None
    if not spoken and not written:
        reading.wrong.append((f"{path}.name", texts.FHIR_NAME_NEEDED()))
        return f"{path}.name", "", None
    # min() returns the first of several names with equal rank.
    chosen = min(written or spoken, key=lambda candidate: candidate[0])
    kana = min(spoken, key=lambda candidate: candidate[0]) if spoken else None
    reading.left_out += [candidate[1] for candidate in [*written, *spoken] if candidate not in (chosen, kana)]
    return chosen[1], chosen[2], kana[2] if kana else None


def _text(name: dict[str, Any], path: str, reading: _Reading) -> str:
    given_names = name.get("given", [])
    parts = [name.get("family"), *(given_names if isinstance(given_names, list) else [given_names])]
    if any(part is not None and not isinstance(part, str) for part in (*parts, name.get("text"))):
        reading.wrong.append((path, texts.FHIR_NOT_TEXTS()))
        return ""
    return (name.get("text") or " ".join(part for part in parts if part)).strip()


def _representation(name: dict[str, Any]) -> str | None:
    extensions = name.get("extension")
    for extension in extensions if isinstance(extensions, list) else []:
        if isinstance(extension, dict) and extension.get("url") == NAME_REPRESENTATION:
            return str(extension.get("valueCode"))
    return None


def _birth_date(patient: dict[str, Any], path: str, reading: _Reading) -> date | None:
    text = patient.get("birthDate")
    if text is None:
        return None
    try:
        if isinstance(text, str) and re.fullmatch(r"\d{4}-\d{2}-\d{2}", text, re.ASCII):
            return date.fromisoformat(text)
    except ValueError:
        pass
    reading.wrong.append((f"{path}.birthDate", texts.FHIR_NOT_DATE(given=repr(str(text)[:40]))))
    return None


def _shortened(text: str) -> str:
    """Return a shortened text that the answer can contain. JSON allows half of a surrogate pair, UTF-8 does not."""
    return text[:60].encode("utf-8", "replace").decode()


def _objects(patient: dict[str, Any], name: str, path: str, reading: _Reading) -> list[dict[str, Any]]:
    objects = patient.get(name, [])
    if not isinstance(objects, list) or not all(isinstance(item, dict) for item in objects):
        reading.wrong.append((f"{path}.{name}", texts.FHIR_NOT_OBJECTS()))
        return []
    return objects
