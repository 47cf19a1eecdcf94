"""What a therapist does to a motion. Every function gives a new motion and leaves the old one alone.

Nothing is limited in silence: what a function makes is checked as a recording is (:meth:`kata.motion.trajectory.Trajectory.check`)
before it may be played, and refused with motor and time.

Where a motion is cut or joined it stands: it is brought to a stand, and set going again, by its pace along the path, so that
the path stays the one that was taught; from one place to another it goes by minimum jerk (:mod:`kata.motion.approach`).
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator

from kata.messages import Template, Text
from kata.motion import texts
from kata.motion.approach import Approach
from kata.motion.axes import AXES
from kata.motion.linkage import Floats
from kata.motion.taught import MIN_DURATION_S

SPEED_PERCENT: Final = (10.0, 150.0)
RANGE_PERCENT: Final = (10.0, 100.0)
LONGEST_S: Final = 3600.0
"""Nothing made here lasts longer: a session's time, and 17 MB on the way to the device."""
JOIN_SPEED_DEG_S: Final = 15.0
"""From the end of one motion to the start of the next: as slow as a station's approach to a recording's start."""
STRETCH_SPEED_DEG_S: Final = 3.0
"""At the end of ROM: what continuous-passive-motion machines do (0.2 to 3.8 deg/s)."""

_STEP_S: Final = 0.01
_INSTANT_S: Final = 1e-3
"""Samples that are closer are one: an encoder's count between them would be a speed."""
_SAME_DEG: Final = 1e-3
"""A hundredth of an encoder's count is no way to go."""
_SPARSE_S: Final = 0.1
"""Samples further apart get others between them: the paper's 10 Hz, slowed down, would count as samples missing."""
_EASE_S: Final = 0.4
"""From full pace to a stand, and back: 100 deg/s end in 375 deg/s^2."""
_GOES_DEG_S: Final = 2.0
"""A motion whose end is slower than this stands there; one count of an encoder within that time is 1.8 deg/s."""
_GOES_S: Final = 0.05


class EditError(ValueError):
    """It cannot be done to this motion; the message says why."""


@dataclass(frozen=True)
class Motion:
    """Motor angles over time: ``times_s`` is ``(n,)``, increasing from 0, ``angles_deg`` is ``(n, 5)`` in axis order."""

    times_s: Floats
    angles_deg: Floats
    done: tuple[str, ...] = ()
    """What was done to the recording, in order and in words."""

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return float(self.times_s[-1])

    def at(self, times_s: Floats) -> Floats:
        """Angles ``(k, 5)`` at times ``(k,)``: never outside the range of the two neighbouring samples."""
        angles: Floats = PchipInterpolator(self.times_s, self.angles_deg)(times_s)
        return angles


# -- one motion -----------------------------------------------------------------------------------------------------


def trim(motion: Motion, start_s: float, end_s: float) -> Motion:
    """Only what is between two times. Where that begins or ends in full motion, playing sets it going and brings it to a stand.

    :raises EditError: when the times are not within the motion, or leave less than half a second.
    """
    if not (start_s >= 0 and end_s <= motion.duration_s and end_s - start_s >= MIN_DURATION_S):
        raise EditError(
            texts.TRIM_TOO_SHORT(start_s=start_s, end_s=end_s, least_s=MIN_DURATION_S, duration_s=motion.duration_s)
        )
    return _named(_part(motion, start_s, end_s), texts.DONE_TRIMMED(start_s=start_s, end_s=end_s))


def at_speed(motion: Motion, percent: float) -> Motion:
    """The same path, slower or faster: 10 to 150 % of the speed that was taught.

    :raises EditError: when the speed is out of that.
    """
    _within(percent, SPEED_PERCENT, texts.SPEED_PERCENT_REFUSED)
    if percent == 100.0:
        return motion
    return _named(_filled(replace(motion, times_s=motion.times_s * 100.0 / percent)), texts.DONE_SPEED(percent=percent))


def scaled(motion: Motion, percent: float, axes: Collection[int] = AXES) -> Motion:
    """Less range, towards the middle of what each of the given axes (1 to 5) goes through; never more than it was.

    :raises EditError: when ``percent`` is not 0 to 100.
    """
    _within(percent, (0.0, 100.0), texts.RANGE_PERCENT_REFUSED)
    if percent == 100.0:
        return motion
    angles = motion.angles_deg.copy()
    some = [axis - 1 for axis in axes]
    low, high = angles[:, some].min(axis=0), angles[:, some].max(axis=0)
    middle = (low + high) / 2
    # Rounding must not leave the range either.
    angles[:, some] = np.clip(middle + (angles[:, some] - middle) * percent / 100.0, low, high)
    return _named(replace(motion, angles_deg=angles), _scaled_text(percent, axes))


