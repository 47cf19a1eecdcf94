"""The modes of the apparatus: which commands each mode allows, and one step for each mode.

The state machine knows neither bus nor clock. Each cycle it gets the state, the faults that hold and at most one
command, and sets what the drives must do.
"""

import logging
from collections.abc import Callable
from datetime import UTC, datetime
from itertools import count
from typing import Final

import numpy as np

from kata.device import journal, texts
from kata.device.config import StationConfig
from kata.device.config_rules import TURN_S
from kata.device.cycle_state import CycleState, Limits
from kata.device.faults import Key
from kata.device.journal import JournalEnd, JournalHeader, JournalWriter
from kata.device.latched_stop import LatchedStop
from kata.device.messages import (
    COMMAND_NAMES,
    Acknowledge,
    Approach,
    Command,
    CommandName,
    Event,
    FinishTeaching,
    Less,
    Load,
    Mode,
    Pause,
    PedalState,
    Play,
    Refusal,
    ReleaseTorque,
    Return,
    RunState,
    StopCause,
    StopCode,
    Teach,
    TeachingState,
    Unload,
)
from kata.device.movement import RAMP_S, Movement
from kata.device.refusals import (
    no_torque_found,
    not_in_this_mode,
    not_verified,
    not_yet_cleared,
    other_side,
    outside_range,
    range_at_minimum,
    too_far_from_start,
)
from kata.device.run import Run
from kata.device.teaching import Teaching
from kata.messages import Text, key_of, with_key
from kata.motion import approach
from kata.motion.learning import Correction
from kata.motion.method import rate_hz
from kata.motion.trajectory import Trajectory

log = logging.getLogger(__name__)

_COMMAND_OF: Final[dict[type, CommandName]] = {
    Teach: "teach",
    FinishTeaching: "finish_teaching",
    Load: "load",
    Unload: "unload",
    Approach: "approach",
    Play: "play",
    Pause: "pause",
    Less: "less",
    Return: "return",
    ReleaseTorque: "release_torque",
    Acknowledge: "acknowledge",
}

