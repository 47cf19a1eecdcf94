"""Step 9: measures the step response of each motor, and lets the technician tune its position gains.

Motors have torque only during a measurement. While the technician compares the responses, torque is off. Every gain that is kept was
measured with each load.
"""

from dataclasses import dataclass, field
from itertools import cycle
from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.gain_proposal import Advice, Gains, gain_limits, propose
from kata.commissioning.gains_review import GainSet, GainsReview, MotorGains
from kata.commissioning.live_drives import LiveDrives, live_drives
from kata.commissioning.record import RecordedCurve
from kata.commissioning.step_response import (
    LARGEST_OVERSHOOT,
    LARGEST_STEADY_ERROR_DEG,
    StepResponse,
    step_response,
)
from kata.commissioning.workbench import ManualAction, StepError, UnstableError, Workbench
from kata.device.config import Axis
from kata.messages import Template, Text
from kata.motion.axes import AXES
from kata.motion.linkage import Floats

STEP_DEG: Final = 2.0
"""Height of the step. It is large compared with the encoder's resolution (0.09 deg) and friction, but stays far from the
torque limit of motor 5.
"""
_STEP_S: Final = 1.5
_CURVE_HZ: Final = 50
LARGEST_DISTANCE_DEG: Final = 5 * STEP_DEG
"""Distance of a motor from its setpoint at which a measurement ends with torque off, because the gains are unstable."""

LOADS: Final = (
    ("weight", ManualAction("free_arm", texts.HANG_WEIGHT())),
    ("empty", ManualAction("empty_arm", texts.EMPTY_ARM())),
)
"""Name of each load, and the instruction with which the technician sets it up."""
_ADVICE: Final[dict[Advice, Template]] = {
    "damp": texts.ADVICE_DAMP,
    "faster": texts.ADVICE_FASTER,
    "integrate": texts.ADVICE_INTEGRATE,
}


def tune_gains(workbench: Workbench) -> None:
    """Measure the step responses with each load, until the technician keeps the gains.

    :raises StepError: when a response with the kept gains exceeds its limits.
    """
    tuning = GainTuning(workbench)
    try:
        tuning.run()
    finally:
        tuning.record()


@dataclass
class _Measurement:
    """The responses of the motors with one load and one set of gains."""

    curves: list[RecordedCurve] = field(default_factory=list)
    responses: dict[int, StepResponse] = field(default_factory=dict)
    """By motor. Motors after an unstable one were not measured."""
    unstable: Text | None = None

    @property
    def fault(self) -> Text | None:
        """Return the fault of the responses; None if they are within their limits."""
        if self.unstable is not None:
            return self.unstable
        for motor, response in self.responses.items():
            if response.overshoot > LARGEST_OVERSHOOT:
                return texts.OVERSHOOT_TOO_LARGE(motor=motor, overshoot_percent=100 * response.overshoot)
            if response.steady_error_deg > LARGEST_STEADY_ERROR_DEG:
                return texts.STEADY_ERROR_LARGE(motor=motor, error_deg=response.steady_error_deg)
        return None


