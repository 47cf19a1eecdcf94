"""Edits of a motion. Every function returns a new motion and leaves the old one unchanged.

No value is clipped silently. The result is checked like a recording (:meth:`kata.motion.trajectory.Trajectory.check`) before
it may be played. A refusal names motor and time.

At cuts and joins the motion comes to rest. It slows down and starts again along the taught path, so that the path does
not change. Between two places it moves by minimum jerk (:mod:`kata.motion.approach`).
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from kata.messages import Template, Text
from kata.motion import texts
from kata.motion.approach import MinimumJerkMove
from kata.motion.axes import AXES
from kata.motion.interpolation import MonotoneCubic
from kata.motion.linkage import Floats
from kata.motion.shoulder import rest_posture_deg
from kata.motion.taught import MIN_DURATION_S

SPEED_PERCENT: Final = (10.0, 150.0)
RANGE_PERCENT: Final = (10.0, 100.0)
LONGEST_S: Final = 3600.0
"""Maximum duration of a result. It is longer than a session needs, and takes 17 MB when it is sent to the device."""
NAME_LETTERS: Final = 40
"""The name of another recording is cut to this length in an edit's text, which becomes part of the new recording's name."""
JOIN_SPEED_DEG_S: Final = 15.0
"""Speed of the movement from the end of one motion to the start of the next. It equals
the default of ``StationConfig.approach_speed_deg_s``. Either may be changed without the other."""
STRETCH_SPEED_DEG_S: Final = 3.0
"""Speed of a stretch at the end of the range. Continuous-passive-motion machines use 0.2 to 3.8 deg/s."""

_STEP_S: Final = 0.01
_INSTANT_S: Final = 1e-3
"""Samples closer than this are treated as one sample, because a difference of one encoder count would look like a high speed."""
_SAME_DEG: Final = 1e-3
"""Angles closer than this count as equal. It is about a hundredth of an encoder count."""
_SPARSE_S: Final = 0.1
"""Longest time between two samples. Samples are added between those that are farther apart, because a motion of 10 Hz that is
slowed down would otherwise look as if samples were missing.
"""
_EASE_S: Final = 0.4
"""Time from full speed to rest, and from rest to full speed. From 100 deg/s the acceleration reaches 375 deg/s^2."""
_MOVING_SPEED_DEG_S: Final = 2.0
"""A motion that is slower than this at its end counts as at rest there. One encoder count within ``_MOVING_WINDOW_S`` is 1.8 deg/s."""
_MOVING_WINDOW_S: Final = 0.05


class EditError(ValueError):
    """The edit is not possible for this motion; the message says why."""


@dataclass(frozen=True)
class Motion:
    """Motor angles over time: ``times_s`` is ``(n,)``, increasing from 0, ``angles_deg`` is ``(n, 5)`` in axis order."""

    times_s: Floats
    angles_deg: Floats
    done: tuple[str, ...] = ()
    """Descriptions of the edits, in order."""

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return float(self.times_s[-1])

    def at(self, times_s: Floats) -> Floats:
        """Return the angles ``(k, 5)`` at times ``(k,)``, interpolated, and never outside the range of the two neighbouring samples."""
        return MonotoneCubic(self.times_s, self.angles_deg)(times_s)


# -- edits of one motion --------------------------------------------------------------------------------------------


def trim(motion: Motion, start_s: float, end_s: float) -> Motion:
    """Return the part between two times. If the part begins or ends in full motion, playback starts from rest and slows down to rest there.

    :raises EditError: when the times are not within the motion, or leave less than half a second.
    """
    if not (start_s >= 0 and end_s <= motion.duration_s and end_s - start_s >= MIN_DURATION_S):
        raise EditError(
            texts.TRIM_TOO_SHORT(start_s=start_s, end_s=end_s, least_s=MIN_DURATION_S, duration_s=motion.duration_s)
        )
    return _named(_part(motion, start_s, end_s), texts.DONE_TRIMMED(start_s=start_s, end_s=end_s))


def at_speed(motion: Motion, percent: float) -> Motion:
    """Return the same path at 10 to 150 % of the taught speed.

    :raises EditError: when the speed is outside that range.
    """
    _within(percent, SPEED_PERCENT, texts.SPEED_PERCENT_REFUSED)
    if percent == 100.0:
        return motion
    return _named(_filled(replace(motion, times_s=motion.times_s * 100.0 / percent)), texts.DONE_SPEED(percent=percent))


def scaled(motion: Motion, percent: float, axes: Collection[int] = AXES) -> Motion:
    """Reduce the range of the given axes (1 to 5) towards the rest posture. The range is never extended.

    The end farther from rest moves towards rest. The end nearer to rest does not move: see
    :func:`~kata.motion.shoulder.rest_posture_deg`.

    :raises EditError: when ``percent`` is not 0 to 100.
    """
    _within(percent, (0.0, 100.0), texts.RANGE_PERCENT_REFUSED)
    if percent == 100.0:
        return motion
    angles = motion.angles_deg.copy()
    some = [axis - 1 for axis in axes]
    low, high = angles[:, some].min(axis=0), angles[:, some].max(axis=0)
    rest_deg = rest_posture_deg(motion.angles_deg)[some]
    # Clip, because rounding must not exceed the original range either.
    angles[:, some] = np.clip(rest_deg + (angles[:, some] - rest_deg) * percent / 100.0, low, high)
    return _named(replace(motion, angles_deg=angles), _scaled_text(percent, axes))


def reduced(motion: Motion, deg: float) -> Motion:
    """Reduce the range of the axis with the largest range by ``deg``, the others in proportion.

    :raises EditError: when nothing would be left.
    """
    reach = _reach_deg(motion)
    if not 0 <= deg < reach:
        raise EditError(texts.LESS_THAN_RANGE(deg=deg, reach_deg=reach))
    return scaled(motion, 100.0 * (1.0 - deg / reach))


def isolated(motion: Motion, axes: Collection[int]) -> Motion:
    """Move only these axes (1 to 5); the others stay at their start angle.

    :raises EditError: when no axis or an unknown axis is named.
    """
    if not axes or not set(axes) <= set(AXES):
        raise EditError(texts.NO_MOTOR_LEFT(first=AXES[0], last=AXES[-1]))
    angles = np.repeat(motion.angles_deg[:1], len(motion.times_s), axis=0)
    some = [axis - 1 for axis in axes]
    angles[:, some] = motion.angles_deg[:, some]
    return _named(replace(motion, angles_deg=angles), _isolated_text(axes))


def held(motion: Motion, at_s: float, hold_s: float) -> Motion:
    """Hold the arm at one point of the motion for a time. If the point is less than 0.2 s from the start or end, hold there.

    :raises EditError: when the point is not within the motion, or the time is below 0.
    """
    if not 0 <= at_s <= motion.duration_s or not hold_s >= 0:
        raise EditError(texts.HOLD_OUTSIDE_MOTION(at_s=at_s, hold_s=hold_s, duration_s=motion.duration_s))
    line = MotionBuilder()
    before, after = halves(motion, at_s)
    if before:
        line.add(eased(before, start=False))
    line.stand(hold_s, after.angles_deg[0] if after else motion.angles_deg[-1])
    if after:
        line.add(eased(after, end=False))
    return line.motion((*motion.done, texts.DONE_HELD(hold_s=hold_s, at_s=at_s)))


def eased(motion: Motion, *, start: bool = True, end: bool = True) -> Motion:
    """Make the motion begin and end at rest. At an end in full motion, the speed along the path rises from 0 or falls to 0.

    The path does not change, and no angle is added. Each changed end makes the motion 0.2 s longer.
    """
    if start and _goes(motion):
        motion = _set_going(motion)
    if end and _goes(backwards := _reversed(motion)):
        motion = _reversed(_set_going(backwards))
    return motion


# -- repetitions ----------------------------------------------------------------------------------------------------


def repeated(
    motion: Motion, repetitions: int, pause_s: float = 0.0, join_speed_deg_s: float = JOIN_SPEED_DEG_S
) -> Motion:
    """Repeat the motion, with a pause at each end at which it turns.

    If the motion ends at another place than its start, the arm moves back by minimum jerk and pauses there too. Nothing
    follows the last repetition.

    :raises EditError: when there are no repetitions, the pause is below 0, or the result would last more than an hour.
    """
    if repetitions < 1 or not pause_s >= 0:
        raise EditError(texts.REPETITIONS_REFUSED(repetitions=repetitions, pause_s=pause_s))
    if repetitions == 1:
        return motion
    if repetitions * motion.duration_s + (repetitions - 1) * pause_s > LONGEST_S:
        raise EditError(
            texts.REPETITIONS_TOO_LONG(repetitions=repetitions, duration_s=motion.duration_s, pause_s=pause_s)
        )
    line = MotionBuilder(join_speed_deg_s)
    repetition = eased(motion)
    for _ in range(repetitions):
        line.join(repetition, pause_s)
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
    """Return repetitions with increasing range. The first has ``less_deg`` less range, each next one ``step_deg`` more, and
    the last one the whole range.

    :raises EditError: when ``step_deg`` is not above 0, the range is not large enough, or the result would last more than an
        hour.
    """
    if not step_deg > 0 or not pause_s >= 0:
        raise EditError(texts.WARM_UP_REFUSED(step_deg=step_deg, pause_s=pause_s))
    steps = int(np.ceil(less_deg / step_deg - 1e-9))
    if (steps + 1) * motion.duration_s + steps * pause_s > LONGEST_S:
        raise EditError(
            texts.REPETITIONS_TOO_LONG(repetitions=steps + 1, duration_s=motion.duration_s, pause_s=pause_s)
        )
    line = MotionBuilder(join_speed_deg_s)
    for step in range(steps + 1):
        line.join(eased(reduced(motion, max(0.0, less_deg - step * step_deg)) if step < steps else motion), pause_s)
    return line.motion((*motion.done, texts.DONE_WARM_UP(less_deg=less_deg, step_deg=step_deg)))


def stretch(
    motion: Motion,
    further_deg: float,
    back_deg: float = 5.0,
    hold_s: float = 0.0,
    speed_deg_s: float = STRETCH_SPEED_DEG_S,
) -> Motion:
    """Stretch at the end of the range of the axis with the largest range.

    The arm moves back along the path by ``back_deg``, then slowly to the end and ``further_deg`` beyond it, and is held there.
    Then it returns to the end and the motion continues.

    :raises EditError: when the axis does not move through ``back_deg`` on its way to the end, or a number is not valid.
    """
    if not (further_deg >= 0 and back_deg > 0 and hold_s >= 0 and speed_deg_s > 0):
        raise EditError(texts.STRETCH_REFUSED(further_deg=further_deg, back_deg=back_deg, hold_s=hold_s))
    axis = int(np.argmax(np.ptp(motion.angles_deg, axis=0)))
    angles = motion.angles_deg[:, axis]
    top = int(np.argmax(np.abs(angles - angles[0])))
    before, after = halves(motion, float(motion.times_s[top]))
    end = before.angles_deg[-1] if before else motion.angles_deg[0]
    below = np.flatnonzero(np.abs(angles[: top + 1] - end[axis]) >= back_deg)
    if before is None or len(below) == 0:
        raise EditError(texts.STRETCH_BEYOND_RANGE(motor=axis + 1, back_deg=back_deg))
    beyond = end.copy()
    beyond[axis] += np.copysign(further_deg, end[axis] - angles[0])

    line = MotionBuilder(speed_deg_s)
    line.add(eased(before, start=False))
    line.go_to(motion.angles_deg[below[-1]])
    line.go_to(beyond)
    line.stand(hold_s, beyond)
    line.go_to(end)
    if after:
        line.add(eased(after, end=False))
    tried = texts.DONE_STRETCHED(further_deg=further_deg, motor=axis + 1, back_deg=back_deg)
    return line.motion((*motion.done, tried))


# -- playback settings ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PlaybackSettings:
    """Playback settings of a recording. The default is once, as taught."""

    speed_percent: float = 100.0
    repetitions: int = 1
    pause_s: float = 0.0
    range_percent: float = 100.0


AS_TAUGHT: Final = PlaybackSettings()


def with_settings(motion: Motion, settings: PlaybackSettings) -> Motion:
    """Apply range, then speed, then repetitions, so that the pauses are not slowed down. The result depends only on
    recording and settings.

    :raises EditError: when a value is outside its range.
    """
    _within(settings.range_percent, RANGE_PERCENT, texts.RANGE_PERCENT_REFUSED)
    single = at_speed(scaled(motion, settings.range_percent), settings.speed_percent)
    return repeated(single, settings.repetitions, settings.pause_s)


def without_range(played: Motion, taught: Motion, range_percent: float) -> Motion:
    """Return ``played`` with the whole range. Its times are the same, so that the two motions can be compared.

    :param played: the result of :func:`with_settings` for ``taught``, with this range.
    """
    if range_percent == 100.0:
        return played
    rest_deg = rest_posture_deg(taught.angles_deg)
    return replace(played, angles_deg=rest_deg + (played.angles_deg - rest_deg) * 100.0 / range_percent)


# -- joining --------------------------------------------------------------------------------------------------------


class MotionBuilder:
    """Builds a motion from pieces, each of which begins where the one before it ended."""

    def __init__(self, join_speed_deg_s: float = JOIN_SPEED_DEG_S) -> None:
        self._join_speed_deg_s = join_speed_deg_s
        self._times: list[Floats] = []
        self._angles: list[Floats] = []
        self._pause_s = 0.0
        """Pause that the last added repetition needs at its ends."""
        self.duration_s = 0.0

    def add(self, motion: Motion) -> None:
        """Append a motion that begins where the last piece ended."""
        new = slice(1 if self._times else 0, None)
        self._times.append(motion.times_s[new] + self.duration_s)
        self._angles.append(motion.angles_deg[new])
        self.duration_s += motion.duration_s

    def stand(self, seconds: float, angles_deg: Floats) -> None:
        """Append a time at rest at these angles."""
        if seconds > _INSTANT_S:
            times = np.linspace(0.0, seconds, int(np.ceil(seconds / _SPARSE_S)) + 1)
            self.add(Motion(times, np.repeat(angles_deg[None, :], len(times), axis=0)))

    def go_to(self, angles_deg: Floats) -> None:
        """Append a minimum-jerk movement to these angles; append nothing if the motion already ends there."""
        last_deg = self._angles[-1][-1]
        if _same_place(last_deg, angles_deg):
            return
        movement = MinimumJerkMove(last_deg, angles_deg, self._join_speed_deg_s)
        times = np.linspace(0.0, movement.duration_s, int(np.ceil(movement.duration_s / _STEP_S)) + 1)
        self.add(Motion(times, np.array([movement.at(float(time_s)) for time_s in times])))

    def join(self, motion: Motion, pause_s: float) -> None:
        """Append a repetition: the pause after the last one, the way to its start, a pause there if the start is elsewhere, and
        the motion.
        """
        if self._times:
            last_deg, start = self._angles[-1][-1], motion.angles_deg[0]
            self.stand(self._pause_s, last_deg)
            if not _same_place(last_deg, start):
                self.go_to(start)
                self.stand(pause_s, start)
        self.add(motion)
        self._pause_s = pause_s

    def motion(self, done: tuple[str, ...]) -> Motion:
        """Return the whole motion."""
        return Motion(np.concatenate(self._times), np.concatenate(self._angles), done)


def _part(motion: Motion, start_s: float, end_s: float) -> Motion:
    """Return the part between two times. Its own times start at 0."""
    within = (motion.times_s > start_s + _INSTANT_S) & (motion.times_s < end_s - _INSTANT_S)
    ends = motion.at(np.array([start_s, end_s]))
    times = np.concatenate([[start_s], motion.times_s[within], [end_s]]) - start_s
    return replace(motion, times_s=times, angles_deg=np.concatenate([ends[:1], motion.angles_deg[within], ends[1:]]))


def halves(motion: Motion, at_s: float) -> tuple[Motion | None, Motion | None]:
    """Return the parts before and after a time. A part shorter than 0.2 s is None, and its samples belong to the other part."""
    if at_s < _EASE_S / 2:
        return None, motion
    if at_s > motion.duration_s - _EASE_S / 2:
        return motion, None
    return _part(motion, 0.0, at_s), _part(motion, at_s, motion.duration_s)


def _goes(motion: Motion) -> bool:
    """Return True if the motion begins in full motion."""
    soon_s = min(_MOVING_WINDOW_S, motion.duration_s)
    distance_deg = np.abs(np.diff(motion.at(np.array([0.0, soon_s])), axis=0))
    return bool(np.max(distance_deg) > _MOVING_SPEED_DEG_S * soon_s)


def _set_going(motion: Motion) -> Motion:
    """Make the motion start from rest. The speed along the path grows as 3 x^2 - 2 x^3 from 0 to 1, so that its acceleration
    begins and ends at 0.
    """
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
    """Add samples between samples that are far apart."""
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
    """Return the range in deg of the axis with the largest range."""
    return float(np.max(np.ptp(motion.angles_deg, axis=0)))


def _named(motion: Motion, step: str) -> Motion:
    return replace(motion, done=(*motion.done, step))


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
