"""Device events reach the database once, and recording them blocks nothing."""

import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from sqlalchemy import select

from kata.clinic.event_spool import EventSpool
from kata.clinic.events import service
from kata.clinic.events.observer import ESTOP_TESTED, AlarmsEnded, NewDeviceEvent, Observer
from kata.clinic.events.service import EventFilter
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.station.schemas import EventLive, LeaseLive, Live, PatientRef, RunLive, StopCauseLive, StopLive
from kata.station.snapshot_tracker import Occupation
from tests.support.databases import upgraded_file

AT = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)
PATIENT, SESSION, RUN = uuid4(), uuid4(), uuid4()
OCCUPATION = Occupation(str(RUN), PatientRef(id=PATIENT, name="N"), "Flexion", SESSION)


NOBODY = LeaseLive(holder=None, mine=False, since=None, taken_from=None, unreachable_since=None, paused=False)


def state(**given: Any) -> Live:
    plain: dict[str, Any] = {
        "device": "running", "at": AT, "age_ms": 1.0, "stops": 0, "verified_since": AT, "side": "right", "mode": "idle", "torque": "off", "estop": "closed",
        "pedal": "up", "axes": [], "stop": None, "run": None, "teaching": None, "refusals": {}, "loop": None, "lease": NOBODY,
    }  # fmt: skip
    return Live(**plain | given)


def playing(**given: Any) -> Live:
    run = RunLive(
        run_id=RUN, recording_id=uuid4(), session_id=SESSION, recording_name="Flexion", changes=[], patient=None,
        position_s=1, duration_s=9, left_s=8, at_start=False, resistance_level=25, reversals=0, reversing=False,
        range_percent=100, resistance=None,
    )  # fmt: skip
    return state(mode="playing", torque="on", run=run, **given)


def stop(*codes: str, **given: Any) -> Live:
    causes = [
        StopCauseLive(code=code, category=1, message=f"{code}.", next_step="", axis=None, cleared=False)
        for code in codes
    ]
    return state(mode="stopped", stop=StopLive(causes=causes, arm_held=False), **given)


def alarms(events: list[NewDeviceEvent | AlarmsEnded]) -> list[NewDeviceEvent]:
    return [event for event in events if isinstance(event, NewDeviceEvent) and event.kind == "alarm"]


def test_stop_alarms_its_run_and_reports_each_cause_once() -> None:
    observer = Observer("Station 1")
    assert observer.observe_state(playing(), OCCUPATION) == []
    (first,) = alarms(observer.observe_state(stop("estop_pressed"), OCCUPATION))
    assert (first.code, first.patient_id, first.session_id, first.run_id) == ("estop_pressed", PATIENT, SESSION, RUN)
    assert (first.station, first.category) == ("Station 1", 1)
    (second,) = alarms(observer.observe_state(stop("estop_pressed", "drive_silent"), OCCUPATION))
    assert second.code == "drive_silent"
    assert observer.observe_state(stop("estop_pressed", "drive_silent"), OCCUPATION) == []


def test_alarm_ends_when_acknowledged_or_its_control_program_ends() -> None:
    observer = Observer("Station 1")
    for gone in (state(), state(device="restarting", mode="offline")):
        (alarm,) = alarms(observer.observe_state(stop("operator_stop"), None))
        (ended,) = observer.observe_state(gone, None)
        assert isinstance(ended, AlarmsEnded)
        assert ended.ids == (alarm.id,)


def test_event_without_a_patient_belongs_to_none() -> None:
    observer = Observer("Station 1")
    observer.observe_state(playing(), OCCUPATION)
    observer.observe_state(state(), OCCUPATION)
    (alarm,) = alarms(observer.observe_state(stop("drive_silent"), OCCUPATION))
    assert (alarm.patient_id, alarm.session_id, alarm.run_id) == (None, None, None)


def test_estop_is_tested_when_pressed_and_released() -> None:
    observer = Observer("Station 1")
    assert alarms(observer.observe_state(stop("estop_pressed", estop="pressed"), None))
    (tried,) = observer.observe_state(stop("estop_pressed", estop="released"), None)
    assert isinstance(tried, NewDeviceEvent)
    assert (tried.code, tried.kind) == (ESTOP_TESTED, "event")
    assert observer.observe_state(stop("estop_pressed", estop="released"), None) == []


def test_press_that_one_contact_missed_does_not_test_the_estop() -> None:
    """The wire of the second contact is broken, or a contact is welded. Then only one contact stops the arm."""
    observer = Observer("Station 1")
    observer.observe_state(stop("estop_pressed", estop="pressed"), None)
    observer.observe_state(stop("estop_pressed", "contacts_disagree", estop="pressed"), None)
    events = observer.observe_state(stop("estop_pressed", "contacts_disagree", estop="released"), None)
    assert ESTOP_TESTED not in [event.code for event in events if isinstance(event, NewDeviceEvent)]
    observer.observe_state(state(), None)
    observer.observe_state(stop("estop_pressed", estop="pressed"), None)
    events = observer.observe_state(stop("estop_pressed", estop="released"), None)
    assert ESTOP_TESTED in [event.code for event in events if isinstance(event, NewDeviceEvent)]


@pytest.mark.parametrize("before", ["unknown", "closed"])
def test_unseen_press_does_not_test_the_estop(before: str) -> None:
    observer = Observer("Station 1")
    observer.observe_state(state(estop=before), None)
    events = observer.observe_state(stop("estop_pressed", estop="released"), None)
    assert ESTOP_TESTED not in [event.code for event in events if isinstance(event, NewDeviceEvent)]