class GainTuning:
    """The gain sets that were measured, and their responses."""

    def __init__(self, workbench: Workbench) -> None:
        self._workbench = workbench
        self._first: GainSet = tuple(_gains(axis) for axis in workbench.draft.axes)
        """The gains before the step."""
        self._sets = [self._first]
        """The present set, after the sets to which the technician can return."""
        self._measured: dict[tuple[str, GainSet], _Measurement] = {}

    def run(self) -> None:
        """Measure and review with each load in turn, until the present gains were kept with every load.

        :raises StepError: when a response with the kept gains exceeds its limits.
        """
        kept_gains: dict[str, GainSet] = {}
        for load, action in cycle(LOADS):
            if all(kept_gains.get(name) == self._sets[-1] for name, _ in LOADS):
                return
            self._workbench.confirm(action)
            self._workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
            self._sets = list(dict.fromkeys((*self._usable_first(), self._sets[-1])))
            for gains in self._sets:
                self._measure(load, gains)
            self._review_until_kept(load)
            if fault := self._measured[load, self._sets[-1]].fault:
                raise StepError(fault)
            kept_gains[load] = self._sets[-1]

    def _usable_first(self) -> list[GainSet]:
        """Return the set before the step, for comparison, unless it has shown a fault."""
        faulty = any(measured.fault for (_, gains), measured in self._measured.items() if gains == self._first)
        return [] if faulty else [self._first]

    def _review_until_kept(self, load: str) -> None:
        while True:
            review = self._review(load)
            choice = self._workbench.choose_gains(review)
            if choice.action == "keep":
                return
            if choice.action == "take_back":
                self._sets.pop()
                self._use(self._sets[-1])
            else:
                self._sets.append(choice.gains)
                self._measure(load, choice.gains)

    def record(self) -> None:
        """Add the values and curves with the gains before the step and with the present ones."""
        workbench, first, last = self._workbench, self._first, self._sets[-1]
        for motor, (before, after) in enumerate(zip(first, last, strict=True), start=1):
            workbench.add_value("p gain", motor, before=before.p, after=after.p)
            workbench.add_value("i gain", motor, before=before.i, after=after.i)
            workbench.add_value("d gain", motor, before=before.d, after=after.d)
        for load, _ in LOADS:
            measurement = self._measured.get((load, last), _Measurement())
            former = self._measured.get((load, first), _Measurement()) if first != last else _Measurement()
            for motor in measurement.responses:
                earlier, now = _figures(former, motor), _figures(measurement, motor)
                workbench.add_value(f"rise time s, {load}", motor, before=earlier[0], after=now[0])
                workbench.add_value(f"overshoot %, {load}", motor, before=earlier[1], after=now[1])
                workbench.add_value(f"steady error deg, {load}", motor, before=earlier[2], after=now[2])
            workbench.curves.extend((*former.curves, *measurement.curves))

    def _use(self, gains: GainSet) -> None:
        def gained(motor: int, axis: Axis) -> Axis:
            p, i, d = structs.astuple(gains[motor - 1])
            return structs.replace(axis, position_p_gain=p, position_i_gain=i, position_d_gain=d)

        self._workbench.change_axes(gained)

    def _measure(self, load: str, gains: GainSet) -> None:
        """Measure the responses of all motors. Unstable gains end the measurement with torque off."""
        self._use(gains)
        if (load, gains) in self._measured:
            return
        measured = self._measured[load, gains] = _Measurement()
        try:
            with live_drives(self._workbench, share=1.0) as drives:
                drives.largest_distance_deg = LARGEST_DISTANCE_DEG
                drives.hold()
                _to_middle(self._workbench, drives)
                for motor in AXES:
                    times, angles = _respond(drives, motor)
                    measured.responses[motor] = step_response(times, angles, STEP_DEG)
                    measured.curves.append(_curve(self._workbench, motor, load, times, angles))
        except UnstableError as error:
            measured.unstable = error.fault

    def _review(self, load: str) -> GainsReview:
        present, former = self._sets[-1], self._sets[-2] if len(self._sets) > 1 else None
        measurement = self._measured[load, present]
        before = self._measured[load, former] if former else _Measurement()
        motors = tuple(
            _motor_gains(motor, gains, measurement.responses.get(motor), former[motor - 1] if former else None, before)
            for motor, gains in enumerate(present, start=1)
        )
        fault = measurement.fault
        return GainsReview(
            load=load,
            motors=motors,
            curves=tuple(measurement.curves),
            former_curves=tuple(before.curves),
            fault=str(fault or ""),
            fault_key=fault.key if fault else None,
        )


def _motor_gains(
    motor: int, gains: Gains, response: StepResponse | None, former: Gains | None, before: _Measurement
) -> MotorGains:
    proposed, advice = propose(gains, response) if response else (gains, "")
    text = _ADVICE[advice]() if advice else None
    lowest, highest = gain_limits(gains)
    return MotorGains(
        motor=motor,
        gains=gains,
        response=response,
        former_gains=former,
        former_response=before.responses.get(motor),
        proposed=proposed,
        advice=str(text or ""),
        advice_key=text.key if text else None,
        lowest=lowest,
        highest=highest,
    )


def _gains(axis: Axis) -> Gains:
    return Gains(axis.position_p_gain, axis.position_i_gain, axis.position_d_gain)


def _figures(measured: _Measurement, motor: int) -> tuple[float | None, ...]:
    """Return the recorded rise time (s), overshoot (%) and steady error (deg) of a motor; None if it was not measured."""
    response = measured.responses.get(motor)
    if response is None:
        return None, None, None
    return round(response.rise_s, 3), round(100 * response.overshoot), round(response.steady_error_deg, 2)


def _to_middle(workbench: Workbench, drives: LiveDrives) -> None:
    """Move every axis at least two steps away from its ends."""
    margin = 2 * STEP_DEG
    goal = [
        min(max(angle, axis.min_deg + margin), axis.max_deg - margin)
        for angle, axis in zip(drives.setpoint_deg.tolist(), workbench.draft.axes, strict=True)
    ]
    drives.move(np.array(goal))
    drives.settle(0.5)


def _respond(drives: LiveDrives, motor: int) -> tuple[Floats, Floats]:
    """Return the times since the step, and the angles relative to the angle before the step."""
    axis = motor - 1
    resting = drives.settle(0.2)
    began = float(np.mean([sample.angle_deg[axis] for sample in resting]))
    drives.setpoint_deg = drives.setpoint_deg.copy()
    drives.setpoint_deg[axis] += STEP_DEG
    samples = drives.settle(_STEP_S)
    goal = drives.setpoint_deg.copy()
    goal[axis] -= STEP_DEG
    drives.move(goal)
    drives.settle(0.5)
    times = np.array([sample.t_s for sample in samples])
    angles = np.array([sample.angle_deg[axis] for sample in samples])
    return times - times[0], angles - began


def _curve(workbench: Workbench, motor: int, load: str, times: Floats, angles: Floats) -> RecordedCurve:
    """Return a response with about 50 samples a second, which is enough to show every oscillation of a motor."""
    step = max(1, workbench.draft.cycle_hz // _CURVE_HZ)
    gains = _gains(workbench.draft.axes[motor - 1])
    return RecordedCurve(
        motor=motor,
        load=load,
        step_deg=STEP_DEG,
        p_gain=gains.p,
        i_gain=gains.i,
        d_gain=gains.d,
        times_s=tuple(round(time, 3) for time in times[::step].tolist()),
        angles_deg=tuple(round(angle, 2) for angle in angles[::step].tolist()),
    )
