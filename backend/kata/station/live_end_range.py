"""Counts the end-range time of the loaded run from the device's snapshots, for the station page."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from kata.device.ipc_messages import Snapshot
from kata.messages import Text
from kata.motion.end_range import EndRangeCounter
from kata.station.schemas import EndRangeLive, TextKey

_PART_NS: Final = 1_000_000_000
"""Snapshots of this time are counted together, because each call costs 2 ms."""


@dataclass(frozen=True)
class PrescribedEndRange:
    """The end-range time that a programme prescribes for the loaded run."""

    motion: int
    name: Text
    motor: int
    seconds: float
    band_deg: float
    torque_nm: float
    problem: Text | None = None
    """The reason why the torque cannot be reached at the run's resistance level; None if it can."""


@dataclass
class LiveEndRange:
    """The end-range time of one run so far. The count of the run's journal replaces it after the run."""

    prescribed: PrescribedEndRange
    counter: EndRangeCounter
    _waiting: list[Snapshot] = field(default_factory=list)
    _counted_s: float | None = field(init=False)

    def __post_init__(self) -> None:
        """Set the count to 0, or to None if the station's load is not identified."""
        self._counted_s = self.counter.times_s().get(self.prescribed.motor)

    def take(self, snapshot: Snapshot) -> None:
        """Count a snapshot of the run. A snapshot in which a drive has no angle does not count."""
        if all(axis.measured_deg is not None for axis in snapshot.axes):
            self._waiting.append(snapshot)
        if self._waiting and snapshot.t_ns - self._waiting[0].t_ns >= _PART_NS:
            self.counter.add(
                np.array([waiting.t_ns for waiting in self._waiting]) / 1e9,
                np.array([[axis.measured_deg for axis in waiting.axes] for waiting in self._waiting], dtype=np.float64),
                np.array([[axis.torque_nm for axis in waiting.axes] for waiting in self._waiting]),
            )
            self._waiting.clear()
            self._counted_s = self.counter.times_s().get(self.prescribed.motor)

    def live(self) -> EndRangeLive:
        """Return the response model."""
        prescribed = self.prescribed
        return EndRangeLive(
            motion=prescribed.motion,
            name=prescribed.name,
            name_key=TextKey.of(prescribed.name),
            counted_s=self._counted_s,
            prescribed_s=prescribed.seconds,
            band_deg=prescribed.band_deg,
            torque_nm=prescribed.torque_nm,
            problem=prescribed.problem,
            problem_key=TextKey.of(prescribed.problem),
        )
