"""Step 7: finds the range of each motor, and checks that its position is unambiguous after power-up."""

from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.axes import PositionWatch, read_counts
from kata.commissioning.bench import LOOK_S, Bench, ManualAction, StepError, wrapped_deg
from kata.commissioning.live_drives import live_drives
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


def find_range(bench: Bench) -> None:
    """Let the technician move each axis to both ends. Set limits. Restart the drives and compare their positions."""
    limits = []
    for motor in AXES:
        low, high = _ends(bench, motor)
        designed = MOTOR_RANGES_DEG[motor - 1]
        span, needed = high - low, _NEEDED_SHARE * (designed[1] - designed[0])
        if span + 2 * bench.draft.limit_tolerance_deg >= _TURN_DEG:
            raise StepError(texts.RANGE_AMBIGUOUS(motor=motor, span_deg=span))
        if span < needed:
            raise StepError(texts.RANGE_TOO_SMALL(motor=motor, span_deg=span, needed_deg=needed))
        limits.append((round(max(low + INSIDE_DEG, designed[0]), 1), round(min(high - INSIDE_DEG, designed[1]), 1)))
    before = bench.draft.axes

    def limited(motor: int, axis: Axis) -> Axis:
        low, high = limits[motor - 1]
        return structs.replace(axis, min_deg=low, max_deg=high)

    bench.change_axes(limited)
    for motor, axis in enumerate(before, start=1):
        bench.add_value("lowest angle deg", motor, before=axis.min_deg, after=limits[motor - 1][0])
        bench.add_value("highest angle deg", motor, before=axis.max_deg, after=limits[motor - 1][1])
    _check_restart(bench)


def _ends(bench: Bench, motor: int) -> tuple[float, float]:
    """Return the lowest and the highest angle that the technician reached."""
    with bench.line() as line:
        watch = PositionWatch(bench, line)
        begin = float(_angles(bench)[motor - 1])
        axis = bench.draft.axes[motor - 1]
        reached = [begin]
        bench.technician.instruct(ManualAction("sweep_axis", texts.SWEEP_AXIS(motor=motor), motor))
        while not bench.technician.has_confirmed():
            watch.look()
            reached.append(begin + axis.direction * float(watch.moved_deg[motor - 1]))
            bench.sleep(LOOK_S)
        if watch.largest_jump_deg > _JUMP_DEG:
            raise StepError(texts.RANGE_AMBIGUOUS(motor=motor, span_deg=max(reached) - min(reached)))
        return min(reached), max(reached)


def _angles(bench: Bench) -> Floats:
    """Return the motors' angles within one turn around the middle of each range, as the driver does after power-up."""
    with bench.line() as line:
        counts = read_counts(line, bench.draft.axes)
    angles = []
    for axis, count in zip(bench.draft.axes, counts.tolist(), strict=True):
        middle = (axis.min_deg + axis.max_deg) / 2
        angle = axis.direction * (count - zero_count(axis)) * DEG_PER_COUNT
        angles.append(middle + wrapped_deg(angle - middle))
    return np.array(angles)


def _check_restart(bench: Bench) -> None:
    """Restart every drive. The driver must then find the same angles, although the drives have lost their turns."""
    before = _angles(bench)
    with bench.line() as line:
        for axis in bench.draft.axes:
            line.reboot(axis.id)
    bench.sleep(_BOOT_S)
    with live_drives(bench) as drives:
        after = drives.angle_deg.copy()
    for n in range(N_AXES):
        off = float(after[n] - before[n])
        if abs(off) > _RESTART_DEG:
            raise StepError(texts.POSITION_AFTER_RESTART(motor=n + 1, off_deg=abs(off)))
