"""Step 9: measures the step response of each motor."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.commissioning import texts
from kata.commissioning.live_drives import LiveDrives, live_drives
from kata.commissioning.record import RecordedCurve
from kata.commissioning.workbench import ManualAction, StepError, Workbench
from kata.motion.axes import AXES
from kata.motion.linkage import Floats

STEP_DEG: Final = 2.0
"""Height of the step. It is large compared with the encoder's resolution (0.09 deg) and friction, but stays far from the
torque limit of motor 5.
"""
_STEP_S: Final = 1.5
_SETTLED_S: Final = 0.3
_CURVE_HZ: Final = 50
LARGEST_OVERSHOOT: Final = 0.6
"""Largest overshoot as a share of the step. We chose it, because the paper states no figure. A motor with more overshoot
vibrates, which a patient feels.
"""
LARGEST_STEADY_ERROR_DEG: Final = 0.5

LOADS: Final = (
    ("weight", ManualAction("free_arm", texts.FREE_ARM())),
    ("empty", ManualAction("empty_arm", texts.EMPTY_ARM())),
)
"""Name of each load, and the instruction with which the technician sets it up."""


@dataclass(frozen=True)
class StepResponse:
    """The response to a step: rise time from 10 to 90 %, overshoot as a share of the step, error at the end."""

    rise_s: float
    overshoot: float
    steady_error_deg: float


def step_response(times_s: Floats, angles_deg: Floats, step_deg: float) -> StepResponse:
    """Return the figures of a response.

    :param times_s: ``(n,)``, times since the step.
    :param angles_deg: ``(n,)``, angles relative to the angle before the step.
    :param step_deg: height of the step, not 0.
    """
    share = angles_deg / step_deg
    over_10, over_90 = np.flatnonzero(share >= 0.1), np.flatnonzero(share >= 0.9)
    rise_s = float(times_s[over_90[0]] - times_s[over_10[0]]) if len(over_10) and len(over_90) else float(times_s[-1])
    settled = angles_deg[times_s > times_s[-1] - _SETTLED_S]
    return StepResponse(rise_s, max(0.0, float(share.max()) - 1.0), abs(float(np.mean(settled)) - step_deg))


def check_gains(workbench: Workbench) -> None:
    """Measure the step response of each motor, with the test weight and without."""
    for load, action in LOADS:
        workbench.confirm(action)
        workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
        with live_drives(workbench, share=1.0) as drives:
            drives.hold()
            _to_middle(workbench, drives)
            for motor in AXES:
                times, angles = _respond(drives, motor)
                response = step_response(times, angles, STEP_DEG)
                workbench.curves.append(_curve(workbench, motor, load, times, angles))
                workbench.add_value(f"rise time s, {load}", motor, after=round(response.rise_s, 3))
                workbench.add_value(f"overshoot %, {load}", motor, after=round(100 * response.overshoot))
                workbench.add_value(f"steady error deg, {load}", motor, after=round(response.steady_error_deg, 2))
                if response.overshoot > LARGEST_OVERSHOOT:
                    raise StepError(texts.OVERSHOOT_TOO_LARGE(motor=motor, overshoot_percent=100 * response.overshoot))
                if response.steady_error_deg > LARGEST_STEADY_ERROR_DEG:
                    raise StepError(texts.STEADY_ERROR_LARGE(motor=motor, error_deg=response.steady_error_deg))


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
    rest = drives.settle(0.2)
    began = float(np.mean([sample.angle_deg[axis] for sample in rest]))
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
    every = max(1, workbench.draft.cycle_hz // _CURVE_HZ)
    axis = workbench.draft.axes[motor - 1]
    return RecordedCurve(
        motor=motor,
        load=load,
        step_deg=STEP_DEG,
        p_gain=axis.position_p_gain,
        i_gain=axis.position_i_gain,
        d_gain=axis.position_d_gain,
        times_s=tuple(round(time, 3) for time in times[::every].tolist()),
        angles_deg=tuple(round(angle, 2) for angle in angles[::every].tolist()),
    )
