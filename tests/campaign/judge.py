"""Safety rules, checked against what the simulated drives accepted and measured.

The checks do not use the control program's own state, with exceptions that are named where they occur: the torque in the newest snapshot
(compared with the drives), the answer to a push, and whether a Stop has ended the activity.
"""

import math
import struct
from collections import deque
from dataclasses import dataclass, field
from typing import Final

from kata.device.config import NO_REGISTER, StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS, Guarded, Load, Snapshot
from kata.motion.method import rate_hz
from kata.simulator.fault_injector import FaultKind
from kata.testing.world import RecordingWorld, Seen
from tests.support.drive_registers import expected_registers

COMMAND_LIFE_NS: Final = 2_000_000_000
"""A command expires this long after its button was pressed."""
_START_CYCLES: Final = 3
_START_NS: Final = 30_000_000
"""Torque switches on within this many cycles and within this time after an accepted approach, or not at all. A fast station needs more than one
cycle for its requests.
"""
_SETTLED_CYCLES: Final = 8
"""A reboot is found by the status of each drive, which is read every fifth cycle, and one may be replaced by another read."""
_SWITCH_S: Final = 0.1
"""The drives' report of their torque is valid 50 ms after each switching, with the next status."""
_ROTATION_NS: Final = 2_300_000_000
"""Every configured register is read within 2 s; then torque must switch off."""
_ROTATED: Final = frozenset({36, 38, 48, 100, 108})
"""PWM limit, current limit, position limits, goal PWM and profile of a Dynamixel drive: configured registers that its status block does not
hold."""
_SETTINGS_BYTES: Final = {"dynamixel": 116, "modbus": 18}
"""Length of the registers from 0 on that contain every configured register."""
_WEAKENED: Final = [
    (36, struct.pack("<H", 100)),
    (38, struct.pack("<H", 100)),
    (100, struct.pack("<H", 100)),
    (108, struct.pack("<II", 0, 20)),
]
"""PWM limit, current limit, goal PWM and profile as another program may have left them: 11 % of the voltage, 0.27 A and 27 deg/s."""
_STOP_S: Final = 1.0
"""A controlled stop ramps down within 0.4 s; the ramp's limit applies to a slow arm."""
_ANSWER_S: Final = 1.4
"""A push above the level has ended or was answered by then: 0.1 s for its detection, and 1 s for a reversal."""
_OVER_LEVEL: Final = 1.15
"""Tolerance for the noise and steps of a drive's current."""
_STEP_TOLERANCE_DEG: Final = 1.2
_FIRST_GOAL_DEG: Final = 4.0
"""Distance of a start's first goal from the shaft: play, the yield of an arm in motion, and a cycle of a hand's movement."""
_LIMIT_TOLERANCE_DEG: Final = 0.5
"""A setpoint that yields to the patient's push may go back to where the arm was some cycles ago, and the arm comes in meanwhile."""
_KNOWN_CYCLES: Final = 3
"""An angle is measured in one cycle, answered to in the next, and sent with the one after it where function 23 carries the goals."""
_FALSE_ANGLES: Final[tuple[FaultKind, ...]] = ("frozen", "garbage", "exchanged_id")
"""Faults with which a drive answers with another angle than its shaft's."""
_POSE_TOLERANCE_DEG: Final = 1.0
_ERROR_CYCLES: Final = 4
"""A hardware error counts in the cycle that first receives it. A lost answer costs a cycle, and a started cycle may still end."""
_PEDAL_S: Final = 0.2
"""A pressed pedal is known by then: it is debounced for 20 ms, and two cycles of a slow station take 100 ms."""
_OUT_DEG: Final = 3.0
"""A way out that is longer than this counts. A turn, a shaft's play and a yielding setpoint are shorter."""
_EXPIRES_NS: Final = 601_000_000_000
"""A loaded recording expires ten minutes after the last command."""
_AT_REST: Final = frozenset({"offline", "idle", "stopped"})
_OWN_FAULTS: Final = frozenset(
    {"setpoint_step", "setpoint_limit", "setpoint_acceleration", "setpoint_frozen", "unexpected_error"}
)
"""Faults of the control program itself; each is a defect."""


_SHOWN_S: Final = 0.2
"""Part of a recording that may pass between two snapshots."""


