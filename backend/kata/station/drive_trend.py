"""Stores supply voltage and temperature of the drives over the last hours, in memory, until the service ends."""

import time
from collections import deque
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Final

from kata.device.ipc_messages import AxisState, Snapshot
from kata.station.schemas import DriveTrendPoint

INTERVAL_S: Final = 10.0
"""Time between two points."""
TREND_HOURS: Final = 3


class DriveTrend:
    """Stores one point for each interval in which a drive reported its voltage or its temperature."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._points: deque[DriveTrendPoint] = deque(maxlen=int(TREND_HOURS * 3600 / INTERVAL_S))
        self._next_s = 0.0

    def take(self, snapshot: Snapshot) -> None:
        """Store the values of a snapshot if the next point is due."""
        now_s = self._now_s()
        if now_s < self._next_s or not any(_reports(axis) for axis in snapshot.axes):
            return
        self._next_s = now_s + INTERVAL_S
        self._points.append(
            DriveTrendPoint(
                at=datetime.now(UTC),
                voltage_v=[axis.voltage_v for axis in snapshot.axes],
                temperature_c=[axis.temperature_c for axis in snapshot.axes],
            )
        )

    def points(self) -> list[DriveTrendPoint]:
        """Return the points, oldest first."""
        return list(self._points)


def _reports(axis: AxisState) -> bool:
    return axis.voltage_v is not None or axis.temperature_c is not None