def less(motion: Motion, deg: float) -> Motion:
    """The axis that goes farthest goes ``deg`` less in all, the others less in proportion.

    :raises EditError: when nothing would be left.
    """
    reach = _reach_deg(motion)
    if not 0 <= deg < reach:
        raise EditError(texts.LESS_THAN_RANGE(deg=deg, reach_deg=reach))
    return scaled(motion, 100.0 * (1.0 - deg / reach))


def isolated(motion: Motion, axes: Collection[int]) -> Motion:
    """Only these axes (1 to 5) move, as they did; the others stay at the angle they started from.

    :raises EditError: when no axis is named, or one that is not there.
    """
    if not axes or not set(axes) <= set(AXES):
        raise EditError(texts.NO_MOTOR_LEFT(first=AXES[0], last=AXES[-1]))
    angles = np.repeat(motion.angles_deg[:1], len(motion.times_s), axis=0)
    some = [axis - 1 for axis in axes]
    angles[:, some] = motion.angles_deg[:, some]
    return _named(replace(motion, angles_deg=angles), _isolated_text(axes))


def held(motion: Motion, at_s: float, hold_s: float) -> Motion:
    """Stand at one point for a while. Nearer than 0.2 s to the start or end it is there.

    :raises EditError: when the point is not within the motion, or the time is below 0.
    """
    if not 0 <= at_s <= motion.duration_s or not hold_s >= 0:
        raise EditError(texts.HOLD_OUTSIDE_MOTION(at_s=at_s, hold_s=hold_s, duration_s=motion.duration_s))
    line = Line()
    before, after = _halves(motion, at_s)
    if before:
        line.add(eased(before, start=False))
    line.stand(hold_s, after.angles_deg[0] if after else motion.angles_deg[-1])
    if after:
        line.add(eased(after, end=False))
    return line.motion((*motion.done, texts.DONE_HELD(hold_s=hold_s, at_s=at_s)))


def eased(motion: Motion, *, start: bool = True, end: bool = True) -> Motion:
    """Beginning and ending at rest: where it does not, the pace along its path grows from 0, or falls to it.

    The path does not change, no angle is added. Each end that is eased takes 0.2 s more.
    """
    if start and _goes(motion):
        motion = _set_going(motion)
    if end and _goes(backwards := _reversed(motion)):
        motion = _reversed(_set_going(backwards))
    return motion


# -- many of one motion ---------------------------------------------------------------------------------------------


def repeated(
    motion: Motion, repetitions: int, pause_s: float = 0.0, join_speed_deg_s: float = JOIN_SPEED_DEG_S
) -> Motion:
    """The motion again and again, with a pause at each end that it turns at.

    Where it ends elsewhere than it starts, it goes back by minimum jerk, and pauses there too. After the last repetition there
    is nothing.

    :raises EditError: when there are no repetitions, the pause is below 0, or it would last more than an hour.
    """
    if repetitions < 1 or not pause_s >= 0:
        raise EditError(texts.REPETITIONS_REFUSED(repetitions=repetitions, pause_s=pause_s))
    if repetitions == 1:
        return motion
    if repetitions * motion.duration_s + (repetitions - 1) * pause_s > LONGEST_S:
        raise EditError(
            texts.REPETITIONS_TOO_LONG(repetitions=repetitions, duration_s=motion.duration_s, pause_s=pause_s)
        )
    line = Line(join_speed_deg_s)
    one = eased(motion)
    for _ in range(repetitions):
        line.join(one, pause_s)
    if pause_s:
        return line.motion((*motion.done, texts.DONE_REPETITIONS_WITH_PAUSE(repetitions=repetitions, pause_s=pause_s)))
    return line.motion((*motion.done, texts.DONE_REPETITIONS(repetitions=repetitions)))


def warm_up(
    motion: Motion,
    less_deg: float,
    step_deg: float,
    pause_s: float = 0.0,
    join_speed_deg_s: float = JOIN_SPEED_DEG_S,
) -> Motion:
    """Repetitions that begin with ``less_deg`` less range and widen it by ``step_deg`` each, the last one the whole.

    :raises EditError: when ``step_deg`` is not above 0, less is more than there is, or it would last more than an hour.
    """
    if not step_deg > 0 or not pause_s >= 0:
        raise EditError(texts.WARM_UP_REFUSED(step_deg=step_deg, pause_s=pause_s))
    steps = int(np.ceil(less_deg / step_deg - 1e-9))
    if (steps + 1) * motion.duration_s + steps * pause_s > LONGEST_S:
        raise EditError(
            texts.REPETITIONS_TOO_LONG(repetitions=steps + 1, duration_s=motion.duration_s, pause_s=pause_s)
        )
    line = Line(join_speed_deg_s)
    for step in range(steps + 1):
        line.join(eased(less(motion, max(0.0, less_deg - step * step_deg)) if step < steps else motion), pause_s)
    return line.motion((*motion.done, texts.DONE_WARM_UP(less_deg=less_deg, step_deg=step_deg)))


