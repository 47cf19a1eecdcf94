"""Export and import of patients as FHIR R4, judged by two independent validators."""

import copy
import json
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest

from kata.clinic.patients import service as patients
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.interop import bundle
from kata.interop.codes import CLINIC_NUMBER, LOCAL, LOCAL_CODES, NAME_REPRESENTATION, PAIN
from kata.interop.fhir_import import FhirImportError, read_patients
from tests.support.fhir_patient import KANA, NAME, NUMBER, treated
from tests.support.validators import judge

Json = dict[str, Any]


def exported(database: Database, patient_id: UUID, path: Path) -> Json:
    with database.read() as session:
        bundle.write(session, patients.get(session, patient_id), path)
    told: Json = json.loads(path.read_text())
    return told


def of_kind(told: Json, kind: str) -> list[Json]:
    return [entry["resource"] for entry in told["entry"] if entry["resource"]["resourceType"] == kind]


def everything(part: Any) -> list[Json]:
    """Every object in it, however deep."""
    if isinstance(part, list):
        return [one for item in part for one in everything(item)]
    if isinstance(part, dict):
        return [part, *(one for item in part.values() for one in everything(item))]
    return []


def judged(cases: dict[str, Json]) -> dict[str, list[str]]:
    """Return each validator's verdict on each resource."""
    told = judge("validate.mjs", given=json.dumps(cases))
    return {name: [*said["medplum"], *said["lantana"]] for name, said in told.items()}


def test_a_patient_with_fifty_sessions_is_accepted_by_both_validators(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database)
    told = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": told}) == {"bundle": []}
    kinds = Counter(entry["resource"]["resourceType"] for entry in told["entry"])
    assert kinds["Procedure"] == kinds["DeviceUseStatement"] == 50
    assert (kinds["Patient"], kinds["Condition"], kinds["CarePlan"], kinds["Device"]) == (1, 1, 2, 2)
    assert kinds["QuestionnaireResponse"] == 5
    # Two runs and two or three pains a session; each assessment has 64 angles, four pains, a score and a note.
    assert kinds["Observation"] == 50 * 2 + 50 * 2 + 25 + 5 * (64 + 4 + 1 + 1)


def test_same_record_makes_the_same_bundle_with_resolvable_references(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=3)
    told = exported(database, patient_id, tmp_path / "bundle.json")
    assert exported(database, patient_id, tmp_path / "again.json") == told
    urls = {entry["fullUrl"] for entry in told["entry"]}
    assert len(urls) == len(told["entry"])
    for entry in told["entry"]:
        resource = entry["resource"]
        assert entry["request"] == {"method": "PUT", "url": f"{resource['resourceType']}/{resource['id']}"}
        assert entry["fullUrl"] == f"urn:uuid:{UUID(resource['id'])}"
    references = {one["reference"] for one in everything(told["entry"]) if "reference" in one}
    assert len(references) >= 10
    assert references <= urls


def test_every_code_of_our_own_is_declared_in_the_bundle(database: Database, tmp_path: Path) -> None:
    told = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    (declared,) = of_kind(told, "CodeSystem")
    known = {one["code"] for one in declared["concept"]}
    used = {one["code"] for one in everything(told) if one.get("system") == LOCAL and "code" in one}
    assert declared["url"] == LOCAL
    assert declared["count"] == len(known) == len(LOCAL_CODES)
    assert len(used) > 20
    assert used <= known