TRANSITIONS: Final[dict[tuple[Mode, Mode], str]] = {
    ("offline", "idle"): "every drive and input has been seen",
    ("offline", "stopped"): "fault",
    ("idle", "teaching"): "teach",
    ("idle", "ready"): "load",
    ("idle", "stopped"): "fault",
    ("teaching", "idle"): "finish teaching",
    ("teaching", "stopped"): "stop or fault",
    ("ready", "idle"): "unload",
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

_SWITCH_FAULTS: Final = frozenset({"estop_pressed", "contacts_disagree"})
"""These may hold when the apparatus is switched on; everything else is known then."""

_MAX_RAMP_NS: Final = int(2 * RAMP_S * 1e9)
"""Limits the ramp of a category 1 stop. After this time the torque is cut even if the arm still moves."""

_PHASES: Final[dict[Mode, int]] = {
    "approaching": journal.PHASE_APPROACHING,
    "playing": journal.PHASE_PLAYING,
    "paused": journal.PHASE_PAUSED,
    "returning": journal.PHASE_RETURNING,
    "stopped": journal.PHASE_STOPPING,
}


class IllegalTransitionError(Exception):
    """A defect: a step tried a transition that is not in the table."""


class StateMachine:
    """Modes, runs and teachings of one apparatus.

    After each :meth:`step`, ``torque_on`` and ``setpoint_deg`` are the commands for the drives.
    """

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
        self._teaching: Teaching | None = None
        self._movement: Movement | None = None
        self.mode: Mode = "offline"
        self.stop: LatchedStop | None = None
        self.torque_on = False
        self.torque_inherited = True
        """True while torque is neither commanded on nor off: a drive may have held an arm since before the port was
        opened.
        """
        self.drive_problem = ""
        """Why a drive cannot be configured; empty if no problem is known."""
        self.stops_latched = 0
        """Number of latched stops."""
        self.setpoint_deg: tuple[float, ...]
        """Without torque: the measured angles."""
        self.setpoint_t_ns: int
        """When the setpoint was computed."""
        self._pending_faults: list[Key] = []
        """Faults that a step detected itself; the next cycle latches them."""
        self._period_s = 1.0 / config.cycle_hz
        self._cycles_on_path: int
        """Cycles since torque was switched on, or since play began with the zero-order hold."""
        self._mechanism_deg = config.mechanism_deg

    # -- one cycle ------------------------------------------------------------------------------------------------

    def step(self, state: CycleState, holding: list[Key], stop_requested: StopCode | None) -> None:
        """Run one cycle: first the faults, then the step of the mode."""
        self._t_ns = state.t_ns
        self._update_torque_inherited(state)
        if not self.torque_on:
            self.setpoint_deg, self.setpoint_t_ns = state.measured_deg, state.t_ns
        if self.mode == "offline":
            self._leave_offline(state, holding)
        if self.mode != "offline":
            self._supervise(state, holding, stop_requested)
        self._STEPS[self.mode](self, state)

    def _update_torque_inherited(self, state: CycleState) -> None:
        """After a loss of the port, leave torque as it is until every drive reports no torque or the emergency stop is
        pressed.
        """
        if not state.bus_ok:
            self.torque_inherited = True
        elif state.estop == "open" or all(reported is False for reported in state.torque_reported):
            self.torque_inherited = False

    def _leave_offline(self, state: CycleState, holding: list[Key]) -> None:
        """Enter idle when everything has been read and is good (the emergency stop may be pressed, it stops at once),
        or when a drive holds an arm.
        """
        # Wait until each drive that answers has reported its torque: the stop must name every drive that holds the arm,
        # and no drive that was only not read yet.
        answers = zip(state.drive_age_ms, state.torque_reported, strict=True)
        asked = all(age_ms > self._config.silence_ms or reported is not None for age_ms, reported in answers)
        arm_held = self.torque_inherited and asked and any(state.torque_reported)
        if arm_held or (state.complete and all(code in _SWITCH_FAULTS for code, _ in holding)):
            self._enter("idle")

    def _supervise(self, state: CycleState, holding: list[Key], stop_requested: StopCode | None) -> None:
        """Latch the faults that hold. A Stop counts if there is something to stop."""
        raised, self._pending_faults = self._pending_faults if self.torque_on else [], []
        if stop_requested and (self.stop or self.torque_on or self._teaching or self._run):
            raised.append((stop_requested, None))
        if self.stop is None and (holding or raised):
            self._latch(state)
        if self.stop is None:
            return
        for cause in self.stop.update(holding, raised):
            self._emit("fault", _fault_event_text(cause))
        if self.mode != "stopped":
            if self._movement:
                self._movement.direction = 0
            self._end_teaching()
            self._enter("stopped")

    # -- one step for each mode -------------------------------------------------------------------------------------

    def _step_stopped(self, state: CycleState) -> None:
        assert self.stop is not None
        if self.torque_on and self.stop.category == 0:
            self._cut_torque()
        elif self.torque_on:
            self._follow_path(state)
            late = state.t_ns - self.stop.at_ns > _MAX_RAMP_NS
            if self.stop.category == 1 and (late or self._at_rest):
                self._cut_torque()
        if not self.torque_on:
            self._end_stopped_run()

    def _step_teaching(self, state: CycleState) -> None:
        teaching = self._teaching
        assert teaching is not None
        was_recording = teaching.recording
        teaching.step(state)
        if teaching.recording and not was_recording:
            self._emit("take_started", texts.TAKE_STARTED(take=teaching.takes))
        elif was_recording and not teaching.recording:
            self._emit_take_ended(teaching)

    def _step_moving(self, state: CycleState) -> None:
        movement, run = self._movement, self._run
        assert movement is not None and run is not None
        self._check_resistance(run, movement, state)
        self._follow_path(state)
        if self.mode == "approaching" and movement.ended:
            if run.settle(self.setpoint_deg, state.measured_deg, self._period_s):
                self._movement = run.movement_along(run.trajectory, direction=0)
                self._enter("paused")
        elif self.mode == "playing":
            self._step_playing(run, movement)
        elif self.mode == "returning" and movement.ended:
            self._cut_torque()
            self._end_run(JournalEnd(reason="completed" if run.played_to_end else "returned"))
            self._enter("idle")

    def _step_playing(self, run: Run, movement: Movement) -> None:
        axis = run.resisting_axis
        if movement.ended and axis is None:
            run.played_to_end = True
            self._begin_return()
        elif axis is not None and run.resisted_again and (movement.ended or movement.at_rest):
            self._pending_faults.append(("load_repeated", axis))
        elif movement.ended:
            movement.direction = 0
        elif movement.at_rest:
            self._enter("paused")

    def _check_resistance(self, run: Run, movement: Movement, state: CycleState) -> None:
        """React to resistance above the patient's level: while playing, take the arm back along the path; otherwise
        stop and hold the arm.
        """
        axis = run.detect_resistance(state)
        if axis is None:
            return
        if self.mode == "playing" and run.resisting_axis is None:
            run.reverse(axis, movement, state)
            at_s = movement.position_s
            self._emit("load_reversal", texts.RESISTANCE_MET(motor=axis + 1, at_s=at_s))
            return
        movement.ramp_s = TURN_S
        self._pending_faults.append(("load_while_held" if self.mode == "paused" else "load_on_the_way", axis))

    def _yield(self, run: Run, movement: Movement, state: CycleState) -> None:
        """Let the setpoint yield where it would push against the patient: while held after resistance, or while taken
        back from it.
        """
        if self.mode == "stopped" and self.stop and self.stop.category == 2:
            run.yield_to_push(state)
        elif self.mode == "playing" and run.resisting_axis is not None and movement.speed_override <= 0.0:
            run.yield_to_push(state, only_to_reversal=True)

    def _step_without_torque(self, state: CycleState) -> None:
        """Do nothing: torque is off."""

    _STEPS: Final[dict[Mode, Callable[["StateMachine", CycleState], None]]] = {
        "offline": _step_without_torque,
        "idle": _step_without_torque,
        "ready": _step_without_torque,
        "teaching": _step_teaching,
        "approaching": _step_moving,
        "playing": _step_moving,
        "paused": _step_moving,
        "returning": _step_moving,
        "stopped": _step_stopped,
    }

    # -- commands -------------------------------------------------------------------------------------------------

    def refusal(self, name: CommandName, state: CycleState) -> Refusal | None:
        """Return why the command would be refused now; None if it would be accepted."""
        refusal = not_in_this_mode(name, self.mode)
        if refusal:
            return refusal
        if name == "acknowledge" and self.stop:
            held = self.stop.category == 2 and self._at_rest
            still_stopping = self.torque_on and not held
            return not_yet_cleared(self.stop, still_stopping=still_stopping) or not_verified(state, self.drive_problem)
        if name == "release_torque":
            return no_torque_found(state)
        if name == "approach":
            assert self._run is not None
            start = tuple(self._run.trajectory.start_deg) if self._run.zero_order_hold else state.measured_deg
            return outside_range(state, self._config) or too_far_from_start(state, start)
        if name == "less":
            assert self._run is not None
            return range_at_minimum(self._run.range_override)
        if name == "pause" and self._movement and self._movement.direction == 0:
            return Refusal.of(
                code="is_pausing", message=texts.ALREADY_PAUSING(), next_step=texts.WAIT_UNTIL_IT_STANDS()
            )
        return None

    def refusals(self, state: CycleState) -> dict[CommandName, Refusal]:
        """Return every command that is refused now, with the reason."""
        found = {name: self.refusal(name, state) for name in COMMAND_NAMES}
        return {name: refusal for name, refusal in found.items() if refusal}

    def command(
        self, command: Command, trajectory: Trajectory | None, state: CycleState, correction: Correction | None = None
    ) -> Refusal | None:
        """Execute a command other than Stop, or refuse it. ``trajectory`` and ``correction`` belong to Load."""
        refusal = self.refusal(_COMMAND_OF[type(command)], state)
        if refusal is None and isinstance(command, Teach | Load):
            refusal = other_side(command.side, self._config.side)
        if refusal:
            return refusal
        match command:
            case Teach():
                header = self._header("teaching", command.teaching_id, None, self._config.rate_hz)
                every = self._config.cycle_hz // self._config.rate_hz
                self._teaching = Teaching(command.teaching_id, self._open_journal(header), every)
                self._enter("teaching")
            case FinishTeaching():
                self._end_teaching()
                self._enter("idle")
            case Load():
                assert trajectory is not None
                header = self._header(
                    "run", command.run_id, command.recording_id, rate_hz(command.method, self._config.rate_hz)
                )
                self._run = Run(command, trajectory, self._open_journal(header), self._config, correction)
                self._enter("ready")
            case Unload():
                self._end_run(JournalEnd(reason="unloaded"))
                self._enter("idle")
            case Approach():
                self._begin_approach(state)
            case Play():
                assert self._movement is not None and self._run is not None
                self._run.resisting_axis = None
                self._movement.direction, self._movement.ramp_s = 1, RAMP_S
                if self._run.zero_order_hold:
                    # The first sample goes out with the next cycle, the others every 0.1 s.
                    self._movement.speed_override, self._cycles_on_path = 1.0, -1
                self._enter("playing")
            case Pause():
                assert self._movement is not None
                self._movement.direction = 0
            case Less():
                assert self._run is not None
                self._run.range_override.reduce()
                self._emit("less", texts.LESS_RANGE_REQUESTED(at_s=self._run.position_s))
            case Return():
                self._begin_return()
            case ReleaseTorque():
                self.torque_inherited = False
                self._emit("torque", texts.TORQUE_RELEASED_BY_HAND())
            case Acknowledge():  # pragma: no branch - the last one: _COMMAND_OF knows no other
                self._cut_torque()
                self._end_stopped_run()
                self.stop = None
                self._enter("idle")
        return None

    def close(self) -> bool:
        """End the teaching or run if torque is off, because the service is gone. Return True when nothing is left."""
        if self.torque_on:
            return False
        self._end_teaching()
        if self._run:
            self._end_run(JournalEnd(reason="unloaded"))
        return True

    def abort(self, state: CycleState, causes: list[Key]) -> None:
        """Cut torque at once because of an internal error, within a cycle that :meth:`step` has begun."""
        stop = self.stop or self._latch(state)
        for cause in stop.update(stop.holding, causes):
            self._emit("fault", _fault_event_text(cause))
        self._cut_torque()
        if self.mode != "stopped":
            self._end_teaching()
            self._enter("stopped")

    # -- snapshot -------------------------------------------------------------------------------------------------

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
        return run.state(self._movement, at_start=self.mode == "paused" and run.position_s == 0.0)

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

    @property
    def config(self) -> StationConfig:
        """The station's configuration; during a run with the patient's speed limit."""
        return self._run.config if self._run else self._config

    @property
    def setpoint_due(self) -> bool:
        """True if this cycle sends a setpoint and records a sample. Only valid with torque on."""
        assert self._run is not None
        return self._cycles_on_path % self._run.cycles_per_setpoint == 0

    @property
    def rate_hz(self) -> int:
        """Setpoints a second."""
        return self._run.rate_hz if self._run else self._config.rate_hz

    @property
    def journal_ok(self) -> bool:
        """False if a sample was lost on its way to the disk."""
        open_now = (self._run and self._run.journal, self._teaching and self._teaching.journal)
        return not any(writer.lost for writer in open_now if writer)

    def emit(self, code: str, message: str) -> None:
        """Emit an event of the loop, numbered with all others."""
        self._emit(code, message)

    # -- helpers --------------------------------------------------------------------------------------------------

    def _latch(self, state: CycleState) -> LatchedStop:
        self.stop = LatchedStop(state.t_ns)
        self.stops_latched += 1
        return self.stop

    def _begin_approach(self, state: CycleState) -> None:
        run = self._run
        assert run is not None
        here = np.array(state.measured_deg)
        run.begin(here)
        assert run.return_to_deg is not None
        speed_deg_s = run.approach_speed_deg_s
        if run.zero_order_hold:
            # The paper's method moves to the start only when it plays; until then the arm is held within the patient's
            # limits.
            self._movement = run.movement_along(approach.Approach(here, run.return_to_deg, speed_deg_s), direction=1)
        else:
            start, leaves = run.trajectory.start_deg, run.trajectory.leaves_deg
            self._movement = run.movement_along(approach.from_its_side(here, start, leaves, speed_deg_s), direction=1)
        self._cycles_on_path = 0
        self.torque_on = True
        self._emit("torque", texts.TORQUE_ON())
        self._enter("approaching")

    def _begin_return(self) -> None:
        run = self._run
        assert run is not None and run.return_to_deg is not None
        run.resisting_axis = None
        here = np.array(self.setpoint_deg)
        run.start_path(here)
        self._movement = run.movement_along(
            approach.Approach(here, run.return_to_deg, run.approach_speed_deg_s), direction=1
        )
        self._enter("returning")

    def _follow_path(self, state: CycleState) -> None:
        """Record the sample for the last setpoint and compute the next one along the path."""
        movement, run = self._movement, self._run
        assert movement is not None and run is not None
        on_recording = movement.path is run.trajectory
        self._cycles_on_path += 1
        if self.setpoint_due:
            if state.measured_t_ns is not None:
                since_s = (state.measured_t_ns - state.t_ns) / 1e9
                place = movement.position_s + movement.speed_override * since_s if on_recording else float("nan")
                run.record(state.measured_t_ns, state, self._phase(run), place, self.setpoint_deg)
            self._yield(run, movement, state)
            self.setpoint_deg = run.setpoint(movement)
            self.setpoint_t_ns = state.t_ns
        movement.advance(self._period_s)
        if on_recording:
            run.position_s = movement.position_s
        run.tighten(self.setpoint_deg, state.measured_deg)

    def _phase(self, run: Run) -> int:
        """Return the journal phase of a sample. Samples with a reduced range or while taken back have their own phases."""
        if self.mode == "playing" and run.resisting_axis is not None:
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


def _fault_event_text(cause: StopCause) -> Text:
    """Return the text of the event for a latched cause."""
    fault = with_key(cause.message, cause.message_key)
    return texts.FAULT_EVENT(fault=fault, fault_code=cause.code, category=cause.category)
