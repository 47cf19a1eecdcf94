"""Calculates the time at which each repetition of a motion ends, without building all repetitions."""

from dataclasses import dataclass, replace

from kata.motion import texts
from kata.motion.edit import LONGEST_S, EditError, Motion, PlaybackSettings, eased, with_settings


@dataclass(frozen=True)
class RepetitionTimes:
    """The first repetition ends at ``first_s``, the others every ``period_s``. A period includes pauses and the movement back."""

    first_s: float
    period_s: float
    repetitions: int

    @property
    def duration_s(self) -> float:
        """Time at the end of the last repetition."""
        return self.first_s + (self.repetitions - 1) * self.period_s

    def done(self, reached_s: float) -> int:
        """Return the number of repetitions that end at or before a place on the path."""
        if reached_s < self.first_s:
            return 0
        if self.repetitions == 1:
            return 1
        return min(self.repetitions, 1 + int((reached_s - self.first_s) / self.period_s))


def repetition_times(motion: Motion, settings: PlaybackSettings) -> RepetitionTimes:
    """Return the times at which the repetitions of a recording with these settings end.

    :raises EditError: when the recording cannot be played with these settings, or would last longer than an hour.
    """
    roughly_s = motion.duration_s * 100.0 / settings.speed_percent * settings.repetitions
    _not_too_long(roughly_s + (settings.repetitions - 1) * settings.pause_s)
    single = with_settings(motion, replace(settings, repetitions=1))
    if settings.repetitions == 1:
        return RepetitionTimes(single.duration_s, 0.0, 1)
    # A repeated motion first slows down to rest at its ends.
    first_s = eased(single).duration_s
    twice_s = with_settings(motion, replace(settings, repetitions=2)).duration_s
    times = RepetitionTimes(first_s, twice_s - first_s, settings.repetitions)
    _not_too_long(times.duration_s)
    return times


def repetition_times_of(motion: Motion, whole: Motion, settings: PlaybackSettings) -> RepetitionTimes:
    """Return the times at which the repetitions end if the whole motion has already been built. ``whole`` is the result of
    :func:`~kata.motion.edit.with_settings`.
    """
    if settings.repetitions == 1:
        return RepetitionTimes(whole.duration_s, 0.0, 1)
    first_s = eased(with_settings(motion, replace(settings, repetitions=1))).duration_s
    return RepetitionTimes(first_s, (whole.duration_s - first_s) / (settings.repetitions - 1), settings.repetitions)


def _not_too_long(duration_s: float) -> None:
    if duration_s > LONGEST_S:
        raise EditError(texts.WOULD_LAST_TOO_LONG(minutes=duration_s / 60))
