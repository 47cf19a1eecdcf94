"""The rhythm of the present take or playback, from snapshots."""

import subprocess
import sys
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import pytest

from kata.device.ipc_messages import AxisState, RunState, Snapshot, TeachingState
from kata.motion.axes import Side
from kata.motion.linkage import Floats, motor_angles_deg
from kata.station.live_rhythm import LiveRhythm
from kata.station.rhythm_schemas import RhythmLive
from kata.station.snapshot_tracker import SnapshotTracker
from tests.support.paths import ROOT
from tests.support.rhythm_motions import RATE_HZ, abduction, evenly, wave
from tests.support.silent_device import snapshot

_SNAPSHOT_EACH = RATE_HZ // 10
ELEVATION = wave(12.0, 95.0, 10.0)


def teaching(*, takes: int = 1, recording: bool = True) -> dict[str, Any]:
    state = TeachingState(teaching_id="teaching", takes=takes, recording=recording, take_s=0.0, samples=0)
    return {"mode": "teaching", "teaching": state}


def run(mode: str = "playing", *, reversing: bool = False) -> dict[str, Any]:
    state = RunState(
        run_id="run", recording_id="recording", position_s=0.0, duration_s=9.0, left_s=9.0, at_start=False, resistance_level=8,
        reversals=0, reversing=reversing, range_percent=100.0,
    )  # fmt: skip
    return {"mode": mode, "run": state}


def snapshots(poses: Floats, side: Side = "right", from_s: float = 0.0, **state: Any) -> Iterator[Snapshot]:
    """Yield ten snapshots a second of the motion."""
    for n, motors in enumerate(motor_angles_deg(poses[::_SNAPSHOT_EACH], side)):
        axes = [
            AxisState(
                motor=motor, setpoint_deg=None, measured_deg=angle, speed_deg_s=0.0, torque_nm=0.0, torque="off", age_ms=0.0
            )
            for motor, angle in enumerate(motors.tolist(), start=1)
        ]  # fmt: skip
        yield snapshot(t_ns=int((from_s + n / 10) * 1e9), axes=tuple(axes), **state)


def after(live: LiveRhythm, poses: Floats, side: Side = "right", **state: Any) -> RhythmLive | None:
    for each in snapshots(poses, side, **state):
        live.take(each, side)
    return live.live()


_FIRST: Final = """
import sys
import numpy as np
from kata.motion.linkage import motor_angles_deg
from kata.motion.scapula_fit import coefficients
from kata.station import live_rhythm
from tests.support.rhythm_motions import abduction, wave

elevation = wave(12.0, 95.0, 10.0)
motors = motor_angles_deg(abduction(elevation, elevation / 5)[::10], "right")
{prepare}
before, misses = set(sys.modules), coefficients.cache_info().misses
live_rhythm._rhythm(np.column_stack([np.arange(len(motors)) / 10, motors]), "right")
print(sorted(set(sys.modules) - before), coefficients.cache_info().misses - misses)
"""
"""What the first take of a service imports and fits."""


@pytest.mark.parametrize(("prepare", "found"), [("live_rhythm.prepare()", "[] 0"), ("", " 1")])
def test_prepared_rhythm_imports_and_fits_nothing_while_an_arm_moves(prepare: str, found: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _FIRST.format(prepare=prepare)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip().endswith(found)


def ratios(found: RhythmLive) -> dict[str, list[float | None]]:
    return {curve.direction: [band.ratio for band in curve.bands] for curve in found.curves}


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("ratio", [1.5, 2.5, 4.0])
def test_live_ratio_is_within_a_fifth_of_the_truth(side: Side, ratio: float) -> None:
    top_deg = min(95.0, 12.0 + 19.0 * (1 + ratio))
    found = after(LiveRhythm(), evenly(wave(12.0, top_deg, 10.0), ratio), side, **teaching())
    assert found is not None
    assert {curve.of for curve in found.curves} == {"taught"}
    for of_direction in ratios(found).values():
        assert of_direction[0] == pytest.approx(ratio, abs=0.2)
        assert all(one is None or abs(one - ratio) < 0.2 for one in of_direction)


def test_curve_and_start_are_those_of_the_motion() -> None:
    scapula = (ELEVATION - 12.0) / 5 + 3.0
    found = after(LiveRhythm(), abduction(ELEVATION, scapula), **run())
    assert found is not None
    assert (found.motion_id, found.start_elevation_deg, found.start_scapula_deg) == ("run", 12.0, 3.0)
    for curve in found.curves:
        assert curve.of == "played"
        expected = (np.array(curve.elevation_deg) - 12.0) / 5 + 3.0
        assert curve.scapula_deg == pytest.approx(expected.tolist(), abs=0.05)


def test_arm_that_is_not_moved_forwards_is_left_out() -> None:
    live = LiveRhythm()
    shrugged = abduction(ELEVATION, (ELEVATION - 12.0) / 5 + 8.0)
    assert after(live, shrugged, **run("approaching")) is None
    assert after(live, shrugged, **run(reversing=True)) is None
    found = after(live, abduction(ELEVATION, (ELEVATION - 12.0) / 5), **run())
    assert found is not None and found.start_scapula_deg == 0.0


def test_next_take_begins_a_curve_and_the_last_stays() -> None:
    live = LiveRhythm()
    first = after(live, evenly(ELEVATION, 4.0), **teaching())
    assert first is not None and first.curves
    assert after(live, evenly(ELEVATION, 4.0)[:20], **teaching(recording=False)) == first
    second = after(live, evenly(ELEVATION, 4.0)[:100], from_s=20.0, **teaching(takes=2))
    assert second is not None and second.motion_id != first.motion_id and second.curves == []
    assert after(live, evenly(ELEVATION, 4.0)[:20]) is None


def test_drive_without_an_angle_adds_nothing() -> None:
    live = LiveRhythm()
    for each in snapshots(evenly(ELEVATION, 4.0), **teaching()):
        unknown = AxisState(
            motor=5, setpoint_deg=None, measured_deg=None, speed_deg_s=0.0, torque_nm=0.0, torque="off", age_ms=None
        )  # fmt: skip
        live.take(snapshot(t_ns=each.t_ns, axes=(*each.axes[:4], unknown), **teaching()), "right")
    assert live.live() is None


def test_only_the_last_two_minutes_are_calculated() -> None:
    live = LiveRhythm()
    after(live, evenly(wave(12.0, 95.0, 10.0, times=2), 4.0), **run())
    found = after(live, evenly(wave(12.0, 95.0, 10.0, times=13), 5.0), from_s=20.1, **run())
    assert found is not None
    assert max(curve.passes for curve in found.curves) <= 12
    assert ratios(found)["raising"][:2] == pytest.approx([5.0, 5.0], abs=0.2)


def test_an_error_of_its_figures_ends_no_control(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: LiveRhythm, snapshot: Snapshot, side: Side) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr(LiveRhythm, "take", fail)
    tracker = SnapshotTracker()
    newest = snapshot(t_ns=1, **teaching())
    tracker.take(newest, "right")
    assert tracker.snapshot is newest
    assert tracker.age_ms is not None
