"""Base of the state machine: its modes and transitions, its state (mode, torque, run, teaching), and the steps of approach and return."""

import logging
from collections.abc import Callable
from datetime import UTC, datetime
from itertools import count
from typing import Final

import msgspec
import numpy as np

from kata.device import journal, texts
from kata.device.approach_and_return import (
    approach_path,
    return_path_via_start,
    reverse_along_recording,
    straight_return_path,
)
from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState, Limits
from kata.device.faults import MAX_OVERRUN_MS, FaultKey
from kata.device.ipc_messages import Event, Mode, PedalState, RunState, TeachingState
from kata.device.journal import JournalEnd, JournalHeader, JournalWriter
from kata.device.latched_stop import LatchedStop
from kata.device.movement import Movement
from kata.device.run import Run, run_state, stretch_of
from kata.device.teaching import Teaching
from kata.messages import key_of
from kata.motion.approach import MinimumJerkMove
from kata.motion.path import Path
from kata.motion.scapula_fit import horner_coefficients

log = logging.getLogger(__name__)

TRANSITIONS: Final[dict[tuple[Mode, Mode], str]] = {
    ("offline", "idle"): "every drive and input has been seen",
    ("offline", "stopped"): "fault",
    ("idle", "teaching"): "teach",
    ("idle", "ready"): "load",
    ("idle", "stopped"): "fault",
    ("teaching", "idle"): "finish teaching",
    ("teaching", "stopped"): "stop or fault",
    ("ready", "idle"): "unload, or no command for ten minutes",
    ("ready", "approaching"): "approach: torque on",
    ("ready", "stopped"): "stop or fault",
    ("approaching", "paused"): "the start is reached",
    ("approaching", "stopped"): "stop or fault",
    ("paused", "playing"): "play",
    ("paused", "returning"): "return",
    ("paused", "stopped"): "stop or fault",
    ("playing", "paused"): "pause, or taken back from resistance",
    ("playing", "returning"): "the end is reached",
    ("playing", "stopped"): "stop, fault, or resistance in the same place",
    ("returning", "idle"): "back where it began: torque off",
    ("returning", "stopped"): "stop or fault",
    ("stopped", "idle"): "acknowledge, once every cause has cleared",
}
"""Every allowed transition between modes and its trigger. docs/reference/state-machine.md is generated from this table.
"""

_PHASES: Final[dict[Mode, int]] = {
    "approaching": journal.PHASE_APPROACHING,
    "playing": journal.PHASE_PLAYING,
    "paused": journal.PHASE_PAUSED,
    "returning": journal.PHASE_RETURNING,
    "stopped": journal.PHASE_STOPPING,
}


_POSE_TOLERANCE_DEG: Final = 0.1
"""Tolerance of the last pose check. A setpoint that is limited to the pose's limits may exceed them by this much where
several limits meet.
"""
UNLOAD_AFTER_MINUTES: Final = 10
"""A loaded recording is unloaded after so long without a command. Its patient may have left by then, and one press would move the arm of
another one. It is longer than placing a patient's arm takes.
"""
_STRAIGHT_RETURN_CHECK_HZ: Final = 10
"""Rate at which a return along the recording looks for a straight path to its end. One look takes about a millisecond."""
_MOTOR_4: Final = 3
"""The axis that a fault about the pose reports."""


class IllegalTransitionError(Exception):
    """A step tried a transition that is not in the table. This is a defect of the program."""


