"""The state of the apparatus at the beginning of a cycle, built from this cycle's sample and earlier samples."""

import math
from typing import Final, Literal

from msgspec import Struct, structs

from kata.device.bus.interface import BusSample, DriveSample, DriveStatus, InputSample
from kata.device.config import Axis, StationConfig
from kata.device.config_rules import OVERTORQUE_FACTOR
from kata.device.ipc_messages import TorqueState

_TORQUE_SETTLING_NS: Final = 50_000_000
"""A drive's torque report counts only if it arrives at least this long after the last torque command."""
_MAX_TORQUE_REPORT_AGE_MS: Final = 1000.0
"""Maximum age of a drive's torque report. Each drive's status is read every few cycles."""
_PEDAL_DEBOUNCE_NS: Final = 20_000_000
"""Minimum time for which a changed pedal contact must be stable before the change counts."""
_NO_SAMPLE: Final = BusSample(drives=(), inputs=None, statuses=())

Contact = Literal["closed", "open", "unknown"]
Limits = tuple[tuple[float, float], ...]
"""Lowest and highest setpoint of each axis, in degrees."""


class LoopContext(Struct, frozen=True):
    """The part of the state that the loop provides. The rest comes from the bus."""

    late_ms: float
    service_age_ms: float
    run_id_mismatches: int
    """Number of consecutive heartbeats in which the service named a run other than the active run."""
    journal_ok: bool
    limits_deg: Limits
    """The tightest of the mechanism's and the run's limits."""
    rate_hz: int
    """Setpoints a second: the run's rate, or the station's rate without a run."""
    torque_inherited: bool = False
    """True from opening the port until torque is commanded on or off. During this time a drive may still be holding an arm."""
    other_adapter: bool = False
    """True while the port cannot be opened because it belongs to another adapter than before."""


class CycleState(Struct, frozen=True):
    """The state at the beginning of a cycle. Tuples have five entries, in axis order.

    A duration starts in the first cycle in which its condition holds. One cycle without the condition resets it.
    """

    t_ns: int
    context: LoopContext
    bus_ok: bool
    complete: bool
    """True if every drive, its status and the inputs have been read since the port was opened, every register is
    verified, and no drive has torque.
    """
    estop: Contact
    contacts_disagree_ms: float
    """Time for which the two antivalent contacts of the emergency stop have reported the same state."""
    pedal_down: bool | None
    """None if unknown."""
    measured_deg: tuple[float, ...]
    """The newest known angles; NaN for a drive that has never answered."""
    speed_deg_s: tuple[float, ...]
    torque_nm: tuple[float, ...]
    drive_age_ms: tuple[float, ...]
    """Age of each drive's last answer; inf for a drive that has never answered."""
    status_age_ms: tuple[float, ...]
    """Age of the last status. Without a status: time since the port was opened. Without a port: inf."""
    corrupt: tuple[bool, ...]
    """True if at least half of the answers that failed since the drive's last valid answer were corrupt; the others timed out. One corrupt
    answer is not enough: data that a busy computer delivers late also looks corrupt, and a drive that is switched off must not be
    reported as corrupt.
    """
    measured_t_ns: int | None
    """Time at which this cycle's angles arrived; None unless all five arrived."""
    hardware_error: tuple[int, ...]
    """Error code of the newest status, or 1 if only the newest answer has the alert bit; 0 for no error."""
    watchdog_tripped: tuple[bool, ...]
    torque_reported: tuple[bool | None, ...]
    """The last torque report of each drive; None if it may be older than the last torque command."""
    torque: tuple[TorqueState, ...]
    """The torque state of each drive. It is "off" only if the drive itself has reported that."""
    unbroken: tuple[bool, ...]
    """True if the drive has answered in every cycle since its newest status. Otherwise it may have lost its settings since."""
    verified: tuple[bool, ...]
    """True if, according to the drive's newest status on this connection, every configured register has its value.
    """
    mismatch: tuple[str, ...]
    """Name of a register with a wrong value; empty if none is known."""
    settings_lost: tuple[bool, ...]
    """True from the detection of a wrong register value until the drive is verified again."""
    torque_on: bool
    """True if the last torque command was "on"."""
    setpoint_deg: tuple[float, ...]
    setpoint_cycles: int
    """Number of cycles since the setpoint was computed, not since it was sent. Cycles are counted, not time, because time
    that the loop loses is a separate fault (overrun).
    """
    following_ms: tuple[float, ...]
    """Time for which each axis has exceeded the allowed distance from its setpoint."""
    overtorque_ms: tuple[float, ...]
    """Time for which each drive has exceeded its torque limit by more than 10 %."""
    accelerating_ms: tuple[float, ...]
    """Time for which each axis has exceeded its acceleration limit."""
    jump_deg: tuple[float, ...]
    """Amount by which the movement between the last two answers exceeds the possible movement."""
    frozen_deg: tuple[float, ...]
    """Distance that the setpoint has moved while the drive reported exactly the same position."""


