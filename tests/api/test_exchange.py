"""Export and import of a patient over REST: FHIR, the whole record, and erasure."""

import asyncio
import csv
import io
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4
from zipfile import ZipFile

import pytest
from arro3.io import read_parquet
from fastapi.testclient import TestClient
from sqlalchemy import String, inspect

from kata.clinic.recordings.tables import RecordingRow, RecordingSamplesRow
from kata.clinic.sessions.tables import MotionTrackingRow, RunRow
from kata.database.base import Base
from kata.database.engine import Database
from kata.interop import patient_export
from kata.interop.router import in_turn
from kata.plotting.figures import FigureWorker
from tests.support.fhir_patient import NAME, treated
from tests.support.responses import problem
from tests.support.units import is_of_a_body

pytestmark = pytest.mark.no_apparatus


def number() -> str:
    return f"X-{uuid4().hex[:8]}"


def history(client: TestClient, sessions: int = 2) -> tuple[str, str]:
    """The id and the clinic number of a patient with a history."""
    app: Any = client.app
    database: Database = app.state.services.database
    taken = number()
    return str(treated(database, sessions=sessions, number=taken)), taken


def fhir_patient(**change: Any) -> dict[str, Any]:
    return {
        "resourceType": "Patient",
        "identifier": [{"value": number()}],
        "name": [{"text": "Satō Ken"}],
        "gender": "male",
    } | change


def imported(client: TestClient, resource: Any, side: str = "right") -> Any:
    return client.post(
        "/api/patients/import/fhir",
        params={"affected_side": side},
        content=json.dumps(resource),
        headers={"content-type": "application/fhir+json"},
    )


def test_patient_is_exported_as_fhir(client: TestClient) -> None:
    key, taken = history(client)
    answer = client.get(f"/api/patients/{key}/fhir")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/fhir+json"
    assert f'filename="patient-{key}.fhir.json"' in answer.headers["content-disposition"]
    found = answer.json()
    assert (found["resourceType"], found["type"]) == ("Bundle", "transaction")
    who = next(entry["resource"] for entry in found["entry"] if entry["resource"]["resourceType"] == "Patient")
    assert who["identifier"][0]["value"] == taken
    problem(client.get(f"/api/patients/{uuid4()}/fhir"), 404, "not_found")


def test_patients_come_in_from_fhir_each_with_an_episode(client: TestClient) -> None:
    answer = imported(client, fhir_patient(birthDate="1970-02-28", telecom=[{"value": "03"}]), side="left")
    assert answer.status_code == 201, answer.text
    (made,) = answer.json()["items"]
    assert answer.json()["left_out"] == ["Patient.telecom"]
    assert (made["name"], made["birth_date"], made["sex"], made["affected_side"]) == (
        "Satō Ken",
        "1970-02-28",
        "male",
        "left",
    )
    assert client.get(f"/api/patients/{made['id']}").json() == made
    both = {"resourceType": "Bundle", "type": "collection", "entry": [{"resource": fhir_patient()} for _ in range(2)]}
    assert len(imported(client, both).json()["items"]) == 2


def test_import_changes_no_patient_and_creates_all_or_none(client: TestClient, patient: dict[str, Any]) -> None:
    taken = fhir_patient(identifier=[{"value": patient["clinic_number"]}])
    free = fhir_patient()
    both = {"resourceType": "Bundle", "type": "collection", "entry": [{"resource": free}, {"resource": taken}]}
    refusal = problem(imported(client, both), 409, "number_taken")
    assert refusal["errors"][0]["pointer"] == "Bundle.entry[1].resource"
    assert client.get(f"/api/patients/{patient['id']}").json() == patient
    # The first patient was not created either: the number is still free.
    assert imported(client, free).status_code == 201