def stretch(
    motion: Motion,
    further_deg: float,
    back_deg: float = 5.0,
    hold_s: float = 0.0,
    speed_deg_s: float = STRETCH_SPEED_DEG_S,
) -> Motion:
    """At the end of ROM of the axis that goes farthest: back along the path, slowly up to the end again and on beyond it, hold.

    Then back to the end, and the motion goes on.

    :raises EditError: when the axis does not go through ``back_deg`` on its way to the end, or a number makes no sense.
    """
    if not (further_deg >= 0 and back_deg > 0 and hold_s >= 0 and speed_deg_s > 0):
        raise EditError(texts.STRETCH_REFUSED(further_deg=further_deg, back_deg=back_deg, hold_s=hold_s))
    axis = int(np.argmax(np.ptp(motion.angles_deg, axis=0)))
    angles = motion.angles_deg[:, axis]
    top = int(np.argmax(np.abs(angles - angles[0])))
    before, after = _halves(motion, float(motion.times_s[top]))
    end = before.angles_deg[-1] if before else motion.angles_deg[0]
    below = np.flatnonzero(np.abs(angles[: top + 1] - end[axis]) >= back_deg)
    if before is None or len(below) == 0:
        raise EditError(texts.STRETCH_BEYOND_RANGE(motor=axis + 1, back_deg=back_deg))
    beyond = end.copy()
    beyond[axis] += np.copysign(further_deg, end[axis] - angles[0])

    line = Line(speed_deg_s)
    line.add(eased(before, start=False))
    line.go_to(motion.angles_deg[below[-1]])
    line.go_to(beyond)
    line.stand(hold_s, beyond)
    line.go_to(end)
    if after:
        line.add(eased(after, end=False))
    tried = texts.DONE_STRETCHED(further_deg=further_deg, motor=axis + 1, back_deg=back_deg)
    return line.motion((*motion.done, tried))


# -- as it is asked for ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PlaybackSettings:
    """How a recording is to be played; unless given, as it was taught, once."""

    speed_percent: float = 100.0
    repetitions: int = 1
    pause_s: float = 0.0
    range_percent: float = 100.0


AS_TAUGHT: Final = PlaybackSettings()


def with_settings(motion: Motion, asked: PlaybackSettings) -> Motion:
    """Range, then speed, then repetitions: the pauses are not slowed down. The same recording and wishes give the same motion.

    :raises EditError: when something is out of what it may be.
    """
    _within(asked.range_percent, RANGE_PERCENT, texts.RANGE_PERCENT_REFUSED)
    once = at_speed(scaled(motion, asked.range_percent), asked.speed_percent)
    return repeated(once, asked.repetitions, asked.pause_s)


# -- putting together -----------------------------------------------------------------------------------------------


class Line:
    """Pieces put one behind the other, each beginning where the one before it ended."""

    def __init__(self, join_speed_deg_s: float = JOIN_SPEED_DEG_S) -> None:
        self._join_speed_deg_s = join_speed_deg_s
        self._times: list[Floats] = []
        self._angles: list[Floats] = []
        self._pause_s = 0.0
        """What the repetition that was put on last wants at its ends."""
        self.duration_s = 0.0

    def add(self, motion: Motion) -> None:
        """What begins where the line has ended."""
        new = slice(1 if self._times else 0, None)
        self._times.append(motion.times_s[new] + self.duration_s)
        self._angles.append(motion.angles_deg[new])
        self.duration_s += motion.duration_s

    def stand(self, seconds: float, angles_deg: Floats) -> None:
        """Stay there."""
        if seconds > _INSTANT_S:
            times = np.linspace(0.0, seconds, int(np.ceil(seconds / _SPARSE_S)) + 1)
            self.add(Motion(times, np.repeat(angles_deg[None, :], len(times), axis=0)))

    def go_to(self, angles_deg: Floats) -> None:
        """By minimum jerk, at the line's speed; nothing where it is there already."""
        here = self._angles[-1][-1]
        if _same_place(here, angles_deg):
            return
        way = Approach(here, angles_deg, self._join_speed_deg_s)
        times = np.linspace(0.0, way.duration_s, int(np.ceil(way.duration_s / _STEP_S)) + 1)
        self.add(Motion(times, np.array([way.at(float(time_s)) for time_s in times])))

    def join(self, motion: Motion, pause_s: float) -> None:
        """One more repetition: the pause of the last, to its start, its own pause if that was elsewhere, and the motion."""
        if self._times:
            here, start = self._angles[-1][-1], motion.angles_deg[0]
            self.stand(self._pause_s, here)
            if not _same_place(here, start):
                self.go_to(start)
                self.stand(pause_s, start)
        self.add(motion)
        self._pause_s = pause_s

    def motion(self, done: tuple[str, ...]) -> Motion:
        """All of it."""
        return Motion(np.concatenate(self._times), np.concatenate(self._angles), done)


