"""Implements a stretch: a closed loop on the torque between apparatus and shoulder. Reasons: docs/explanation/stretch.md.

The way out, the weighing of the arm and the way back are those of an end-feel test. In between, the arm is held at the torque by slow
movements along the path.
"""

from collections.abc import Collection
from typing import Final

import numpy as np

from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.end_feel import MARGIN_NM, TURN_BACK_RAMP_S, EndFeelTest
from kata.device.ipc_messages import EndFeel, StretchPhase, StretchState
from kata.device.movement import Movement
from kata.motion.end_feel import STATED_SHARE
from kata.motion.trajectory import Trajectory

_REDUCTION_SHARE: Final = 0.2
"""Share of the chosen torque that one request removes."""
_LEAST_SHARE: Final = 0.2
_AIM_NM: Final = MARGIN_NM + 0.05
"""The arm is held this much below the target: the margin of an end-feel test, and half of :data:`_STEADY_NM`."""
_STEADY_NM: Final = 0.1
"""The arm does not move while the torque differs by less from where it is held. A motor's torque has steps of up to 0.25 Nm."""
_RAMP_SHARE: Final = 0.5
_RAMP_LEAST_NM: Final = 0.5
"""The way out slows down over this share of the target, at least over this torque."""
_SLOWEST_OUT: Final = 0.1
"""Slowest speed override of the way out. The arm would not arrive with less."""
_CREEP_OUT: Final = 0.04
"""Highest speed override outwards while the torque is held. A capsule relaxes by a few degrees in a minute. A patient who helps the apparatus
for some seconds must not take the shoulder much farther."""
_SPAN_NM: Final = 0.5
"""Difference of torque at which the arm moves back with the path's own speed while it is held."""
_SUDDEN_NM: Final = 0.1
"""Torque above the target at which the arm is released: the patient pushes."""
_LOWERED_NM_S: Final = 0.5
"""The limit of the release follows a reduced target at this rate, so that a request for less torque is no push."""
_SLIDING_DEG: Final = 0.5
"""Movement in which friction changes its direction (Dahl's model)."""
_FRICTION_S: Final = 1.0
"""At rest the assumed friction decays with this time constant. Less friction means more torque at the shoulder, so an error of this value
makes a stretch gentler."""


