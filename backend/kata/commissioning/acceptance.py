"""Step 11: plays the six motions of Table 2 with the control loop that treats patients, with a weight and without."""

from typing import Final

import numpy as np

from kata.commissioning import texts
from kata.commissioning.direct_station import DirectStation, PlaybackError
from kata.commissioning.gains import LOADS
from kata.commissioning.workbench import ManualAction, StepError, Workbench
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING
from kata.motion.axes import BASIC_MOTIONS, BasicMotion
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.motion.tracking import MotorTracking, compare

LIMITS_DEG: Final = {1: 4.0, 2: 4.0, 3: 5.0, 4: 4.0, 5: 6.0, 6: 8.0}
"""Limit of the error by motion: the largest error that the paper reports for its motors (Section 4, start excepted)."""


def play_motions(workbench: Workbench) -> None:
    """Play the motions. Record peak error and RMSE of the motors that each motion moves."""
    for load, action in LOADS:
        workbench.confirm(action)
        workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
        try:
            station = DirectStation(workbench.draft, workbench.open_transport, workbench.now_ns, workbench.sleep)
        except PlaybackError as error:
            raise StepError(texts.MOTION_FAILED(motion=1, reason=str(error))) from error
        try:
            for motion, taught in zip(BASIC_MOTIONS, built_in_motions(), strict=False):
                for tracking in _played(station, motion, taught):
                    _judge(workbench, motion.number, tracking, load)
        finally:
            station.close()


def _played(station: DirectStation, motion: BasicMotion, taught: Taught) -> list[MotorTracking]:
    """Play one motion. Return the figures of its motors."""
    angles = motor_angles_deg(taught.poses_deg)
    load = Load(
        run_id=f"motion {motion.number}",
        recording_id="acceptance",
        times_s=taught.times_s.astype("<f8").tobytes(),
        angles_deg=angles.astype("<f8").tobytes(),
        method="smooth",
    )
    try:
        run = station.play(load, float(taught.times_s[-1]))
    except PlaybackError as error:
        raise StepError(texts.MOTION_FAILED(motion=motion.number, reason=str(error))) from error
    playing = run.phase == PHASE_PLAYING
    measured, torque = run.measured_deg[playing].astype(np.float64), run.torque_nm[playing].astype(np.float64)
    comparison = compare(taught.times_s, angles, run.path_s[playing], measured, torque)
    return [tracking for tracking in comparison.motors if tracking.motor in motion.motors]


def _judge(workbench: Workbench, motion: int, tracking: MotorTracking, load: str) -> None:
    workbench.add_value(f"motion {motion}, {load}: peak error deg", tracking.motor, after=round(tracking.peak_deg, 2))
    workbench.add_value(f"motion {motion}, {load}: RMSE deg", tracking.motor, after=round(tracking.rmse_deg, 2))
    if abs(tracking.peak_deg) > LIMITS_DEG[motion]:
        raise StepError(
            texts.TRACKING_POOR(
                motor=tracking.motor, motion=motion, peak_deg=abs(tracking.peak_deg), limit_deg=LIMITS_DEG[motion]
            )
        )
