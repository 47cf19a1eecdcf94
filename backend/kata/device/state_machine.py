"""Implements the modes of the apparatus: the refusals in each mode, the execution of commands, and one step for each mode.

The state machine uses neither bus nor clock. In each cycle it receives the state, the faults that hold and at most one
command, and sets the commands for the drives.
"""

import logging
from collections.abc import Callable
from typing import Final

from kata.device import texts
from kata.device.config_rules import REVERSAL_RAMP_S
from kata.device.cycle_state import CycleState
from kata.device.faults import FaultKey
from kata.device.ipc_messages import (
    COMMAND_NAMES,
    Acknowledge,
    Approach,
    Command,
    CommandName,
    FinishTeaching,
    Load,
    Mode,
    Pause,
    Play,
    ReduceRange,
    Refusal,
    ReleaseTorque,
    Return,
    StopCause,
    StopCode,
    Teach,
    Unload,
)
from kata.device.journal import JournalEnd
from kata.device.movement import RAMP_S, Movement
from kata.device.refusals import (
    angles_not_current,
    no_torque_found,
    not_in_this_mode,
    not_reducible,
    not_verified,
    not_yet_cleared,
    other_side,
    outside_range,
    path_leaves_limits,
    too_far_from_start,
)
from kata.device.run import Run, reduce
from kata.device.state_machine_base import UNLOAD_AFTER_MINUTES, StateMachineBase
from kata.device.teaching import Teaching
from kata.messages import Text, with_key
from kata.motion.ilc import Correction
from kata.motion.method import rate_hz
from kata.motion.trajectory import Trajectory

log = logging.getLogger(__name__)

_TAKES_OVER_S: Final = 0.3
"""Time in which the motors take over the arm's weight at the start of an approach. The arm has hardly moved."""
_COMMAND_OF: Final[dict[type, CommandName]] = {
    Teach: "teach",
    FinishTeaching: "finish_teaching",
    Load: "load",
    Unload: "unload",
    Approach: "approach",
    Play: "play",
    Pause: "pause",
    ReduceRange: "reduce_range",
    Return: "return",
    ReleaseTorque: "release_torque",
    Acknowledge: "acknowledge",
}

_SWITCH_FAULTS: Final = frozenset({"estop_pressed", "contacts_disagree"})
"""Faults that may be present when the apparatus leaves the mode offline, unless drives still hold an arm from before the connection."""

_MAX_RAMP_NS: Final = int(2 * RAMP_S * 1e9)
"""Longest ramp of a category 1 stop. After this time torque is cut even if the arm still moves."""


