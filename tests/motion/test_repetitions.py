"""Ends of repetitions, compared with the whole motion as it is made for the device."""

import numpy as np
import pytest

from kata.motion.edit import EditError, Motion, PlaybackSettings, with_settings
from kata.motion.linkage import Floats
from kata.motion.repetitions import RepetitionTimes, repetition_times, repetition_times_of


def motion(*, ends_elsewhere: bool) -> Motion:
    """Return a motion of two seconds: there and back at rest, or in full motion to another place."""
    times_s = np.arange(201) / 100
    share: Floats = times_s / 2 if ends_elsewhere else np.sin(np.pi * times_s / 2) ** 4
    return Motion(times_s, np.repeat(20.0 * share[:, None], 5, axis=1))


@pytest.mark.parametrize("ends_elsewhere", [False, True])
@pytest.mark.parametrize(
    "asked",
    [
        PlaybackSettings(),
        PlaybackSettings(speed_percent=50.0),
        PlaybackSettings(repetitions=2),
        PlaybackSettings(repetitions=7, pause_s=1.5),
        PlaybackSettings(speed_percent=150.0, repetitions=5, pause_s=2.0, range_percent=60.0),
    ],
)
def test_repeated_motion_lasts_as_long_as_the_device_reference(ends_elsewhere: bool, asked: PlaybackSettings) -> None:
    taught = motion(ends_elsewhere=ends_elsewhere)
    whole = with_settings(taught, asked)
    found = repetition_times(taught, asked)
    assert found.duration_s == pytest.approx(whole.duration_s, abs=1e-6)
    # The result from the whole motion is the same.
    same = repetition_times_of(taught, whole, asked)
    assert (same.first_s, same.period_s) == pytest.approx((found.first_s, found.period_s), abs=1e-6)


def test_repetition_counts_only_after_it_has_ended() -> None:
    # There and back in 2 s, at rest for 1 s between.
    found = repetition_times(motion(ends_elsewhere=False), PlaybackSettings(repetitions=3, pause_s=1.0))
    reached = {0.0: 0, 1.99: 0, 2.0: 1, 4.9: 1, 5.0: 2, 7.9: 2, 8.0: 3, 9.0: 3}
    assert {at_s: found.done(at_s + 1e-6) for at_s in reached} == reached


def test_single_playback_counts_as_done_at_its_end() -> None:
    assert [RepetitionTimes(2.0, 0.0, 1).done(at_s) for at_s in (0.0, 1.9, 2.0, 5.0)] == [0, 0, 1, 1]


@pytest.mark.parametrize(
    "asked", [PlaybackSettings(speed_percent=10.0, repetitions=200), PlaybackSettings(repetitions=200, pause_s=20.0)]
)
def test_playback_beyond_an_hour_is_refused_before_it_is_built(asked: PlaybackSettings) -> None:
    with pytest.raises(EditError, match="the maximum is one hour"):
        repetition_times(motion(ends_elsewhere=False), asked)


def test_return_that_exceeds_an_hour_in_total_is_refused() -> None:
    asked = PlaybackSettings(repetitions=200, pause_s=8.0)
    taught = motion(ends_elsewhere=True)
    assert 200 * taught.duration_s + 199 * asked.pause_s < 3600
    with pytest.raises(EditError, match="the maximum is one hour"):
        repetition_times(taught, asked)