def _part(motion: Motion, start_s: float, end_s: float) -> Motion:
    """Between two times, counted from the first of them."""
    within = (motion.times_s > start_s + _INSTANT_S) & (motion.times_s < end_s - _INSTANT_S)
    ends = motion.at(np.array([start_s, end_s]))
    times = np.concatenate([[start_s], motion.times_s[within], [end_s]]) - start_s
    return replace(motion, times_s=times, angles_deg=np.concatenate([ends[:1], motion.angles_deg[within], ends[1:]]))


def _halves(motion: Motion, at_s: float) -> tuple[Motion | None, Motion | None]:
    """Before and after a time; None where that is next to nothing, which then belongs to the other half."""
    if at_s < _EASE_S / 2:
        return None, motion
    if at_s > motion.duration_s - _EASE_S / 2:
        return motion, None
    return _part(motion, 0.0, at_s), _part(motion, at_s, motion.duration_s)


def _goes(motion: Motion) -> bool:
    """It begins in full motion."""
    soon_s = min(_GOES_S, motion.duration_s)
    way = np.abs(np.diff(motion.at(np.array([0.0, soon_s])), axis=0))
    return bool(np.max(way) > _GOES_DEG_S * soon_s)


def _set_going(motion: Motion) -> Motion:
    """The pace along the path grows as 3 x^2 - 2 x^3 from 0 to 1: acceleration begins and ends with nothing."""
    ease_s = min(_EASE_S, 2 * motion.duration_s)
    x = np.linspace(0.0, 1.0, int(np.ceil(ease_s / _STEP_S)) + 1)
    place_s = ease_s * (x**3 - x**4 / 2)
    later = motion.times_s > ease_s / 2 + _INSTANT_S
    return replace(
        motion,
        times_s=np.concatenate([x * ease_s, motion.times_s[later] + ease_s / 2]),
        angles_deg=np.concatenate([motion.at(place_s), motion.angles_deg[later]]),
    )


def _reversed(motion: Motion) -> Motion:
    return replace(motion, times_s=motion.duration_s - motion.times_s[::-1], angles_deg=motion.angles_deg[::-1])


def _filled(motion: Motion) -> Motion:
    """With samples between those that lie far apart."""
    parts = np.ceil(np.diff(motion.times_s) / _SPARSE_S - 1e-9).astype(int)
    if np.all(parts <= 1):
        return motion
    between = [
        np.linspace(start, end, count + 1)[1:-1]
        for start, end, count in zip(motion.times_s[:-1], motion.times_s[1:], parts, strict=True)
    ]
    times = np.sort(np.concatenate([motion.times_s, *between]))
    return replace(motion, times_s=times, angles_deg=motion.at(times))


def _same_place(one_deg: Floats, other_deg: Floats) -> bool:
    return bool(np.max(np.abs(one_deg - other_deg)) < _SAME_DEG)


def _reach_deg(motion: Motion) -> float:
    """What the axis that goes farthest goes through."""
    return float(np.max(np.ptp(motion.angles_deg, axis=0)))


def _named(motion: Motion, what: str) -> Motion:
    return replace(motion, done=(*motion.done, what))


def _scaled_text(percent: float, axes: Collection[int]) -> Text:
    if set(axes) == set(AXES):
        return texts.DONE_RANGE(percent=percent)
    if len(axes) == 1:
        return texts.DONE_RANGE_OF_MOTOR(percent=percent, motor=min(axes))
    return texts.DONE_RANGE_OF_MOTORS(percent=percent, motors=_motors(axes))


def _isolated_text(axes: Collection[int]) -> Text:
    if len(axes) == 1:
        return texts.DONE_ISOLATED_MOTOR(motor=min(axes))
    return texts.DONE_ISOLATED_MOTORS(motors=_motors(axes))


def _motors(axes: Collection[int]) -> str:
    return ", ".join(str(axis) for axis in sorted(axes))


def _within(percent: float, bounds: tuple[float, float], refused: Template) -> None:
    low, high = bounds
    if not low <= percent <= high:
        raise EditError(refused(percent=percent, lowest=low, highest=high))