@dataclass(frozen=True)
class Start:
    """An approach that the device accepted."""

    accepted_ns: int
    pressed_ns: int
    stopped_ns: int
    """Arrival of the last Stop before its acceptance."""


@dataclass
class _Motor:
    """Knowledge of one drive from the bus."""

    torque_since_ns: int | None = None
    goal: tuple[int, float] | None = None
    outside_deg: float | None = None
    """Distance beyond the patient's limits of the innermost goal since torque switched on."""
    recent_angles_deg: deque[float] = field(default_factory=lambda: deque(maxlen=_KNOWN_CYCLES))
    """Angles of the shaft in the last cycles."""
    over_since_ns: int | None = None
    answered: object = None
    wrong_since_ns: int | None = None
    energised_at_loss: bool = False
    """It had torque when the port was lost, and the arm has not been released since."""
    had_torque: bool = False
    """It had torque after the last cycle."""
    named: bool = False
    """The stop says that it has torque although it was switched off."""
    powerless: bool = False
    """Its torque was lost: power, reboot, exchange or a hardware error."""


@dataclass
class _Test:
    """The goals of a loaded end-feel test."""

    load: Load
    innermost_deg: float = math.inf
    """Least goal of the present way, outward counted positive."""
    farthest_deg: float = -math.inf
    ways_out: int = 0
    out: bool = False
    """True on a way out."""
    ended_at_deg: float | None = None
    """Least goal since the patient has ended the test."""
    weighed: bool = False
    """True if a stretch has passed the part in which the arm is weighed, on its present way out."""


