"""Commissioning records in the database and over the API."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from msgspec import structs

from kata.bench.commissioned import write_commissioned
from kata.clinic.commissionings import service
from kata.clinic.commissionings.importer import import_records
from kata.clinic.stations.tables import StationRow
from kata.commissioning.procedure import continue_from, with_step
from kata.commissioning.record import (
    CHECKED,
    CommissioningRecord,
    RecordedStep,
    RecordedValue,
    read_record,
    record_path,
    sealed,
    write_record,
)
from kata.database.engine import Database
from kata.device import config
from kata.device.config import as_toml, simulated
from tests.support.service import running
from tests.support.station_api import until

AT = datetime(2026, 3, 2, 10, 0, tzinfo=UTC)
CONFIG = simulated("virtual")


def step(key: str, at: datetime, friction_deg: float = 0.1, *, passed: bool = True) -> RecordedStep:
    values = (RecordedValue("friction deg", 3, 0.05, friction_deg), RecordedValue("voltage_v", 3, None, 11.9))
    end = (at + timedelta(minutes=1)).isoformat()
    return RecordedStep(
        key, at.isoformat(), end, passed=passed, values=values, by="Sato", fault="" if passed else "It failed."
    )


def checks(at: datetime, friction_deg: float = 0.1) -> tuple[RecordedStep, ...]:
    return tuple(step(key, at + timedelta(minutes=n), friction_deg) for n, key in enumerate(CHECKED))


def with_checks(record: CommissioningRecord, *steps: RecordedStep) -> CommissioningRecord:
    return sealed(structs.replace(record, checks=(*record.checks, *steps)))


def test_a_record_is_split_into_commissioning_and_checks(tmp_path: Path) -> None:
    record = write_commissioned(CONFIG, tmp_path / "station.toml", AT)
    later = AT + timedelta(days=7)
    failed = (step(CHECKED[0], later), step(CHECKED[1], later, passed=False))
    found = list(
        service.finished(with_checks(record, *checks(AT), *failed, step(CHECKED[0], later + timedelta(days=1))))
    )
    assert [(row.kind, len(row.steps), row.steps[-1].passed) for row in found] == [
        ("full", 11, True), ("check", 4, True), ("check", 2, False),
    ]  # fmt: skip
    assert found[0].record.digest == record.digest, "the hash of the record as it was when it had no checks"
    assert list(service.finished(sealed(structs.replace(record, passed=False)))) == []


def test_steps_taken_over_are_no_second_commissioning(tmp_path: Path) -> None:
    """The database knows a commissioning by its start, and its figures are those that it measured."""
    later = AT + timedelta(days=30)
    former = write_commissioned(CONFIG, tmp_path / "station.toml", AT)
    again = continue_from(former, CONFIG, "Mori", "gains")
    for n, key in enumerate(("gains", "lags", "acceptance")):
        ran = structs.replace(step(key, later + timedelta(minutes=n)), by="")
        again = with_step(again, ran, CONFIG)
    (found,) = service.finished(again)
    assert [ran.step for ran in found.steps] == ["gains", "lags", "acceptance"]
    assert found.steps[0].began_at == later.isoformat()
    assert len(found.record.steps) == 11, "the record that is shown and printed is whole"


@pytest.mark.parametrize(
    ("column", "value", "changed"),
    [
        ("done_by", "another person", "done_by"),
        ("passed", False, "passed"),
        ("figures", [{"motor": motor, "friction_deg": 0.0} for motor in range(1, 6)], "figures"),
        ("record", None, "record"),
    ],
)
def test_a_value_that_was_changed_in_the_database_is_named(
    column: str, value: object, changed: str, tmp_path: Path, database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "station.toml"
    record = write_record(
        with_checks(write_commissioned(CONFIG, file, AT), *checks(AT + timedelta(days=7))), record_path(file)
    )
    with database.write() as session:
        session.add(StationRow(name=CONFIG.name, config="", registered_at=AT, started_at=AT))
    import_records(database, CONFIG.name, file)
    with database.read() as session:
        rows, _ = service.find(session, CONFIG.name, 10, None)
        assert [(row.kind, service.verify(row).state) for row in rows] == [("check", "valid"), ("full", "valid")]
        assert {service.verify(row).public_key for row in rows} == {record.public_key}
        other, stored = rows[1].id, rows[0].record
    assert caplog.messages == []
    with database.write() as session:
        row = service.get(session, rows[0].id)
        setattr(row, column, stored.replace('"after":0.1', '"after":0.2') if value is None else value)
    import_records(database, CONFIG.name, file)
    with database.read() as session:
        found = service.verify(service.get(session, rows[0].id))
        assert (found.state, found.changed) == ("changed", [changed])
        assert service.verify(service.get(session, other)).state == "valid"
    assert caplog.messages == [f"the commissioning record {rows[0].id} was changed in the database: {changed}"]


def test_a_stored_record_that_another_key_has_signed_is_named(
    tmp_path: Path, database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    forged, file = tmp_path / "elsewhere.toml", tmp_path / "station.toml"
    write_commissioned(CONFIG, forged, AT)
    with database.write() as session:
        session.add(StationRow(name=CONFIG.name, config="", registered_at=AT, started_at=AT))
    import_records(database, CONFIG.name, forged)
    assert caplog.messages == []
    write_commissioned(CONFIG, file, AT)
    import_records(database, CONFIG.name, file)
    (message,) = caplog.messages
    assert f"is signed with another key than this station's: {read(forged).public_key}" in message


@pytest.fixture
def station(tmp_path: Path) -> Path:
    """A station's file with a record of a commissioning and of one check."""
    file = tmp_path / "station.toml"
    write_record(with_checks(write_commissioned(CONFIG, file, AT), *checks(AT + timedelta(days=7))), record_path(file))
    return file


