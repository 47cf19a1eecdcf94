"""The live state is built from changed fields, and equals a state that is validated as a whole."""

from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import uuid4

import msgspec
import pytest
from pydantic import ValidationError

from kata.device.ipc_messages import AxisState, DriveWarning, Refusal, RunState, StopCause, StopState, TeachingState
from kata.station.live_builder import LiveBuilder
from kata.station.rhythm_schemas import RhythmLive
from kata.station.schemas import DatabaseStatus, LeaseLive, Live
from tests.support.silent_device import snapshot

_AT = datetime(2026, 11, 29, tzinfo=UTC)
_FREE = LeaseLive(holder=None, mine=False, since=None, taken_from=None, unreachable_since=None, paused=False)
_RUN = RunState(
    run_id=str(uuid4()), recording_id=str(uuid4()), position_s=1.5, duration_s=9.0, left_s=7.5, at_start=False, resistance_level=8,
    reversals=0, reversing=False, range_percent=100.0,
)  # fmt: skip
_OCCUPATION = {"patient": None, "recording_name": "Lift", "changes": (), "session_id": None, "resistance": None}
_VALUES: dict[str, Any] = msgspec.to_builtins(snapshot()) | {
    "device": "running",
    "at": _AT,
    "age_ms": 5.0,
    "side": "left",
    "verified_since": None,
    "lease": _FREE,
    "rhythm": None,
    "database": DatabaseStatus(),
}
_CHANGES: dict[str, Any] = msgspec.to_builtins(
    snapshot(
        mode="playing",
        torque="on",
        stops=1,
        estop="pressed",
        pedal="down",
        axes=(
            AxisState(motor=1, setpoint_deg=0.5, measured_deg=None, speed_deg_s=0.0, torque_nm=0.1, torque="on", age_ms=1.0),
        ),
        stop=StopState(causes=(StopCause(code="cause", category=0, message="It stopped.", next_step="Look.", cleared=True),), at_ns=0),
        run=_RUN,
        teaching=TeachingState(teaching_id=str(uuid4()), takes=1, recording=True, take_s=1.0, samples=100),
        refusals={"load": Refusal.of(code="code", message="It is refused.", next_step="Look.")},
        loop=msgspec.structs.replace(snapshot().loop, cycles=10),
        warnings=(DriveWarning(code="drive_hot", motor=1, message="It is hot.", next_step="Wait."),),
    )
) | {
    "device": "restarting",
    "at": _AT + timedelta(seconds=0.1),
    "age_ms": None,
    "side": "right",
    "verified_since": _AT,
    "lease": _FREE.model_copy(update={"holder": "Emi Sato"}),
    "rhythm": RhythmLive(motion_id="run 1", start_elevation_deg=1.0, start_scapula_deg=2.0, curves=[]),
    "database": DatabaseStatus(waiting=3),
}  # fmt: skip
_CHANGES["run"] |= _OCCUPATION
_CHANGES["stop"]["arm_held"] = True
_CHANGES["teaching"] |= _OCCUPATION


@pytest.mark.parametrize("name", Live.model_fields)
def test_only_a_changed_field_is_validated(name: str) -> None:
    builder = LiveBuilder()
    before = builder.build(_VALUES)
    assert before == Live.model_validate(_VALUES)
    after = builder.build(_VALUES | {name: _CHANGES[name]})
    assert after == Live.model_validate(_VALUES | {name: _CHANGES[name]})
    assert getattr(after, name) != getattr(before, name)
    assert all(getattr(after, other) is getattr(before, other) for other in Live.model_fields if other != name)


def test_a_field_without_a_value_has_its_default_again() -> None:
    builder = LiveBuilder()
    assert builder.build(_VALUES | {"rhythm": _CHANGES["rhythm"]}).rhythm is not None
    without = {name: value for name, value in _VALUES.items() if name != "rhythm"}
    assert builder.build(without).rhythm is None


def test_the_state_after_an_invalid_one_is_complete() -> None:
    builder = LiveBuilder()
    builder.build(_VALUES)
    with pytest.raises(ValidationError):
        builder.build(_VALUES | {"mode": "playing", "age_ms": -1.0})
    assert builder.build(_VALUES | {"mode": "playing"}) == Live.model_validate(_VALUES | {"mode": "playing"})
