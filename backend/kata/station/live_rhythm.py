"""Calculates the scapulohumeral rhythm of the present take or playback from the device's snapshots, for the station page."""

from collections import deque
from collections.abc import Iterable
from typing import Final

import numpy as np

from kata.device.ipc_messages import Snapshot
from kata.motion.axes import CANONICAL_SIDE, N_AXES, Side
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.rhythm import MotionRhythm, rhythm_of_poses
from kata.motion.scapula_fit import scapula_of
from kata.station.rhythm_schemas import CurveOf, RhythmLive, curve_of, rounded

_PERIOD_NS: Final = 1_000_000_000
"""Time between two calculations, because each takes up to 7 ms."""
_MOST_ROWS: Final = 1200
"""Two minutes at 10 Hz. Older snapshots are dropped, so that the time of a calculation is bounded."""


def prepare() -> None:
    """Calculate a rhythm, so that the fit of the scapula and NumPy's modules are there when an arm moves.

    The first calculation takes a tenth of a second of a fast processor. Meanwhile the service would not confirm to the device that it runs.
    """
    lifted = np.concatenate([np.linspace(0.0, 90.0, 100), np.linspace(90.0, 0.0, 100)])
    poses = np.column_stack([np.zeros_like(lifted), lifted / 6, lifted, np.zeros((len(lifted), 2))])
    _rhythm(np.column_stack([np.arange(len(lifted)) / 10, motor_angles_deg(poses)]), CANONICAL_SIDE)


class LiveRhythm:
    """The rhythm of the newest take, or of the newest playback. It is kept until the teaching or the run ends."""

    def __init__(self) -> None:
        self._motion_id: str | None = None
        self._of: CurveOf = "taught"
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_MOST_ROWS)
        """Time in seconds and the five motor angles of each snapshot."""
        self._start_deg: tuple[float, float] | None = None
        """Elevation and upward rotation at the start of the motion."""
        self._calculated_ns = 0
        self._live: RhythmLive | None = None

    def take(self, snapshot: Snapshot, side: Side) -> None:
        """Add a snapshot of a take or a playback. A snapshot in which a drive has no angle does not count."""
        motion_id = _motion_of(snapshot)
        if motion_id != self._motion_id:
            self._begin(motion_id, "taught" if snapshot.teaching else "played")
        angles = [axis.measured_deg for axis in snapshot.axes if axis.measured_deg is not None]
        if motion_id is None or not _moves(snapshot) or len(angles) < N_AXES:
            return
        self._rows.append((snapshot.t_ns / 1e9, *angles))
        if self._start_deg is None:
            self._start_deg = _rhythm(self._rows, side).start_deg
        if snapshot.t_ns - self._calculated_ns >= _PERIOD_NS:
            self._calculated_ns = snapshot.t_ns
            self._live = RhythmLive(
                motion_id=motion_id,
                start_elevation_deg=rounded(self._start_deg[0]),
                start_scapula_deg=rounded(self._start_deg[1]),
                curves=[curve_of(self._of, one) for one in _rhythm(self._rows, side).rhythms],
            )

    def live(self) -> RhythmLive | None:
        """Return the response model; None before the first sample of a take or playback."""
        return self._live

    def _begin(self, motion_id: str | None, of: CurveOf) -> None:
        self._motion_id, self._of = motion_id, of
        self._rows.clear()
        self._start_deg = self._live = None


def _rhythm(snapshots: Iterable[tuple[float, ...]] | Floats, side: Side) -> MotionRhythm:
    rows = np.array(list(snapshots))
    # The fit of the scapula differs from the linkage by less than 0.01 deg and needs no root finder.
    scapula = scapula_of(rows[:, 1:3], side)
    return rhythm_of_poses(rows[:, 0], np.column_stack([scapula.phi_deg, scapula.psi_deg, rows[:, 3:]]))


def _motion_of(snapshot: Snapshot) -> str | None:
    """Return a name of the present take or run, which another take or run does not have; None without one."""
    if snapshot.teaching:
        return f"{snapshot.teaching.teaching_id}/{snapshot.teaching.takes}"
    return snapshot.run.run_id if snapshot.run else None


def _moves(snapshot: Snapshot) -> bool:
    """Return True while a take is recorded, or the arm moves forwards along the recording."""
    if snapshot.teaching:
        return snapshot.teaching.recording
    return snapshot.mode == "playing" and snapshot.run is not None and not snapshot.run.reversing
