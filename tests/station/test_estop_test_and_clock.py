"""A test of the emergency stop from before the drives were configured does not count, also if the computer's clock was set meanwhile."""

import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

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


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("test"), st.just(0.0)),
            st.tuples(st.just("configure"), st.just(0.0)),
            st.tuples(st.just("wait"), st.sampled_from([0.01, 0.5, 6.0, 23.0, 25.0])),
            st.tuples(st.just("set"), st.sampled_from([-48.0, -25.0, -5.0, -0.5, 0.5, 5.0, 24.0])),
        ),
        max_size=12,
    )
)
def test_no_setting_of_the_clock_revives_an_old_test(events: list[tuple[str, float]]) -> None:
    """The switch is tested, drives are configured again, time passes and the clock is set, in any order."""
    unused: Any = None
    cache = OfflineCache(unused, "Station 1")
    now_s, ahead, tested_s = 100_000.0, timedelta(0), -1e9
    verified_s, verified_at = now_s, datetime(2026, 5, 1, 12, tzinfo=UTC)

    def wall() -> datetime:
        return datetime(2026, 5, 1, 12, tzinfo=UTC) + timedelta(seconds=now_s - 100_000.0) + ahead

    def midnight(zone: object) -> datetime:
        return wall().replace(hour=0, minute=0, second=0)

    with (
        mock.patch.object(offline_cache, "time", SimpleNamespace(monotonic=lambda: now_s)),
        mock.patch.object(checks, "utc_now", wall),
        mock.patch.object(checks, "today", midnight),
    ):
        for what, hours in events:
            match what:
                case "test":
                    cache.on_event(
                        NewDeviceEvent(station="Station 1", at=wall(), kind="event", code=ESTOP_TESTED, message="")
                    )
                    tested_s = now_s
                case "configure":
                    verified_s, verified_at = now_s, wall()
                case "wait":
                    now_s += 3600.0 * hours
                case _:
                    ahead += timedelta(hours=hours)
            known = ApparatusState(
                "Station 1",
                pedal_answers=True,
                verified_since=verified_at,
                tested_since_verified=cache.has_estop_test_since(verified_s),
            )
            if estop_test(cache.estop_tested_at, known) is not None:
                assert tested_s >= verified_s, "a test from before the drives were configured counts"
                assert now_s - tested_s <= 24 * 3600.0, "a test of another day counts"
            else:
                # A clock that was set may make a new test necessary.
                assert what != "test" or any(event == "set" for event, _ in events), "a test just made does not count"
