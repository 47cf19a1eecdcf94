"""What is known of the apparatus at the beginning of a cycle, gathered from this cycle's replies and earlier ones."""

import math
from dataclasses import dataclass
from typing import Final, Literal

from kata.device.bus.port import DriveReading, DriveStatus, InputReading, Reading
from kata.device.config import StationConfig

_SWITCHING_NS: Final = 50_000_000
"""A drive's word on its torque counts from this long after the torque was switched."""
_STEADY_NS: Final = 20_000_000
"""A pedal contact that bounces for less than this has not moved."""
_NOTHING: Final = Reading(drives=(None,) * 5, inputs=None, statuses=())

Contact = Literal["closed", "open", "unknown"]


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known at the beginning of a cycle. Tuples have five entries, axis order."""

    t_ns: int
    bus_ok: bool
    estop: Contact
    pedal_down: bool | None
    """None: unknown."""
    measured_deg: tuple[float, ...]
    """The newest known; NaN where a drive never answered."""
    speed_deg_s: tuple[float, ...]
    torque_nm: tuple[float, ...]
    drive_age_ms: tuple[float, ...]
    """inf where a drive never answered."""
    measured_t_ns: int | None
    """When this cycle's angles came; None unless all five did."""
    hardware_error: tuple[int, ...]
    watchdog_tripped: tuple[bool, ...]
    torque_reported: tuple[bool | None, ...]
    """What each drive last said of its torque; None while that may be older than the last switching."""
    torque_on: bool
    """What was last commanded."""
    setpoint_deg: tuple[float, ...]
    following_ms: tuple[float, ...]
    """How long each axis has been further from its setpoint than allowed."""
    service_age_ms: float
    late_ms: float
    journal_ok: bool


class Observer:
    """Keeps the newest reply of everybody, and says how old it is."""

    def __init__(self, config: StationConfig) -> None:
        self._config = config
        axes = len(config.axes)
        self._drives: list[DriveReading | None] = [None] * axes
        self._status: list[DriveStatus | None] = [None] * axes
        self._following_since_ns: list[int | None] = [None] * axes
        self._inputs: InputReading | None = None
        self._pedal_down: bool | None = None
        self._pedal_changed_ns: int | None = None
        self._torque_on = False
        self._torque_switched_ns = 0
        self._setpoint = (math.nan,) * axes

    def commanded(self, t_ns: int, torque_on: bool, setpoint_deg: tuple[float, ...]) -> None:
        """Remember what the drives were told in this cycle."""
        if torque_on != self._torque_on:
            self._torque_on = torque_on
            self._torque_switched_ns = t_ns
        self._setpoint = setpoint_deg

    def facts(
        self, t_ns: int, reading: Reading | None, *, service_age_ms: float, late_ms: float, journal_ok: bool
    ) -> Facts:
        """Take in this cycle's replies (None: the bus is not there) and tell what is known at ``t_ns``."""
        replies = reading or _NOTHING
        for n, drive in enumerate(replies.drives):
            self._drives[n] = drive or self._drives[n]
        for status in replies.statuses:
            self._status[status.axis] = status
        if replies.inputs:
            self._inputs = replies.inputs
            self._settle_pedal(replies.inputs)
        inputs = self._inputs
        inputs_known = inputs is not None and _age_ms(t_ns, inputs.t_ns) <= self._config.silence_ms
        answered = [drive.t_ns for drive in replies.drives if drive]
        return Facts(
            t_ns=t_ns,
            bus_ok=reading is not None,
            estop="unknown" if not inputs_known or inputs is None else "open" if inputs.estop_open else "closed",
            pedal_down=self._pedal_down if inputs_known else None,
            measured_deg=tuple(drive.position_deg if drive else math.nan for drive in self._drives),
            speed_deg_s=tuple(drive.speed_deg_s if drive else 0.0 for drive in self._drives),
            torque_nm=tuple(drive.torque_nm if drive else 0.0 for drive in self._drives),
            drive_age_ms=tuple(_age_ms(t_ns, drive.t_ns) if drive else math.inf for drive in self._drives),
            measured_t_ns=max(answered) if len(answered) == len(self._drives) else None,
            hardware_error=tuple(status.hardware_error if status else 0 for status in self._status),
            watchdog_tripped=tuple(bool(status and status.watchdog_tripped) for status in self._status),
            torque_reported=tuple(self._torque_reported(status) for status in self._status),
            torque_on=self._torque_on,
            setpoint_deg=self._setpoint,
            following_ms=tuple(self._following_ms(n, t_ns) for n in range(len(self._drives))),
            service_age_ms=service_age_ms,
            late_ms=late_ms,
            journal_ok=journal_ok,
        )

    def _settle_pedal(self, inputs: InputReading) -> None:
        if inputs.pedal_down == self._pedal_down:
            self._pedal_changed_ns = None
        elif self._pedal_down is None or (
            self._pedal_changed_ns is not None and inputs.t_ns - self._pedal_changed_ns >= _STEADY_NS
        ):
            self._pedal_down = inputs.pedal_down
            self._pedal_changed_ns = None
        elif self._pedal_changed_ns is None:
            self._pedal_changed_ns = inputs.t_ns

    def _torque_reported(self, status: DriveStatus | None) -> bool | None:
        if status is None or status.t_ns < self._torque_switched_ns + _SWITCHING_NS:
            return None
        return status.torque_on

    def _following_ms(self, axis: int, t_ns: int) -> float:
        drive = self._drives[axis]
        error = abs(self._setpoint[axis] - drive.position_deg) if drive else 0.0
        if not self._torque_on or error <= self._config.following_error_deg:
            self._following_since_ns[axis] = None
            return 0.0
        since = self._following_since_ns[axis]
        if since is None:
            self._following_since_ns[axis] = since = t_ns
        return _age_ms(t_ns, since)


def _age_ms(t_ns: int, then_ns: int) -> float:
    """A cycle's time is its deadline; what was answered within it is a little younger than that, so of age 0."""
    return max(0, t_ns - then_ns) / 1e6