def test_bundle_repeats_the_values_of_the_record(database: Database, tmp_path: Path) -> None:
    told = exported(database, treated(database, sessions=11), tmp_path / "bundle.json")
    (who,) = of_kind(told, "Patient")
    assert (who["identifier"][0]["system"], who["identifier"][0]["value"]) == (CLINIC_NUMBER, NUMBER)
    assert [(name["text"], name["use"], name["extension"]) for name in who["name"]] == [
        (NAME, "official", [{"url": NAME_REPRESENTATION, "valueCode": "IDE"}]),
        (KANA, "official", [{"url": NAME_REPRESENTATION, "valueCode": "SYL"}]),
    ]
    assert (who["birthDate"], who["gender"], who["active"]) == ("1968-04-12", "female", True)

    (condition,) = of_kind(told, "Condition")
    assert condition["code"]["coding"][0]["code"] == "399114005"
    assert condition["bodySite"][0]["coding"][0]["code"] == "91775009"
    assert condition["onsetDateTime"] == "2026-01-10"
    assert [stage["extension"][0]["valueDate"] for stage in condition["stage"]] == ["2026-02-01", "2026-05-20"]
    assert any(
        "Abduction / adduction of the shoulder: as far as it goes to 90 deg" in note["text"]
        for note in condition["note"]
    )

    old, new = sorted(of_kind(told, "CarePlan"), key=lambda plan: plan["title"])
    assert (old["status"], new["status"]) == ("revoked", "active")
    assert new["replaces"][0]["reference"] == f"urn:uuid:{old['id']}"
    assert new["activity"][0]["detail"]["quantity"] == {"value": 10}

    observations = of_kind(told, "Observation")
    codes = Counter(one["code"]["coding"][0]["code"] for one in observations)
    flexion = next(one for one in observations if one["code"]["coding"][0]["code"] == "41389-8")
    assert flexion["valueQuantity"] == {
        "value": 90.0,
        "unit": "deg",
        "system": "http://unitsofmeasure.org",
        "code": "deg",
    }
    rotation = [one for one in observations if one["code"]["coding"][0]["code"] == "41387-2"]
    at = {one["component"][0]["valueCodeableConcept"]["coding"][0]["code"] for one in rotation}
    assert at == {"position-at_side", "position-abducted_90", "position-flexed_90"}
    assert codes[PAIN] == 11 * 2 + 6 + 2 * 4
    assert codes["rom-adduction-active"] == 4
    withdrawn = {
        one["status"]
        for one in observations
        if one["effectiveDateTime" if "effectiveDateTime" in one else "status"].startswith("2026-04-16T10")
    }
    assert withdrawn == {"entered-in-error"}
    run = next(one for one in observations if one["code"]["coding"][0]["code"] == "run-tracking")
    assert run["valueQuantity"]["value"] == 0.4
    answers = of_kind(told, "QuestionnaireResponse")[0]["item"]
    assert [item.get("answer", [{}])[0].get("valueInteger") for item in answers] == [
        7,
        8,
        6,
        5,
        4,
        5,
        7,
        4,
        3,
        3,
        6,
        7,
        None,
    ]
    seen = of_kind(told, "Procedure")[0]
    assert [note["text"] for note in seen["note"]] == ["Visit 0: Mrs Yamada did well.", "Seen by me."]
    assert seen["note"][0]["authorString"] == "Suzuki Aya"


def test_patient_with_almost_no_data_is_accepted(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=0)
    with database.write() as session:
        row = patients.get(session, patient_id)
        row.kana = row.birth_date = None
        row.sex = "unknown"
        row.archived_at = utc_now()
        for episode in row.episodes:
            episode.onset_on, episode.diagnosis, episode.closed_at = None, "", utc_now()
            episode.contraindications, episode.limits, episode.max_load_level = "", [], None
    assert judged({"bundle": exported(database, patient_id, tmp_path / "bundle.json")}) == {"bundle": []}


def test_bundle_has_no_empty_or_double_values_or_zoneless_times(database: Database, tmp_path: Path) -> None:
    """Nothing is empty, nothing has two values, and no time is without its zone."""
    parts = everything(exported(database, treated(database, sessions=1), tmp_path / "bundle.json"))
    assert len(parts) > 500
    for part in parts:
        assert all(value not in (None, "", [], {}) for value in part.values()), part
        assert sum(name.startswith("value") for name in part if name != "value") <= 1, part
        times = [value for value in part.values() if isinstance(value, str) and re.match(r"\d{4}-\d\d-\d\dT", value)]
        assert all(re.search(r"(Z|[+-]\d\d:\d\d)$", value) for value in times), part


def _first(kind: str) -> Callable[[Json], Json]:
    return lambda told: of_kind(told, kind)[0]


BREAKS: dict[str, Callable[[Json], Any]] = {
    "a gender that is none": lambda told: _first("Patient")(told).update(gender="f"),
    "half a birth date": lambda told: _first("Patient")(told).update(birthDate="1968-4"),
    "an element that is none": lambda told: _first("Patient")(told).update(age=58),
    "a name that is no list": lambda told: _first("Patient")(told).update(name={"text": "Yamada"}),
    "a condition of nobody": lambda told: _first("Condition")(told).pop("subject"),
    "abated and active": lambda told: _first("Condition")(told).update(abatementDateTime="2026-11-01"),
    "a plan without intent": lambda told: _first("CarePlan")(told).pop("intent"),
    "a status that is none": lambda told: _first("CarePlan")(told).update(status="done"),
    "a procedure without status": lambda told: _first("Procedure")(told).pop("status"),
    "an observation of nothing": lambda told: _first("Observation")(told).pop("code"),
    "a number that is text": lambda told: _first("Observation")(told)["valueQuantity"].update(value="0.4"),
    "an answer without its question": lambda told: _first("QuestionnaireResponse")(told)["item"][0].pop("linkId"),
    "a use without a device": lambda told: _first("DeviceUseStatement")(told).pop("device"),
    "an entry without request": lambda told: told["entry"][3].pop("request"),
}  # fmt: skip


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_broken_bundle_is_refused_by_at_least_one_validator(database: Database, tmp_path: Path) -> None:
    whole = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    cases = {}
    for name, damage in BREAKS.items():
        cases[name] = copy.deepcopy(whole)
        damage(cases[name])
    told = judged(cases | {"whole": whole})
    assert told.pop("whole") == []
    assert [name for name, said in told.items() if not said] == []


