"""A run: one recording on its way from load to end, what was measured of it, and where the patient resisted."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from kata.device.comfort import Comfort
from kata.device.config import REFERENCE_SHARE, StationConfig
from kata.device.facts import Facts, Limits
from kata.device.faults import largest_step_deg
from kata.device.journal import JournalWriter
from kata.device.messages import LOAD_LEVELS, Load, RunState
from kata.device.movement import Movement, longest_step
from kata.motion.learning import Correction
from kata.motion.linkage import Floats
from kata.motion.method import rate_hz
from kata.motion.trajectory import Trajectory

AHEAD_SHARE: Final = 0.98 - REFERENCE_SHARE
"""Of what an axis may be bent: what the reference leaves, but for a little that less range bends it more."""
_STEP_SHARE: Final = 0.8
"""Of what the longest step leaves above an axis' highest speed: that is judged over a tenth of a second, and may be more in between."""
_RESISTS_NS: Final = 100_000_000
"""A push shorter than this is none."""
_MOVING_DEG_S: Final = 2.0
"""An axis that is slower has no direction to push in."""
_SAME_PLACE_S: Final = 1.0
"""Resistance this close on the recording's clock is in the same place."""
_YIELD_S: Final = 0.08
"""Turning back is quicker than a pause: until then the arm is still pushed."""
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
    came_from: Floats | None = None
    """Where the approach began, and where the arm is taken back to."""
    position_s: float = 0.0
    played_to_end: bool = False
    resisted_at_s: list[float] = field(default_factory=list)
    """Where strokes were broken off, on the recording's clock."""
    resisting_axis: int | None = None
    """Whose resistance the arm is being taken back from."""
    reference_deg: Floats = field(init=False)
    """Where the arm was last to be; its setpoint may be ahead of that. With torque on."""
    _setpoint_deg: Floats = field(init=False)
    """The last one."""
    _ahead_deg: Floats = field(init=False)
    _ahead_change_deg: Floats = field(init=False)
    """With the last setpoint."""
    _resists_since_ns: list[int | None] = field(default_factory=list)

    def __post_init__(self) -> None:
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
        self._ahead_step_deg = np.minimum(self._ahead_bend_deg, _STEP_SHARE * np.array(steps))
        self.comfort = Comfort(
            self.trajectory,
            self.load.repetition_s or self.trajectory.duration_s,
            np.array([axis.max_speed_deg_s for axis in self.config.axes]),
        )
        level = self.load.load_level / LOAD_LEVELS * _AT_FULL_TORQUE
        self._threshold_nm = [axis.max_torque_nm * level for axis in self.config.axes]
        self.forget_resistance()
        self._allow(self._tightest())

    def begin(self, came_from: Floats) -> None:
        """Torque is about to go on, with the arm at ``came_from``: wherever that is, on the way from there and back it may be."""
        self.came_from = came_from
        self.set_out(came_from)
        self._allow(
            tuple(
                (min(low, float(angle)), max(high, float(angle)))
                for (low, high), angle in zip(self.limits_deg, came_from, strict=True)
            )
        )

    def set_out(self, here_deg: Floats) -> None:
        """Another path begins where the last setpoint was."""
        self.reference_deg = self._setpoint_deg = here_deg
        self._ahead_deg = np.zeros(len(here_deg))
        self._ahead_change_deg = np.zeros(len(here_deg))

    def setpoint(self, movement: Movement) -> tuple[float, ...]:
        """What the drives are to be told now: the reference, and ahead of it as much as they will lag behind.

        The reference is left as it is, for the last look to refuse; what is added stays within the limits and never jumps.
        """
        motion = movement.motion(self._lead_s)
        if movement.path is self.trajectory:
            motion = self.comfort.apply(motion, movement.pace, 1.0 / self.rate_hz)
        self.reference_deg = motion.angles_deg
        if not self.as_in_paper:
            wanted = self._lag.ahead(motion)
            if self.correction and movement.path is self.trajectory:
                # Learned at the path's own pace and range; where the arm stands or goes back, something else would be right.
                wanted = wanted + max(movement.pace, 0.0) * self.comfort.share * self.correction.at(
                    movement.place_s(self._lead_s)
                )
            self._go_ahead(wanted)
        lowest = np.minimum(self._lowest_deg, self.reference_deg)
        highest = np.maximum(self._highest_deg, self.reference_deg)
        setpoint = self._braked(lowest, highest)
        self._setpoint_deg = setpoint
        return tuple(setpoint.tolist())

    def _braked(self, lowest: Floats, highest: Floats) -> Floats:
        """Return the setpoint ``(5,)``: within its limits, and no faster towards them than it can be slowed down before them.

        A setpoint that is ahead of a fast reference would stop at a limit from full speed otherwise, which the last look takes for a jerk.
        """
        setpoint = _within(self.reference_deg + self._ahead_deg, lowest, highest)
        if self.as_in_paper:
            return setpoint
        last, bend = self._setpoint_deg, self._ahead_bend_deg
        fastest_up = last + longest_step(np.maximum(highest - last, 0.0), bend)
        fastest_down = last - longest_step(np.maximum(last - lowest, 0.0), bend)
        # The reference itself is never slowed down here: it brakes by its own share.
        braked = _within(
            setpoint, np.minimum(fastest_down, self.reference_deg), np.maximum(fastest_up, self.reference_deg)
        )
        ahead = braked - self.reference_deg
        self._ahead_change_deg = self._ahead_change_deg + ahead - self._ahead_deg
        self._ahead_deg = ahead
        return braked

    def _go_ahead(self, wanted_deg: Floats) -> None:
        """Towards what is wanted: never bent by more than its share, no further in a step than the last look leaves it, and no
        faster than it can still be slowed down from.
        """
        bend = self._ahead_bend_deg
        left = wanted_deg - self._ahead_deg
        fastest = np.minimum(self._ahead_step_deg, longest_step(np.abs(left), bend))
        change = _within(_within(left, -fastest, fastest), self._ahead_change_deg - bend, self._ahead_change_deg + bend)
        self._ahead_deg, self._ahead_change_deg = self._ahead_deg + change, change

    def _allow(self, limits_deg: Limits) -> None:
        self.limits_deg = limits_deg
        """What may be commanded: the tighter of mechanism and patient."""
        self._lowest_deg, self._highest_deg = np.array(limits_deg).T

    def _tightest(self) -> Limits:
        limits = self.config.mechanism_deg
        if not self.load.limits_deg:
            return limits
        return tuple(
            (max(low, patients_low), min(high, patients_high))
            for (low, high), (patients_low, patients_high) in zip(limits, self.load.limits_deg, strict=True)
        )

    # -- resistance -----------------------------------------------------------------------------------------------

    def forget_resistance(self) -> None:
        """What was felt so far belongs to another stroke."""
        self.resisting_axis = None
        self._resists_since_ns = [None] * len(self.config.axes)

    def resisted(self, facts: Facts, before_deg: Sequence[float], reference_deg: Sequence[float]) -> int | None:
        """The axis that has pushed forward harder than the patient's level for a tenth of a second, if there is one."""
        for n, threshold in enumerate(self._threshold_nm):
            speed = (reference_deg[n] - before_deg[n]) * self.rate_hz
            pushes = facts.torque_nm[n] * np.sign(speed) >= threshold and abs(speed) >= _MOVING_DEG_S
            since = self._resists_since_ns[n]
            if not pushes:
                self._resists_since_ns[n] = None
            elif since is None:
                self._resists_since_ns[n] = facts.t_ns
            elif facts.t_ns - since >= _RESISTS_NS:
                return n
        return None

    def turn_back(self, axis: int, movement: Movement) -> None:
        """Take the arm back along the path it came."""
        self.resisted_at_s.append(movement.position_s)
        self.resisting_axis = axis
        movement.course = -1
        movement.ramp_s = _YIELD_S
        movement.back_to_s = max(0.0, movement.position_s - self.config.reversal_s)

    @property
    def resisted_again(self) -> bool:
        """The last resistance was where there had been one before."""
        *earlier, last = self.resisted_at_s
        return any(abs(last - place) <= _SAME_PLACE_S for place in earlier)

    # -- as others see it -----------------------------------------------------------------------------------------

    def record(self, t_ns: int, facts: Facts, phase: int, path_s: float, setpoint_deg: tuple[float, ...]) -> None:
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
