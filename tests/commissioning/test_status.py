"""Whether a station is commissioned, when its check is due, and that others refuse patients."""

import contextlib
import hashlib
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from msgspec import structs

from kata.bench.commissioned import write_commissioned
from kata.cli import doctor
from kata.cli.commission import begin
from kata.commissioning import texts
from kata.commissioning.procedure import check, continue_from, with_step
from kata.commissioning.record import (
    CHECKED,
    CommissioningRecord,
    RecordedStep,
    key_path,
    read_record,
    record_path,
    sealed,
    write_record,
)
from kata.commissioning.status import PERIODIC_CHECK_INTERVAL, commissioning_status
from kata.device import config
from kata.device.config import as_toml, simulated
from kata.evaluation.factory_new import FactoryNewApparatus, SimulatedTechnician
from kata.messages import Template
from kata.settings import Settings
from kata.simulator.process import SimulatorProcess
from tests.support.service import running
from tests.support.station_api import until

AT = datetime(2026, 3, 2, 10, 0, tzinfo=UTC)
CONFIG = simulated("virtual")
SLOWER = structs.replace(CONFIG, approach_speed_deg_s=10.0)


def ran(step: str, *, passed: bool = True, at: datetime = AT) -> RecordedStep:
    return RecordedStep(step, at.isoformat(), at.isoformat(), passed=passed)


