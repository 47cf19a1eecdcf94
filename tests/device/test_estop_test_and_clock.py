"""A test of the emergency stop from before the drives were configured does not count, also if the computer's clock was set meanwhile."""

import time
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from kata.clinic.sessions.checks import estop_test
from kata.station import snapshot_tracker
from kata.station.snapshot_tracker import SnapshotTracker


def test_clock_set_back_revives_no_old_estop_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is 30 minutes fast when the switch is tested. Then it is set, and a drive is exchanged and configured."""
    fast = timedelta(minutes=30)
    tested_at = datetime.now(UTC) + fast
    tracker = SnapshotTracker()
    snapshot: Any = SimpleNamespace(verified_since_ns=time.monotonic_ns() - 60 * 1_000_000_000)
    monkeypatch.setattr(snapshot_tracker, "datetime", SimpleNamespace(now=lambda zone: datetime.now(zone) + fast))
    tracker._note_verification(snapshot)
    monkeypatch.undo()
    again: Any = SimpleNamespace(verified_since_ns=time.monotonic_ns())
    tracker.snapshot = snapshot
    tracker._note_verification(again)
    apparatus: Any = SimpleNamespace(today=tested_at - timedelta(hours=8), verified_since=tracker.verified_since)
    assert estop_test(tested_at, apparatus) is None
