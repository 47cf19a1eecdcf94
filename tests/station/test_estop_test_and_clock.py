"""A test of the emergency stop from before the drives were configured does not count, also if the computer's clock was set meanwhile."""

import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from kata.clinic.events.observer import ESTOP_TESTED, NewDeviceEvent
from kata.clinic.sessions import checks, offline_cache
from kata.clinic.sessions.checks import ApparatusState, estop_test
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.station import snapshot_tracker
from kata.station.snapshot_tracker import SnapshotTracker
from tests.support.silent_device import Silent, snapshot, station


def test_clock_set_back_revives_no_old_estop_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is 30 minutes fast when the switch is tested. Then it is set, and a drive is exchanged and configured."""
    fast = timedelta(minutes=30)
    tested_at = datetime.now(UTC) + fast
    tracker = SnapshotTracker()
    before: Any = SimpleNamespace(verified_since_ns=time.monotonic_ns() - 60 * 1_000_000_000)
    monkeypatch.setattr(snapshot_tracker, "datetime", SimpleNamespace(now=lambda zone: datetime.now(zone) + fast))
    tracker._note_verification(before)
    monkeypatch.undo()
    again: Any = SimpleNamespace(verified_since_ns=time.monotonic_ns())
    tracker.snapshot = before
    tracker._note_verification(again)
    apparatus: Any = SimpleNamespace(
        today=tested_at - timedelta(hours=8), verified_since=tracker.verified_since, tested_since_verified=True
    )
    assert estop_test(tested_at, apparatus) is None


def test_clock_set_back_by_hours_revives_no_old_test_later(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is five hours fast when the switch is tested. Then it is set, and a drive is exchanged and configured. Six hours pass."""
    unused: Any = None
    cache = OfflineCache(unused, "Station 1")
    now = datetime.now(UTC)
    tested_at = now + timedelta(hours=5)
    cache.on_event(NewDeviceEvent(station="Station 1", at=tested_at, kind="event", code=ESTOP_TESTED, message=""))
    tested_s = time.monotonic()
    apparatus = ApparatusState(
        "Station 1", pedal_answers=True, verified_since=now + timedelta(minutes=1), tested_since_verified=False
    )
    monkeypatch.setattr(checks, "utc_now", lambda: now + timedelta(hours=6))
    monkeypatch.setattr(checks, "today", lambda zone: now - timedelta(hours=1))
    for verified_s, counts in ((tested_s - 60.0, True), (tested_s + 60.0, False), (None, False)):
        known = replace(apparatus, tested_since_verified=cache.has_estop_test_since(verified_s))
        assert checks.estop_test(tested_at, known) == (tested_at if counts else None)


def test_yesterdays_test_does_not_count_after_clock_was_set_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unused: Any = None
    cache = OfflineCache(unused, "Station 1")
    cache.on_event(
        NewDeviceEvent(station="Station 1", at=datetime.now(UTC), kind="event", code=ESTOP_TESTED, message="")
    )
    verified_s, now_s = time.monotonic() - 60.0, time.monotonic()
    for hours, counts in ((23.0, True), (25.0, False)):
        monkeypatch.setattr(
            offline_cache, "time", SimpleNamespace(monotonic=lambda later=hours: now_s + 3600.0 * later)
        )
        assert cache.has_estop_test_since(verified_s) is counts


def test_a_service_that_saw_no_test_knows_none(silent: list[Silent]) -> None:
    """The test of another run of the service is from before the present verification."""
    at = station()
    unused: Any = None
    silent[0].tell(snapshot(verified_since_ns=time.monotonic_ns()))
    assert not OfflineCache(unused, "Station 1").has_estop_test_since(at.verified_since_s)