class StateMachineBase:
    """Mode, torque, stop, run and teaching of one apparatus. :class:`kata.device.state_machine.StateMachine` changes them."""

    def __init__(
        self,
        config: StationConfig,
        open_journal: Callable[[JournalHeader], JournalWriter],
        emit: Callable[[Event], None],
    ) -> None:
        self._config = config
        self._open_journal = open_journal
        self._emit_event = emit
        self._event_numbers = count(1)
        self._t_ns: int
        """Time of this cycle; :meth:`step` sets it."""
        self._run: Run | None = None
        self._ready_until_ns: int
        """Time at which a loaded recording expires. Each command sets it."""
        self._teaching: Teaching | None = None
        self._movement: Movement | None = None
        self.mode: Mode = "offline"
        self.stop: LatchedStop | None = None
        self.torque_on = False
        self.torque_inherited = True
        """True until torque is commanded on or off. During this time a drive may be holding an arm since before the port was
        opened.
        """
        self.drive_problem = ""
        """The reason why a drive cannot be configured; empty if no problem is known."""
        self.stops_latched = 0
        """Number of latched stops."""
        self.loaded_runs_and_reversals = 0
        """Number of accepted loads, and of reversals by resistance. An earlier command to start is refused after each of them."""
        self.setpoint_deg: tuple[float, ...]
        """The setpoint of each axis. Without torque it equals the measured angles."""
        self.setpoint_t_ns: int
        """Time at which the setpoint was computed."""
        self._pending_faults: list[FaultKey] = []
        """Faults that a step detected. The next cycle latches them."""
        self._period_s = 1.0 / config.cycle_hz
        self._cycles_between_return_checks = config.cycle_hz // _STRAIGHT_RETURN_CHECK_HZ
        self._cycles_on_path: int
        """Cycles since torque was switched on. With the zero-order hold: cycles since play began."""
        self._mechanism_deg = config.mechanism_deg
        # Fit the pose gate's polynomials before the loop runs.
        horner_coefficients()

    def pedal(self, state: CycleState) -> PedalState:
        """Return the debounced pedal state."""
        if state.pedal_down is None:
            return "unknown"
        if state.pedal_down and self._teaching and not self._teaching.pedal_was_up:
            return "stuck"
        return "down" if state.pedal_down else "up"

    def run_state(self) -> RunState | None:
        """Return the loaded run and its place on the path."""
        run = self._run
        if run is None:
            return None
        at_start = self.mode == "paused" and run.position_s == 0.0
        return run_state(run, self._movement, at_start=at_start, returning=self.mode == "returning")

    def teaching_state(self) -> TeachingState | None:
        """Return the active teaching and its takes."""
        return self._teaching.state() if self._teaching else None

    @property
    def active_id(self) -> str:
        """Id of the active run or teaching; "" for none."""
        return self._run.load.run_id if self._run else self._teaching.teaching_id if self._teaching else ""

    @property
    def limits_deg(self) -> Limits:
        """The tightest of the mechanism's and the run's limits, for each axis."""
        return self._run.limits_deg if self._run else self._mechanism_deg

    def refused_pose(self) -> list[FaultKey]:
        """Return the fault if the setpoint's pose is beyond the run's limits. This is the last check before the setpoint is sent."""
        if self._run is None or self._run.pose_beyond_deg(self.setpoint_deg) <= _POSE_TOLERANCE_DEG:
            return []
        return [("setpoint_limit", _MOTOR_4)]

    @property
    def config(self) -> StationConfig:
        """The station's configuration. During a run it includes the patient's speed limit."""
        return self._run.config if self._run else self._config

    @property
    def setpoint_due(self) -> bool:
        """True if this cycle sends a setpoint and records a sample. Only valid with torque on."""
        assert self._run is not None
        return self._cycles_on_path % self._run.cycles_per_setpoint == 0

    @property
    def rate_hz(self) -> int:
        """Number of setpoints a second."""
        return self._run.rate_hz if self._run else self._config.rate_hz

    @property
    def journal_ok(self) -> bool:
        """False if a sample was lost on its way to the disk."""
        open_now = (self._run and self._run.journal, self._teaching and self._teaching.journal)
        return not any(writer.lost for writer in open_now if writer)

    def emit(self, code: str, message: str) -> None:
        """Emit an event of the loop. Its number is in the same sequence as all other events."""
        self._emit(code, message)

    def _latch(self, state: CycleState) -> LatchedStop:
        self.stop = LatchedStop(state.t_ns)
        self.stops_latched += 1
        return self.stop

    def _begin_approach(self, state: CycleState) -> None:
        run = self._run
        assert run is not None
        here = np.array(state.measured_deg)
        run.begin(here)
        if run.zero_order_hold:
            # The paper's method moves to the start only when it plays. Until then the approach holds the arm within the
            # patient's limits.
            assert run.return_to_deg is not None
            path: Path = MinimumJerkMove(here, run.return_to_deg, run.config.approach_speed_deg_s)
        else:
            path, _ = approach_path(run, here)
        self._movement = run.movement_along(path, direction=1)
        self._cycles_on_path = 0
        self.torque_on = True
        self._emit("torque", texts.TORQUE_ON())
        self._enter("approaching")

    def _step_ready(self, state: CycleState) -> None:
        if state.context.late_ms > MAX_OVERRUN_MS:
            # A suspended computer's clock did not run.
            self._ready_until_ns -= int(state.context.late_ms * 1e6)
        if state.t_ns >= self._ready_until_ns:
            self._emit("unloaded", texts.LOAD_EXPIRED(minutes=UNLOAD_AFTER_MINUTES))
            self._end_run(JournalEnd(reason="unloaded"))
            self._enter("idle")

    def _begin_return(self) -> None:
        run = self._run
        assert run is not None and self._movement is not None
        run.resisting_axis = None
        if run.self_pacing:
            run.self_pacing.rest()
        if path := straight_return_path(run, self.setpoint_deg):
            self._leave_recording(run, path)
        else:
            reverse_along_recording(run, self._movement)
        self._enter("returning")

    def _step_returning(self, run: Run, movement: Movement) -> None:
        if movement.path is not run.trajectory:
            if movement.ended:
                self._cut_torque()
                self._end_run(JournalEnd(reason="completed" if run.played_to_end else "returned"))
                self._enter("idle")
            return
        rests = movement.ended or movement.at_rest
        if not (run.may_leave_path if rests else self._cycles_on_path % self._cycles_between_return_checks == 0):
            return
        path = straight_return_path(run, self.setpoint_deg)
        if movement.ended:
            self._leave_recording(run, path or return_path_via_start(run, self.setpoint_deg))
        elif path and movement.at_rest:
            self._leave_recording(run, path)
        elif path:
            movement.direction = 0
        elif movement.at_rest:
            reverse_along_recording(run, movement)

    def _leave_recording(self, run: Run, path: Path) -> None:
        run.start_path(np.array(self.setpoint_deg))
        self._movement = run.movement_along(path, direction=1)

    def _moves_back(self, run: Run) -> bool:
        """Return True while the arm moves back from resistance."""
        return self.mode == "playing" and run.resisting_axis is not None

    def _phase(self, run: Run) -> int:
        """Return the journal phase of a sample. Playing with a reduced range and moving back from resistance have their own phases."""
        if self._moves_back(run):
            return journal.PHASE_REVERSING
        if self.mode == "playing" and not run.range_override.is_full:
            return journal.PHASE_REDUCED_RANGE
        return _PHASES[self.mode]

    @property
    def _at_rest(self) -> bool:
        return self._movement is None or self._movement.at_rest

    def _cut_torque(self) -> None:
        if self.torque_on:
            self.torque_on = False
            self._emit("torque", texts.TORQUE_OFF())

    def _emit_take_ended(self, teaching: Teaching) -> None:
        self._emit("take_ended", texts.TAKE_ENDED(take=teaching.takes, take_s=teaching.take_s))

    def _end_teaching(self) -> None:
        teaching, self._teaching = self._teaching, None
        if teaching:
            if teaching.recording:
                self._emit_take_ended(teaching)
            teaching.end()

    def _end_stopped_run(self) -> None:
        if self._run and self.stop:
            first = self.stop.causes()[0]
            self._end_run(
                JournalEnd(
                    reason="stopped", cause_code=first.code, cause_message=first.message, cause_key=first.message_key
                )
            )

    def _end_run(self, end: JournalEnd) -> None:
        assert self._run is not None
        if stretch := stretch_of(self._run):
            end = msgspec.structs.replace(end, held_s=stretch.held_s, target_nm=stretch.target_nm)
        if pacing := self._run.self_pacing:
            end = msgspec.structs.replace(
                end,
                work_j=pacing.work_j,
                mean_effort_nm=pacing.mean_effort_nm,
                mean_pace_percent=pacing.mean_pace_percent,
            )
        self._run.journal.finish(end)
        self._run = None
        self._movement = None

    def _header(self, kind: str, identity: str, recording_id: str | None, rate_hz: int) -> JournalHeader:
        return JournalHeader(
            kind="teaching" if kind == "teaching" else "run",
            id=identity,
            recording_id=recording_id,
            station=self._config.name,
            rate_hz=rate_hz,
            started_at=datetime.now(UTC),
            started_ns=self._t_ns,
        )

    def _enter(self, mode: Mode) -> None:
        if (self.mode, mode) not in TRANSITIONS:
            raise IllegalTransitionError(f"from {self.mode} to {mode}")
        self.mode = mode
        self._emit("mode", mode)

    def _emit(self, code: str, message: str) -> None:
        log.info("%s: %s", code, message)
        self._emit_event(
            Event(
                number=next(self._event_numbers),
                t_ns=self._t_ns,
                code=code,
                message=str(message),
                message_key=key_of(message),
            )
        )
