"""The list of stations with their reports, on a stepped clock."""

import json
from datetime import UTC, datetime
from typing import Any
from uuid import UUID

import pytest

from kata.station.fleet import (
    MAX_REPORT_BYTES,
    SILENT_AFTER_S,
    PlaybackProgress,
    Roster,
    StationReport,
    StationStatus,
    as_json,
)
from kata.station.lease import ClockReading
from kata.station.schemas import PatientRef, StopCauseLive

ID = UUID(int=7)
BEGIN = ClockReading(1000.0, datetime(2026, 3, 1, 9, 0, tzinfo=UTC))


def state(station: str = "Station 2", service: int = 1, **fields: Any) -> StationReport:
    given: dict[str, Any] = {
        "simulated": True, "device": "running", "mode": "idle", "torque": "off", "estop": "closed", "causes": [],
        "arm_held": False, "operator": None, "patient": None, "recording_name": None, "progress": None, "take_s": None,
    }  # fmt: skip
    return StationReport(station=station, service=UUID(int=service), **(given | fields))


def one(roster: Roster, now: ClockReading, name: str = "Station 2") -> StationStatus:
    return next(shown for shown in roster.statuses(now) if shown.name == name)


def test_silent_station_is_shown_as_silent_since_its_last_message() -> None:
    roster = Roster("Station 1")
    roster.take(state(mode="playing", torque="on"), BEGIN)
    shown = one(roster, BEGIN.later(SILENT_AFTER_S))
    assert shown.state
    assert (shown.silent, shown.state.mode) == (False, "playing")

    shown = one(roster, BEGIN.later(SILENT_AFTER_S + 0.1))
    assert (shown.silent, shown.state, shown.heard_at) == (True, None, BEGIN.at)

    roster.take(state(mode="idle"), BEGIN.later(60))
    assert one(roster, BEGIN.later(60)).silent is False


def test_registered_station_never_heard_is_silent() -> None:
    roster = Roster("Station 2")
    roster.register(["Station 1", "Station 2", "Station 3"])
    shown = roster.statuses(BEGIN)
    assert [(status.name, status.here, status.silent, status.heard_at) for status in shown] == [
        ("Station 2", True, True, None),
        ("Station 1", False, True, None),
        ("Station 3", False, True, None),
    ]


def test_reregistered_station_is_still_received() -> None:
    roster = Roster("Station 1")
    roster.take(state(), BEGIN)
    roster.register(["Station 2"])
    assert one(roster, BEGIN).silent is False


def test_duplicate_service_names_are_reported_but_restarts_are_not() -> None:
    roster = Roster("Station 1")
    roster.take(state(service=1), BEGIN)
    roster.take(state(service=2), BEGIN.later(0.5))
    assert one(roster, BEGIN.later(0.5)).doubled is False, "the other service has restarted"
    roster.take(state(service=2), BEGIN.later(1.0))
    assert one(roster, BEGIN.later(1.0)).doubled is False
    roster.take(state(service=1), BEGIN.later(1.5))
    assert one(roster, BEGIN.later(1.5)).doubled is True
    later = 1.5 + SILENT_AFTER_S + 0.1
    roster.take(state(service=1), BEGIN.later(later))
    assert one(roster, BEGIN.later(later)).doubled is False


def test_progress_alone_is_no_news_and_everything_else_is() -> None:
    def at(position_s: float, **fields: Any) -> StationReport:
        progress = PlaybackProgress(position_s=position_s, duration_s=9.0, left_s=9.0 - position_s, reversing=False)
        return state(mode="playing", progress=progress, **fields)

    assert at(1.0).without_progress == at(2.0).without_progress
    assert state(take_s=1.0).without_progress == state(take_s=2.0).without_progress
    for changed in ({"estop": "pressed"}, {"torque": "unknown"}, {"device": "restarting"}, {"operator": "Sato"}):
        assert at(1.0, **changed).without_progress != at(1.0).without_progress


@pytest.mark.parametrize("length", [10, 100, 1500, 30_000])
def test_station_messages_never_exceed_the_database_column(length: int) -> None:
    cause = StopCauseLive(code="bus_lost", category=0, message="線" * length, next_step="n", axis=None, cleared=False)
    patient = PatientRef(id=ID, name="長" * min(length, 200))
    report = state(mode="stopped", causes=[cause] * 5, patient=patient, recording_name="曲" * length)
    text = as_json(report)
    assert len(text.encode()) <= MAX_REPORT_BYTES
    read = StationReport.model_validate_json(text)
    assert (read.mode, read.estop, read.station) == ("stopped", "closed", "Station 2")
    assert length > 100 or read == report


def test_unknown_fields_of_a_newer_version_are_ignored() -> None:
    report = json.loads(as_json(state())) | {"something_new": [1, 2]}
    assert StationReport.model_validate_json(json.dumps(report)) == state()