@dataclass
class Judge:
    """Raises AssertionError when a safety rule is broken. Call :meth:`check` after every cycle."""

    world: RecordingWorld
    config: StationConfig
    last_stop_ns: int = -1
    """Arrival of the last Stop at the device."""
    last_pause_ns: int = -1
    """Time of the cycle that executed or refused the last Pause."""
    begun_ns: int = -1
    """Time of the last accepted load or teaching."""
    loaded_ns: int = -1
    """Time of the cycle that accepted the last load."""
    start: Start | None = None
    released: bool = False
    """The emergency stop is or was pressed, or the torque was released by command, since the port was lost."""
    limits_deg: tuple[tuple[float, float], ...] = ()
    """The patient's limits in the newest load."""
    pedal_since_ns: int | None = None
    """Time since which the pedal is down, while there is no fault."""
    error_since_ns: int | None = None
    """Time since which a drive has a hardware error, while every drive answers and there is no other fault."""
    _motors: list[_Motor] = field(default_factory=lambda: [_Motor() for _ in range(5)])
    _test: "_Test | None" = None
    _judged: int = 0
    _shown: int = 0
    """Number of checked snapshots of the present device process."""
    _checked_ns: int = 0
    """Time of the last check."""

    def __post_init__(self) -> None:
        self._expect()
        self._factory = [
            {address: self.world.registers(motor, address, len(data)) for address, data in expected.items()}
            for motor, expected in enumerate(self._expected, start=1)
        ]
        self._period_ns = 1_000_000_000 // self.config.cycle_hz
        self._rate_hz = self.config.rate_hz
        self._watches = self.config.protocol != "modbus" or self.config.modbus.watchdog_ms != NO_REGISTER
        """True if the drives have a bus watchdog."""

    def _expect(self) -> None:
        config = self.config.with_side_directions
        self._expected = [expected_registers(config, motor) for motor in range(1, 6)]
        self._compared: list[tuple[bytes, dict[int, str]]] = [(b"", {})] * 5
        """Contents of each drive's settings at the last comparison, and its result."""

    # -- people and faults -------------------------------------------------------------------------------------------

    def device_started(self) -> None:
        """Start with the snapshots of a new device process."""
        self._shown = 0

    def turned(self) -> None:
        """Note that the apparatus was turned for the other shoulder. The positions in the drives' registers change."""
        self.config = self.world.config
        self._expect()

    def port_lost(self, *, pressed: bool) -> None:
        """Note that the adapter was unplugged, or the device process ended. ``pressed``: the emergency stop reads as pressed."""
        # The poll of the emergency stop between two cycles came before.
        self._check_drives()
        for known, drive in zip(self._motors, self.world.apparatus.drives, strict=True):
            known.energised_at_loss = known.energised_at_loss or drive.torque_on
        self.released = pressed

    def power_lost(self, motor: int) -> None:
        """Note that motor 1-5 has lost its torque; it may still get goals until the loss is detected."""
        self._motors[motor - 1].powerless = True

    def holds_since_loss(self, motor: int) -> bool:
        """Return True if motor 1-5 had torque when the port was lost, and the arm has not been released since."""
        return self._motors[motor - 1].energised_at_loss

    def accepted(self, command: Guarded, pressed_ns: int) -> None:
        """Note a command that can start motion or release an arm. A Pause ends it as a Stop does, also a Pause that was refused."""
        name = type(command).__name__
        assert pressed_ns >= self.last_pause_ns, f"{name} from before a Pause was accepted"
        assert pressed_ns >= self.loaded_ns, f"{name} from before a load was accepted"

    def reversed(self, t_ns: int) -> None:
        """Note a reversal by resistance. It ends earlier commands as a Pause does."""
        self.last_pause_ns = max(self.last_pause_ns, t_ns)

    def suspended(self, seconds: float) -> None:
        """Note that the computer is suspended for longer than a motion may be late. It ends earlier commands as a Stop does."""
        self.last_pause_ns = max(self.last_pause_ns, self.world.t_ns)

    def loaded_for(self, waited_ns: int) -> None:
        """Note an accepted approach. ``waited_ns``: real time since the command before it, suspensions of the computer included."""
        assert waited_ns <= _EXPIRES_NS, f"a recording was started {waited_ns / 1e9:.0f} s after the last command"

    def loaded(self, load: Load) -> None:
        """Note an accepted load."""
        assert load.side == self.config.side, f"a motion of the {load.side} shoulder was accepted"
        self.limits_deg = load.limits_deg
        self._rate_hz = rate_hz(load.method, self.config.rate_hz)
        self._test = _Test(load) if load.end_feel else None
        for known in self._motors:
            known.outside_deg = None

    @property
    def test_goes_back(self) -> bool:
        """True if an end-feel test is on a way back."""
        return self._test is not None and self._test.ways_out > 0 and not self._test.out

    # -- after each cycle -----------------------------------------------------------------------------------------------

    def check(self, snapshots: list[Snapshot]) -> None:
        """Check everything since the last call."""
        self._check_drives()
        for snapshot in snapshots[self._shown :]:
            self._torque_shown(snapshot)
            self._torque_remains(snapshot)
            self._own_faults(snapshot)
        self._shown = len(snapshots)
        newest = snapshots[-1]
        self._check_stop_ends_activity(newest)
        self._hardware_error()
        self._end_feel(newest)
        for n, angle_deg in enumerate(self.world.angles_deg):
            self._motors[n].recent_angles_deg.append(angle_deg)
            self._motors[n].had_torque = self.world.apparatus.drives[n].torque_on
            self._registers(n)
            self._resistance(n, newest)
        self._angles(newest)
        self._checked_ns = self.world.t_ns

    def _check_drives(self) -> None:
        started: list[int] = []
        for seen in self.world.seen[self._judged :]:
            known = self._motors[seen.motor - 1]
            if seen.what == "goal":
                self._goal(seen, known)
            elif seen.value:
                self._torque_on(seen, known)
                started.append(seen.motor)
            else:
                self._torque_off(seen, known)
        self._judged = len(self.world.seen)
        for motor in started:
            self._starts_where_it_is(motor)

    def _starts_where_it_is(self, motor: int) -> None:
        """With torque, a drive turns to the goal that it has, also to one of an earlier run."""
        drive = self.world.apparatus.drives[motor - 1]
        if drive.torque_on and not any(self.world.faults.has(kind, motor) for kind in _FALSE_ANGLES):
            away_deg = abs(math.degrees(drive.goal - drive.angle))
            assert away_deg <= _FIRST_GOAL_DEG, f"motor {motor} got torque with a goal {away_deg:.1f} deg away"

    def _torque_on(self, seen: Seen, known: _Motor) -> None:
        start = self.start
        assert start is not None, f"motor {seen.motor} got torque without a start"
        late_ns = seen.t_ns - start.accepted_ns
        assert late_ns < max(_START_CYCLES * self._period_ns, _START_NS), (
            f"motor {seen.motor} got torque without a new start"
        )
        assert start.pressed_ns > start.stopped_ns, f"motor {seen.motor} got torque by a command from before the Stop"
        age_ns = start.accepted_ns - start.pressed_ns
        assert age_ns <= COMMAND_LIFE_NS + self._period_ns, f"motor {seen.motor} got torque by an expired command"
        known.torque_since_ns = seen.t_ns
        known.powerless = False

    def _torque_off(self, seen: Seen, known: _Motor) -> None:
        if known.energised_at_loss:
            assert self.released or known.powerless, f"motor {seen.motor} let the arm go without a confirmation"
            known.energised_at_loss = False
        known.torque_since_ns = known.goal = known.outside_deg = None

    def _goal(self, seen: Seen, known: _Motor) -> None:
        if known.powerless:
            return
        motor, axis = seen.motor, self.config.axes[seen.motor - 1]
        assert self.start is not None, f"motor {motor} got a goal without a start"
        tolerance = self.config.limit_tolerance_deg
        assert axis.min_deg - tolerance <= seen.value <= axis.max_deg + tolerance, (
            f"motor {motor} was sent to {seen.value}"
        )
        before, known.goal = known.goal, (seen.t_ns, seen.value)
        if before is None and not any(self.world.faults.has(kind, motor) for kind in _FALSE_ANGLES):
            away_deg = abs(seen.value - self.world.angles_deg[motor - 1])
            assert away_deg <= _FIRST_GOAL_DEG, f"motor {motor} was sent {away_deg:.1f} deg away by a start"
        if before is not None:
            # The paper's method jumps to its first angle, however soon after the last goal of the held arm.
            seconds = max((seen.t_ns - before[0]) / 1e9, 1 / self._rate_hz)
            step_deg = abs(seen.value - before[1])
            allowed_deg = 1.5 * axis.max_speed_deg_s * seconds + _STEP_TOLERANCE_DEG
            assert step_deg <= allowed_deg, f"motor {motor} was sent a jump"
        if self.limits_deg:
            low, high = self.limits_deg[motor - 1]
            outside_deg = max(low - seen.value, seen.value - high, 0.0)
            # The first goal is the arm's last measured angle.
            innermost_deg = outside_deg if known.outside_deg is None else known.outside_deg
            # A goal that is not further out than the arm's last known angle does not push it outwards.
            recent_angles_deg = (*known.recent_angles_deg, self.world.angles_deg[motor - 1])
            allowed_deg = max(low - min(recent_angles_deg), max(recent_angles_deg) - high, innermost_deg)
            # A goal that stays where the last one was moves no arm, although the arm may have swung on.
            held_deg = max(low - before[1], before[1] - high) if before else 0.0
            assert outside_deg <= max(allowed_deg + _LIMIT_TOLERANCE_DEG, held_deg), (
                f"motor {motor} was moved away from its limits"
            )
            known.outside_deg = min(outside_deg, innermost_deg)

    def _registers(self, n: int) -> None:
        """A drive with torque has exactly the configured registers, except during the time to detect a difference."""
        known, drive = self._motors[n], self.world.apparatus.drives[n]
        # An arm that was held when the port was lost is held until a confirmation, independent of its registers.
        if not drive.torque_on or known.torque_since_ns is None or known.energised_at_loss:
            known.wrong_since_ns = None
            return
        wrong = self._wrong_registers(n + 1, drive.watchdog_s)
        if not wrong:
            known.wrong_since_ns = None
            return
        known.wrong_since_ns = known.wrong_since_ns or self.world.t_ns
        allowed_ns = self._seen_after_ns(wrong) + int(_STOP_S * 1e9)
        lasted_ns = self.world.t_ns - known.wrong_since_ns
        assert lasted_ns <= allowed_ns, f"motor {n + 1} has torque with {[*wrong.values()]}"

    @property
    def a_setting_differs(self) -> bool:
        """True if a drive has other registers than the configured ones, the bus watchdog excepted."""
        return any(self._differing(motor) for motor in range(1, 6))

    @property
    def a_setting_of_the_inputs_differs(self) -> bool:
        """True if the inputs' drive has other registers than the configured ones."""
        return bool(self._differing(self.config.inputs_axis + 1))

    def rotated_registers(self, motor: int) -> list[tuple[int, bytes]]:
        """Return address and another content of the configured registers that no status carries: the factory's, or one that weakens the drive.

        Registers that change the drive's measurements or its inputs are left out.
        """
        factory = [*self._factory[motor - 1].items()]
        if self.config.protocol == "modbus":
            return factory
        return [*(register for register in factory if register[0] in _ROTATED), *_WEAKENED]

    def _seen_after_ns(self, wrong: dict[int, str]) -> int:
        if self.config.protocol == "modbus" or wrong.keys() <= _ROTATED:
            return _ROTATION_NS
        return _SETTLED_CYCLES * self._period_ns + int(_SWITCH_S * 1e9)

    def _wrong_registers(self, motor: int, watchdog_s: float) -> dict[int, str]:
        """Registers by address; the watchdog is at -1."""
        found = dict(self._differing(motor))
        if (
            self._watches
            and watchdog_s * 1000 != self.config.bus_watchdog_ms
            and not self.world.apparatus.drives[motor - 1].tripped
        ):
            found[-1] = f"a watchdog of {watchdog_s} s"
        return found

    def _differing(self, motor: int) -> dict[int, str]:
        """Compare the registers. Most of the time nothing has changed since the last comparison, which then counts."""
        stored = self.world.drives[motor - 1].stored(0, _SETTINGS_BYTES[self.config.protocol])
        if self._compared[motor - 1][0] != stored:
            self._compared[motor - 1] = (stored, self._compare(motor))
        return self._compared[motor - 1][1]

    def _compare(self, motor: int) -> dict[int, str]:
        stored = self.world.drives[motor - 1].stored
        return {
            address: f"register {address} {present.hex()} for {data.hex()}"
            for address, data in self._expected[motor - 1].items()
            if (present := stored(address, len(data))) != data
        }

    def _torque_shown(self, snapshot: Snapshot) -> None:
        """Uses the snapshot's torque."""
        drives = self.world.apparatus.drives
        for axis, drive in zip(snapshot.axes, drives, strict=True):
            assert not (drive.torque_on and axis.torque == "off"), f"motor {axis.motor} has torque and is shown without"
        assert not (any(drive.torque_on for drive in drives) and snapshot.torque == "off"), (
            "torque is shown off and is on"
        )

    def _torque_remains(self, snapshot: Snapshot) -> None:
        """Uses the snapshot's causes: a drive that is said to keep its torque must have it."""
        causes = snapshot.stop.causes if snapshot.stop else ()
        named = {cause.axis for cause in causes if cause.code == "torque_remains"}
        for n, (known, drive) in enumerate(zip(self._motors, self.world.apparatus.drives, strict=True)):
            if n in named and not known.named:
                assert known.had_torque or drive.torque_on, f"motor {n + 1} is said to keep its torque, and has none"
            known.named = n in named

    def _check_stop_ends_activity(self, newest: Snapshot) -> None:
        """Uses the snapshot's mode: after a Stop nothing is loaded that an approach could begin with."""
        just_stopped = 0 <= self.last_stop_ns <= newest.t_ns <= self.last_stop_ns + self._period_ns
        if just_stopped and self.begun_ns < self.last_stop_ns:
            assert newest.mode in _AT_REST, f"after a Stop the mode is {newest.mode}"

    def _hardware_error(self) -> None:
        """With one drive in error the others release the arm."""
        if self.error_since_ns is None:
            return
        if any(drive.torque_on for drive in self.world.apparatus.drives):
            lasted_ns = self.world.t_ns - self.error_since_ns
            assert lasted_ns <= _ERROR_CYCLES * self._period_ns, "a drive's hardware error was not answered at once"
        else:
            self.error_since_ns = None

    def _own_faults(self, snapshot: Snapshot) -> None:
        """Uses the snapshot's causes."""
        causes = {cause.code for cause in snapshot.stop.causes} if snapshot.stop else set()
        assert not causes & _OWN_FAULTS, f"a fault of the control program's own: {causes & _OWN_FAULTS}"

    def _resistance(self, n: int, newest: Snapshot) -> None:
        """Uses the snapshot's level and answer; force and direction of the push come from the drive."""
        known, drive, run = self._motors[n], self.world.apparatus.drives[n], newest.run
        if run is None or not drive.torque_on or newest.stop or drive.tripped:
            known.over_since_ns = None
            return
        level_nm = run.resistance_level / RESISTANCE_LEVELS * self.config.axes[n].max_torque_nm * _OVER_LEVEL
        towards = drive.goal - drive.angle
        answered = (run.reversals, newest.mode)
        over = drive.torque_nm * towards > 0 and abs(drive.torque_nm) > level_nm
        if not over or answered != known.answered:
            known.over_since_ns, known.answered = None, answered
            return
        known.over_since_ns = known.over_since_ns or self.world.t_ns
        lasted_s = (self.world.t_ns - known.over_since_ns) / 1e9
        assert lasted_s <= _ANSWER_S, f"motor {n + 1} pushed over its level for {lasted_s:.2f} s while {newest.mode}"

    def _end_feel(self, newest: Snapshot) -> None:
        """A test goes out as often as requested, once more after each reversal, and never after the patient has ended it.

        Uses the snapshot's mode, place and reversals.
        """
        test, run = self._test, newest.run
        if test is None or run is None or run.run_id != test.load.run_id or newest.mode not in ("playing", "paused"):
            return
        asked = test.load.end_feel
        assert asked is not None
        if stretch := run.stretch:
            passed = run.position_s > asked.weighed_s[1] - _SHOWN_S
            test.weighed = passed or (test.weighed and stretch.phase != "out")
            assert test.weighed or stretch.phase != "hold", "a stretch held an arm that was not weighed"
        goal = self._motors[asked.motor - 1].goal
        if goal is None:
            return
        goal_deg = goal[1]
        held_ns = 0 if self.pedal_since_ns is None else self.world.t_ns - self.pedal_since_ns
        if held_ns > _PEDAL_S * 1e9 and run.position_s > 0.0 and test.ended_at_deg is None:
            test.ended_at_deg = goal_deg
        if test.ended_at_deg is not None:
            test.ended_at_deg = min(test.ended_at_deg, goal_deg)
            assert goal_deg <= test.ended_at_deg + _OUT_DEG, "the arm went out after the patient had ended the test"
        if test.out:
            test.farthest_deg = max(test.farthest_deg, goal_deg)
            if goal_deg < test.farthest_deg - _OUT_DEG:
                test.out, test.innermost_deg = False, goal_deg
            return
        test.innermost_deg = min(test.innermost_deg, goal_deg)
        if goal_deg > test.innermost_deg + _OUT_DEG:
            test.out, test.farthest_deg = True, goal_deg
            test.ways_out += 1
            allowed = asked.repetitions + run.reversals
            # A stretch moves in and out to hold its torque.
            assert asked.hold_s or test.ways_out <= allowed, (
                f"the arm went out {test.ways_out} times, {allowed} are allowed"
            )

    def _angles(self, newest: Snapshot) -> None:
        """Without torque and with every drive configured, the shown angles are those of the shafts."""
        at_rest = newest.mode in ("idle", "ready") or (newest.mode == "offline" and not self.a_setting_differs)
        if not at_rest or self.world.t_ns - newest.t_ns >= self._period_ns:
            return
        for axis in newest.axes:
            # Values that were not read in this cycle are shown with their age.
            if axis.measured_deg is None or axis.age_ms is None or axis.age_ms * 2e6 >= self._period_ns:
                continue
            if self.world.speaks_untruth(axis.motor):
                continue
            # The arm may have moved since the angle was read: during this cycle and, if the cycle made up for a pause, during the one before.
            made_up = axis.age_ms > 0 and newest.t_ns - axis.age_ms * 1e6 <= self._checked_ns
            passed_deg = list(self._motors[axis.motor - 1].recent_angles_deg)[-3 if made_up else -2 :]
            wrong_deg = max(min(passed_deg) - axis.measured_deg, axis.measured_deg - max(passed_deg))
            assert wrong_deg <= _POSE_TOLERANCE_DEG, (
                f"motor {axis.motor} is at {passed_deg[-1]:.1f}, shown at {axis.measured_deg:.1f}"
            )
