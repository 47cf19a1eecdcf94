"""A run: one recording on its way from load to end, what was measured of it, and where the patient resisted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from kata.device.config import REFERENCE_SHARE, StationConfig
from kata.device.config_rules import RAMP_SHARE, TURN_S
from kata.device.cycle_state import CycleState, Limits
from kata.device.faults import largest_step_deg
from kata.device.journal import JournalWriter
from kata.device.limits import RunLimits
from kata.device.messages import LOAD_LEVELS, Load, RunState
from kata.device.movement import CREEP, Movement, Path, longest_step
from kata.device.range_override import RangeOverride
from kata.device.resistance import ResistanceMonitor, YieldOffset
from kata.motion.learning import Correction
from kata.motion.linkage import Floats
from kata.motion.method import rate_hz
from kata.motion.trajectory import Trajectory

_USED_SHARE: Final = 0.98
"""Of the highest acceleration: reference and what is added to it together take no more."""
FEED_FORWARD_SHARE: Final = _USED_SHARE - REFERENCE_SHARE
"""Of what an axis may be bent: what is added to the reference takes this much at most, and no more than the reference leaves."""
_STEP_SHARE: Final = 0.8
"""Of what the longest step leaves above an axis' highest speed: that is judged over a tenth of a second, and may be more in between."""
_SAME_PLACE_S: Final = 1.0
"""Resistance this close on the recording's clock is in the same place."""
_FULL_TORQUE_SHARE: Final = 0.98
"""The highest level is the drive's own limit, which it reports a little below."""


