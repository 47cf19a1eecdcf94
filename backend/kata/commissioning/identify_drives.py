"""Step 10: identifies lag, friction and the effect of the integral of each drive."""

from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.live_drives import LiveSample, live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench
from kata.device.config import Axis
from kata.device.config_rules import LARGEST_FRICTION_DEG, LARGEST_LAG2_S2, LARGEST_LAG_S
from kata.motion.identify import excitation
from kata.motion.identify_load import IdentifiedAxis, identify_load
from kata.motion.linkage import Floats

_EXCITATION_S: Final = 24.0
MIN_R_SQUARED: Final = 0.9
"""Smallest accepted share of the variance of setpoint minus angle that the model explains (R²). With less a feed-forward would not improve the tracking."""
LARGEST_UNCERTAINTY: Final = 0.3
"""Largest half of a lag's confidence interval, as a share of the lag. The feed-forward then removes at least 70 % of the lag's error."""
_ENDS_S: Final = 1.0
_MISSED_SHARE: Final = 0.05
"""Share of cycles that the computer may miss while the motors move. They are interpolated. At this share the lags differ by at most 5 %."""
_MISSED_IN_A_ROW: Final = 5


def identify_drives(workbench: Workbench) -> None:
    """Move all axes slowly and fast. Identify lag, friction and the effect of the drive's integral. Refuse a poor fit.

    No arm is in the apparatus, so the weight is not identified.
    """
    workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
    with live_drives(workbench, share=1.0) as drives:
        drives.hold()
        rest_deg = drives.setpoint_deg.copy()
        ranges = [(axis.min_deg, axis.max_deg) for axis in workbench.draft.axes]
        wave = excitation(rest_deg.tolist(), _EXCITATION_S, 1 / workbench.draft.cycle_hz, ranges)
        samples = drives.follow(iter(wave))
    identified_axes = identified(samples)
    for motor, identified_axis in enumerate(identified_axes, start=1):
        check_fit(motor, identified_axis)
    before = workbench.draft.axes

    def with_identified(motor: int, axis: Axis) -> Axis:
        identified_axis = identified_axes[motor - 1]
        return structs.replace(
            axis,
            lag_s=round(identified_axis.lag_s, 4),
            lag2_s2=round(max(0.0, identified_axis.lag2_s2), 5),
            friction_deg=round(max(0.0, identified_axis.friction_deg), 3),
            integral_s=round(identified_axis.integral_s, 3),
            droop_deg_nm=round(identified_axis.droop_deg_nm, 4),
        )

    workbench.change_axes(with_identified)
    for motor, (axis, now, identified_axis) in enumerate(
        zip(before, workbench.draft.axes, identified_axes, strict=True), start=1
    ):
        workbench.add_value("lag s", motor, before=axis.lag_s, after=now.lag_s)
        workbench.add_value("second-order lag s2", motor, before=axis.lag2_s2, after=now.lag2_s2)
        workbench.add_value("friction deg", motor, before=axis.friction_deg, after=now.friction_deg)
        workbench.add_value("integral s", motor, before=axis.integral_s, after=now.integral_s)
        workbench.add_value("droop deg/Nm", motor, before=axis.droop_deg_nm, after=now.droop_deg_nm)
        workbench.add_value("residual deg", motor, after=round(identified_axis.residual_deg, 3))
        workbench.add_value("lag uncertainty s", motor, after=round(identified_axis.lag_uncertainty_s, 4))
        workbench.add_value("explained %", motor, after=round(100 * identified_axis.r_squared, 1))


def identified(samples: list[LiveSample]) -> tuple[IdentifiedAxis, ...]:
    """Return the identified axes. The ends of the movement are omitted.

    :raises StepError: when the cycles were too uneven, or a motor did not move.
    """
    times, setpoints, angles, torques = _evenly(samples)
    inner = (times > times[0] + _ENDS_S) & (times < times[-1] - _ENDS_S)
    try:
        return identify_load(times[inner], setpoints[inner], angles[inner], torques[inner]).axes
    except ValueError as error:
        raise StepError(texts.NOT_IDENTIFIABLE(reason=str(error))) from error


def _evenly(samples: list[LiveSample]) -> tuple[Floats, Floats, Floats, Floats]:
    """Return times, setpoints, angles and torques without a gap. For a cycle that the computer missed, the setpoint is the last one
    sent, and angle and torque are interpolated.

    :raises StepError: when the computer missed many cycles, or several in a row.
    """
    times = np.array([sample.t_s for sample in samples])
    period_s = float(np.median(np.diff(times)))
    cycles = np.round((times - times[0]) / period_s).astype(np.intp)
    all_cycles = np.arange(cycles[-1] + 1)
    missed = len(all_cycles) - len(cycles)
    if missed > _MISSED_SHARE * len(all_cycles) or np.max(np.diff(cycles)) > _MISSED_IN_A_ROW + 1:
        raise StepError(texts.NOT_IDENTIFIABLE(reason=f"this computer missed {missed} of {len(all_cycles)} cycles"))
    last_sent = np.searchsorted(cycles, all_cycles, side="right") - 1
    setpoints = np.array([sample.setpoint_deg for sample in samples])[last_sent]
    angles, torques = (
        np.column_stack([np.interp(all_cycles, cycles, axis) for axis in series.T])
        for series in (
            np.array([sample.angle_deg for sample in samples]),
            np.array([sample.torque_nm for sample in samples]),
        )
    )
    return times[0] + all_cycles * period_s, setpoints, angles, torques


def check_fit(motor: int, identified_axis: IdentifiedAxis) -> None:
    """Refuse a poor fit.

    :raises StepError: when the model explains too little, gives an impossible value, or the lag is uncertain.
    """
    possible = (
        0.0 < identified_axis.lag_s <= LARGEST_LAG_S
        and identified_axis.lag2_s2 <= LARGEST_LAG2_S2
        and identified_axis.friction_deg <= LARGEST_FRICTION_DEG
    )
    if identified_axis.r_squared < MIN_R_SQUARED or not possible:
        raise StepError(
            texts.POOR_FIT(
                motor=motor,
                explained_percent=100 * identified_axis.r_squared,
                residual_deg=identified_axis.residual_deg,
            )
        )
    if identified_axis.lag_uncertainty_s > LARGEST_UNCERTAINTY * identified_axis.lag_s:
        raise StepError(
            texts.LAG_UNCERTAIN(
                motor=motor, lag_s=identified_axis.lag_s, uncertainty_s=identified_axis.lag_uncertainty_s
            )
        )
