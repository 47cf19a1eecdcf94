"""Steps 4 and 5: find the axis and direction that each drive moves, and check the sign of its torque."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.drive_line import DriveLine
from kata.commissioning.live_drives import LiveDrives, live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench, naming_drive, wrapped_deg
from kata.device.bus.dynamixel.registers import DEG_PER_COUNT
from kata.device.config import Axis
from kata.motion.axes import AXES, N_AXES
from kata.motion.linkage import Floats

MOTION_TEXTS: Final = {
    1: texts.RAISE_SCAPULA_FORWARD,
    2: texts.ROTATE_SCAPULA_DOWN,
    3: texts.LIFT_ARM_SIDEWAYS,
    4: texts.LIFT_ARM_FORWARD,
    5: texts.TURN_FOREARM_OUT,
}
"""The motion of each motor in its positive direction, on the unturned apparatus. The linkage gives motors 1 and 2 the opposite sign of
the scapula's angles. Each of these two moves little in the other's motion (:mod:`kata.motion.linkage`)."""

_SEEN_DEG: Final = 8.0
_STILL_DEG: Final = 0.3
_STILL_LOOKS: Final = 25
_POSITION: Final = 132
_TEST_DEG: Final = 3.0
_PUSH_DEG: Final = 0.15
_PUSH_NM: Final = 0.3
"""Torque from which a push counts. A push of a hand has some Nm; friction hides 0.2 Nm."""


class PositionWatch:
    """Watches the positions of drives without torque, across whole turns."""

    def __init__(self, workbench: Workbench, line: DriveLine) -> None:
        self._axes = workbench.draft.axes
        self._line = line
        self._last = read_counts(line, self._axes)
        self.moved_deg: Floats = np.zeros(len(self._axes))
        """Movement of each axis in the encoder's direction."""
        self.largest_jump_deg = 0.0

    def read_positions(self) -> Floats:
        """Read the positions. Return the movement of each drive since the last call."""
        now = read_counts(self._line, self._axes)
        step = np.array([wrapped_deg(value) for value in (now - self._last) * DEG_PER_COUNT])
        self._last = now
        self.moved_deg = self.moved_deg + step
        self.largest_jump_deg = max(self.largest_jump_deg, float(np.max(np.abs(step))))
        return step


def read_counts(line: DriveLine, axes: Sequence[Axis]) -> Floats:
    """Return the position that each drive reports, ``(5,)`` in its own counts.

    :raises StepError: naming the motor that does not answer.
    """
    counts = []
    for motor, axis in enumerate(axes, start=1):
        with naming_drive(motor, axis.id):
            counts.append(int.from_bytes(line.read(axis.id, _POSITION, 4), "little", signed=True))
    return np.array(counts, dtype=np.float64)


def find_axes(workbench: Workbench) -> None:
    """Let the technician move each axis. The drive with the axis' id must move most. The sign of its movement is the axis' direction."""
    directions = []
    with workbench.line() as line:
        for motor in AXES:
            moved = _moved_by_hand(workbench, line, motor)
            moved_most = int(np.argmax(np.abs(moved))) + 1
            if moved_most != motor:
                raise StepError(texts.DRIVES_SWAPPED(motor=motor, moved=moved_most))
            directions.append(1 if moved[motor - 1] > 0 else -1)
    before = [axis.direction for axis in workbench.draft.axes]
    workbench.change_axes(lambda motor, axis: structs.replace(axis, direction=directions[motor - 1]))
    for motor in AXES:
        workbench.add_value("direction", motor, before=before[motor - 1], after=directions[motor - 1])


def _moved_by_hand(workbench: Workbench, line: DriveLine, motor: int) -> Floats:
    """Return the movement of each drive until all drives are at rest again."""
    watch = PositionWatch(workbench, line)
    still = 0

    def is_done() -> bool:
        nonlocal still
        step = watch.read_positions()
        still = still + 1 if np.max(np.abs(step)) < _STILL_DEG else 0
        return float(np.max(np.abs(watch.moved_deg))) > _SEEN_DEG and still > _STILL_LOOKS

    text = texts.MOVE_AXIS(motor=motor, motion=MOTION_TEXTS[motor]())
    workbench.watch(ManualAction("move_axis", text, motor), is_done, texts.NO_MOVEMENT_SEEN(motor=motor))
    return watch.moved_deg


def check_torque(workbench: Workbench) -> None:
    """Move each motor slightly, then let the technician push each. Movement and torque must have the correct signs.

    No motor moves after the first push, because the technician's hands are at the apparatus.
    """
    workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
    with live_drives(workbench) as drives:
        drives.hold()
        for axis in range(N_AXES):
            for by_deg in (_TEST_DEG, -_TEST_DEG):
                drives.move_axis(axis, by_deg)
        for motor in AXES:
            _check_push(workbench, drives, motor)


def _check_push(workbench: Workbench, drives: LiveDrives, motor: int) -> None:
    """Let the technician push a motor that holds its position."""
    axis = motor - 1
    resting = drives.settle(0.3)
    rest_deg = float(np.mean([sample.angle_deg[axis] for sample in resting]))
    rest_nm = float(np.mean([sample.torque_nm[axis] for sample in resting]))
    push: list[tuple[float, float]] = []

    def is_pushed() -> bool:
        sample = drives.cycle()
        moved, torque = float(sample.angle_deg[axis]) - rest_deg, float(sample.torque_nm[axis]) - rest_nm
        push_detected = abs(moved) > _PUSH_DEG and abs(torque) > _PUSH_NM
        if push_detected:
            push.append((moved, torque))
        return push_detected

    text = texts.PUSH_AXIS(motor=motor, motion=MOTION_TEXTS[motor]())
    workbench.watch(ManualAction("push_axis", text, motor), is_pushed, texts.PUSH_NOT_SEEN(motor=motor))
    moved, torque = push[-1]
    if moved < 0:
        raise StepError(texts.AXIS_REVERSED(motor=motor))
    if torque > 0:
        raise StepError(texts.TORQUE_SIGN_WRONG(motor=motor))
    workbench.add_value("push: angle deg", motor, after=round(moved, 2))
    workbench.add_value("push: torque Nm", motor, after=round(torque, 2))
    drives.settle(1.0)