@dataclass
class Run:
    """One load of one recording."""

    load: Load
    trajectory: Trajectory
    journal: JournalWriter
    config: StationConfig
    correction: Correction | None = None
    return_to_deg: Floats | None = None
    """Where the arm is taken back to: where the approach began, or the patient's limit nearest to that."""
    position_s: float = 0.0
    played_to_end: bool = False
    resisted_at_s: list[float] = field(default_factory=list)
    """Where strokes were broken off, on the recording's clock."""
    resisting_axis: int | None = None
    """Whose resistance the arm is being taken back from. None once the recording plays on."""
    reference_deg: Floats = field(init=False)
    """Where the arm was last to be; its setpoint may be ahead of that. With torque on."""
    _feed_forward_deg: Floats = field(init=False)
    _feed_forward_change_deg: Floats = field(init=False)
    """With the last setpoint."""
    _speed_deg_s: Floats = field(init=False)
    """Of the reference, over the last setpoint's time."""
    _reversal_torque_nm: float = 0.0
    """Torque with which the resisting axis pushed."""

    def __post_init__(self) -> None:
        self.config = self.config.with_speed_limit(self.load.max_speed_deg_s)
        self.zero_order_hold = self.load.method == "paper"
        """Nothing is led ahead, and where the arm stands it is told nothing new."""
        self.rate_hz = rate_hz(self.load.method, self.config.rate_hz)
        """Setpoints and samples a second."""
        self.cycles_per_setpoint = self.config.cycle_hz // self.rate_hz
        """So many cycles."""
        # A setpoint holds until the next one: it aims at the middle of that time.
        self._lead_s = 0.0 if self.zero_order_hold else 0.5 / self.rate_hz + self.config.setpoint_delay_s
        self._servo_model = self.config.lag
        acceleration = np.array([axis.max_acceleration_deg_s2 for axis in self.config.axes])
        self._feed_forward_second_difference_deg = FEED_FORWARD_SHARE * acceleration / self.rate_hz**2
        steps = [
            largest_step_deg(axis, self.rate_hz) - axis.max_speed_deg_s / self.rate_hz for axis in self.config.axes
        ]
        self._min_second_difference_deg = (_USED_SHARE - REFERENCE_SHARE - RAMP_SHARE) * acceleration / self.rate_hz**2
        self._max_second_difference_deg = _USED_SHARE * acceleration / self.rate_hz**2
        ramps_s = [axis.max_speed_deg_s / (RAMP_SHARE * axis.max_acceleration_deg_s2) for axis in self.config.axes]
        self._shortest_ramp_s = max(ramps_s)
        self._feed_forward_step_deg = np.minimum(
            self._feed_forward_second_difference_deg, _STEP_SHARE * np.array(steps)
        )
        self.range_override = RangeOverride(
            self.trajectory,
            self.load.repetition_s or self.trajectory.duration_s,
            np.array([axis.max_speed_deg_s for axis in self.config.axes]),
        )
        level = self.load.load_level / LOAD_LEVELS * _FULL_TORQUE_SHARE
        thresholds_nm = [axis.max_torque_nm * level for axis in self.config.axes]
        self._monitor = ResistanceMonitor(thresholds_nm)
        slowest_deg_s = min(axis.max_speed_deg_s for axis in self.config.axes)
        self._yield_offset = YieldOffset(thresholds_nm, self.rate_hz, slowest_deg_s)
        self._limits = RunLimits(self.config.mechanism_deg, self.load.limits_deg, self.config.limit_tolerance_deg)
        self._update_bounds()

    @property
    def approach_speed_deg_s(self) -> float:
        """Highest speed of approach and return: the station's, or the patient's limit where that is lower."""
        return min(self.config.approach_speed_deg_s, self.load.max_speed_deg_s or math.inf)

    # -- limits ---------------------------------------------------------------------------------------------------

    @property
    def limits_deg(self) -> Limits:
        """What may be commanded: the tighter of mechanism and patient, during the approach as far as the arm is outside."""
        return self._limits.now_deg

    def begin(self, here_deg: Floats) -> None:
        """Begin an approach at ``here_deg``, ``(5,)``; the return will end there, or at the limit nearest to it."""
        self.start_path(here_deg)
        self.return_to_deg = _clip(here_deg, self._lowest_deg, self._highest_deg)
        self._limits.widen(here_deg.tolist())
        self._update_bounds()

    def tighten(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float]) -> None:
        """Take limits that were widened for the approach inwards. To be called in every cycle with torque."""
        if self._limits.widened:
            self._limits.tighten(setpoint_deg, measured_deg)
            self._update_bounds()

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Return True once the approach is over and the tight limits count; see :meth:`RunLimits.settle`."""
        settled = self._limits.settle(setpoint_deg, measured_deg, dt_s)
        self._update_bounds()
        return settled

    def _update_bounds(self) -> None:
        self._lowest_deg, self._highest_deg = np.array(self.limits_deg).T

    # -- setpoints ------------------------------------------------------------------------------------------------

    def movement_along(self, path: Path, direction: Literal[0, 1]) -> Movement:
        """Return a movement along a path whose changes of pace no axis finds too abrupt."""
        # At its end the reference stands still within one setpoint's time.
        creep = min(CREEP, 1.0 / (self._shortest_ramp_s * self.rate_hz))
        return Movement(path, direction=direction, shortest_ramp_s=self._shortest_ramp_s, creep=creep)

    def start_path(self, here_deg: Floats) -> None:
        """Another path begins where the last setpoint was."""
        self.reference_deg = here_deg
        self._reference_change_deg = np.zeros(len(here_deg))
        self._feed_forward_deg = np.zeros(len(here_deg))
        self._feed_forward_change_deg = np.zeros(len(here_deg))
        self._speed_deg_s = np.zeros(len(here_deg))
        self._yield_offset.offset_deg = np.zeros(len(here_deg))

    def setpoint(self, movement: Movement) -> tuple[float, ...]:
        """What the drives are to be told now: the reference, and ahead of it as much as they will lag behind.

        The reference is left as it is, for the last look to refuse; what is added stays within the limits and never jumps. An arm that comes
        from outside the patient's limits is different: its setpoint is ahead of the reference, and never goes back outwards.
        """
        before_deg = self.reference_deg
        wanted = np.zeros(len(before_deg))
        if not (self.zero_order_hold and movement.at_rest):
            wanted = self._advance_reference(movement)
        change_deg = self.reference_deg - before_deg
        second_difference_deg, self._reference_change_deg = np.abs(change_deg - self._reference_change_deg), change_deg
        self._speed_deg_s = change_deg * self.rate_hz
        lowest, highest = self._lowest_deg, self._highest_deg
        if not self._limits.widened:
            lowest, highest = np.minimum(lowest, self.reference_deg), np.maximum(highest, self.reference_deg)
        if self.resisting_axis is None and movement.direction == 1:
            self._yield_offset.resume(max(movement.speed_override, 0.0))
        self._yield_offset.keep_within(lowest - self.reference_deg, highest - self.reference_deg)
        wanted = _clip(
            wanted + self._yield_offset.offset_deg, lowest - self.reference_deg, highest - self.reference_deg
        )
        self._update_feed_forward(
            wanted,
            _clip(
                self._max_second_difference_deg - second_difference_deg,
                self._min_second_difference_deg,
                self._feed_forward_second_difference_deg,
            ),
        )
        return tuple(_clip(self.reference_deg + self._feed_forward_deg, lowest, highest).tolist())

    def _advance_reference(self, movement: Movement) -> Floats:
        """Move the reference on along the path. Return how far ahead of it the drives' lag wants the setpoint, ``(5,)``."""
        motion = movement.motion(self._lead_s)
        if movement.path is self.trajectory:
            motion = self.range_override.apply(motion, movement.speed_override, 1.0 / self.rate_hz)
        self.reference_deg = motion.angles_deg
        if self.zero_order_hold:
            return np.zeros(len(motion.angles_deg))
        wanted = self._servo_model.ahead(motion)
        if self.correction and movement.path is self.trajectory:
            # Learned at the path's own pace and range; where the arm stands or goes back, something else would be right.
            wanted = wanted + max(movement.speed_override, 0.0) * self.range_override.share * self.correction.at(
                movement.place_s(self._lead_s)
            )
        return wanted

    def _update_feed_forward(self, wanted_deg: Floats, second_difference: Floats) -> None:
        """Towards what is wanted: never bent by more than ``second_difference``, no further in a step than the last look leaves it, and no faster than
        it can still be slowed down from.
        """
        left = wanted_deg - self._feed_forward_deg
        fastest = np.minimum(self._feed_forward_step_deg, longest_step(np.abs(left), second_difference))
        change = _clip(
            _clip(left, -fastest, fastest),
            self._feed_forward_change_deg - second_difference,
            self._feed_forward_change_deg + second_difference,
        )
        self._feed_forward_deg, self._feed_forward_change_deg = self._feed_forward_deg + change, change

    # -- resistance -----------------------------------------------------------------------------------------------

    def detect_resistance(self, state: CycleState) -> int | None:
        """Return the axis whose drive has pushed with the patient's level for a tenth of a second, else None.

        To be asked in every cycle with torque; the direction of a moving axis is that of the last setpoints' reference.
        """
        return self._monitor.resisting_axis(state, self._speed_deg_s.tolist())

    def reverse(self, axis: int, movement: Movement, state: CycleState) -> None:
        """Take the arm back along the path it came."""
        self.resisted_at_s.append(movement.position_s)
        self.resisting_axis = axis
        self._reversal_torque_nm = state.torque_nm[axis]
        self._monitor.start_after_reversal(axis, self._reversal_torque_nm, state.t_ns)
        movement.direction = -1
        movement.ramp_s = TURN_S
        movement.reverse_to_s = max(0.0, movement.position_s - self.config.reversal_s)

    def yield_to_push(self, state: CycleState, *, only_to_reversal: bool = False) -> None:
        """Let the next setpoint yield to every push above the level; ``only_to_reversal``: to the one that was met last."""
        torque_nm = np.array(state.torque_nm)
        if only_to_reversal:
            others = np.arange(len(torque_nm)) != self.resisting_axis
            torque_nm[others | (torque_nm * self._reversal_torque_nm < 0)] = 0.0
        self._yield_offset.yield_to(torque_nm, np.array(state.setpoint_deg), np.array(state.measured_deg))

    @property
    def resisted_again(self) -> bool:
        """The last resistance was where there had been one before."""
        *earlier, last = self.resisted_at_s
        return any(abs(last - place) <= _SAME_PLACE_S for place in earlier)

    # -- as others see it -----------------------------------------------------------------------------------------

    def record(self, t_ns: int, state: CycleState, phase: int, path_s: float, setpoint_deg: tuple[float, ...]) -> None:
        """Keep what the last setpoint came to: what was measured at ``t_ns``."""
        self.journal.append_sample(
            t_ns,
            take=0,
            phase=phase,
            path_s=path_s,
            setpoint_deg=setpoint_deg,
            measured_deg=state.measured_deg,
            torque_nm=state.torque_nm,
        )

    def state(self, movement: Movement | None, *, at_start: bool) -> RunState:
        """As the snapshot tells it."""
        duration = self.trajectory.duration_s
        left = duration - self.position_s
        if movement and movement.path is not self.trajectory:
            left = movement.path.duration_s - movement.position_s
        return RunState(
            run_id=self.load.run_id,
            recording_id=self.load.recording_id,
            position_s=self.position_s,
            duration_s=duration,
            left_s=left,
            at_start=at_start,
            load_level=self.load.load_level,
            reversals=len(self.resisted_at_s),
            reversing=self.resisting_axis is not None,
            range_percent=100.0 * self.range_override.share,
        )


def _clip(values: Floats, lowest: Floats, highest: Floats) -> Floats:
    """As np.clip would, in a fifth of its time."""
    bounded: Floats = np.minimum(np.maximum(values, lowest), highest)
    return bounded
