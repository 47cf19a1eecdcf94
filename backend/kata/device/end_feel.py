"""Implements the end-feel test: decides when the arm moves back, and counts the repetitions. Reasons: docs/explanation/end-feel.md."""

import math
from collections import deque
from typing import Final

import numpy as np

from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.ipc_messages import EndFeel
from kata.device.movement import RAMP_S, Movement
from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats
from kata.motion.trajectory import Trajectory

TURN_BACK_RAMP_S: Final = 0.03
"""Time from the path's speed to rest and from rest to the speed back. 10 deg/s then need 330 deg/s2."""
SPEED_LIMIT_DEG_S: Final = 15.0
"""Speed limit of every axis during a test. The time for a turn follows from it and from the axes' acceleration; at the station's usual limit a
turn would take longer than :data:`TURN_BACK_RAMP_S`."""
_WINDOW_S: Final = 0.12
"""Time over which a straight line is fitted to the torque. An encoder count of 0.09 deg changes a drive's torque by up to 0.25 Nm, so a
single reading is too uncertain."""
_REACTION_S: Final = 0.05
"""Time from the newest reading until the arm moves back: a cycle, the drive's reaction and half a turn. The line is extrapolated by this time."""
MARGIN_NM: Final = 0.1
"""The arm moves back this much below the chosen torque, because a drive may follow up to 0.1 s later."""
_UNSTEADY_NM: Final = 0.25
"""Largest RMS difference between the torque in the free range and the fitted weight. Relaxed patients have up to 0.12 Nm. If a patient works
in the free range, the weight is wrong by 1 Nm at the turn."""
_MOST_WEIGHT_NM: Final = 1.5
"""An arm may oppose the way out by at most this torque more than the test weight does, where the moments are largest. Elsewhere the limit
is smaller, in proportion to the moments. More counts as resistance: a shoulder that resists from the start looks like a heavy arm."""
_LEAST_READINGS: Final = 20
_RETREAT_MEAN_S: Final = 0.05
"""Time over which the torque is averaged on the way back."""
_RETREAT_DEG_S_NM: Final = 40.0
"""Additional speed of the way back for each Nm above the chosen torque. A patient's push grows faster than the path moves the arm back."""
_RETREAT_DEG_S: Final = 10.0
"""Highest additional speed."""
_FACTOR_PRIOR_NM: Final = 1.0
"""Regularises the factors towards 0, the weight of the baseline, like one reading in which a factor makes this torque."""
_CONSTANT_PRIOR_NM: Final = 10.0
"""Draws the constant towards 0, more strongly than :data:`_FACTOR_PRIOR_NM` draws the factors: it is usually a tenth of a factor."""


