"""Defines a run: one recording from load to end, its setpoints and samples, and the patient's resistance."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from kata.device import texts
from kata.device.config import REFERENCE_SHARE, StationConfig
from kata.device.config_rules import RAMP_SHARE, REVERSAL_RAMP_S
from kata.device.cycle_state import CycleState, Limits
from kata.device.end_feel import SPEED_LIMIT_DEG_S as END_FEEL_SPEED_DEG_S
from kata.device.end_feel import EndFeelTest
from kata.device.ipc_messages import Load, RunState
from kata.device.journal import JournalWriter, Sample
from kata.device.movement import CREEP, RAMP_S, Movement
from kata.device.range_override import RangeOverride
from kata.device.resistance import SLOW_DEG_S, ResistanceMonitor, YieldOffset
from kata.device.run_limits import PATH_TOLERANCE_DEG, RunLimits
from kata.device.self_pacing import SelfPacing
from kata.device.setpoint_gate import largest_step_deg
from kata.device.setpoint_limiters import LimitedFeedForward, SetpointBrake, clip
from kata.device.stretch import TorqueStretch
from kata.messages import Text
from kata.motion.ilc import Correction
from kata.motion.linkage import Floats
from kata.motion.method import FeedForward, rate_hz
from kata.motion.path import Path
from kata.motion.pose_gate import PoseGate
from kata.motion.trajectory import Trajectory

_USED_SHARE: Final = 0.98
"""Share of an axis' acceleration limit that reference and feed-forward together may use."""
FEED_FORWARD_SHARE: Final = _USED_SHARE - RAMP_SHARE
"""Share of an axis' acceleration limit that the feed-forward may use at most. The feed-forward uses less if the reference needs more. What
it leaves is enough for a reference that stops at the end of its path.
"""
_CLOSING_SHARE: Final = _USED_SHARE - REFERENCE_SHARE
"""Share of an axis' acceleration limit with which a feed-forward that catches up with its target can stop within one setpoint."""
_STEP_SHARE: Final = 0.8
"""Share of the feed-forward in the difference between the setpoint gate's step limit and the step at an axis' highest speed.
Overspeed is judged from averages over 0.1 s, so single steps may exceed the highest speed.
"""
_SAME_PLACE_S: Final = 1.0
"""Two places of resistance that are at most this far apart on the recording's clock count as the same place."""