class TorqueStretch(EndFeelTest):
    """The state of one stretch: phase, target, and counted time."""

    def __init__(self, stretch: EndFeel, trajectory: Trajectory, config: StationConfig) -> None:
        super().__init__(stretch, trajectory, config)
        self._chosen_nm = stretch.torque_nm
        self._hold_s = stretch.hold_s
        self._cycle_s = 1.0 / config.cycle_hz
        way_deg = abs(trajectory.at(trajectory.duration_s)[self._axis] - trajectory.start_deg[self._axis])
        self._deg_per_s = float(way_deg) / trajectory.duration_s
        self._limit_nm = self._chosen_nm + _SUDDEN_NM
        self._phase: StretchPhase = "out"
        self._hold_left_s = stretch.hold_s
        self._friction = 0.0
        """Direction of friction, from -1 to 1, positive as on the way out."""
        self._place_s = 0.0
        self._shown_nm = 0.0
        self.held_s = 0.0
        """Time in all repetitions with at least :data:`~kata.motion.end_feel.STATED_SHARE` of the target."""

    @property
    def target_nm(self) -> float:
        """The chosen torque, or less after a request."""
        return self._torque_nm

    @property
    def at_minimum(self) -> bool:
        """True if the torque cannot be reduced further."""
        return self._torque_nm <= _LEAST_SHARE * self._chosen_nm + 1e-9

    def reduce(self) -> None:
        """Reduce the target by one step for the rest of the stretch."""
        self._torque_nm = max(self._torque_nm - _REDUCTION_SHARE * self._chosen_nm, _LEAST_SHARE * self._chosen_nm)

    def release(self) -> None:
        """Let the repetition end by the way back, also after a pause."""
        self._phase, self._turned = "release", True

    def must_move_back(self, state: CycleState, movement: Movement) -> bool:
        """Set the speed along the path. Return True if the arm is stretched and must be released. Call it in every cycle of the stretch."""
        self.note_pedal(state)
        self._follow_friction(movement)
        weigh = self._phase == "out" and movement.direction == 1
        against_nm = self._against_nm(state, movement, self._friction, weigh=weigh)
        self._limit_nm = max(self._torque_nm + _SUDDEN_NM, self._limit_nm - _LOWERED_NM_S * self._cycle_s)
        if self._phase == "release":
            self._note_back(against_nm)
            self._count(self._recent_back)
            return False
        self._note_out(against_nm)
        self._count(self._recent)
        if movement.direction == 0:
            # Pause has been requested.
            return False
        if self.ended_by_patient or self._weight_uncertain(movement):
            return True
        expected_nm = self._expected_nm()
        if expected_nm is None:
            return False
        movement.ramp_s = TURN_BACK_RAMP_S
        if self._phase == "out":
            begins_hold = self._approach(movement, expected_nm)
            # The arm must be weighed before a hold. Without its weight the torque at the shoulder is unknown.
            unweighed = begins_hold and movement.position_s <= self._weighed_s[1]
            return unweighed or expected_nm >= self._limit_nm
        self._hold_left_s -= self._cycle_s
        mean_nm = sum(self._recent) / len(self._recent)
        self._hold(movement, mean_nm)
        # An encoder's counts make the extrapolated line uncertain. A push also raises the mean.
        pushed = expected_nm >= self._limit_nm and mean_nm >= self._limit_nm - _SUDDEN_NM / 2
        return pushed or self._hold_left_s <= 0.0

    def note_hold(self, state: CycleState, movement: Movement) -> None:
        """Note the torque of a paused stretch. Its time counts too. Call it in every cycle of the pause."""
        super().note_hold(state, movement)
        self._place_s = movement.position_s
        self._count(self._recent_back)

    def turn_back(self, movement: Movement) -> None:
        """Release the arm: take it back along its path."""
        super().turn_back(movement)
        movement.top_override = 1.0
        self._phase = "release"

    def resume(self, movement: Movement) -> None:
        """Continue after a pause. A stretch that was held is released: a therapist pauses because the patient is in pain."""
        self._turned = self._turned or self._phase != "out"
        super().resume(movement)

    def turn_at_end(self, movement: Movement) -> bool:
        """Hold the arm at the end of the path, which is the largest angle. Count a repetition at the path's start. Return False after the last
        one.
        """
        if movement.direction == 1:
            self._phase = "hold"
            return True
        continues = super().turn_at_end(movement)
        self._phase, self._hold_left_s = "out", self._hold_s
        return continues

    def state(self) -> StretchState:
        """Return the stretch for the snapshot."""
        return StretchState(
            phase=self._phase,
            torque_nm=self._shown_nm,
            target_nm=self._torque_nm,
            hold_left_s=max(self._hold_left_s, 0.0),
            held_s=self.held_s,
            repetitions_left=self.repetitions_left,
        )

    def _approach(self, movement: Movement, expected_nm: float) -> bool:
        """Slow the way out down near the target. Begin to hold there. Return True if the hold begins."""
        left_nm = self._torque_nm - _AIM_NM - expected_nm
        begins_hold = left_nm <= 0.0
        if begins_hold:
            self._phase = "hold"
        ramp_nm = max(_RAMP_SHARE * self._chosen_nm, _RAMP_LEAST_NM)
        movement.top_override = min(max(left_nm / ramp_nm, _SLOWEST_OUT), 1.0)
        return begins_hold

    def _hold(self, movement: Movement, mean_nm: float) -> None:
        """Move slowly towards the torque that is held. The arm may move back faster than out."""
        left_nm = self._torque_nm - _AIM_NM - mean_nm
        beyond_nm = left_nm - float(np.clip(left_nm, -_STEADY_NM, _STEADY_NM))
        override = min(max(beyond_nm / _SPAN_NM, -1.0), _CREEP_OUT)
        movement.direction = 1 if override >= 0.0 else -1
        movement.top_override = abs(override)
        movement.reverse_to_s = 0.0

    def _follow_friction(self, movement: Movement) -> None:
        """Change the direction of friction by the movement along the path. At rest it fades."""
        moved_deg = (movement.position_s - self._place_s) * self._deg_per_s
        self._place_s = movement.position_s
        share = min(abs(moved_deg) / _SLIDING_DEG, 1.0)
        towards = float(np.sign(moved_deg))
        fading = self._cycle_s / _FRICTION_S * (1.0 - min(abs(movement.speed_override) / _SLOWEST_OUT, 1.0))
        self._friction += share * (towards - self._friction) - fading * self._friction

    def _count(self, recent: Collection[float]) -> None:
        """Count the time of this cycle. ``recent``: torques of the last cycles."""
        self._shown_nm = sum(recent) / len(recent)
        if self._shown_nm >= STATED_SHARE * self._torque_nm:
            self.held_s += self._cycle_s
