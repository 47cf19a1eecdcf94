"""Export and import of patients as FHIR R4, judged by two independent validators."""

import copy
import json
import re
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import pytest
from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from kata.clinic.assessments.spadi import ITEMS
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import ExportedStatementRow
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.interop.codes import (
    LOCAL,
    LOCAL_CODES,
    NAME_REPRESENTATION,
    PAIN,
    PATIENT_NUMBERS,
    ExportSettings,
    local_codes,
)
from kata.interop.fhir_import import FhirImportError, read_patients
from kata.messages import key_of
from tests.support.databases import SQLITE_FIRST
from tests.support.fhir_bundle import Json, everything, exported, judged, of_kind
from tests.support.fhir_patient import KANA, NAME, NUMBER, treated


@pytest.mark.campaign
@SQLITE_FIRST
def test_a_patient_with_fifty_sessions_is_accepted_by_both_validators(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    kinds = Counter(entry["resource"]["resourceType"] for entry in bundle["entry"])
    assert kinds["Procedure"] == kinds["DeviceUseStatement"] == 50
    assert (kinds["Patient"], kinds["Condition"], kinds["CarePlan"], kinds["Device"]) == (1, 1, 2, 2)
    assert kinds["QuestionnaireResponse"] == 5
    # Two runs and two or three pains a session; each assessment has 64 angles, four pains, a score and a note.
    assert (kinds["EpisodeOfCare"], kinds["Flag"]) == (1, 2)
    # Two goniometer readings in the first session, and the patient's angles of its two runs.
    assert kinds["Observation"] == 50 * 2 + 50 * 2 + 25 + 5 * (64 + 4 + 1 + 1) + 2 + 2


@SQLITE_FIRST
def test_same_record_makes_the_same_bundle_with_resolvable_references(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=3)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert exported(database, patient_id, tmp_path / "again.json") == bundle
    urls = {entry["fullUrl"] for entry in bundle["entry"]}
    assert len(urls) == len(bundle["entry"])
    for entry in bundle["entry"]:
        resource = entry["resource"]
        assert entry["request"] == {"method": "PUT", "url": f"{resource['resourceType']}/{resource['id']}"}
        assert entry["fullUrl"] == f"urn:uuid:{UUID(resource['id'])}"
    references = {element["reference"] for element in everything(bundle["entry"]) if "reference" in element}
    assert len(references) >= 10
    assert references <= urls


def _remove_findings(session: Session) -> None:
    """Remove one value of each kind that a user can remove."""
    visit = session.scalars(select(SessionRow).order_by(SessionRow.started_at)).first()
    found = session.scalars(select(AssessmentRow)).one()
    assert visit
    visit.pain_before = found.pain_rest = found.spadi = None
    found.note = ""
    del found.rom[0]
    session.delete(visit.goniometer_readings[0])
    episode = session.scalars(select(EpisodeRow)).one()
    for stage in list(episode.stages):
        session.delete(stage)
    episode.diagnosis = episode.contraindications = ""
    episode.onset_on = episode.max_resistance_level = episode.max_speed_deg_s = None
    episode.limits = []


def _said(bundle: Json) -> dict[str, Json]:
    return {entry["resource"]["id"]: entry["resource"] for entry in bundle["entry"]}


@SQLITE_FIRST
def test_removed_statements_are_withdrawn_at_the_receiver(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=2)
    before = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    with database.write() as session:
        _remove_findings(session)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    after = _said(bundle)
    assert before.keys() == after.keys(), "the receiver hears about everything that it was sent"
    status = {key: resource.get("verificationStatus") or resource.get("status") for key, resource in after.items()}
    changed = [
        key for key in after if status[key] != (before[key].get("verificationStatus") or before[key].get("status"))
    ]
    kinds = Counter(after[key]["resourceType"] for key in changed)
    # Both pains, an angle, the note, the total, one reading; the angles of both runs need two readings.
    assert kinds == {"Observation": 6 + 2, "QuestionnaireResponse": 1, "Condition": 1, "Flag": 2}
    for key in changed:
        resource = after[key]
        wanted = "inactive" if resource["resourceType"] == "Flag" else "entered-in-error"
        assert wanted in json.dumps(status[key])
        assert not {"item", "component", "note"} & set(resource) and not any(
            name.startswith("value") for name in resource
        )
    assert judged({"bundle": bundle}) == {"bundle": []}
    assert exported(database, patient_id, tmp_path / "again.json") == bundle
    with database.write() as session:
        session.scalars(select(AssessmentRow)).one().pain_rest = 4
    again = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    assert [
        key for key in changed if again[key].get("status") == "amended" and again[key]["valueQuantity"]["value"] == 4
    ]


def _change_answers_and_pain(database: Database, pain_rest: int) -> None:
    with database.write() as session:
        found = session.scalars(select(AssessmentRow)).one()
        assert found.spadi
        found.pain_rest = pain_rest
        found.spadi = [found.spadi[0] + 1 if pain_rest == 9 else found.spadi[0] - 1, *found.spadi[1:]]  # type: ignore[operator]


def _changes(before: dict[str, Json], after: dict[str, Json]) -> Counter[tuple[str, str, str]]:
    assert before.keys() == after.keys()
    return Counter(
        (after[key]["resourceType"], before[key]["status"], after[key]["status"])
        for key in after
        if after[key] != before[key]
    )


_AMENDMENTS = {
    # The pain at rest and the total, and the answers.
    ("Observation", "final", "amended"): 2,
    ("QuestionnaireResponse", "completed", "amended"): 1,
}


@SQLITE_FIRST
def test_values_that_change_after_an_export_are_amended_for_ever(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=2)
    first = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    _change_answers_and_pain(database, pain_rest=9)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert _changes(first, _said(bundle)) == _AMENDMENTS
    assert judged({"bundle": bundle}) == {"bundle": []}
    assert exported(database, patient_id, tmp_path / "again.json") == bundle, "nothing changed since"
    _change_answers_and_pain(database, pain_rest=2)
    back = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    assert _changes(first, back) == _AMENDMENTS, "the receiver had another value in the meantime"
    assert {key: resource | {"status": ""} for key, resource in back.items() if "status" in resource} == {
        key: resource | {"status": ""} for key, resource in first.items() if "status" in resource
    }


@SQLITE_FIRST
def test_changed_condition_flag_and_note_keep_their_status(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=1)
    first = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    with database.write() as session:
        episode = session.scalars(select(EpisodeRow)).one()
        episode.diagnosis, episode.contraindications = "Another text", "Another warning"
        session.scalars(select(SessionRow)).one().note = "Another note."
    after = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    changed = [key for key in after if after[key] != first[key]]
    assert Counter(after[key]["resourceType"] for key in changed) == {"Condition": 1, "Flag": 1, "Procedure": 1}
    assert all(after[key].get("status") == first[key].get("status") for key in changed)


@SQLITE_FIRST
def test_statement_of_an_older_version_stays_final(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=1)
    first = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    with database.write() as session:
        # Version 0028 stored only the withdrawal.
        session.execute(update(ExportedStatementRow).values(final_digest=None))
    _change_answers_and_pain(database, pain_rest=9)
    second = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    assert {(kind, now) for kind, _, now in _changes(first, second)} == {
        ("Observation", "final"),
        ("QuestionnaireResponse", "completed"),
    }
    _change_answers_and_pain(database, pain_rest=2)
    assert _changes(second, _said(exported(database, patient_id, tmp_path / "bundle.json"))) == _AMENDMENTS


@SQLITE_FIRST
def test_renamed_code_amends_nothing(database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    patient_id = treated(database, sessions=1)
    first = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    monkeypatch.setitem(LOCAL_CODES, "position-abducted_90", "Another name of the position")
    after = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    assert any(after[key] != first[key] for key in after if after[key]["resourceType"] == "Observation")
    assert "amended" not in {resource.get("status") for resource in after.values()}


def test_values_of_an_open_session_are_preliminary_and_become_final(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=1)
    with database.write() as session:
        visit = session.scalars(select(SessionRow)).one()
        ended_at, visit.ended_at = visit.ended_at, None
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    first = _said(bundle)
    with database.write() as session:
        visit = session.scalars(select(SessionRow)).one()
        visit.ended_at, visit.pain_before = ended_at, 1
    after = _said(exported(database, patient_id, tmp_path / "bundle.json"))
    changes = _changes(first, after)
    # Three pains, two goniometer readings and the angles of two runs.
    assert changes["Observation", "preliminary", "final"] == 3 + 2 + 2
    assert "amended" not in {now for _, _, now in changes}


@SQLITE_FIRST
def test_every_code_of_our_own_is_declared_in_the_bundle(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    (declared,) = of_kind(bundle, "CodeSystem")
    known = {concept["code"] for concept in declared["concept"]}
    used = {element["code"] for element in everything(bundle) if element.get("system") == LOCAL and "code" in element}
    assert declared["url"] == LOCAL
    assert declared["count"] == len(known) == len(local_codes())
    assert len(used) > 20
    assert used <= known


@SQLITE_FIRST
@pytest.mark.parametrize("written", ["", "Rotator cuff tear, postoperative"])
def test_no_diagnosis_is_exported_that_nobody_made(database: Database, tmp_path: Path, written: str) -> None:
    patient_id = treated(database, sessions=1)
    with database.write() as session:
        episode = session.scalars(select(EpisodeRow).filter_by(patient_id=patient_id)).one()
        assert episode.stages, "a stage is no diagnosis either"
        episode.diagnosis = written
    (condition,) = of_kind(exported(database, patient_id, tmp_path / "bundle.json"), "Condition")
    assert condition.get("code") == ({"text": written} if written else None)
    assert "verificationStatus" not in condition


@SQLITE_FIRST
def test_partial_run_has_no_error_but_its_compared_share(database: Database, tmp_path: Path) -> None:
    patient = treated(database, sessions=1)
    with database.write() as session:
        for row in session.scalars(select(RunRow)):
            row.compared_percent, row.worst_rmse_deg, row.worst_peak_deg = 41.5, None, None
    bundle = exported(database, patient, tmp_path / "bundle.json")
    runs = [
        resource
        for resource in of_kind(bundle, "Observation")
        if resource["code"]["coding"][0]["code"] == "run-tracking"
    ]
    assert runs
    for run in runs:
        assert "valueQuantity" not in run
        assert run["dataAbsentReason"]["coding"][0]["code"] == "unknown"
        assert (
            run["dataAbsentReason"]["text"]
            == "Less than 90 % of the playing time or no complete repetition was compared"
        )
        shares = {
            part["code"]["coding"][0]["code"]: part["valueQuantity"]["value"]
            for part in run["component"]
            if "valueQuantity" in part
        }
        assert shares["compared-share"] == 41.5
        assert "tracking-peak" not in shares
        assert not any(name.endswith("-rmse") for name in shares)


@SQLITE_FIRST
def test_run_names_its_following_error_and_its_change_by_settings(database: Database, tmp_path: Path) -> None:
    patient = treated(database, sessions=1)
    with database.write() as session:
        for row in session.scalars(select(RunRow)):
            row.clock_offset_s = 0.094
            row.work_j, row.mean_effort_nm, row.mean_pace_percent = 3.21, 1.44, 61.5
            for motor in row.tracking:
                motor.change_deg = -12.5 if motor.motor == 3 else 1.0
            for motion in row.motions:
                motion.end_range_s = 92.5 if motion.motion == 4 else None
                motion.end_range_band_deg, motion.end_range_torque_nm = 5.0, 1.5
    bundle = exported(database, patient, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    runs = [
        resource
        for resource in of_kind(bundle, "Observation")
        if resource["code"]["coding"][0]["code"] == "run-tracking"
    ]
    assert runs
    for run in runs:
        assert run["code"]["coding"][0]["display"].startswith("Tracking error")
        values = {
            part["code"]["coding"][0]["code"]: part["valueQuantity"]
            for part in run["component"]
            if "valueQuantity" in part
        }
        assert (values["change-by-settings"]["value"], values["change-by-settings"]["unit"]) == (-12.5, "deg")
        assert (values["clock-offset"]["value"], values["clock-offset"]["unit"]) == (0.094, "s")
        assert (values["self-paced-work"]["value"], values["self-paced-work"]["unit"]) == (3.21, "J")
        assert (values["self-paced-effort"]["value"], values["self-paced-effort"]["unit"]) == (1.44, "N.m")
        assert (values["self-paced-pace"]["value"], values["self-paced-pace"]["unit"]) == (61.5, "%")
        held = {code: (value["value"], value["unit"]) for code, value in values.items() if "end-range" in code}
        # The prescription's band and torque, not the usual ones.
        assert held == {
            "motion-4-end-range-time": (92.5, "s"),
            "motion-4-end-range-band": (5.0, "deg"),
            "motion-4-end-range-torque": (1.5, "N.m"),
        }


@SQLITE_FIRST
def test_goniometer_readings_and_the_patients_angles_name_their_method(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=2), tmp_path / "bundle.json")
    observations = of_kind(bundle, "Observation")

    def of_code(code: str) -> list[Json]:
        return [observation for observation in observations if observation["code"]["coding"][0]["code"] == code]

    readings, angles = of_code("goniometer-reading"), of_code("patient-angle")
    assert [reading["valueQuantity"]["value"] for reading in readings] == [26.0, 78.0]
    assert {reading["method"]["coding"][0]["code"] for reading in readings} == {"goniometer"}
    assert [reading["component"][0]["valueQuantity"]["value"] for reading in readings] == [20.0, 80.0]
    # Two playbacks of the session with readings; nothing is estimated in the other session or for another motion.
    assert len(angles) == 2
    for angle in angles:
        assert "basic motion 4" in angle["code"]["text"]
        assert angle["method"]["coding"][0]["code"] == "goniometer-estimate"
        assert "valueQuantity" not in angle
        names = [part["code"]["coding"][0]["code"] for part in angle["component"]]
        assert names == [f"patient-angle-{end}{what}" for end in ("lowest", "highest") for what in ("", "-uncertainty")]
        assert len(angle["derivedFrom"]) == 3


@SQLITE_FIRST
def test_bundle_repeats_the_values_of_the_record(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=11), tmp_path / "bundle.json")
    (who,) = of_kind(bundle, "Patient")
    assert (who["identifier"][0]["system"], who["identifier"][0]["value"]) == (PATIENT_NUMBERS, NUMBER)
    assert [(name["text"], name["use"], name["extension"]) for name in who["name"]] == [
        (NAME, "official", [{"url": NAME_REPRESENTATION, "valueCode": "IDE"}]),
        (KANA, "official", [{"url": NAME_REPRESENTATION, "valueCode": "SYL"}]),
    ]
    assert (who["birthDate"], who["gender"], who["active"]) == ("1968-04-12", "female", True)

    (condition,) = of_kind(bundle, "Condition")
    assert set(condition["code"]) == {"text"}
    assert "verificationStatus" not in condition
    assert condition["bodySite"][0]["coding"][0]["code"] == "91775009"
    assert condition["onsetDateTime"] == "2026-01-10"
    assert [stage["extension"][0]["valueDate"] for stage in condition["stage"]] == ["2026-02-01", "2026-05-20"]
    warnings = [flag["code"]["text"] for flag in of_kind(bundle, "Flag")]
    assert warnings[0] == "Left shoulder. Contraindications: None known to Mrs Yamada."
    assert "Abduction / adduction of the shoulder: as far as it goes to 90 deg" in warnings[1]

    old, new = sorted(of_kind(bundle, "CarePlan"), key=lambda plan: plan["title"])
    assert (old["status"], new["status"]) == ("revoked", "active")
    assert new["replaces"][0]["reference"] == f"urn:uuid:{old['id']}"
    assert new["activity"][0]["detail"]["quantity"]["value"] == 10
    assert new["activity"][0]["detail"]["scheduledTiming"]["repeat"]["frequency"] == 3
    assert "scheduledTiming" not in old["activity"][0]["detail"], "no number was prescribed"

    observations = of_kind(bundle, "Observation")
    codes = Counter(observation["code"]["coding"][0]["code"] for observation in observations)
    flexion = next(observation for observation in observations if observation["code"]["coding"][0]["code"] == "41389-8")
    assert flexion["valueQuantity"] == {
        "value": 90.0,
        "unit": "deg",
        "system": "http://unitsofmeasure.org",
        "code": "deg",
    }
    rotation = [observation for observation in observations if observation["code"]["coding"][0]["code"] == "41387-2"]
    at = {observation["component"][0]["valueCodeableConcept"]["coding"][0]["code"] for observation in rotation}
    assert at == {"position-at_side", "position-abducted_90", "position-flexed_90"}
    assert codes[PAIN] == 11 * 2 + 6 + 2 * 4
    assert codes["rom-adduction-active"] == 4
    withdrawn = {
        observation["status"]
        for observation in observations
        if observation["effectiveDateTime" if "effectiveDateTime" in observation else "status"].startswith(
            "2026-04-16T10"
        )
    }
    assert withdrawn == {"entered-in-error"}
    run = next(
        observation for observation in observations if observation["code"]["coding"][0]["code"] == "run-tracking"
    )
    assert run["valueQuantity"]["value"] == 0.4
    answers = of_kind(bundle, "QuestionnaireResponse")[0]["item"]
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
    seen = of_kind(bundle, "Procedure")[0]
    assert [note["text"] for note in seen["note"]] == ["Visit 0: Mrs Yamada did well.", "Seen by me."]
    assert seen["note"][0]["authorString"] == "Suzuki Aya"


@SQLITE_FIRST
def test_unsigned_note_is_marked_and_has_no_author(database: Database, tmp_path: Path) -> None:
    """The software may have drafted it, and no user has signed it."""
    patient_id = treated(database, sessions=1)
    with database.write() as session:
        row = session.scalars(select(SessionRow).filter_by(patient_id=patient_id)).one()
        row.signed_at, row.signed_by = None, ""
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    (procedure,) = of_kind(bundle, "Procedure")
    assert procedure["note"][0] == {"text": f"Draft, not signed: {row.note}"}
    assert judged({"bundle": bundle}) == {"bundle": []}


def test_patient_with_almost_no_data_is_accepted(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=0)
    with database.write() as session:
        row = patients.get(session, patient_id)
        row.kana = row.birth_date = None
        row.sex = "unknown"
        row.archived_at = utc_now()
        for episode in row.episodes:
            episode.onset_on, episode.diagnosis, episode.closed_at = None, "", utc_now()
            episode.contraindications, episode.limits, episode.max_resistance_level = "", [], None
    assert judged({"bundle": exported(database, patient_id, tmp_path / "bundle.json")}) == {"bundle": []}


@SQLITE_FIRST
def test_bundle_has_no_empty_or_double_values_or_zoneless_times(database: Database, tmp_path: Path) -> None:
    """No element is empty or has two values, and every time has its zone."""
    parts = everything(exported(database, treated(database, sessions=1), tmp_path / "bundle.json"))
    assert len(parts) > 500
    for part in parts:
        assert all(value not in (None, "", [], {}) for value in part.values()), part
        assert sum(name.startswith("value") for name in part if name != "value") <= 1, part
        times = [value for value in part.values() if isinstance(value, str) and re.match(r"\d{4}-\d\d-\d\dT", value)]
        assert all(re.search(r"(Z|[+-]\d\d:\d\d)$", value) for value in times), part


@SQLITE_FIRST
def test_pain_scores_of_one_moment_differ_and_name_the_shoulder(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    pains = [resource for resource in of_kind(bundle, "Observation") if resource["code"]["coding"][0]["code"] == PAIN]
    assert len(pains) == 7
    meant = {(pain["code"]["coding"][1]["code"], pain.get("effectiveDateTime")) for pain in pains}
    assert len({code for code, _ in meant}) == len(pains)
    assert {pain["bodySite"]["coding"][0]["display"] for pain in pains} == {"Structure of left shoulder"}
    assert {pain["code"]["text"] for pain in pains} >= {"Pain at rest", "Pain before the session"}
    (during,) = [pain for pain in pains if pain["code"]["coding"][1]["code"] == "pain-during"]
    assert set(during["effectivePeriod"]) == {"start", "end"}, "nobody noted the moment"


@SQLITE_FIRST
def test_our_own_wording_of_the_spadi_is_not_exported(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    written = json.dumps(bundle, ensure_ascii=False)
    assert [item.english for item in ITEMS if item.english in written] == []
    assert [item.japanese for item in ITEMS if item.japanese in written] == []
    (questions,) = of_kind(bundle, "Questionnaire")
    scores = ["score-pain", "score-disability", "score-total"]
    assert [item["linkId"] for item in questions["item"]] == [*(str(number) for number in range(1, 14)), *scores]


@SQLITE_FIRST
def test_clinic_sets_identifier_system_and_profiles_and_reimports_them(database: Database, tmp_path: Path) -> None:
    system = "urn:oid:1.2.392.100495.20.3.51.11311234567"
    profile = "http://jpfhir.jp/fhir/core/StructureDefinition/JP_Patient"
    bundle = exported(
        database, treated(database, sessions=1), tmp_path / "bundle.json", ExportSettings(system, {"Patient": profile})
    )
    (who,) = of_kind(bundle, "Patient")
    assert (who["identifier"][0]["system"], who["meta"]) == (system, {"profile": [profile]})
    assert all("meta" not in resource for resource in of_kind(bundle, "Observation"))
    who["identifier"].append({"system": "urn:oid:1.2", "value": "insurance", "type": who["identifier"][0]["type"]})
    ((found,), left_out) = read_patients(bundle, "left", system)
    assert (found.patient.clinic_number, found.patient.name) == (NUMBER, NAME)
    assert [path for path in left_out if "meta" in path] == []


@SQLITE_FIRST
def test_observations_that_claim_jp_core_have_its_category(database: Database, tmp_path: Path) -> None:
    profile = "http://jpfhir.jp/fhir/core/StructureDefinition/JP_Observation_Common"
    bundle = exported(
        database,
        treated(database, sessions=1),
        tmp_path / "bundle.json",
        ExportSettings(profiles={"Observation": profile}),
    )
    assert judged({"bundle": bundle}) == {"bundle": []}
    for resource in of_kind(bundle, "Observation"):
        systems = {coding["system"]: coding["code"] for part in resource["category"] for coding in part["coding"]}
        assert len(systems) == 2
        assert len(set(systems.values())) == 1
        assert any("JP_SimpleObservationCategory_CS" in system for system in systems)


ODD: dict[str, tuple[Json, Json | None]] = {
    "nothing written": ({"diagnosis": "", "onset_on": None}, None),
    "spaces and signs": ({"diagnosis": "? <b>&#0;", "onset_on": None}, {"code": {"text": "? <b>&#0;"}}),
    "written, not chosen": (
        {"diagnosis": "Rotator cuff tear, postoperative", "onset_on": None},
        {"code": {"text": "Rotator cuff tear, postoperative"}},
    ),
    "a certainty of nothing": ({"diagnosis": "", "onset_on": None, "verification": "confirmed"}, None),
    "a code of another version": ({"diagnosis": "", "onset_on": None, "diagnosis_code": "M99.9"}, None),
    "only an onset": ({"diagnosis": ""}, {"code": None, "verificationStatus": None, "onsetDateTime": "2026-01-10"}),
    "chosen, contradicted by the text, closed": (
        {"diagnosis": "No frozen shoulder", "diagnosis_code": "M75.0", "verification": "differential", "closed_at": utc_now()},
        {"clinicalStatus": None, "abatementDateTime": None},
    ),
}  # fmt: skip
"""Odd, empty and contradictory episodes with their Condition, or None without one."""


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_odd_records_are_valid_and_say_only_what_was_entered(database: Database, tmp_path: Path) -> None:
    cases = {}
    for number, (name, (columns, says)) in enumerate(ODD.items()):
        patient_id = treated(database, sessions=2, number=f"K-{number}")
        with database.write() as session:
            episode = session.scalars(select(EpisodeRow).filter_by(patient_id=patient_id)).one()
            session.execute(delete(StageRow).filter_by(episode_id=episode.id))
            session.expire(episode)
            for column, value in columns.items():
                setattr(episode, column, value)
        cases[name] = exported(database, patient_id, tmp_path / "bundle.json")
        conditions = of_kind(cases[name], "Condition")
        assert len(conditions) == (says is not None), name
        for element, value in (says or {}).items():
            assert conditions[0].get(element) == value, (name, element)
        assert bool(conditions) == ("addresses" in of_kind(cases[name], "CarePlan")[0])
    assert judged(cases) == {name: [] for name in cases}
    (chosen,) = of_kind(cases["chosen, contradicted by the text, closed"], "Condition")
    assert [coding["code"] for coding in chosen["code"]["coding"]] == ["M75.0", "399114005"]
    assert chosen["code"]["text"] == "No frozen shoulder"
    assert chosen["verificationStatus"]["coding"][0]["code"] == "differential"


ENTERED: dict[str, dict[str, str]] = {
    "Condition": {"code": "diagnosis", "onsetDateTime": "onset", "stage": "stages", "bodySite": "side"},
    "EpisodeOfCare": {"type": "side", "period": "opened and closed", "status": "opened and closed", "diagnosis": "diagnosis"},
    "Flag": {
        "code": "entry of the list with note, permission and end; free contraindications; limits",
        "author": "who recorded it; the doctor of the limits",
        "status": "resolved or not; opened and closed",
        "period": "recorded and resolved",
        "category": "all are warnings",
    },
    "Patient": {
        "identifier": "clinic number", "name": "name and kana", "birthDate": "birth date", "gender": "sex", "active": "archived or not",
    },
    "CarePlan": {
        "title": "programme and version", "activity": "items with their settings", "note": "note of the version", "created": "saved",
        "period": "saved; replaced", "status": "replaced or not", "replaces": "the version before", "addresses": "diagnosis of the episode",
        "supportingInfo": "limits of the episode", "intent": "all are plans",
    },
    "Observation": {
        "valueQuantity": "angle, score or pain as typed; calculated errors and angles", "valueString": "note", "code": "what was asked for",
        "category": "of the code", "component": "position of the arm; calculated figures of a run", "bodySite": "side",
        "effectiveDateTime": "time of the assessment, of the reading or of the score", "effectivePeriod": "period of run or session",
        "performer": "assessed by, read by", "method": "goniometer, estimate from its readings, or end-feel test", "derivedFrom": "answers; readings",
        "partOf": "session", "status": "withdrawn or not",
    },
    "QuestionnaireResponse": {
        "item": "answers", "authored": "time of the assessment", "questionnaire": "the definition", "status": "withdrawn or not",
    },
    "Procedure": {
        "note": "note and addenda with their authors", "performedPeriod": "begun and ended", "performer": "therapist", "status": "end of the session",
        "bodySite": "side", "basedOn": "programme version", "reasonReference": "diagnosis of the episode", "usedReference": "station",
        "code": "all are sessions on the apparatus",
    },
    "DeviceUseStatement": {
        "device": "station", "timingPeriod": "begun and ended", "recordedOn": "ended", "status": "ended or not", "bodySite": "side",
        "reasonReference": "diagnosis of the episode", "derivedFrom": "session",
    },
    "Device": {"identifier": "station", "deviceName": "station", "type": "the apparatus", "status": "all are in use"},
    "Questionnaire": {
        "item": "numbers, bounds and scores of the definition", "title": "the definition or the licensed texts", "copyright": "the same", "url": "the definition",
        "name": "the definition", "version": "the definition", "status": "all are in use", "subjectType": "all are of patients",
    },
}  # fmt: skip
"""Exported elements (left) with the entered value or Kata's own value that each contains (right). Every other element is bookkeeping."""
_BOOKKEEPING = {"resourceType", "id", "subject", "patient", "recordedDate", "clinicalStatus"}


def contraindicated(database: Database, patient_id: UUID) -> None:
    """Record contraindications of the list: open, signed off, resolved, of another version; of the patient and of a shoulder."""
    at = datetime(2026, 5, 1, 9, 0, tzinfo=UTC)
    with database.write() as session:
        episode = session.scalars(select(EpisodeRow).filter_by(patient_id=patient_id)).one()
        for code, whose, more in (
            ("pacemaker", None, {}),
            ("fracture", episode.id, {"note": "Humeral neck.", "resolved_at": at, "resolved_by": "Kimura Jun", "resolution": "United."}),
            ("recent_repair", episode.id, {"signed_off_at": at, "signed_off_by": "Dr. Mori"}),
            ("other", episode.id, {"note": "Afraid of <b>motors</b>"}),
            ("of_tomorrow", None, {}),
        ):  # fmt: skip
            session.add(
                ContraindicationRow(
                    id=uuid4(), patient_id=patient_id, episode_id=whose, code=code, noted_at=at, noted_by="Sato Mai", **more
                )
            )  # fmt: skip


@SQLITE_FIRST
def test_every_exported_statement_was_entered(database: Database, tmp_path: Path) -> None:
    """No element is exported that ``ENTERED`` does not explain, and it explains none that is never exported."""
    patient_id = treated(database, sessions=11)
    contraindicated(database, patient_id)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    stated: dict[str, set[str]] = {}
    for entry in bundle["entry"]:
        resource = entry["resource"]
        stated.setdefault(resource["resourceType"], set()).update(set(resource) - _BOOKKEEPING)
    # Our own codes and their meanings contain no patient data.
    del stated["CodeSystem"]
    assert stated == {kind: set(entered) for kind, entered in ENTERED.items()}


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_listed_contraindications_are_exported_as_entered(database: Database, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=1)
    contraindicated(database, patient_id)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    said = {flag["code"]["text"]: flag for flag in of_kind(bundle, "Flag") if "period" in flag}
    assert list(said) == [
        "Pacemaker or other active implant.",
        "Left shoulder. Fracture that has not united. Note: Humeral neck. No longer applies (Kimura Jun, 2026-05-01): United.",
        "Left shoulder. Recent repair of tendon, ligament or capsule. Treatment allowed by Dr. Mori, 2026-05-01.",
        "Left shoulder. Other contraindication. Note: Afraid of <b>motors</b>",
        "of_tomorrow.",
    ]  # fmt: skip
    assert [flag["status"] for flag in said.values()] == ["active", "inactive", "active", "active", "active"]
    codes = [flag["code"].get("coding", [{}])[0].get("code") for flag in said.values()]
    assert codes == [
        "contraindication-pacemaker",
        "contraindication-fracture",
        "contraindication-recent_repair",
        "contraindication-other",
        None,
    ]
    assert len(of_kind(bundle, "Condition")) == 1, "a warning is no diagnosis"


def _first(kind: str) -> Callable[[Json], Json]:
    return lambda bundle: of_kind(bundle, kind)[0]


BREAKS: dict[str, Callable[[Json], Any]] = {
    "a gender that is none": lambda bundle: _first("Patient")(bundle).update(gender="f"),
    "half a birth date": lambda bundle: _first("Patient")(bundle).update(birthDate="1968-4"),
    "an element that is none": lambda bundle: _first("Patient")(bundle).update(age=58),
    "a name that is no list": lambda bundle: _first("Patient")(bundle).update(name={"text": "Yamada"}),
    "a condition without a patient": lambda bundle: _first("Condition")(bundle).pop("subject"),
    "abated and active": lambda bundle: _first("Condition")(bundle).update(abatementDateTime="2026-11-01"),
    "a plan without intent": lambda bundle: _first("CarePlan")(bundle).pop("intent"),
    "a status that is none": lambda bundle: _first("CarePlan")(bundle).update(status="done"),
    "a procedure without status": lambda bundle: _first("Procedure")(bundle).pop("status"),
    "an observation of nothing": lambda bundle: _first("Observation")(bundle).pop("code"),
    "a number that is text": lambda bundle: _first("Observation")(bundle)["valueQuantity"].update(value="0.4"),
    "an answer without its question": lambda bundle: _first("QuestionnaireResponse")(bundle)["item"][0].pop("linkId"),
    "a use without a device": lambda bundle: _first("DeviceUseStatement")(bundle).pop("device"),
    "an entry without request": lambda verdicts: verdicts["entry"][3].pop("request"),
}  # fmt: skip


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_broken_bundle_is_refused_by_at_least_one_validator(database: Database, tmp_path: Path) -> None:
    whole = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    cases = {}
    for name, damage in BREAKS.items():
        cases[name] = copy.deepcopy(whole)
        damage(cases[name])
    verdicts = judged(cases | {"whole": whole})
    assert verdicts.pop("whole") == []
    assert [name for name, said in verdicts.items() if not said] == []


# -- in -------------------------------------------------------------------------------------------------------------


def incoming(**change: Any) -> Json:
    return {
        "resourceType": "Patient",
        "identifier": [{"type": {"coding": [{"code": "MR"}]}, "value": "K-7"}],
        "name": [{"use": "official", "family": "Sato", "given": ["Ken"]}],
    } | change


@SQLITE_FIRST
def test_exported_patient_is_imported_as_the_same_person(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=1), tmp_path / "bundle.json")
    ((found,), left_out) = read_patients(bundle, "left")
    who = found.patient
    assert (who.clinic_number, who.name, who.kana, str(who.birth_date), who.sex) == (
        NUMBER, NAME, KANA, "1968-04-12", "female",
    )  # fmt: skip
    assert all(re.fullmatch(r"Bundle\.entry\[\d+\]\.resource \(\w+\)", path) for path in left_out)
    assert len(left_out) == len(bundle["entry"]) - 1


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
        ({"identifier": []}, "Patient.identifier", "must contain the patient's clinic number"),
        ({"identifier": [{"value": "1"}, {"value": "2"}]}, "Patient.identifier", "several numbers; mark the clinic's number with type MR"),
        ({"identifier": [{"value": 7}]}, "Patient.identifier[0].value", "must be a text"),
        ({"identifier": [{"value": "x" * 33}]}, "Patient.identifier[0].value", "must have 32 characters or fewer"),
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
        ({"link": []}, "Patient.link", "refers to another record of this patient; import the valid record"),
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
    reason = caught.value.places[0][1]
    assert reason.startswith(what)
    assert key_of(reason), "the page translates it by its code"


def test_every_bundle_path_is_reported_and_patients_are_required() -> None:
    patients_in = [incoming(), incoming(gender="f"), incoming(birthDate="today")]
    with pytest.raises(FhirImportError) as caught:
        read_patients({"resourceType": "Bundle", "entry": [{"resource": resource} for resource in patients_in]}, "left")
    assert [where for where, _ in caught.value.places] == [
        "Bundle.entry[1].resource.gender", "Bundle.entry[2].resource.birthDate",
    ]  # fmt: skip
    with pytest.raises(FhirImportError, match=r"Bundle\.entry must contain at least one Patient and at most 500"):
        read_patients({"resourceType": "Bundle", "entry": [{"resource": {"resourceType": "Group"}}]}, "left")
