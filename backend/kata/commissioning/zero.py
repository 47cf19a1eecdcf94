"""Step 6: finds the zero of each motor with a fixture in two reference poses, and checks it on both sides and against gravity.

The encoder is on the motor's side of the gear. Each motor therefore presses its play to both ends while the fixture holds the arm.
The middle of the two angles is the arm's angle.
"""

from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.live_drives import LiveDrives, live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench, wrapped_deg
from kata.device.bus.dynamixel.registers import COUNTS_PER_TURN, DEG_PER_COUNT, zero_count
from kata.device.config import Axis
from kata.motion.axes import AXES, CANONICAL_SIDE, N_AXES, Side
from kata.motion.linkage import Floats, motor_angles_deg

POSES_DEG: Final = ((0.0, 0.0, 0.0, 0.0, 0.0), (-10.0, -8.0, 60.0, 60.0, -45.0))
"""The fixture's two poses, as angles of a pose (:mod:`kata.motion.axes`). We chose them, because the paper describes no fixture."""
_ANGLES: Final = ("scapula_abduction", "scapula_rotation", "abduction", "flexion", "rotation")
POSE_TOLERANCE_DEG: Final = 1.0
"""Largest deviation from a pose. A seated fixture holds each axis within a few tenths of a degree. A wrong hole is tens of degrees away."""
_PRESS_DEG: Final = 3.0
_PRESS_S: Final = 0.6
_GRAVITY_DEG: Final = 60.0
_GRAVITY_NM: Final = 0.15
"""Smallest torque of the weight. The test weight gives a multiple of it at 60 deg. The mean of the torques up and down
excludes friction.
"""


def find_zeros(workbench: Workbench) -> None:
    """Measure both poses and set the zeros. Check them on the other side and against gravity."""
    before = [zero_count(axis) for axis in workbench.draft.axes]
    first, play = _measure(workbench, CANONICAL_SIDE, 0)
    _shift(workbench, first - _expected(CANONICAL_SIDE, 0))
    second, _ = _measure(workbench, CANONICAL_SIDE, 1)
    off = second - _expected(CANONICAL_SIDE, 1)
    _check_pose(off, _expected(CANONICAL_SIDE, 1) - _expected(CANONICAL_SIDE, 0), pose=2)
    # Both poses have the same weight.
    _shift(workbench, off / 2)
    for motor in AXES:
        workbench.add_value("zero", motor, before=before[motor - 1], after=workbench.draft.axes[motor - 1].zero_count)
        workbench.add_value("play deg", motor, after=round(float(play[motor - 1]), 2))
    other: Side = "left"
    workbench.confirm(ManualAction("turn", texts.TURN_TO_LEFT()))
    for pose in (0, 1):
        measured, _ = _measure(workbench, other, pose)
        movement = _expected(other, 1) - _expected(other, 0)
        off = measured - _expected(other, pose)
        _check_pose(off, movement if pose else np.zeros(N_AXES), pose=pose + 1)
        for motor in AXES:
            workbench.add_value(f"left, pose {pose + 1}: difference deg", motor, after=round(float(off[motor - 1]), 2))
    workbench.confirm(ManualAction("turn", texts.TURN_TO_RIGHT()))
    _check_gravity(workbench)


def _expected(side: Side, pose: int) -> Floats:
    return motor_angles_deg(np.array(POSES_DEG[pose]), side)


def _measure(workbench: Workbench, side: Side, pose: int) -> tuple[Floats, Floats]:
    """Return the motors' angles in a pose of the fixture, at the middle of their play, and the play."""
    angles = dict(zip(_ANGLES, POSES_DEG[pose], strict=True))
    workbench.confirm(ManualAction("fit_pose", texts.FIT_POSE(pose=pose + 1, **angles), pose + 1))
    workbench.change(side=side)
    try:
        with live_drives(workbench) as drives:
            drives.hold()
            ends = [_pressed(drives, sign) for sign in (1.0, -1.0)]
    finally:
        workbench.change(side=CANONICAL_SIDE)
    return (ends[0] + ends[1]) / 2, ends[0] - ends[1]


def _pressed(drives: LiveDrives, sign: float) -> Floats:
    """Return the angles while every motor presses in one direction."""
    start = drives.setpoint_deg.copy()
    drives.move(start + sign * _PRESS_DEG)
    samples = drives.settle(_PRESS_S)
    drives.move(start)
    tail = samples[len(samples) // 2 :]
    mean: Floats = np.mean([sample.angle_deg for sample in tail], axis=0)
    return mean


def _shift(workbench: Workbench, off_deg: Floats) -> None:
    """Move the zeros so that the measured angles become smaller by ``off_deg``."""

    def shifted(motor: int, axis: Axis) -> Axis:
        counts = zero_count(axis) + axis.direction * float(off_deg[motor - 1]) / DEG_PER_COUNT
        return structs.replace(axis, zero_count=round(counts) % COUNTS_PER_TURN)

    workbench.change_axes(shifted)


def _check_pose(off_deg: Floats, way_deg: Floats, *, pose: int) -> None:
    """Compare a pose. ``way_deg``: expected movement from the first pose to this pose. An axis that moved in the opposite
    direction is reversed.
    """
    for motor, (off, movement) in enumerate(zip(off_deg.tolist(), way_deg.tolist(), strict=True), start=1):
        if abs(wrapped_deg(off)) <= POSE_TOLERANCE_DEG:
            continue
        if movement and abs(wrapped_deg(off + 2 * movement)) <= 2 * POSE_TOLERANCE_DEG:
            raise StepError(texts.AXIS_REVERSED(motor=motor))
        raise StepError(texts.POSE_DIFFERS(motor=motor, off_deg=abs(wrapped_deg(off)), pose=pose))


def _check_gravity(workbench: Workbench) -> None:
    """Raise the arm with motors 3 and 4 in turn. The torque of each must be directed upwards."""
    workbench.confirm(ManualAction("free_arm", texts.FREE_ARM()))
    workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
    with live_drives(workbench, share=1.0) as drives:
        drives.hold()
        start = drives.setpoint_deg.copy()
        for axis in (2, 3):
            raised = start.copy()
            raised[axis] = _GRAVITY_DEG
            drives.move(raised)
            torques = []
            for by_deg in (3.0, -3.0):
                samples = drives.move_axis(axis, by_deg)
                tail = samples[-10:]
                torques.append(float(np.mean([sample.torque_nm[axis] for sample in tail])))
            carried_nm = sum(torques) / 2
            if carried_nm < _GRAVITY_NM:
                raise StepError(texts.GRAVITY_CONTRADICTS(motor=axis + 1))
            workbench.add_value("weight at 60 deg, Nm", axis + 1, after=round(carried_nm, 2))
            drives.move(start)