def test_unsupported_import_element_is_reported_by_its_path(client: TestClient) -> None:
    refusal = problem(imported(client, fhir_patient(gender="f", birthDate="1970")), 422, "not_understood")
    assert [error["pointer"] for error in refusal["errors"]] == ["Patient.gender", "Patient.birthDate"]
    problem(imported(client, fhir_patient(), side="middle"), 422, "invalid")
    problem(imported(client, []), 422, "invalid")


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/api/patients/import/fhir?affected_side=right", "application/fhir+json"),
        ("/api/patients/{patient}/recordings/import?name=N&side=right", "text/csv"),
        ("/api/patients/{patient}/recordings/import/preview?side=right", "text/csv"),
    ],
)
def test_imported_file_is_not_stored(client: TestClient, patient: dict[str, Any], path: str, kind: str) -> None:
    """The service stores no uploaded file, so it can pass none on. The file is the test virus of virus scanners."""
    eicar = rb"X5O!P%@AP[4\PZX54(P^)7CC)7}$EICAR-STANDARD-ANTIVIRUS-TEST-FILE!$H+H*"
    app: Any = client.app
    folder = Path(app.state.services.auth.folder)
    for content in (
        eicar,
        b"time_s,a\n0," + eicar,
        b'{"resourceType": "Patient", "photo": "' + eicar + b'"}',
        b"PK\x03\x04" + eicar,
    ):
        url = path.format(patient=patient["id"])
        answer = client.post(url, content=content, headers={"content-type": kind})
        assert answer.status_code in (415, 422), answer.text
        assert b"EICAR" not in answer.content
    stored = [file for file in folder.rglob("*") if file.is_file() and b"EICAR" in file.read_bytes()]
    assert stored == []


def test_whole_record_is_one_file_with_everything_in_it(client: TestClient) -> None:
    key, taken = history(client)
    answer = client.get(f"/api/patients/{key}/export.zip")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/zip"
    with ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        record = json.loads(archive.read("patient.json"))
        assert (record["patient"]["clinic_number"], record["patient"]["name"]) == (taken, NAME)
        assert [stage["stage"] for stage in record["episodes"][0]["stages"]] == ["freezing", "frozen"]
        assert [version["number"] for version in record["programmes"][0]["versions"]] == [1, 2]
        assert len(record["assessments"][0]["rom"]) == 64
        first, second = json.loads(archive.read("sessions.json"))
        assert (first["note"], first["signed_by"]) == ("Visit 0: Mrs Yamada did well.", "Suzuki Aya")
        assert [addendum["text"] for addendum in first["addenda"]] == ["Seen by me."]
        assert len(second["runs"]) == 2
        assert len(second["runs"][0]["motions"]) == 6
        assert json.loads(archive.read("events.json"))[0]["code"] == "paused"
        assert json.loads(archive.read("fhir.json")) == client.get(f"/api/patients/{key}/fhir").json()
        assert [reading["patient_deg"] for reading in first["goniometer_readings"]] == [26.0, 78.0]
        read = csv.DictReader(io.StringIO(archive.read("goniometer.csv").decode()))
        assert [(line["apparatus_deg"], line["patient_deg"], line["side"]) for line in read] == [
            ("20.0", "26.0", "left"),
            ("80.0", "78.0", "left"),
        ]
        for kind, count, measured in (("recordings", 1, 1), ("runs", 4, 2)):
            lines = list(csv.DictReader(io.StringIO(archive.read(f"{kind}.csv").decode())))
            files = [line["file"] for line in lines if line["file"]]
            assert (len(lines), len(files)) == (count, measured)
            assert ("change_by_settings_deg" in lines[0]) == (kind == "runs")
            assert set(files) <= set(names)
            table = read_parquet(archive.read(files[0])).read_all()
            assert (table.num_rows, table.schema.metadata[b"patient_id"]) == (201, key.encode())
        readme = archive.read("README.txt").decode()
    assert names[0] == "README.txt"
    for name in names[1:]:
        assert name.partition("/")[0] in readme
    assert NAME not in " ".join(names)


