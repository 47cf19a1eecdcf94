"""Step 7: finds the range of each motor, and checks that its position is unambiguous after power-up."""

from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.axes import MOTION_TEXTS, PositionWatch, read_counts
from kata.commissioning.live_drives import live_drives
from kata.commissioning.workbench import LOOK_S, ManualAction, StepError, Workbench, wrapped_deg
from kata.device.bus.dynamixel.registers import DEG_PER_COUNT, zero_count
from kata.device.config import Axis
from kata.device.config_rules import MOTOR_RANGES_DEG
from kata.motion.axes import AXES, N_AXES
from kata.motion.linkage import Floats

INSIDE_DEG: Final = 2.0
"""Distance of the proposed limits inside the ends that a hand reached. It is larger than the play and the compression of a soft stop."""
_NEEDED_SHARE: Final = 0.8
"""Smallest share of the range in Table 2. With less, something blocks the axis, or the technician did not reach the ends."""
_TURN_DEG: Final = 360.0
_JUMP_DEG: Final = 45.0
"""Largest movement between two reads. A hand is slower."""
_BOOT_S: Final = 1.0
_RESTART_DEG: Final = 1.0


def find_range(workbench: Workbench) -> None:
    """Let the technician move each axis to both ends. Set limits. Restart the drives and compare their positions."""
    limits = []
    for motor in AXES:
        low, high = _ends(workbench, motor)
        designed = MOTOR_RANGES_DEG[motor - 1]
        span, needed = high - low, _NEEDED_SHARE * (designed[1] - designed[0])
        if span + 2 * workbench.draft.limit_tolerance_deg >= _TURN_DEG:
            raise StepError(texts.RANGE_AMBIGUOUS(motor=motor, span_deg=span))
        if span < needed:
            raise StepError(texts.RANGE_TOO_SMALL(motor=motor, span_deg=span, needed_deg=needed))
        limits.append((round(max(low + INSIDE_DEG, designed[0]), 1), round(min(high - INSIDE_DEG, designed[1]), 1)))
    before = workbench.draft.axes

    def limited(motor: int, axis: Axis) -> Axis:
        low, high = limits[motor - 1]
        return structs.replace(axis, min_deg=low, max_deg=high)

    workbench.change_axes(limited)
    for motor, axis in enumerate(before, start=1):
        workbench.add_value("lowest angle deg", motor, before=axis.min_deg, after=limits[motor - 1][0])
        workbench.add_value("highest angle deg", motor, before=axis.max_deg, after=limits[motor - 1][1])
    _check_restart(workbench)


def _ends(workbench: Workbench, motor: int) -> tuple[float, float]:
    """Return the lowest and the highest angle that the technician reached."""
    with workbench.line() as line:
        watch = PositionWatch(workbench, line)
        begin = float(_angles(workbench)[motor - 1])
        axis = workbench.draft.axes[motor - 1]
        reached = [begin]
        text = texts.SWEEP_AXIS(motor=motor, motion=MOTION_TEXTS[motor]())
        workbench.technician.instruct(ManualAction("sweep_axis", text, motor))
        while not workbench.technician.has_confirmed():
            watch.read_positions()
            reached.append(begin + axis.direction * float(watch.moved_deg[motor - 1]))
            workbench.sleep(LOOK_S)
        if watch.largest_jump_deg > _JUMP_DEG:
            raise StepError(texts.RANGE_AMBIGUOUS(motor=motor, span_deg=max(reached) - min(reached)))
        return min(reached), max(reached)


def _angles(workbench: Workbench) -> Floats:
    """Return the motors' angles within one turn around the middle of each range, as the driver does after power-up."""
    with workbench.line() as line:
        counts = read_counts(line, workbench.draft.axes)
    angles = []
    for axis, count in zip(workbench.draft.axes, counts.tolist(), strict=True):
        middle = (axis.min_deg + axis.max_deg) / 2
        angle = axis.direction * (count - zero_count(axis)) * DEG_PER_COUNT
        angles.append(middle + wrapped_deg(angle - middle))
    return np.array(angles)


def _check_restart(workbench: Workbench) -> None:
    """Restart every drive. The driver must then find the same angles, although the drives have lost their turns."""
    before = _angles(workbench)
    with workbench.line() as line:
        for axis in workbench.draft.axes:
            line.reboot(axis.id)
    workbench.sleep(_BOOT_S)
    with live_drives(workbench) as drives:
        after = drives.angle_deg.copy()
    for n in range(N_AXES):
        off = float(after[n] - before[n])
        if abs(off) > _RESTART_DEG:
            raise StepError(texts.POSITION_AFTER_RESTART(motor=n + 1, off_deg=abs(off)))