def test_press_before_a_control_program_restart_does_not_count() -> None:
    observer = Observer("Station 1")
    observer.observe_state(stop("estop_pressed", estop="pressed"), None)
    observer.observe_state(state(device="restarting", estop="unknown"), None)
    events = observer.observe_state(stop("estop_pressed", estop="released"), None)
    assert ESTOP_TESTED not in [event.code for event in events if isinstance(event, NewDeviceEvent)]


def test_events_are_stored_unchanged_except_alarms() -> None:
    observer = Observer("Station 1")
    (heard,) = observer.observe_event(
        EventLive(number=1, code="take_started", message="Take 1 is being recorded.", at=AT)
    )
    assert (heard.kind, heard.code, heard.at) == ("event", "take_started", AT)
    assert observer.observe_event(EventLive(number=2, code="fault", message="Stopped.", at=AT)) == []


def happening(code: str = "torque", at: datetime = AT, **given: Any) -> NewDeviceEvent:
    return NewDeviceEvent(station="Station 1", at=at, kind="event", code=code, message=f"{code}.", **given)


def stored_events(database: Database) -> list[DeviceEventRow]:
    with database.read() as session:
        return list(session.scalars(select(DeviceEventRow).order_by(DeviceEventRow.at, DeviceEventRow.code)))


def test_event_put_repeatedly_is_stored_once_and_ended(database: Database, tmp_path: Path) -> None:
    event_spool = EventSpool(database, "Station 1", tmp_path)
    alarm = NewDeviceEvent(
        station="Station 1", at=AT, kind="alarm", code="operator_stop", message="Stopped.", category=1
    )
    for item in (
        alarm,
        happening(at=AT + timedelta(seconds=1)),
        alarm,
        AlarmsEnded((alarm.id,), AT + timedelta(minutes=1)),
    ):
        event_spool.put_event(item)
    event_spool.close()
    rows = stored_events(database)
    assert [(row.code, row.kind) for row in rows] == [("operator_stop", "alarm"), ("torque", "event")]
    assert rows[0].ended_at == AT + timedelta(minutes=1)
    assert rows[1].ended_at is None


def test_event_refused_by_the_database_blocks_no_other(database: Database, tmp_path: Path) -> None:
    event_spool = EventSpool(database, "Station 1", tmp_path)
    for item in (happening("a"), happening("b", session_id=uuid4()), happening("c")):
        event_spool.put_event(item)
    event_spool.close()
    assert [row.code for row in stored_events(database)] == ["a", "c"]
    assert '"code":"b"' in (tmp_path / "refused.jsonl").read_text()


@pytest.fixture
def sqlite(tmp_path: Path) -> Database:
    return Database(upgraded_file(tmp_path / "kata.db"))


def test_locked_database_delays_no_writer_and_loses_nothing(sqlite: Database, tmp_path: Path) -> None:
    event_spool = EventSpool(sqlite, "Station 1", tmp_path / "spool", retry_s=0.01)
    assert event_spool.until_taken(10)
    sent = [happening(f"e{n:02d}", at=AT + timedelta(seconds=n)) for n in range(50)]
    with sqlite.writer.connect() as locking, locking.begin():

        def put_all() -> None:
            for event in sent:
                event_spool.put_event(event)

        putting = threading.Thread(target=put_all)
        putting.start()
        putting.join(5.0)
        assert not putting.is_alive()
        assert event_spool.spool.until_written(5.0)
        assert event_spool.delivery.waiting == 50
    event_spool.close()
    assert [row.code for row in stored_events(sqlite)] == [event.code for event in sent]


def test_what_an_ended_service_left_open_is_closed(database: Database) -> None:
    with database.write() as session:
        session.add(
            DeviceEventRow(
                id=uuid4(), station="Station 1", at=AT, kind="alarm", code="bus_lost", message="Gone.", ended_at=None
            )
        )
    for station, ended_at in (("Station 2", None), ("Station 1", AT)):
        with database.write() as session:
            service.end_left_open(session, station, AT)
        with database.read() as session:
            assert session.scalars(select(DeviceEventRow.ended_at)).one() == ended_at


def test_the_switch_counts_for_its_day_and_its_station(database: Database) -> None:
    with database.write() as session:
        session.add(
            DeviceEventRow(id=uuid4(), station="Station 1", at=AT, kind="event", code=ESTOP_TESTED, message="Tried.")
        )
    with database.read() as session:
        assert service.estop_tested_at(session, "Station 1", AT) == AT
        assert service.estop_tested_at(session, "Station 1", AT + timedelta(seconds=1)) is None
        assert service.estop_tested_at(session, "Station 2", AT) is None


def test_pages_lose_and_repeat_nothing_at_equal_times(database: Database) -> None:
    with database.write() as session:
        patient = patients.create(session, PatientCreate(clinic_number="1", name="N", affected_side="left"))
        for n in range(7):
            session.add(
                DeviceEventRow(
                    id=uuid4(), station="Station 1", at=AT + timedelta(seconds=n // 3), kind="event", code=f"e{n}",
                    message="E.", patient_id=patient.id if n % 2 else None,
                )
            )  # fmt: skip
    everything = EventFilter()
    with database.read() as session:
        found: list[str] = []
        after = None
        for _ in range(4):
            rows, after = service.find(session, everything, 2, after)
            found += [row.code for row in rows]
        assert after is None
        assert sorted(found) == [f"e{n}" for n in range(7)]
        assert found[0] == "e6"
        own, _ = service.find(session, EventFilter(patient_id=patient.id), 50, None)
        assert len(own) == 3
        with pytest.raises(ProblemError, match="cannot be read"):
            service.find(session, everything, 2, "yesterday")