def test_every_table_of_a_record_says_side_time_and_origin(client: TestClient) -> None:
    """A therapist opens one table alone. A new table with an angle, a torque or a score needs these columns, too."""
    key, _ = history(client)
    with ZipFile(io.BytesIO(client.get(f"/api/patients/{key}/export.zip").content)) as archive:
        tables = {
            name: next(csv.reader(io.StringIO(archive.read(name).decode())))
            for name in archive.namelist()
            if name.endswith(".csv")
        }
    assert len(tables) == 5
    assert sum(map(is_of_a_body, (column for columns in tables.values() for column in columns))) > 10
    for name, columns in tables.items():
        assert {"side", "simulated"} <= set(columns), name
        assert any(column.endswith("_at") for column in columns), name


@pytest.mark.parametrize("row_class", [RecordingRow, RunRow])
@pytest.mark.parametrize(
    "payload", ['=HYPERLINK("http://evil.example")', "+1+1", "-1+1", "@SUM(1)", "\t=1", " =1", "＝1", "%0A=1"]
)
def test_no_text_column_of_an_export_becomes_a_formula(tmp_path: Path, row_class: type[Base], payload: str) -> None:
    columns = inspect(row_class).column_attrs
    row = {column.key: payload for column in columns if isinstance(column.columns[0].type, String)}
    assert len(row) > 2
    patient_export._write_table_with_file_column(tmp_path / "index.csv", [row | {"count": -1.5}])
    with (tmp_path / "index.csv").open(encoding="utf-8", newline="") as file:
        (read,) = csv.DictReader(file)
    assert {read[name] for name in row} == {f"'{payload}"}
    assert read["count"] == "-1.5"


def test_runs_table_has_the_end_range_time_of_each_motion() -> None:
    motions = [MotionTrackingRow(motion=2), MotionTrackingRow(motion=4, end_range_s=92.5)]
    found = patient_export._end_range_times(RunRow(motions=motions))
    assert found == {f"motion_{number}_end_range_s": 92.5 if number == 4 else None for number in range(3, 7)}


def test_a_record_with_damaged_samples_is_exported_without_them(client: TestClient) -> None:
    key, _ = history(client)
    recording = client.get(f"/api/patients/{key}/recordings").json()["items"][0]["id"]
    app: Any = client.app
    with app.state.services.database.write() as session:
        session.get_one(RecordingSamplesRow, UUID(recording)).data = b"damaged"
    with ZipFile(io.BytesIO(client.get(f"/api/patients/{key}/export.zip").content)) as archive:
        (line,) = csv.DictReader(io.StringIO(archive.read("recordings.csv").decode()))
        assert (line["id"], line["file"]) == (recording, "")
        assert len([name for name in archive.namelist() if name.startswith("runs/")]) == 2


# -- erasure --------------------------------------------------------------------------------------------------------


def asked(client: TestClient, key: str) -> dict[str, Any]:
    body = {"reason": "Mrs Yamada asked in writing.", "noted_by": "Suzuki Aya"}
    answer = client.post(f"/api/patients/{key}/erasures", json=body)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def consent(taken: str) -> dict[str, str]:
    return {"clinic_number": taken, "explanation": "Nothing forbids it.", "decided_by": "Director Kobayashi"}


def test_a_request_is_noted_listed_and_refused_with_an_explanation(client: TestClient) -> None:
    key, _ = history(client, sessions=1)
    request = asked(client, key)
    assert (request["decision"], request["reason"]) == (None, "Mrs Yamada asked in writing.")
    assert request["id"] in {item["id"] for item in client.get("/api/erasures").json()["items"]}
    again = {"reason": "Once more.", "noted_by": "Suzuki Aya"}
    problem(client.post(f"/api/patients/{key}/erasures", json=again), 409, "already_asked")

    refusal = {"explanation": "To be kept for five years.", "decided_by": "Director Kobayashi"}
    decided = client.post(f"/api/erasures/{request['id']}/refuse", json=refusal).json()
    assert (decided["decision"], decided["explanation"]) == ("refused", "To be kept for five years.")
    assert request["id"] not in {item["id"] for item in client.get("/api/erasures").json()["items"]}
    assert client.get(f"/api/patients/{key}/erasures").json()["items"] == [decided]
    assert client.get(f"/api/patients/{key}").json()["name"] == NAME
    problem(client.post(f"/api/erasures/{request['id']}/refuse", json=refusal), 409, "decided")
    # A refused erasure can be requested again.
    assert asked(client, key)["id"] != request["id"]


