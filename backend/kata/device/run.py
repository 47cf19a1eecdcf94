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
from kata.device.resistance import GivingWay, ResistanceMonitor
from kata.motion.learning import Correction
from kata.motion.linkage import Floats
from kata.motion.method import rate_hz
from kata.motion.trajectory import Trajectory

_USED_SHARE: Final = 0.98
"""Of the highest acceleration: reference and what is added to it together take no more."""
AHEAD_SHARE: Final = _USED_SHARE - REFERENCE_SHARE
"""Of what an axis may be bent: what is added to the reference takes this much at most, and no more than the reference leaves."""
_STEP_SHARE: Final = 0.8
"""Of what the longest step leaves above an axis' highest speed: that is judged over a tenth of a second, and may be more in between."""
_SAME_PLACE_S: Final = 1.0
"""Resistance this close on the recording's clock is in the same place."""
_AT_FULL_TORQUE: Final = 0.98
"""The highest level is the drive's own limit, which it reports a little below."""


@dataclass
class Run:
    """One load of one recording."""

    load: Load
    trajectory: Trajectory
    journal: JournalWriter
    config: StationConfig
    correction: Correction | None = None
    back_to_deg: Floats | None = None
    """Where the arm is taken back to: where the approach began, or the patient's limit nearest to that."""
    position_s: float = 0.0
    played_to_end: bool = False
    resisted_at_s: list[float] = field(default_factory=list)
    """Where strokes were broken off, on the recording's clock."""
    resisting_axis: int | None = None
    """Whose resistance the arm is being taken back from. None once the recording plays on."""
    reference_deg: Floats = field(init=False)
    """Where the arm was last to be; its setpoint may be ahead of that. With torque on."""
    _ahead_deg: Floats = field(init=False)
    _ahead_change_deg: Floats = field(init=False)
    """With the last setpoint."""
    _speed_deg_s: Floats = field(init=False)
    """Of the reference, over the last setpoint's time."""
    _met_nm: float = 0.0
    """Torque with which the resisting axis pushed."""

    def __post_init__(self) -> None:
        self.config = self.config.with_speed_limit(self.load.max_speed_deg_s)
        self.as_in_paper = self.load.method == "paper"
        """Nothing is led ahead, and where the arm stands it is told nothing new."""
        self.rate_hz = rate_hz(self.load.method, self.config.rate_hz)
        """Setpoints and samples a second."""
        self.every = self.config.cycle_hz // self.rate_hz
        """So many cycles."""
        # A setpoint holds until the next one: it aims at the middle of that time.
        self._lead_s = 0.0 if self.as_in_paper else 0.5 / self.rate_hz + self.config.setpoint_delay_s
        self._lag = self.config.lag
        acceleration = np.array([axis.max_acceleration_deg_s2 for axis in self.config.axes])
        self._ahead_bend_deg = AHEAD_SHARE * acceleration / self.rate_hz**2
        steps = [
            largest_step_deg(axis, self.rate_hz) - axis.max_speed_deg_s / self.rate_hz for axis in self.config.axes
        ]
        self._least_bend_deg = (_USED_SHARE - REFERENCE_SHARE - RAMP_SHARE) * acceleration / self.rate_hz**2
        self._bend_deg = _USED_SHARE * acceleration / self.rate_hz**2
        ramps_s = [axis.max_speed_deg_s / (RAMP_SHARE * axis.max_acceleration_deg_s2) for axis in self.config.axes]
        self._shortest_ramp_s = max(ramps_s)
        self._ahead_step_deg = np.minimum(self._ahead_bend_deg, _STEP_SHARE * np.array(steps))
        self.comfort = RangeOverride(
            self.trajectory,
            self.load.repetition_s or self.trajectory.duration_s,
            np.array([axis.max_speed_deg_s for axis in self.config.axes]),
        )
        level = self.load.load_level / LOAD_LEVELS * _AT_FULL_TORQUE
        thresholds_nm = [axis.max_torque_nm * level for axis in self.config.axes]
        self._monitor = ResistanceMonitor(thresholds_nm)
        slowest_deg_s = min(axis.max_speed_deg_s for axis in self.config.axes)
        self._giving_way = GivingWay(thresholds_nm, self.rate_hz, slowest_deg_s)
        self._limits = RunLimits(self.config.mechanism_deg, self.load.limits_deg, self.config.limit_tolerance_deg)
        self._bound()

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
        self.set_out(here_deg)
        self.back_to_deg = _within(here_deg, self._lowest_deg, self._highest_deg)
        self._limits.widen(here_deg.tolist())
        self._bound()

    def tighten(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float]) -> None:
        """Take limits that were widened for the approach inwards. To be called in every cycle with torque."""
        if self._limits.widened:
            self._limits.tighten(setpoint_deg, measured_deg)
            self._bound()

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Return True once the approach is over and the tight limits count; see :meth:`RunLimits.settle`."""
        settled = self._limits.settle(setpoint_deg, measured_deg, dt_s)
        self._bound()
        return settled

    def _bound(self) -> None:
        self._lowest_deg, self._highest_deg = np.array(self.limits_deg).T

    # -- setpoints ------------------------------------------------------------------------------------------------

    def along(self, path: Path, course: Literal[0, 1]) -> Movement:
        """Return a movement along a path whose changes of pace no axis finds too abrupt."""
        # At its end the reference stands still within one setpoint's time.
        creep = min(CREEP, 1.0 / (self._shortest_ramp_s * self.rate_hz))
        return Movement(path, course=course, shortest_ramp_s=self._shortest_ramp_s, creep=creep)

    def set_out(self, here_deg: Floats) -> None:
        """Another path begins where the last setpoint was."""
        self.reference_deg = here_deg
        self._reference_change_deg = np.zeros(len(here_deg))
        self._ahead_deg = np.zeros(len(here_deg))
        self._ahead_change_deg = np.zeros(len(here_deg))
        self._speed_deg_s = np.zeros(len(here_deg))
        self._giving_way.offset_deg = np.zeros(len(here_deg))

    def setpoint(self, movement: Movement) -> tuple[float, ...]:
        """What the drives are to be told now: the reference, and ahead of it as much as they will lag behind.

        The reference is left as it is, for the last look to refuse; what is added stays within the limits and never jumps. An arm that comes
        from outside the patient's limits is different: its setpoint is ahead of the reference, and never goes back outwards.
        """
        before_deg = self.reference_deg
        wanted = np.zeros(len(before_deg))
        if not (self.as_in_paper and movement.stands):
            wanted = self._refer(movement)
        change_deg = self.reference_deg - before_deg
        bent_deg, self._reference_change_deg = np.abs(change_deg - self._reference_change_deg), change_deg
        self._speed_deg_s = change_deg * self.rate_hz
        lowest, highest = self._lowest_deg, self._highest_deg
        if not self._limits.widened:
            lowest, highest = np.minimum(lowest, self.reference_deg), np.maximum(highest, self.reference_deg)
        if self.resisting_axis is None and movement.course == 1:
            self._giving_way.resume(max(movement.pace, 0.0))
        self._giving_way.keep_within(lowest - self.reference_deg, highest - self.reference_deg)
        wanted = _within(
            wanted + self._giving_way.offset_deg, lowest - self.reference_deg, highest - self.reference_deg
        )
        self._go_ahead(wanted, _within(self._bend_deg - bent_deg, self._least_bend_deg, self._ahead_bend_deg))
        return tuple(_within(self.reference_deg + self._ahead_deg, lowest, highest).tolist())

    def _refer(self, movement: Movement) -> Floats:
        """Move the reference on along the path. Return how far ahead of it the drives' lag wants the setpoint, ``(5,)``."""
        motion = movement.motion(self._lead_s)
        if movement.path is self.trajectory:
            motion = self.comfort.apply(motion, movement.pace, 1.0 / self.rate_hz)
        self.reference_deg = motion.angles_deg
        if self.as_in_paper:
            return np.zeros(len(motion.angles_deg))
        wanted = self._lag.ahead(motion)
        if self.correction and movement.path is self.trajectory:
            # Learned at the path's own pace and range; where the arm stands or goes back, something else would be right.
            wanted = wanted + max(movement.pace, 0.0) * self.comfort.share * self.correction.at(
                movement.place_s(self._lead_s)
            )
        return wanted

    def _go_ahead(self, wanted_deg: Floats, bend: Floats) -> None:
        """Towards what is wanted: never bent by more than ``bend``, no further in a step than the last look leaves it, and no faster than
        it can still be slowed down from.
        """
        left = wanted_deg - self._ahead_deg
        fastest = np.minimum(self._ahead_step_deg, longest_step(np.abs(left), bend))
        change = _within(_within(left, -fastest, fastest), self._ahead_change_deg - bend, self._ahead_change_deg + bend)
        self._ahead_deg, self._ahead_change_deg = self._ahead_deg + change, change

    # -- resistance -----------------------------------------------------------------------------------------------

    def resisted(self, facts: CycleState) -> int | None:
        """Return the axis whose drive has pushed with the patient's level for a tenth of a second, else None.

        To be asked in every cycle with torque; the direction of a moving axis is that of the last setpoints' reference.
        """
        return self._monitor.resisting_axis(facts, self._speed_deg_s.tolist())

    def turn_back(self, axis: int, movement: Movement, facts: CycleState) -> None:
        """Take the arm back along the path it came."""
        self.resisted_at_s.append(movement.position_s)
        self.resisting_axis = axis
        self._met_nm = facts.torque_nm[axis]
        self._monitor.turned_back(axis, self._met_nm, facts.t_ns)
        movement.course = -1
        movement.ramp_s = TURN_S
        movement.back_to_s = max(0.0, movement.position_s - self.config.reversal_s)

    def give_way(self, facts: CycleState, *, only_to_met: bool = False) -> None:
        """Let the next setpoint yield to every push above the level; ``only_to_met``: to the one that was met last."""
        torque_nm = np.array(facts.torque_nm)
        if only_to_met:
            others = np.arange(len(torque_nm)) != self.resisting_axis
            torque_nm[others | (torque_nm * self._met_nm < 0)] = 0.0
        self._giving_way.yield_to(torque_nm, np.array(facts.setpoint_deg), np.array(facts.measured_deg))

    @property
    def resisted_again(self) -> bool:
        """The last resistance was where there had been one before."""
        *earlier, last = self.resisted_at_s
        return any(abs(last - place) <= _SAME_PLACE_S for place in earlier)

    # -- as others see it -----------------------------------------------------------------------------------------

    def record(self, t_ns: int, facts: CycleState, phase: int, path_s: float, setpoint_deg: tuple[float, ...]) -> None:
        """Keep what the last setpoint came to: what was measured at ``t_ns``."""
        self.journal.sample(
            t_ns,
            take=0,
            phase=phase,
            path_s=path_s,
            setpoint_deg=setpoint_deg,
            measured_deg=facts.measured_deg,
            torque_nm=facts.torque_nm,
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
            range_percent=100.0 * self.comfort.share,
        )


def _within(values: Floats, lowest: Floats, highest: Floats) -> Floats:
    """As np.clip would, in a fifth of its time."""
    bounded: Floats = np.minimum(np.maximum(values, lowest), highest)
    return bounded