class _Duration:
    """Measures for each axis how long a condition has held without interruption."""

    def __init__(self, axes: int) -> None:
        self._since_ns: list[int | None] = [None] * axes

    def ms(self, axis: int, t_ns: int, holds: bool) -> float:
        """Return the duration in ms up to ``t_ns``. It is 0 in the first cycle and if the condition does not hold."""
        since_ns = self._since_ns[axis]
        if not holds:
            self._since_ns[axis] = None
            return 0.0
        if since_ns is None:
            self._since_ns[axis] = since_ns = t_ns
        return _age_ms(t_ns, since_ns)


class CycleStateBuilder:
    """Keeps the newest answer of every drive and input, and builds the state of each cycle from them."""

    def __init__(self, config: StationConfig) -> None:
        self._config = config
        axes = len(config.axes)
        self._drives: list[DriveSample | None] = [None] * axes
        self._previous_drives: list[DriveSample | None] = [None] * axes
        self._status: list[DriveStatus | None] = [None] * axes
        self._timeouts, self._corrupt = [0] * axes, [0] * axes
        self._missed_ns = [-math.inf] * axes
        """Time of the last cycle in which each drive did not answer."""
        self._following, self._overtorque, self._accelerating = _Duration(axes), _Duration(axes), _Duration(axes)
        self._frozen_since: list[float | None] = [None] * axes
        self._torque: list[TorqueState] = ["unknown"] * axes
        self._settings_lost = [False] * axes
        self._inputs: InputSample | None = None
        self._disagree_since_ns: int | None = None
        self._input_limit_ms = config.inputs.max_age_cycles * 1000 / config.cycle_hz
        self._estop_opened = False
        self._port_opened_ns = -math.inf
        """Time at which the port was opened; -inf without a port."""
        self._pedal_down: bool | None = None
        self._pedal_changed_ns: int | None = None
        self._torque_on = False
        self._torque_switched_ns = -math.inf
        self._setpoint = (math.nan,) * axes
        self._setpoint_t_ns = 0
        self._setpoint_cycles = 0

    def record_command(self, t_ns: int, torque_on: bool, setpoint_deg: tuple[float, ...], setpoint_t_ns: int) -> None:
        """Record the commands sent in this cycle and the time at which the setpoint was computed."""
        if torque_on != self._torque_on:
            self._torque_on = torque_on
            self._torque_switched_ns = t_ns
        self._setpoint_cycles = 0 if setpoint_t_ns != self._setpoint_t_ns else self._setpoint_cycles + 1
        self._setpoint, self._setpoint_t_ns = setpoint_deg, setpoint_t_ns

    def record_release(self, t_ns: int) -> None:
        """Record that drives which held an arm from before the connection are switched off in this cycle."""
        if "on" in self._torque:
            self._torque_switched_ns = t_ns

    def record_polled_inputs(self, inputs: InputSample) -> None:
        """Store the inputs of the poll between two cycles.

        An open switch also counts as open in the next cycle, because the loop has switched torque off.
        """
        self._inputs = inputs
        if inputs.estop_open:
            self._estop_opened = True
            self._torque_switched_ns = inputs.t_ns

    def build(self, t_ns: int, sample: BusSample | None, context: LoopContext) -> CycleState:
        """Add this cycle's sample (None without a port) and return the state at ``t_ns``."""
        received = sample or _NO_SAMPLE
        self._record_sample(t_ns, received, bus_ok=sample is not None)
        inputs = self._inputs
        inputs_known = inputs is not None and _age_ms(t_ns, inputs.t_ns) <= self._input_limit_ms
        self._update_torque(t_ns, bus_ok=sample is not None)
        answered = [drive.t_ns for drive in received.drives if drive]
        axes = range(len(self._drives))
        reported = tuple([self._torque_reported(status) for status in self._status])
        return CycleState(
            t_ns=t_ns,
            context=context,
            bus_ok=sample is not None,
            complete=inputs_known
            and all(self._drives)
            and all(torque is False for torque in reported)
            and all(status is not None and status.verified for status in self._status),
            estop="unknown" if not inputs_known or inputs is None else "open" if inputs.estop_open else "closed",
            contacts_disagree_ms=0.0 if self._disagree_since_ns is None else _age_ms(t_ns, self._disagree_since_ns),
            pedal_down=self._pedal_down if inputs_known else None,
            measured_deg=tuple([drive.position_deg if drive else math.nan for drive in self._drives]),
            speed_deg_s=tuple([drive.speed_deg_s if drive else 0.0 for drive in self._drives]),
            torque_nm=tuple([drive.torque_nm if drive else 0.0 for drive in self._drives]),
            drive_age_ms=tuple([_age_ms(t_ns, drive.t_ns) if drive else math.inf for drive in self._drives]),
            status_age_ms=tuple(
                [_age_ms(t_ns, status.t_ns if status else self._port_opened_ns) for status in self._status]
            ),
            corrupt=tuple(
                [0 < corrupt >= timeouts for corrupt, timeouts in zip(self._corrupt, self._timeouts, strict=True)]
            ),
            measured_t_ns=max(answered) if len(answered) == len(self._drives) else None,
            hardware_error=tuple([self._hardware_error(n) for n in axes]),
            watchdog_tripped=tuple([bool(status and status.watchdog_tripped) for status in self._status]),
            torque_reported=reported,
            torque=tuple(self._torque),
            unbroken=tuple(
                [
                    status is not None and status.t_ns > missed_ns
                    for status, missed_ns in zip(self._status, self._missed_ns, strict=True)
                ]
            ),
            verified=tuple([bool(status and status.verified) for status in self._status]),
            mismatch=tuple([status.mismatch if status else "" for status in self._status]),
            settings_lost=tuple(self._settings_lost),
            torque_on=self._torque_on,
            setpoint_deg=self._setpoint,
            setpoint_cycles=self._setpoint_cycles,
            following_ms=tuple([self._following.ms(n, t_ns, self._exceeds_following_error(n)) for n in axes]),
            overtorque_ms=tuple([self._overtorque.ms(n, t_ns, self._exceeds_torque(n)) for n in axes]),
            accelerating_ms=tuple([self._accelerating.ms(n, t_ns, self._exceeds_acceleration(n)) for n in axes]),
            jump_deg=tuple([self._jump_deg(n) for n in axes]),
            frozen_deg=tuple([self._frozen_deg(n) for n in axes]),
        )

    def _record_sample(self, t_ns: int, received: BusSample, *, bus_ok: bool) -> None:
        for n, drive in enumerate(received.drives):
            if drive:
                self._previous_drives[n], self._drives[n] = self._drives[n], drive
                self._timeouts[n] = self._corrupt[n] = 0
            else:
                self._missed_ns[n] = t_ns
                self._timeouts[n] += n in received.timed_out
                self._corrupt[n] += n in received.corrupt
        if not bus_ok:
            # A drive that answers again may have lost power, so its last status is discarded.
            self._status = [None] * len(self._status)
            self._port_opened_ns = -math.inf
        elif self._port_opened_ns == -math.inf:
            self._port_opened_ns = t_ns
        for status in received.statuses:
            self._status[status.axis] = status
            self._settings_lost[status.axis] = bool(status.mismatch) or (
                self._settings_lost[status.axis] and not status.verified
            )
        if received.inputs:
            self._note_contacts(received.inputs)
            estop_opened, self._estop_opened = self._estop_opened, False
            self._inputs = structs.replace(received.inputs, estop_open=True) if estop_opened else received.inputs
            self._debounce_pedal(received.inputs)

    def _note_contacts(self, inputs: InputSample) -> None:
        if not inputs.contacts_disagree:
            self._disagree_since_ns = None
        elif self._disagree_since_ns is None:
            self._disagree_since_ns = inputs.t_ns

    def _debounce_pedal(self, inputs: InputSample) -> None:
        if inputs.pedal_down is None:
            self._pedal_down = self._pedal_changed_ns = None
        elif inputs.pedal_down == self._pedal_down:
            self._pedal_changed_ns = None
        elif self._pedal_down is None or (
            self._pedal_changed_ns is not None and inputs.t_ns - self._pedal_changed_ns >= _PEDAL_DEBOUNCE_NS
        ):
            self._pedal_down = inputs.pedal_down
            self._pedal_changed_ns = None
        elif self._pedal_changed_ns is None:
            self._pedal_changed_ns = inputs.t_ns

    def _torque_reported(self, status: DriveStatus | None) -> bool | None:
        if status is None or status.t_ns < self._torque_switched_ns + _TORQUE_SETTLING_NS:
            return None
        return status.torque_on

    def _update_torque(self, t_ns: int, *, bus_ok: bool) -> None:
        """Update the torque states. A drive counts as "on" from the command until it reports no torque. Without a recent report
        its state is "unknown".
        """
        for n, status in enumerate(self._status):
            reported = self._torque_reported(status)
            recent = status is not None and _age_ms(t_ns, status.t_ns) <= _MAX_TORQUE_REPORT_AGE_MS
            if self._torque_on and bus_ok:
                self._torque[n] = "on"
            elif not (bus_ok and recent):
                self._torque[n] = "unknown"
            elif reported is not None:
                self._torque[n] = "on" if reported else "off"

    def _hardware_error(self, n: int) -> int:
        status, drive = self._status[n], self._drives[n]
        return (status.hardware_error if status else 0) or int(drive is not None and drive.alert)

    # -- conditions of one axis over several cycles -----------------------------------------------------------------

    def _exceeds_following_error(self, n: int) -> bool:
        drive = self._drives[n]
        allowed_deg = self._config.following_error_deg
        return drive is not None and self._torque_on and abs(self._setpoint[n] - drive.position_deg) > allowed_deg

    def _exceeds_torque(self, n: int) -> bool:
        drive = self._drives[n]
        return drive is not None and abs(drive.torque_nm) > self._axis(n).max_torque_nm * OVERTORQUE_FACTOR

    def _exceeds_acceleration(self, n: int) -> bool:
        previous, now = self._previous_drives[n], self._drives[n]
        if previous is None or now is None or now.t_ns <= previous.t_ns:
            return False
        change_deg_s2 = abs(now.speed_deg_s - previous.speed_deg_s) / ((now.t_ns - previous.t_ns) / 1e9)
        return change_deg_s2 > self._axis(n).max_acceleration_deg_s2

    def _jump_deg(self, n: int) -> float:
        previous, now = self._previous_drives[n], self._drives[n]
        if previous is None or now is None:
            return 0.0
        possible = 2 * self._axis(n).max_speed_deg_s * (now.t_ns - previous.t_ns) / 1e9
        return max(0.0, abs(now.position_deg - previous.position_deg) - possible)

    def _frozen_deg(self, n: int) -> float:
        previous, now = self._previous_drives[n], self._drives[n]
        if previous is None or now is None or not self._torque_on or now.position_deg != previous.position_deg:
            self._frozen_since[n] = None
            return 0.0
        began_at = self._frozen_since[n]
        if began_at is None:
            self._frozen_since[n] = began_at = self._setpoint[n]
        return abs(self._setpoint[n] - began_at)

    def _axis(self, n: int) -> Axis:
        return self._config.axes[n]


def _age_ms(t_ns: int, then_ns: float) -> float:
    """Return the age in milliseconds. A cycle's time is its deadline. Answers that arrive within the cycle are later than the
    deadline and have age 0.
    """
    return max(0, t_ns - then_ns) / 1e6