def test_erased_patient_is_anonymous_and_figures_remain(client: TestClient) -> None:
    key, taken = history(client)
    before = client.get(f"/api/patients/{key}").json()
    request = asked(client, key)
    refusal = problem(client.post(f"/api/erasures/{request['id']}/approve", json=consent("K-1")), 422, "other_number")
    assert refusal["errors"][0]["pointer"] == "#/clinic_number"
    done = client.post(f"/api/erasures/{request['id']}/approve", json=consent(taken))
    assert done.status_code == 200, done.text
    assert (done.json()["decision"], done.json()["reason"]) == ("erased", "")

    who = client.get(f"/api/patients/{key}").json()
    assert who["name"] == "Erased"
    assert who["erased_at"]
    assert who["archived_at"]
    assert (who["kana"], who["birth_date"], who["notes"]) == (None, None, "")
    assert who["clinic_number"] != before["clinic_number"]
    assert client.get("/api/patients", params={"search": taken, "archived": True}).json()["items"] == []
    recording = client.get(f"/api/patients/{key}/recordings").json()["items"][0]
    assert client.get(f"/api/recordings/{recording['id']}/samples.csv").status_code == 200


def test_an_erased_record_stays_erased(client: TestClient) -> None:
    key, taken = history(client, sessions=1)
    request = asked(client, key)
    assert client.post(f"/api/erasures/{request['id']}/approve", json=consent(taken)).status_code == 200
    who = client.get(f"/api/patients/{key}").json()
    for change in ({"name": "Yamada"}, {"archived": False}):
        body = change | {"updated_at": who["updated_at"]}
        problem(client.patch(f"/api/patients/{key}", json=body), 409, "erased")
    problem(client.get(f"/api/patients/{key}/fhir"), 409, "erased")
    problem(client.get(f"/api/patients/{key}/export.zip"), 409, "erased")
    body = {"reason": "Again.", "noted_by": "Suzuki Aya"}
    problem(client.post(f"/api/patients/{key}/erasures", json=body), 409, "erased")
    problem(client.post(f"/api/erasures/{request['id']}/approve", json=consent(taken)), 409, "decided")


def test_nothing_is_erased_while_a_session_is_open(client: TestClient, patient: dict[str, Any]) -> None:
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    request = asked(client, patient["id"])
    url, body = f"/api/erasures/{request['id']}/approve", consent(patient["clinic_number"])
    problem(client.post(url, json=body), 409, "session_open")
    assert client.get(f"/api/patients/{patient['id']}").json() == patient
    assert client.post(f"/api/sessions/{visit['id']}/end").status_code == 200
    assert client.post(url, json=body).status_code == 200


@pytest.mark.parametrize("path", ["patients/{}/export.zip", "patients/{}/fhir", "patients/{}/erasures"])
def test_patient_without_data_exports_nothing(client: TestClient, path: str) -> None:
    problem(client.get(f"/api/{path.format(uuid4())}"), 404, "not_found")
    refusal = {"explanation": "None.", "decided_by": "Director Kobayashi"}
    problem(client.post(f"/api/erasures/{uuid4()}/refuse", json=refusal), 404, "not_found")


def test_two_exports_are_made_at_once() -> None:
    counting, both, running, most = threading.Lock(), threading.Barrier(2, timeout=30), 0, 0

    def pieces() -> Iterator[bytes]:
        nonlocal running, most
        for _ in range(5):
            with counting:
                running += 1
                most = max(most, running)
            both.wait()
            with counting:
                running -= 1
            yield b""

    async def export(worker: FigureWorker) -> None:
        async for _ in in_turn(pieces(), worker.exporting):
            pass

    async def export_all(worker: FigureWorker) -> None:
        await asyncio.gather(*(export(worker) for _ in range(6)))

    worker = FigureWorker()
    try:
        asyncio.run(export_all(worker))
    finally:
        worker.close()
    assert most == 2