class StateMachine(StateMachineBase):
    """Modes, runs and teachings of one apparatus.

    After each :meth:`step`, ``torque_on`` and ``setpoint_deg`` are the commands for the drives.
    """

    # -- one cycle ------------------------------------------------------------------------------------------------

    def step(self, state: CycleState, holding: list[FaultKey], stop_requested: StopCode | None) -> None:
        """Run one cycle: evaluate the faults, then run the step of the mode."""
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
        """Update whether torque is inherited. After a loss of the port, torque is left unchanged until every drive reports no
        torque or the emergency stop is pressed.
        """
        if not state.bus_ok:
            self.torque_inherited = True
        elif state.estop == "open" or all(reported is False for reported in state.torque_reported):
            self.torque_inherited = False

    def _leave_offline(self, state: CycleState, holding: list[FaultKey]) -> None:
        """Enter idle when everything has been read and no fault holds, or when a drive holds an arm. The emergency stop may be
        pressed or its contacts may disagree: these faults cause a stop in the same cycle.
        """
        # Wait until each drive that answers has reported its torque. The stop must name every drive that holds the arm, but
        # no drive that has only not been read yet.
        answers = zip(state.drive_age_ms, state.torque_reported, strict=True)
        asked = all(age_ms > self._config.silence_ms or reported is not None for age_ms, reported in answers)
        arm_held = self.torque_inherited and asked and any(state.torque_reported)
        if arm_held or (state.complete and all(code in _SWITCH_FAULTS for code, _ in holding)):
            self._enter("idle")

    def _supervise(self, state: CycleState, holding: list[FaultKey], stop_requested: StopCode | None) -> None:
        """Latch the faults that hold. A Stop is latched if torque is on or a stop, a teaching or a run exists."""
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
        if self.mode == "playing":
            run.watch_torque(movement, state)
        elif self.mode == "paused":
            run.watch_paused_test(movement, state)
        self._follow_path(state)
        if self.mode == "approaching" and movement.ended and run.may_leave_path:
            if run.settle(self.setpoint_deg, state.measured_deg, self._period_s):
                self._movement = run.movement_along(run.trajectory, direction=0)
                self._enter("paused")
        elif self.mode == "playing":
            self._step_playing(run, movement)
        elif self.mode == "returning":
            self._step_returning(run, movement)

    def _step_playing(self, run: Run, movement: Movement) -> None:
        axis = run.resisting_axis
        if movement.ended and axis is None:
            if run.may_leave_path and not run.turn_at_end(movement):
                run.played_to_end = not (run.end_feel and run.end_feel.ended_by_patient)
                self._begin_return()
        elif axis is not None and run.resisted_again and (movement.ended or movement.at_rest):
            self._pending_faults.append(("load_repeated", axis))
        elif movement.ended:
            movement.direction = 0
        elif movement.at_rest and run.may_leave_path:
            self._enter("paused")

    def _check_resistance(self, run: Run, movement: Movement, state: CycleState) -> None:
        """React to resistance above the patient's level. While playing, move the arm back along the path. In other modes, and on
        the way back of an end-feel test, stop and hold the arm. An approach that meets it at once has another message.
        """
        moves_back = self._moves_back(run)
        axis = run.detect_resistance(state, moves_back=moves_back)
        if axis is None:
            return
        if self.mode == "playing" and not moves_back and not run.resists_moving_back(axis, movement, state):
            run.reverse(axis, movement, state)
            self.loaded_runs_and_reversals += 1
            at_s = movement.position_s
            self._emit("load_reversal", texts.RESISTANCE_MET(motor=axis + 1, at_s=at_s))
            return
        movement.ramp_s = REVERSAL_RAMP_S
        code = "load_while_held" if self.mode == "paused" else "load_on_the_way"
        if self.mode == "approaching" and movement.position_s <= _TAKES_OVER_S:
            code = "arm_too_heavy"
        self._pending_faults.append((code, axis))

    def _yield(self, run: Run, movement: Movement, state: CycleState) -> None:
        """Let the setpoint yield to a push of the patient: while the arm is held by a category 2 stop, while it moves back from
        resistance, and in an end-feel test.
        """
        if self.mode == "stopped" and self.stop and self.stop.category == 2:
            run.yield_to_push(state)
        elif self._moves_back(run) and movement.speed_override <= 0.0:
            run.yield_to_push(state, only_to_reversal=True)
        elif self.mode in ("playing", "paused"):
            run.retreat_in_test()

    def _step_without_torque(self, state: CycleState) -> None:
        """Do nothing, because torque is off."""

    _STEPS: Final[dict[Mode, Callable[["StateMachine", CycleState], None]]] = {
        "offline": _step_without_torque,
        "idle": _step_without_torque,
        "ready": StateMachineBase._step_ready,
        "teaching": _step_teaching,
        "approaching": _step_moving,
        "playing": _step_moving,
        "paused": _step_moving,
        "returning": _step_moving,
        "stopped": _step_stopped,
    }

    # -- commands -------------------------------------------------------------------------------------------------

    def refusal(self, name: CommandName, state: CycleState) -> Refusal | None:
        """Return the refusal that the command would get now; None if it would be accepted."""
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
            refusal = outside_range(state, self._config)
            check_path = too_far_from_start if self._run.zero_order_hold else path_leaves_limits
            return refusal or check_path(state, self._run)
        if name == "reduce_range":
            assert self._run is not None
            return not_reducible(self._run)
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
        """Execute a command other than Stop, or refuse it. Only a Load has ``trajectory`` and ``correction``."""
        self._ready_until_ns = state.t_ns + UNLOAD_AFTER_MINUTES * 60_000_000_000
        refusal = self.refusal(_COMMAND_OF[type(command)], state)
        if refusal is None and isinstance(command, Teach | Load):
            refusal = other_side(command.side, self._config.side)
        if refusal is None and isinstance(command, Approach):
            # Not in the refusals that pages show: a single lost answer would disable the button for a moment.
            refusal = angles_not_current(state)
        if refusal:
            return refusal
        match command:
            case Teach():
                header = self._header("teaching", command.teaching_id, None, self._config.rate_hz)
                cycles_per_sample = self._config.cycle_hz // self._config.rate_hz
                self._teaching = Teaching(command.teaching_id, self._open_journal(header), cycles_per_sample)
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
                self.loaded_runs_and_reversals += 1
                self._enter("ready")
            case Unload():
                self._end_run(JournalEnd(reason="unloaded"))
                self._enter("idle")
            case Approach():
                self._begin_approach(state)
            case Play():
                assert self._movement is not None and self._run is not None
                self._run.play(self._movement)
                if self._run.zero_order_hold:
                    # The first sample is sent in the next cycle, the others every 0.1 s.
                    self._movement.speed_override, self._cycles_on_path = 1.0, -1
                self._enter("playing")
            case Pause():
                assert self._movement is not None
                self._movement.direction = 0
            case ReduceRange():
                assert self._run is not None
                self._emit("range_reduced", reduce(self._run))
            case Return():
                self._begin_return()
            case ReleaseTorque():
                self.torque_inherited = False
                self._emit("torque", texts.TORQUE_RELEASED_BY_HAND())
            case Acknowledge():  # pragma: no branch - the last case: _COMMAND_OF contains no other command
                self._cut_torque()
                self._end_stopped_run()
                self.stop = None
                self._enter("idle")
        return None

    def close(self) -> bool:
        """End the teaching and the run if torque is off, because the service is gone. Return False if torque is still on."""
        if self.torque_on:
            return False
        self._end_teaching()
        if self._run:
            self._end_run(JournalEnd(reason="unloaded"))
        return True

    def abort(self, state: CycleState, causes: list[FaultKey]) -> None:
        """Cut torque at once because of an internal error, within a cycle in which :meth:`step` was called."""
        stop = self.stop or self._latch(state)
        for cause in stop.update(stop.holding, causes):
            self._emit("fault", _fault_event_text(cause))
        self._cut_torque()
        if self.mode != "stopped":
            self._end_teaching()
            self._enter("stopped")

    # -- helpers --------------------------------------------------------------------------------------------------

    def _follow_path(self, state: CycleState) -> None:
        """Record the sample for the last setpoint and compute the next one along the path."""
        movement, run = self._movement, self._run
        assert movement is not None and run is not None
        on_recording = movement.path is run.trajectory and self.mode != "returning"
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


def _fault_event_text(cause: StopCause) -> Text:
    """Return the text of the event for a latched cause."""
    fault = with_key(cause.message, cause.message_key)
    return texts.FAULT_EVENT(fault=fault, category=cause.category)
