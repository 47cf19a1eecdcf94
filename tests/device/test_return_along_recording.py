"""The return along the recording is as slow as any other return, and does not repeat what was played."""

from pathlib import Path

import numpy as np

from kata.device.ipc_messages import Approach, Pause, Play, Refusal, Return
from kata.device.references import build
from kata.motion.linkage import Floats
from tests.device.test_return_way import CONFIG, Motion, around_a_corner
from tests.support.stepped import Stepped

_AROUND_A_CORNER_SEED = 2


def _motion(repetitions: int) -> Motion:
    """Return a motion that ends where the straight way back leaves the limits. Each repetition after the first goes back and out again."""
    motion = around_a_corner(np.random.default_rng(_AROUND_A_CORNER_SEED))
    assert motion is not None
    out = motion.poses_deg
    return motion._replace(poses_deg=[*out, *(out[-2::-1] + out[1:]) * (repetitions - 1)])


def _forward_to(station: Stepped, mode: str, within_s: float) -> None:
    for _ in range(round(within_s)):
        station.link.journals[-1].write()
        for _ in range(100):
            if station.mode == mode:
                return
            station.cycle()
    assert station.mode == mode, station.causes()


def _returned(folder: Path, motion: Motion, paused_before_end_s: float) -> Floats:
    """Play, pause shortly before the end, and return. Return the setpoints of the return, ``(n, 5)``."""
    load = motion.load()
    reference = build(load, CONFIG)
    assert not isinstance(reference, Refusal)
    station = Stepped(folder, CONFIG)
    station.apparatus.angles_deg = motion.here_deg.tolist()
    station.forward(0.1)
    assert station.send(load, reference.trajectory) is None
    assert station.send(Approach()) is None
    _forward_to(station, "paused", 60.0)
    assert station.send(Play()) is None
    for n in range(round(100 * (reference.trajectory.duration_s - paused_before_end_s))):
        station.cycle()
        if n % 1000 == 0:
            station.link.journals[-1].write()
    assert station.send(Pause()) is None
    _forward_to(station, "paused", 5.0)
    before = len(station.apparatus.written)
    assert station.send(Return()) is None
    _forward_to(station, "idle", 300.0)
    return np.array(station.apparatus.written[before - 1 :])


def test_return_along_recording_keeps_approach_speed(tmp_path: Path) -> None:
    setpoints_deg = _returned(tmp_path, _motion(1), 0.4)
    # Over 0.2 s, because the feed-forward changes within some setpoints where the arm starts and turns.
    fastest_deg_s = float(np.abs(setpoints_deg[20:] - setpoints_deg[:-20]).max()) / 0.2
    assert fastest_deg_s < 1.05 * CONFIG.approach_speed_deg_s


def test_return_along_recording_repeats_no_repetition(tmp_path: Path) -> None:
    motion = _motion(2)
    setpoints_deg = _returned(tmp_path, motion, 0.4)
    travelled_deg = float(np.abs(np.diff(setpoints_deg, axis=0)).max(axis=1).sum())
    once = np.array([motion.here_deg, *_motion(1).poses_deg])
    once_deg = float(np.abs(np.diff(once, axis=0)).max(axis=1).sum())
    assert travelled_deg < 1.2 * once_deg
