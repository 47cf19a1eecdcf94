"""Changes a part of a motion smoothly, without a new teaching. The motion outside the part does not change.

The change of each motor is a curve through its points, and 0 at both marks. Between two neighbouring points it is a
polynomial of degree 5 in Bernstein form (Farin 2002, Curves and Surfaces for CAGD, Chapters 5 and 6). Its second derivative is 0
at every point, and its first derivative is 0 at the marks and at every point at which the change turns, so the curve is continuous
up to its second derivative. At the other points the slope is the harmonic mean of the neighbouring slopes, as Fritsch and Butland
(1984, SIAM J. Sci. Stat. Comput. 5, 300) choose it, but at most 1.25 times the smaller one. With this bound the control points of each
piece increase or decrease, so no value exceeds those of its two points.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from kata.messages import Text
from kata.motion import texts
from kata.motion.axes import AXES
from kata.motion.edit import EditError, Motion
from kata.motion.linkage import Floats

POINT_GAP_S: Final = 0.2
"""Shortest time between two points of a motor, and between a point and a mark. A shorter change could not be seen in playback, because
playback smooths the motion.
"""
_STEEPEST: Final = 1.25
"""Largest slope at a point as a multiple of the smaller neighbouring slope. Two such slopes leave the piece between them monotone."""
_ROUNDING_S: Final = 1e-6


@dataclass(frozen=True)
class ChangePoint:
    """A point that a changed motor passes: ``change_deg`` beside its taught angle, ``at_s`` after the start of the motion."""

    motor: int
    at_s: float
    change_deg: float


def retouched(motion: Motion, start_s: float, end_s: float, points: Sequence[ChangePoint]) -> Motion:
    """Return the motion with each motor changed through its points between two times. Times and other samples are the same.

    :param start_s: mark before which nothing changes; ``end_s``: mark after which nothing changes.
    :param points: at least one point, in any order.
    :raises EditError: when a mark is not within the motion, or two points of a motor are nearer than :data:`POINT_GAP_S`.
    """
    long_enough = end_s - start_s >= 2 * POINT_GAP_S - _ROUNDING_S
    if not (start_s >= 0 and end_s <= motion.duration_s + _ROUNDING_S and long_enough):
        raise EditError(
            texts.RETOUCH_MARKS_REFUSED(
                start_s=start_s, end_s=end_s, least_s=2 * POINT_GAP_S, duration_s=motion.duration_s
            )
        )
    motors = sorted({point.motor for point in points})
    if not motors or not set(motors) <= set(AXES):
        raise EditError(texts.NO_MOTOR_LEFT(first=AXES[0], last=AXES[-1]))
    within = (motion.times_s > start_s) & (motion.times_s < end_s)
    angles = motion.angles_deg.copy()
    for motor in motors:
        knots = sorted((point.at_s, point.change_deg) for point in points if point.motor == motor)
        times = np.array([start_s, *(at_s for at_s, _ in knots), end_s])
        changes = np.array([0.0, *(change_deg for _, change_deg in knots), 0.0])
        near = np.flatnonzero(np.diff(times) < POINT_GAP_S - _ROUNDING_S)
        if len(near):
            raise EditError(
                texts.RETOUCH_POINTS_TOO_CLOSE(
                    motor=motor, first_s=times[near[0]], second_s=times[near[0] + 1], least_s=POINT_GAP_S
                )
            )
        angles[within, motor - 1] += change_deg(times, changes, motion.times_s[within])
    return replace(motion, angles_deg=angles, done=(*motion.done, _done(motors, start_s, end_s, points)))


def change_deg(knots_s: Floats, changes_deg: Floats, times_s: Floats) -> Floats:
    """Return the smooth change ``(n,)`` in deg at the times ``(n,)``, which are between the first and the last knot.

    :param knots_s: ``(k,)``, increasing; ``changes_deg``: ``(k,)``, the change at each knot.
    """
    slopes = np.diff(changes_deg) / np.diff(knots_s)
    before, after = slopes[:-1], slopes[1:]
    smaller = np.minimum(np.abs(before), np.abs(after))
    larger = np.maximum(np.abs(before), np.abs(after))
    same_direction = before * after > 0
    mean = 2 * smaller * larger / np.where(same_direction, smaller + larger, 1.0)
    at_knots = np.zeros_like(knots_s)
    at_knots[1:-1] = np.where(same_direction, np.sign(before) * np.minimum(mean, _STEEPEST * smaller), 0.0)
    # Between two knots a polynomial of degree 5, whose acceleration is 0 at both.
    row = np.clip(np.searchsorted(knots_s, times_s, side="right") - 1, 0, len(knots_s) - 2)
    step = np.diff(knots_s)[row]
    share = (times_s - knots_s[row]) / step
    rise, leaving, arriving = np.diff(changes_deg)[row], at_knots[row] * step, at_knots[row + 1] * step
    cubic, quartic, quintic = (
        10 * rise - 6 * leaving - 4 * arriving,
        -15 * rise + 8 * leaving + 7 * arriving,
        6 * rise - 3 * leaving - 3 * arriving,
    )
    changed: Floats = changes_deg[row] + share * (leaving + share**2 * (cubic + share * (quartic + share * quintic)))
    return changed


def _done(motors: Sequence[int], start_s: float, end_s: float, points: Sequence[ChangePoint]) -> Text:
    largest = max((point.change_deg for point in points), key=abs)
    if len(motors) == 1:
        return texts.DONE_RETOUCHED_MOTOR(motor=motors[0], change_deg=largest, start_s=start_s, end_s=end_s)
    names = ", ".join(map(str, motors))
    return texts.DONE_RETOUCHED_MOTORS(motors=names, change_deg=largest, start_s=start_s, end_s=end_s)