@pytest.fixture
def client(station: Path, tmp_path: Path) -> Iterator[TestClient]:
    with running(tmp_path, "technician", station=station) as client:
        yield client


def records(client: TestClient) -> list[dict[str, object]]:
    items: list[dict[str, object]] = client.get("/api/commissionings", params={"station": CONFIG.name}).json()["items"]
    return items


def until_imported(client: TestClient, count: int) -> list[dict[str, object]]:
    until(client, lambda _: len(records(client)) == count)
    return records(client)


def test_records_are_imported_at_start_and_on_change(client: TestClient, station: Path) -> None:
    check, full = until_imported(client, 2)
    assert (full["kind"], full["done_by"], check["kind"], check["done_by"]) == (
        "full",
        "simulated drives",
        "check",
        "Sato",
    )
    figures = check["figures"]
    assert isinstance(figures, list)
    assert (figures[2]["friction_deg"], figures[2]["voltage_v"], figures[2]["play_deg"]) == (0.1, 11.9, None)
    write_record(with_checks(read(station), *checks(AT + timedelta(days=14), 0.3)), record_path(station))
    newest, *_ = until_imported(client, 3)
    assert newest["figures"][2]["friction_deg"] == 0.3  # type: ignore[index]


def read(station: Path) -> CommissioningRecord:
    record = read_record(record_path(station))
    assert record is not None
    return record


def test_a_record_is_shown_with_its_steps_and_printed(client: TestClient) -> None:
    check, _ = until_imported(client, 2)
    detail = client.get(f"/api/commissionings/{check['id']}").json()
    assert [run["step"] for run in detail["steps"]] == list(CHECKED)
    assert (detail["signature"]["state"], len(detail["signature"]["public_key"])) == ("valid", 64)
    assert detail["steps"][0]["values"][0] == {"name": "friction deg", "motor": 3, "before": 0.05, "after": 0.1}
    pdf = client.get(f"/api/commissionings/{check['id']}/report.pdf", params={"language": "ja"})
    assert pdf.content.startswith(b"%PDF")
    assert client.get("/api/commissionings/00000000-0000-0000-0000-000000000000").json()["code"] == "not_found"


def test_settings_have_units_and_ranges(client: TestClient) -> None:
    shown = client.get("/api/station-settings", params={"station": CONFIG.name}).json()
    fields = {field["name"]: field for field in shown["fields"]}
    assert fields["axes[1].max_torque_nm"]["unit"] == "Nm"
    assert fields["axes[1].max_torque_nm"]["value"] == "4"
    assert (fields["cycle_hz"]["accepted"]["low"], fields["cycle_hz"]["accepted"]["high"]) == (20, 500)
    assert not any(name.startswith("modbus.") for name in fields)


def test_an_import_names_field_value_and_range(client: TestClient, station: Path) -> None:
    before = station.read_text()
    wrong = before.replace("cycle_hz = 100", "cycle_hz = 7")
    refused = client.put("/api/station/configuration", json={"config": wrong})
    assert (refused.status_code, refused.json()["code"]) == (422, "settings_invalid")
    assert "cycle_hz: 7 is not within 20 to 500 Hz" in refused.json()["detail"]
    other = as_toml(structs.replace(CONFIG, name="Room 2"))
    assert (
        client.post("/api/station/configuration/preview", json={"config": other}).json()["code"]
        == "other_stations_file"
    )
    assert client.put("/api/station/configuration", json={"config": "["}).json()["code"] == "settings_invalid"
    assert station.read_text() == before


def test_an_import_replaces_the_file_and_names_the_user(client: TestClient, station: Path) -> None:
    wanted = as_toml(structs.replace(config.read(station), approach_speed_deg_s=9.0))
    preview = client.post("/api/station/configuration/preview", json={"config": wanted}).json()
    change = {"name": "approach_speed_deg_s", "unit": "deg/s", "before": "15", "after": "9"}
    assert preview["changes"] == [change]
    assert config.read(station).approach_speed_deg_s == 15.0, "a preview stores nothing"
    assert client.put("/api/station/configuration", json={"config": wanted}).status_code == 200
    assert config.read(station).approach_speed_deg_s == 9.0
    newest, *_ = client.get("/api/station-versions", params={"station": CONFIG.name}).json()["items"]
    assert (newest["number"], newest["changed_by"]) == (2, "Test technician")


def test_a_therapist_sees_the_state_but_no_records(tmp_path: Path, station: Path) -> None:
    with running(tmp_path, "therapist", station=station) as client:
        state = client.get("/api/station/commissioning").json()
        assert (state["state"], state["due_at"]) == ("not_needed", None)
        assert client.get("/api/commissionings", params={"station": CONFIG.name}).status_code == 403
        assert client.put("/api/station/configuration", json={"config": "x"}).status_code == 403


def test_the_state_of_a_real_station_follows_its_record(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    now = datetime.now(UTC)
    write_commissioned(CONFIG, station, now - timedelta(days=8))
    with running(tmp_path, "technician", simulate=False, station=station) as client:

        def state() -> str:
            return str(client.get("/api/station/commissioning").json()["state"])

        assert state() == "due"
        write_record(with_checks(read(station), *checks(now)), record_path(station))
        until(client, lambda _: state() == "commissioned")
        write_record(with_checks(read(station), step(CHECKED[0], now, passed=False)), record_path(station))
        until(client, lambda _: state() == "not_commissioned")
