"""A run whose length depends on the patient shows no remaining time, because the device knows that of the path alone."""

from typing import Any
from uuid import uuid4

import pytest
from msgspec import structs

from kata.device.ipc_messages import Mode, RunState
from kata.station.schemas import PatientRef
from kata.station.snapshot_tracker import Occupation, SnapshotTracker
from tests.support.silent_device import snapshot

_RUN = RunState(
    run_id=str(uuid4()), recording_id=str(uuid4()), position_s=9.0, duration_s=9.0, left_s=0.0, at_start=False, resistance_level=8,
    reversals=0, reversing=False, range_percent=100.0,
)  # fmt: skip


def _left_s(mode: Mode, run: RunState = _RUN, **given: Any) -> float | None:
    tracker = SnapshotTracker()
    tracker.begin(Occupation(_RUN.run_id, PatientRef(id=uuid4(), name="Sato Emi"), **given))
    left_s: float | None = tracker.known_fields(snapshot(mode=mode, run=run))["run"]["left_s"]
    return left_s


@pytest.mark.parametrize("mode", ["playing", "paused"])
def test_held_arm_is_not_shown_as_nearly_ready(mode: Mode) -> None:
    """A stretch once showed 0 s remaining while it held the arm for a minute, and then twice more."""
    assert _left_s(mode, duration_known=False) is None
    assert _left_s(mode) == 0.0


@pytest.mark.parametrize("mode", ["approaching", "returning"])
def test_approach_and_return_have_a_remaining_time(mode: Mode) -> None:
    assert _left_s(mode, duration_known=False) == 0.0


def test_another_run_is_not_taken_for_it() -> None:
    assert _left_s("playing", structs.replace(_RUN, run_id=str(uuid4())), duration_known=False) == 0.0