@dataclass
class Run:
    """One run of a loaded recording."""

    load: Load
    trajectory: Trajectory
    journal: JournalWriter
    config: StationConfig
    correction: Correction | None = None
    return_to_deg: Floats | None = None
    """Target of the return; see :meth:`begin`."""
    position_s: float = 0.0
    played_to_end: bool = False
    resisted_at_s: list[float] = field(default_factory=list)
    """Places on the recording's clock at which the arm met resistance and moved back."""
    resisting_axis: int | None = None
    """The axis whose resistance causes the present backward movement; None when the recording plays again."""
    reference_deg: Floats = field(init=False)
    """Target of the arm at the last setpoint. The setpoint may lead this target. Only valid with torque on."""
    _speed_deg_s: Floats = field(init=False)
    """Speed of the reference over the last setpoint period."""
    _reversal_torque_nm: float = field(init=False)
    """Torque of the resisting axis when the backward movement began. Only valid while the arm moves back from resistance."""

    def __post_init__(self) -> None:
        limit_deg_s = self.load.max_speed_deg_s
        if self.load.end_feel:
            limit_deg_s = min(limit_deg_s or END_FEEL_SPEED_DEG_S, END_FEEL_SPEED_DEG_S)
        self.config = self.config.with_speed_limit(limit_deg_s)
        self.zero_order_hold = self.load.method == "paper"
        """True for the paper's method: no feed-forward, and the setpoint does not change while the arm is at rest."""
        self.rate_hz = rate_hz(self.load.method, self.config.rate_hz)
        """Number of setpoints and samples a second."""
        self.cycles_per_setpoint = self.config.cycle_hz // self.rate_hz
        """Number of cycles for each setpoint."""
        # A setpoint applies until the next one. It therefore aims at the middle of this period.
        self._lead_s = 0.0 if self.zero_order_hold else 0.5 / self.rate_hz + self.config.setpoint_delay_s
        self._feed_forward = FeedForward(self.config.servo_model, 1.0 / self.rate_hz)
        acceleration = np.array([axis.max_acceleration_deg_s2 for axis in self.config.axes])
        self._feed_forward_second_difference_deg = FEED_FORWARD_SHARE * acceleration / self.rate_hz**2
        steps = [
            largest_step_deg(axis, self.rate_hz) - axis.max_speed_deg_s / self.rate_hz for axis in self.config.axes
        ]
        self._min_second_difference_deg = (_USED_SHARE - REFERENCE_SHARE - RAMP_SHARE) * acceleration / self.rate_hz**2
        self._max_second_difference_deg = _USED_SHARE * acceleration / self.rate_hz**2
        self._brake = SetpointBrake(self._max_second_difference_deg)
        ramps_s = [axis.max_speed_deg_s / (RAMP_SHARE * axis.max_acceleration_deg_s2) for axis in self.config.axes]
        self.ramp_s = max(ramps_s)
        """Shortest time from rest to a path's own speed that the axes' acceleration limits allow."""
        self._limited_feed_forward = LimitedFeedForward(
            _STEP_SHARE * np.array(steps), _CLOSING_SHARE * acceleration / self.rate_hz**2
        )
        self.range_override = RangeOverride(
            self.trajectory,
            self.load.repetition_s or self.trajectory.duration_s,
            np.array([axis.max_speed_deg_s for axis in self.config.axes]),
        )
        asked = self.load.end_feel
        kind = TorqueStretch if asked and asked.hold_s else EndFeelTest
        self.end_feel = kind(asked, self.trajectory, self.config) if asked else None
        self.self_pacing = SelfPacing(self.trajectory, self.config) if self.load.self_paced else None
        thresholds_nm = self.config.resistance_thresholds_nm(self.load.resistance_level)
        self._monitor = ResistanceMonitor(thresholds_nm)
        slowest_deg_s = min(axis.max_speed_deg_s for axis in self.config.axes)
        self._yield_offset = YieldOffset(thresholds_nm, self.rate_hz, slowest_deg_s)
        self._gate = PoseGate(self.load.side, self.load.arm_limits, self.config.pose_tolerance_deg)
        self.limits = RunLimits(
            self.config.mechanism_deg, self.load.limits_deg, self.config.limit_tolerance_deg, self._gate
        )
        self._update_bounds()

    # -- limits ---------------------------------------------------------------------------------------------------

    @property
    def limits_deg(self) -> Limits:
        """Limits of the setpoints: the tighter of the mechanism's and the patient's limits. They are wider during the approach
        if the arm is outside them.
        """
        return self.limits.now_deg

    def begin(self, here_deg: Floats) -> None:
        """Begin an approach at ``here_deg``, ``(5,)``. The return ends there, or at the nearest angles within the limits. If none are
        found, or the path from the recording's start to them exceeds the limits, the return ends at the first pose of the approach that is
        within the limits.
        """
        self.start_path(here_deg)
        inside_deg = clip(here_deg, self._lowest_deg, self._highest_deg)
        self.return_to_deg = np.array(self._held(inside_deg, self._lowest_deg, self._highest_deg))
        start_deg = self.trajectory.start_deg
        leaves = self.limits.path_excess_deg(start_deg, self.return_to_deg) > PATH_TOLERANCE_DEG
        if leaves or not self.limits.are_inside(self.return_to_deg.tolist()):
            self.return_to_deg = self.limits.entry_deg(here_deg, start_deg)
        self.limits.widen(here_deg.tolist())
        self._update_bounds()

    def tighten(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float]) -> None:
        """Tighten limits that were widened for the approach. The caller calls this in every cycle with torque."""
        if self.limits.widened:
            # A setpoint that leads the arm inwards can come back. It must be able to stop before a limit that follows the arm.
            stop_deg = setpoint_deg if self.zero_order_hold else self._brake.stop_deg.tolist()
            self.limits.tighten(setpoint_deg, measured_deg, stop_deg)
            self._update_bounds()

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Return True when the approach is over and the tight limits apply; see :meth:`RunLimits.settle`."""
        settled = self.limits.settle(setpoint_deg, measured_deg, dt_s)
        self._update_bounds()
        return settled

    def pose_beyond_deg(self, setpoint_deg: Sequence[float]) -> float:
        """Return the distance in deg by which a setpoint exceeds the present limits of the pose; 0 or less inside them."""
        return self._gate.beyond_deg(setpoint_deg) - self.limits.beyond_deg

    def _held(self, angles_deg: Floats, lowest_deg: Floats, highest_deg: Floats) -> list[float]:
        """Return the nearest pose within the limits. A pose inside the limits is unchanged."""
        return self._gate.held(angles_deg.tolist(), self.limits.beyond_deg, lowest_deg.tolist(), highest_deg.tolist())

    def _update_bounds(self) -> None:
        self._lowest_deg, self._highest_deg = np.array(self.limits_deg).T

    # -- setpoints ------------------------------------------------------------------------------------------------

    def movement_along(self, path: Path, direction: Literal[0, 1]) -> Movement:
        """Return a movement along a path. Its changes of speed stay within every axis' acceleration limit."""
        # Choose a creep speed from which the reference can stop within one setpoint period at the end of the path.
        creep = min(CREEP, 1.0 / (self.ramp_s * self.rate_hz))
        return Movement(path, direction=direction, shortest_ramp_s=self.ramp_s, creep=creep)

    def start_path(self, here_deg: Floats) -> None:
        """Start another path at ``here_deg`` without feed-forward and offset."""
        self.reference_deg = here_deg
        self._reference_change_deg = np.zeros(len(here_deg))
        self._limited_feed_forward.start()
        self._speed_deg_s = np.zeros(len(here_deg))
        self._yield_offset.offset_deg = np.zeros(len(here_deg))
        self._brake.start(here_deg)

    @property
    def may_leave_path(self) -> bool:
        """True if another path may start at the last setpoint: the feed-forward can stop there."""
        return self._limited_feed_forward.can_stop

    def setpoint(self, movement: Movement) -> tuple[float, ...]:
        """Return the next setpoint: the reference plus the feed-forward for the drives' lag.

        The reference is not clipped. If it is beyond a limit, the setpoint gate refuses it. The feed-forward stays within the
        limits and never jumps. A setpoint that leads the reference brakes before a limit. While an arm is fetched from outside the
        patient's limits, the setpoint itself is limited: it leads the reference inwards and never moves outwards again.
        """
        before_deg = self.reference_deg
        wanted = np.zeros(len(before_deg))
        if not (self.zero_order_hold and movement.at_rest):
            wanted = self._advance_reference(movement)
        change_deg = self.reference_deg - before_deg
        second_difference_deg, self._reference_change_deg = np.abs(change_deg - self._reference_change_deg), change_deg
        self._speed_deg_s = change_deg * self.rate_hz
        lowest, highest = self._lowest_deg, self._highest_deg
        if not self.limits.widened:
            lowest, highest = np.minimum(lowest, self.reference_deg), np.maximum(highest, self.reference_deg)
        elif movement.direction == 1 and not self.zero_order_hold:
            lowest, highest = self._brake.only_inwards(lowest, highest, self.limits.tight_deg)
        if self.resisting_axis is None and movement.direction == 1:
            self._yield_offset.resume(max(movement.speed_override, 0.0))
        self._yield_offset.keep_within(lowest - self.reference_deg, highest - self.reference_deg)
        wanted = clip(wanted + self._yield_offset.offset_deg, lowest - self.reference_deg, highest - self.reference_deg)
        wanted = np.array(self._held(self.reference_deg + wanted, lowest, highest)) - self.reference_deg
        self._limited_feed_forward.follow(
            wanted,
            clip(
                self._max_second_difference_deg - second_difference_deg,
                self._min_second_difference_deg,
                self._feed_forward_second_difference_deg,
            ),
        )
        # The reference may leave the pose's limits on a straight line between two poses or with a reduced range.
        setpoint = clip(self.reference_deg + self._limited_feed_forward.deg, lowest, highest)
        setpoint = np.array(self._held(setpoint, lowest, highest))
        self._limited_feed_forward.hold(setpoint - self.reference_deg)
        if not self.zero_order_hold:
            setpoint = self._brake.setpoint(setpoint, lowest, highest)
        return tuple(setpoint.tolist())

    def _advance_reference(self, movement: Movement) -> Floats:
        """Advance the reference along the path. Return the feed-forward that the drives' lag needs, ``(5,)``."""
        motion = movement.motion(self._lead_s)
        if movement.path is self.trajectory:
            motion = self.range_override.apply(motion, movement.speed_override, 1.0 / self.rate_hz)
            here_deg = self.range_override.reduced_deg(self.trajectory.at(movement.position_s))
        else:
            here_deg = movement.motion(0.0).angles_deg
        self.reference_deg = here_deg
        if self.zero_order_hold:
            return np.zeros(len(here_deg))
        # The lead is fed forward, not a part of the reference: where the movement turns, the lead changes its sign at once.
        wanted = motion.angles_deg - here_deg + self._feed_forward.at(motion)
        if self.correction and movement.path is self.trajectory:
            # The correction was learned at the path's own speed and range. It does not fit an arm that is at rest or moves
            # backwards.
            wanted = wanted + max(movement.speed_override, 0.0) * self.range_override.share * self.correction.at(
                movement.place_s(self._lead_s)
            )
        return wanted

    # -- resistance -----------------------------------------------------------------------------------------------

    def detect_resistance(self, state: CycleState, *, moves_back: bool) -> int | None:
        """Return the axis whose drive has pushed with the patient's level for 0.1 s, else None.

        Call this in every cycle with torque. The direction of a moving axis is that of the reference.
        """
        speed_deg_s = self._speed_deg_s.tolist()
        if self.self_pacing:
            speed_deg_s = self.self_pacing.resisted_deg_s(speed_deg_s)
        return self._monitor.resisting_axis(state, speed_deg_s, moves_back=moves_back)

    def resists_moving_back(self, axis: int, movement: Movement, state: CycleState) -> bool:
        """Return True if the patient resists an arm that moves back already."""
        speed_deg_s = float(self._speed_deg_s[axis])
        rests = abs(speed_deg_s) < SLOW_DEG_S
        return movement.speed_override < 0.0 and (rests or speed_deg_s * state.torque_nm[axis] > 0.0)

    def reverse(self, axis: int, movement: Movement, state: CycleState) -> None:
        """Start moving the arm back along its path."""
        self.resisted_at_s.append(movement.position_s)
        self.resisting_axis = axis
        self._reversal_torque_nm = state.torque_nm[axis]
        self._monitor.start_after_reversal(axis, self._reversal_torque_nm, state.t_ns)
        if stretch := stretch_of(self):
            stretch.release()
        movement.direction, movement.top_override = -1, 1.0
        movement.ramp_s = REVERSAL_RAMP_S
        movement.reverse_to_s = max(0.0, movement.position_s - self.config.reversal_s)

    def yield_to_push(self, state: CycleState, *, only_to_reversal: bool = False) -> None:
        """Let the next setpoint yield to every push above the level. With ``only_to_reversal`` it yields only to the push that
        caused the last reversal.
        """
        torque_nm = np.array(state.torque_nm)
        if only_to_reversal:
            others = np.arange(len(torque_nm)) != self.resisting_axis
            torque_nm[others | (torque_nm * self._reversal_torque_nm < 0)] = 0.0
        self._yield_offset.yield_to(torque_nm, np.array(state.setpoint_deg), np.array(state.measured_deg))

    @property
    def resisted_again(self) -> bool:
        """True if the last resistance was at the same place as an earlier one."""
        *earlier, last = self.resisted_at_s
        return any(abs(last - place) <= _SAME_PLACE_S for place in earlier)

    # -- the end-feel test ------------------------------------------------------------------------------------------

    def play(self, movement: Movement) -> None:
        """Continue along the recording. An end-feel test that has turned, or that the patient has ended, continues its way back."""
        self.resisting_axis = None
        movement.direction, movement.ramp_s = 1, RAMP_S
        if self.end_feel:
            self.end_feel.resume(movement)

    def watch_paused_test(self, movement: Movement, state: CycleState) -> None:
        """Watch the torque of a paused end-feel test, and let the patient end it. The arm is taken back when the test continues."""
        if self.end_feel and movement.position_s > 0.0:
            self.end_feel.note_hold(state, movement)

    def watch_torque(self, movement: Movement, state: CycleState) -> None:
        """Take the arm back along its path if an end-feel test's torque is met on the way out. Let the patient's effort set the pace of a
        self-paced run.
        """
        if self.end_feel and self.end_feel.must_move_back(state, movement):
            self.end_feel.turn_back(movement)
        if self.self_pacing:
            limits_deg = (self._lowest_deg, self._highest_deg)
            self.self_pacing.set_pace(movement, state, self.range_override.share, limits_deg)

    def retreat_in_test(self) -> None:
        """Let the next setpoint retreat faster than the path if the patient pushes more than the test's torque. It never goes beyond the
        path's start.
        """
        if self.end_feel:
            self._yield_offset.retreat(self.end_feel.retreat_deg_s() / self.rate_hz)
            from_start_deg = np.abs(self.reference_deg - self.trajectory.start_deg)
            self._yield_offset.keep_within(-from_start_deg, from_start_deg)

    def turn_at_end(self, movement: Movement) -> bool:
        """Turn at an end of the path if the test is not over. Return False if the run has ended."""
        return self.end_feel is not None and self.end_feel.turn_at_end(movement)

    # -- journal --------------------------------------------------------------------------------------------------

    def record(self, t_ns: int, state: CycleState, phase: int, path_s: float, setpoint_deg: tuple[float, ...]) -> None:
        """Write the sample for the last setpoint, measured at ``t_ns``, to the journal."""
        self.journal.append_sample(
            Sample(
                t_ns=t_ns,
                take=0,
                phase=phase,
                path_s=path_s,
                setpoint_deg=setpoint_deg,
                measured_deg=state.measured_deg,
                torque_nm=state.torque_nm,
            )
        )