# -- in -------------------------------------------------------------------------------------------------------------


def incoming(**change: Any) -> Json:
    return {
        "resourceType": "Patient",
        "identifier": [{"type": {"coding": [{"code": "MR"}]}, "value": "K-7"}],
        "name": [{"use": "official", "family": "Sato", "given": ["Ken"]}],
    } | change


def test_exported_patient_is_imported_as_the_same_person(database: Database, tmp_path: Path) -> None:
    told = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    ((found,), left_out) = read_patients(told, "left")
    who = found.patient
    assert (who.clinic_number, who.name, who.kana, str(who.birth_date), who.sex) == (
        NUMBER, NAME, KANA, "1968-04-12", "female",
    )  # fmt: skip
    assert all(re.fullmatch(r"Bundle\.entry\[\d+\]\.resource \(\w+\)", path) for path in left_out)
    assert len(left_out) == len(told["entry"]) - 1


def test_import_names_omitted_elements() -> None:
    resource = incoming(
        telecom=[{"value": "03"}],
        identifier=[
            {"system": "urn:oid:1.2", "value": "insurance"},
            {"type": {"coding": [{"code": "MR"}]}, "value": "K-7"},
        ],
        name=[{"use": "old", "text": "Ito Ken"}, {"text": "Satō Ken"}, {"use": "official", "text": "Sato Ken"}],
        deceasedBoolean=False,
        _birthDate={"extension": []},
    )
    ((found,), left_out) = read_patients(resource, "right")
    assert (found.patient.clinic_number, found.patient.name, found.patient.sex) == ("K-7", "Sato Ken", "unknown")
    assert sorted(left_out) == [
        "Patient._birthDate", "Patient.identifier[0]", "Patient.name[0]", "Patient.name[1]", "Patient.telecom",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "path", "what"),
    [
        ({"identifier": []}, "Patient.identifier", "must contain the clinic's number"),
        ({"identifier": [{"value": "1"}, {"value": "2"}]}, "Patient.identifier", "several numbers; mark the clinic's number with type MR"),
        ({"identifier": [{"value": 7}]}, "Patient.identifier[0].value", "must be a text"),
        ({"identifier": [{"value": "x" * 33}]}, "Patient.identifier[0].value", "string should have at most 32"),
        ({"identifier": "K-7"}, "Patient.identifier", "must be a list of objects"),
        ({"name": []}, "Patient.name", "must have a name"),
        ({"name": [{"use": "old", "text": "Ito"}]}, "Patient.name", "must have a name"),
        ({"name": [{"given": [1]}]}, "Patient.name[0]", "must consist of texts"),
        ({"gender": "f"}, "Patient.gender", "must be one of female, male, other, unknown"),
        ({"birthDate": "1968-04"}, "Patient.birthDate", "must be a whole date"),
        ({"birthDate": "1968-02-30"}, "Patient.birthDate", "must be a whole date"),
        ({"birthDate": "2999-01-01"}, "Patient.birthDate", "must be between 1900 and today"),
        ({"active": False}, "Patient.active", "says that this record is inactive"),
        ({"deceasedBoolean": True}, "Patient.deceasedBoolean", "says that this patient has died"),
        ({"deceasedDateTime": "2026-01-01"}, "Patient.deceasedDateTime", "says that this patient has died"),
        ({"modifierExtension": []}, "Patient.modifierExtension", "may change the meaning of the other elements, and is not supported"),
        ({"link": []}, "Patient.link", "says that another record of this patient exists; import the valid one"),
        ({"name": [{"use": ["old"], "family": []}]}, "Patient.name[0]", "must consist of texts"),
        ({"\ud800": 1}, "Patient.?", "is not an element of a Patient in FHIR R4"),
        ({"age": 58}, "Patient.age", "is not an element of a Patient in FHIR R4"),
        ({"resourceType": "Practitioner"}, "resourceType", "must be Patient, or Bundle"),
    ],
)  # fmt: skip
def test_unsupported_element_is_refused_by_its_path(change: Json, path: str, what: str) -> None:
    with pytest.raises(FhirImportError) as caught:
        read_patients(incoming(**change), "left")
    assert [where for where, _ in caught.value.places] == [path]
    assert caught.value.places[0][1].startswith(what)


def test_every_bundle_path_is_reported_and_patients_are_required() -> None:
    patients_in = [incoming(), incoming(gender="f"), incoming(birthDate="today")]
    with pytest.raises(FhirImportError) as caught:
        read_patients({"resourceType": "Bundle", "entry": [{"resource": one} for one in patients_in]}, "left")
    assert [where for where, _ in caught.value.places] == [
        "Bundle.entry[1].resource.gender", "Bundle.entry[2].resource.birthDate",
    ]  # fmt: skip
    with pytest.raises(FhirImportError, match=r"Bundle\.entry must contain at least one Patient and at most 500"):
        read_patients({"resourceType": "Bundle", "entry": [{"resource": {"resourceType": "Group"}}]}, "left")