def test_a_commissioned_station_is_due_after_a_week(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    record = write_commissioned(CONFIG, station, AT)
    found = commissioning_status(station, CONFIG)
    assert (found.missing, found.due_at) == (None, AT + PERIODIC_CHECK_INTERVAL)
    later = AT + timedelta(days=6)
    write_record(sealed(structs.replace(record, checks=(ran("inputs", at=later),))), record_path(station))
    assert commissioning_status(station, CONFIG).due_at == later + PERIODIC_CHECK_INTERVAL


@pytest.mark.parametrize(
    ("change", "missing"),
    [
        (lambda record: sealed(structs.replace(record, passed=False)), texts.COMMISSIONING_UNFINISHED),
        (lambda record: structs.replace(record, by="another person"), texts.RECORD_CHANGED),
        (lambda record: sealed(structs.replace(record, configuration=as_toml(SLOWER))), texts.CONFIGURATION_CHANGED),
        (lambda record: sealed(structs.replace(record, configuration="cycle_hz = 0")), texts.CONFIGURATION_CHANGED),
        (lambda record: sealed(structs.replace(record, checks=(ran("stops", passed=False),))), texts.CHECK_FAILED),
    ],
)
def test_anything_less_is_not_commissioned(
    change: Callable[[CommissioningRecord], CommissioningRecord], missing: Template, tmp_path: Path
) -> None:
    station = tmp_path / "station.toml"
    assert commissioning_status(station, CONFIG).missing == texts.NO_RECORD()
    write_record(change(write_commissioned(CONFIG, station, AT)), record_path(station))
    assert commissioning_status(station, CONFIG).missing == missing()


def former_release(config_fields: set[str], axis_fields: set[str]) -> str:
    """Return CONFIG as a release without these fields, and with a weight of each axis, wrote it."""
    fields = msgspec.toml.decode(as_toml(CONFIG))
    axes = [
        {name: value for name, value in axis.items() if name not in axis_fields} | {"weight_nm": [0.0] * 6}
        for axis in fields["axes"]
    ]
    former_fields = {name: value for name, value in fields.items() if name not in config_fields}
    return msgspec.toml.encode(former_fields | {"axes": axes}).decode()


def test_a_record_stays_valid_when_a_release_adds_configuration_fields(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    record = write_commissioned(CONFIG, station, AT)
    former = former_release({"reversal_s", "service_silence_ms", "arm"}, {"coulomb_nm", "torque_share"})
    digest = hashlib.sha256(former.encode()).hexdigest()
    write_record(
        sealed(structs.replace(record, configuration=former, configuration_digest=digest)), record_path(station)
    )
    station.write_text(former)
    assert commissioning_status(station, config.read(station)).missing is None
    changed = structs.replace(config.read(station), reversal_s=3.0)
    assert commissioning_status(station, changed).missing == texts.CONFIGURATION_CHANGED()


def test_a_record_stays_valid_when_a_release_adds_record_fields(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    fields = msgspec.to_builtins(write_commissioned(CONFIG, station, AT))
    del fields["checks"], fields["previous"], fields["public_key"], fields["signatures"]
    key_path(record_path(station)).unlink()
    fields["digest"] = hashlib.sha256(msgspec.json.encode(fields | {"digest": ""})).hexdigest()
    record_path(station).write_bytes(msgspec.json.encode(fields))
    assert commissioning_status(station, CONFIG).missing is None
    record_path(station).write_bytes(msgspec.json.encode(fields | {"by": "another person"}))
    assert commissioning_status(station, CONFIG).missing == texts.RECORD_CHANGED()


def test_a_passed_check_repairs_a_failed_one(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    record = write_commissioned(CONFIG, station, AT)
    checks = (ran("stops", passed=False), *(ran(key) for key in CHECKED))
    write_record(sealed(structs.replace(record, checks=checks)), record_path(station))
    assert commissioning_status(station, CONFIG).missing is None


def test_taken_over_steps_keep_person_and_date(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    record = write_commissioned(CONFIG, station, AT)
    checked_at, tuned_at = AT + timedelta(days=3), AT + timedelta(days=5)
    checks = tuple(structs.replace(ran(key, at=checked_at), by="Ito") for key in CHECKED)
    former = sealed(structs.replace(record, checks=checks))
    again = continue_from(former, CONFIG, "Mori", "gains")
    assert {step.step: step.by for step in again.steps} == {
        "ids": record.by, "registers": "Ito", "inputs": "Ito", "axes": record.by, "torque": record.by, "zero": record.by,
        "range": record.by, "stops": "Ito",
    }  # fmt: skip
    for key in ("gains", "lags", "acceptance"):
        assert not again.passed
        again = with_step(again, ran(key, at=tuned_at), CONFIG)
    write_record(again, record_path(station))
    found = commissioning_status(station, CONFIG)
    assert (found.missing, found.due_at) == (None, checked_at + PERIODIC_CHECK_INTERVAL)
    assert found.commissioned_at == tuned_at


def test_steps_of_a_faulty_station_are_not_taken_over(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    record = write_commissioned(CONFIG, station, AT)
    for changed in (
        sealed(structs.replace(record, checks=(ran("stops", passed=False),))),
        sealed(structs.replace(record, configuration=as_toml(SLOWER))),
    ):
        signed = write_record(changed, record_path(station))
        with pytest.raises(SystemExit):
            begin(station, None, "Mori", "gains")
        assert read_record(record_path(station)) == signed, "a refused start changes no record"
    older = sealed(structs.replace(record, steps=tuple(step for step in record.steps if step.step != "stops")))
    write_record(older, record_path(station))
    with pytest.raises(SystemExit):
        begin(station, None, "Mori", "gains")
    write_record(record, record_path(station))
    again, draft = begin(station, "/dev/ttyUSB3", "Mori", "gains")
    assert len(again.steps) == 8 and again.previous == record.digest
    assert draft == structs.replace(config.read(station), port="/dev/ttyUSB3")


def test_the_periodic_check_changes_no_configuration(tmp_path: Path) -> None:
    apparatus = FactoryNewApparatus(3)
    for servo, motor in zip(apparatus.servos, range(1, 6), strict=True):
        servo.table[7], servo.table[8] = motor, 3
    workbench = apparatus.workbench(SimulatedTechnician(apparatus))
    axes = tuple(
        structs.replace(axis, direction=sign, zero_count=round(zero) % 4096)
        for axis, sign, zero in zip(workbench.draft.axes, apparatus.direction, apparatus.zero_count, strict=True)
    )
    workbench.draft = structs.replace(workbench.draft, axes=axes)
    before = workbench.draft
    record = write_commissioned(before, tmp_path / "station.toml")
    begin_ns = workbench.now_ns()
    for _, after in check(workbench, record, lambda: AT):
        record = after or record
    assert (workbench.now_ns() - begin_ns) / 1e9 < 120, "it takes two minutes of a technician's time"
    assert [(step.step, step.passed) for step in record.checks] == [(key, True) for key in CHECKED]
    assert workbench.draft == before
    assert {value.name for value in record.checks[-1].values} >= {"lag s", "friction deg", "residual deg"}


def test_the_doctor_names_a_due_check(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"

    def found() -> doctor.CheckResult:
        settings = Settings(data=tmp_path, database_url="", station=station)
        return next(finding for finding in doctor.examine(settings) if finding.name == "Commissioning")

    config.write(CONFIG, station)
    assert (found().state, "there is no commissioning record" in found().message) == ("problem", True)
    write_commissioned(CONFIG, station, datetime.now(UTC) - timedelta(days=8))
    assert (found().state, f"{station} --check" in found().what_to_do) == ("warning", True)
    write_commissioned(CONFIG, station)
    assert found().state == "ok"


def test_real_hardware_refuses_patients_until_it_is_commissioned(tmp_path: Path) -> None:
    with contextlib.closing(SimulatorProcess(tmp_path)) as apparatus:
        station = tmp_path / "station.toml"
        config.write(simulated(apparatus.port), station)
        with running(tmp_path, simulate=False, station=station) as client:
            live = until(client, lambda live: live["mode"] == "idle")
            assert live["refusals"]["teach"]["code"] == live["refusals"]["load"]["code"] == "not_commissioned"
            assert live["refusals"]["teach"]["next_step"] == texts.RUN_COMMISSION()
        write_commissioned(simulated(apparatus.port), station)
        with running(tmp_path, simulate=False, station=station) as client:
            live = until(client, lambda live: live["mode"] == "idle")
            assert live["refusals"].get("teach", {}).get("code") != "not_commissioned"