class EndFeelTest:
    """The state of one test: the remaining repetitions, and the torque between apparatus and shoulder."""

    def __init__(self, test: EndFeel, trajectory: Trajectory, config: StationConfig) -> None:
        self._axis = test.motor - 1
        self._torque_nm = test.torque_nm
        self._curves_nm = np.array([test.expected_nm, test.back_nm or test.expected_nm, *test.arm_nm])
        self._places_a_s = (len(test.expected_nm) - 1) / trajectory.duration_s
        self._weighed_s = test.weighed_s
        self._largest_growth = float(np.max(np.linalg.norm(self._curves_nm[2:], axis=0))) if test.arm_nm else 0.0
        self._arm = _ArmWeight(len(test.arm_nm))
        self._outward = np.sign(trajectory.at(trajectory.duration_s)[self._axis] - trajectory.start_deg[self._axis])
        self.repetitions_left = test.repetitions
        self.ended_by_patient = False
        """True if the patient pressed the pedal in the hand. No repetition follows."""
        self._weight_nm = self._most_nm = 0.0
        self._turned = False
        """True on the way back, also while it is paused."""
        rows = max(3, round(_WINDOW_S * config.cycle_hz))
        self._recent: deque[float] = deque(maxlen=rows)
        self._recent_back: deque[float] = deque(maxlen=max(2, round(_RETREAT_MEAN_S * config.cycle_hz)))
        self._weights = _continued(rows, _REACTION_S * config.cycle_hz)

    def must_move_back(self, state: CycleState, movement: Movement) -> bool:
        """Return True if the arm is on its way out and must move back. Call it in every cycle of the test."""
        self.note_pedal(state)
        if movement.direction != 1:
            self._note_back(self._against_nm(state, movement, friction=-1.0))
            return False
        self._note_out(self._against_nm(state, movement, friction=1.0, weigh=True))
        if self.ended_by_patient or self._weight_uncertain(movement):
            return True
        expected_nm = self._expected_nm()
        return expected_nm is not None and expected_nm >= self._torque_nm - MARGIN_NM

    def note_hold(self, state: CycleState, movement: Movement) -> None:
        """Note the torque of a paused test. At rest, friction acts in neither direction. Call it in every cycle of the pause."""
        self.note_pedal(state)
        self._recent_back.append(self._against_nm(state, movement, friction=0.0))

    def note_pedal(self, state: CycleState) -> None:
        """End the test if the patient presses the pedal. A missing pedal also ends it. Call it in every cycle between the start and the
        end of the test.
        """
        self.ended_by_patient = self.ended_by_patient or state.pedal_down is not False

    def _against_nm(self, state: CycleState, movement: Movement, friction: float, *, weigh: bool = False) -> float:
        """Return the torque between apparatus and shoulder, outwards. ``friction``: 1 as on the way out, -1 as on the way back."""
        out_nm, back_nm, *arm_nm = self._curves_at(movement.position_s).tolist()
        beyond_nm = state.torque_nm[self._axis] - (out_nm + back_nm + friction * (out_nm - back_nm)) / 2
        if weigh:
            self._weigh(movement, arm_nm, beyond_nm)
        self._weight_nm, self._most_nm = self._outward * self._arm.weight_nm(arm_nm), self._most_weight_nm(arm_nm)
        return float(self._outward * beyond_nm - min(self._weight_nm, self._most_nm))

    def _weight_uncertain(self, movement: Movement) -> bool:
        """Return True if the patient worked while the arm was weighed, or if resistance looked like weight."""
        weighed = movement.position_s > self._weighed_s[1]
        return weighed and (self._arm.rms_nm > _UNSTEADY_NM or self._weight_nm > self._most_nm)

    def _note_out(self, against_nm: float) -> None:
        self._recent_back.clear()
        self._recent.append(against_nm)

    def _note_back(self, against_nm: float) -> None:
        self._recent.clear()
        self._recent_back.append(against_nm)

    def _expected_nm(self) -> float | None:
        """Return the torque :data:`_REACTION_S` from now, or the mean of the last readings if this is greater; None without enough readings."""
        if len(self._recent) < len(self._weights):
            return None
        recent = np.array(self._recent)
        return float(max(self._weights @ recent, recent.mean()))

    def _weigh(self, movement: Movement, arm_nm: list[float], beyond_nm: float) -> None:
        """Weigh the arm in the free range of every way out."""
        if movement.position_s < self._weighed_s[0]:
            self._arm = _ArmWeight(len(arm_nm))
        elif movement.position_s <= self._weighed_s[1]:
            self._arm.add(arm_nm, beyond_nm)

    def _most_weight_nm(self, arm_nm: list[float]) -> float:
        """Return the largest torque by which the arm's weight may oppose the way out at a place, beyond the baseline's."""
        return _MOST_WEIGHT_NM * math.hypot(*arm_nm) / self._largest_growth if self._largest_growth else 0.0

    def retreat_deg_s(self) -> Floats:
        """Return the additional speed back, ``(5,)`` in deg/s, of the way back and of a pause. It is 0 unless the patient pushes with more than
        the chosen torque.
        """
        speeds = np.zeros(N_AXES)
        if len(self._recent_back) == self._recent_back.maxlen:
            excess_nm = sum(self._recent_back) / len(self._recent_back) - (self._torque_nm - MARGIN_NM)
            speeds[self._axis] = -self._outward * min(max(excess_nm, 0.0) * _RETREAT_DEG_S_NM, _RETREAT_DEG_S)
        return speeds

    def _curves_at(self, position_s: float) -> Floats:
        place = position_s * self._places_a_s
        before = min(int(place), self._curves_nm.shape[1] - 2)
        share = place - before
        found: Floats = self._curves_nm[:, before] * (1.0 - share) + self._curves_nm[:, before + 1] * share
        return found

    def turn_back(self, movement: Movement) -> None:
        """Take the arm back along its path."""
        self._turned = True
        movement.direction, movement.ramp_s, movement.reverse_to_s = -1, TURN_BACK_RAMP_S, 0.0

    def resume(self, movement: Movement) -> None:
        """Continue after a pause: the way back if the arm has turned or the patient has ended the test."""
        if self._turned or self.ended_by_patient:
            self.turn_back(movement)

    def turn_at_end(self, movement: Movement) -> bool:
        """Turn at an end of the path if the test is not over. Count a repetition at its start. Return False after the last one."""
        if movement.direction == 1:
            self.turn_back(movement)
            return True
        self.repetitions_left -= 1
        if self.repetitions_left <= 0 or self.ended_by_patient:
            return False
        self._turned = False
        movement.direction, movement.ramp_s = 1, RAMP_S
        return True


class _ArmWeight:
    """Finds the factors of the arm's weight, relative to the baseline's, by recursive least squares.

    The last factor is a constant: the torque of the relaxed patient's muscles. It is fitted separately, because the weight grows along the
    way and the constant does not. It acts between apparatus and shoulder and is not subtracted.
    """

    def __init__(self, number: int) -> None:
        self._prior = np.diag([_FACTOR_PRIOR_NM**2] * number + [_CONSTANT_PRIOR_NM**2])
        self._products = self._prior.copy()
        self._count = 0
        self._square = 0.0
        self._sums = np.zeros(number + 1)
        self.factors: Floats = np.zeros(number + 1)

    def weight_nm(self, growth_nm: list[float]) -> float:
        return float(self.factors[:-1] @ np.array(growth_nm))

    @property
    def rms_nm(self) -> float:
        """Return the RMS difference between the torques and the fitted weight."""
        if self._count < _LEAST_READINGS:
            return 0.0
        found = self.factors @ (self._products - self._prior) @ self.factors
        return float(np.sqrt(max(self._square - 2 * self.factors @ self._sums + found, 0.0) / self._count))

    def add(self, growth_nm: list[float], beyond_nm: float) -> None:
        row = np.array([*growth_nm, 1.0])
        self._products += np.outer(row, row)
        self._sums += row * beyond_nm
        self._count += 1
        self._square += beyond_nm**2
        self.factors = np.asarray(np.linalg.solve(self._products, self._sums), dtype=np.float64)


def _continued(rows: int, ahead: float) -> Floats:
    """Return weights ``(rows,)``. The weighted sum of evenly spaced values is their fitted line ``ahead`` steps after the last value."""
    steps = np.arange(rows) - (rows - 1) / 2
    weights: Floats = 1 / rows + steps * ((rows - 1) / 2 + ahead) / np.sum(steps**2)
    return weights
