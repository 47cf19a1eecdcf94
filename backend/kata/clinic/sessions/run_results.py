"""Calculates the results of a playback from its journal: repetitions, errors, end-range time, and what is learned.

The service runs this in the figure worker, because it needs scipy. To import scipy would delay the process that answers a Stop. Therefore
this module and those that it imports do not import the database's tables.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from kata.clinic.programmes.repetition_count import count_repetitions
from kata.clinic.sessions import correction_learning, phases, run_errors
from kata.database.arrays import Floats
from kata.database.series import Series, unpack
from kata.device.config import StationConfig
from kata.device.journal import PHASE_PLAYING, PHASE_REDUCED_RANGE, Journal
from kata.motion import edit
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.end_range import USUAL, EndRangeCounter, EndRangeThreshold
from kata.motion.ilc import Correction
from kata.plotting import downsampling


@dataclass(frozen=True, kw_only=True)
class EndedPlayback:
    """A playback that has ended, with the data of the database that its results depend on."""

    run_id: str
    journal: Journal
    recording: Series
    """The taught samples as they are stored."""
    settings: edit.PlaybackSettings
    outcome: str
    config: StationConfig
    """Configuration of the station that imports the journal, with the run's side: the station may have been turned since."""
    end_range: Mapping[int, EndRangeThreshold]
    """Band and torque of the prescribed end-range time, by motor."""
    learns: bool
    """True if the method learns from its runs."""
    correction: Correction | None
    """Correction that the run played."""
    resistance_share: float
    """Share of each axis' torque that the resistance level allows."""

    @cached_property
    def taught(self) -> edit.Motion:
        """Return the recording as a motion.

        :raises UnreadableError: when its samples are damaged.
        """
        columns = unpack(self.recording)
        return edit.Motion(columns["time_s"], columns["angle_deg"])

    @cached_property
    def motion(self) -> edit.Motion:
        """Return the motion that the run requested from the motors."""
        return edit.with_settings(self.taught, self.settings)


@dataclass(frozen=True)
class PlaybackResults:
    """Columns of :class:`~kata.clinic.sessions.tables.RunRow` and its rows of motors and motions, by name."""

    run: dict[str, Any]
    motors: list[dict[str, Any]] = field(default_factory=list)
    motions: list[dict[str, Any]] = field(default_factory=list)
    overview: bytes | None = None
    """Lines of the run's figure, if they are stored."""
    correction: bytes | None = None
    """The learned correction as it is stored; None if nothing was learned."""


def calculate(playback: EndedPlayback) -> PlaybackResults:
    """Return the results of a playback. Samples and motions are read only if a result needs them.

    :raises UnreadableError: when the samples of the recording are damaged.
    :raises EditError: when the recording cannot be played with the run's settings.
    """
    journal = playback.journal
    done, played_s = count_repetitions(
        journal, playback.outcome, playback.settings, lambda: (playback.taught, playback.motion)
    )
    run: dict[str, Any] = {"repetitions_done": done, "played_s": played_s}
    if len(journal.t_ns):
        run["reversals"] = phases.reversals(journal.phase)
    if np.any(journal.phase == PHASE_REDUCED_RANGE):
        run["least_range_percent"] = phases.least_range_percent(
            playback.motion, journal.phase, journal.path_s, journal.measured_deg.astype(np.float64)
        )
    if not np.any((journal.phase == PHASE_PLAYING) | (journal.phase == PHASE_REDUCED_RANGE)):
        return PlaybackResults(run)
    full_range = edit.without_range(playback.motion, playback.taught, playback.settings.range_percent)
    compared_run = run_errors.compare_run(playback.run_id, journal, playback.motion, full_range, playback.config.side)
    run |= compared_run.run
    if compared_run.comparison is None:
        return PlaybackResults(run)
    _count_end_range(playback, compared_run.motions)
    correction = None
    if playback.learns:
        lesson = correction_learning.learn(
            playback.run_id,
            playback.correction,
            playback.motion,
            journal,
            playback.outcome,
            correction_learning.Learner(playback.config, playback.resistance_share),
        )
        run |= lesson.run
        correction = lesson.data
    overview = downsampling.of_run(playback.motion, compared_run.comparison)
    return PlaybackResults(run, compared_run.motors, compared_run.motions, overview, correction)


def _count_end_range(playback: EndedPlayback, motions: list[dict[str, Any]]) -> None:
    """Add the end-range time of each motion of the shoulder joint. All samples of the run count, also those of pauses and of the way back.

    The prescription's band and torque count for its motion, the usual ones for the others. Nothing is added if the station's load is not
    identified, and for a motion without an end.
    """
    journal = playback.journal
    counter = EndRangeCounter(playback.taught.angles_deg, playback.config.servo_model.load, playback.end_range)
    times_s: Floats = (journal.t_ns - journal.t_ns[0]) / 1e9
    counter.add(times_s, journal.measured_deg, journal.torque_nm)
    counted = counter.times_s()
    for motion in motions:
        motors = BASIC_MOTIONS[motion["motion"] - 1].motors
        if len(motors) == 1 and motors[0] in counted:
            threshold = playback.end_range.get(motors[0], USUAL)
            motion["end_range_s"] = counted[motors[0]]
            motion["end_range_band_deg"], motion["end_range_torque_nm"] = threshold.band_deg, threshold.torque_nm