def run_state(run: Run, movement: Movement | None, *, at_start: bool, returning: bool) -> RunState:
    """Return the run for the snapshot."""
    duration = run.trajectory.duration_s
    left = duration - run.position_s
    if movement and movement.path is not run.trajectory:
        left = movement.path.duration_s - movement.position_s
    elif movement and returning:
        left = movement.position_s / movement.top_override
    return RunState(
        run_id=run.load.run_id,
        recording_id=run.load.recording_id,
        position_s=run.position_s,
        duration_s=duration,
        left_s=left,
        at_start=at_start,
        resistance_level=run.load.resistance_level,
        reversals=len(run.resisted_at_s),
        reversing=run.resisting_axis is not None,
        range_percent=100.0 * run.range_override.share,
        stretch=stretch.state() if (stretch := stretch_of(run)) else None,
        self_pacing=run.self_pacing.state() if run.self_pacing else None,
    )


def stretch_of(run: Run) -> TorqueStretch | None:
    """Return the run's stretch; None if the run is none."""
    return run.end_feel if isinstance(run.end_feel, TorqueStretch) else None


def reduce(run: Run) -> Text:
    """Reduce the range, or the torque of a stretch, by one step. Return the text of the event."""
    if stretch := stretch_of(run):
        stretch.reduce()
        return texts.LESS_TORQUE_REQUESTED(target_nm=stretch.target_nm, at_s=run.position_s)
    run.range_override.reduce()
    return texts.LESS_RANGE_REQUESTED(at_s=run.position_s)
