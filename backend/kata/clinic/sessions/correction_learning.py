"""Calculates what a run of the learned method teaches (:mod:`kata.motion.ilc`), as it is stored. The figure worker runs this."""

import logging
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from kata.clinic import texts
from kata.database import arrays
from kata.device.config import StationConfig
from kata.device.journal import Journal
from kata.messages import Text, sent_key
from kata.motion.axes import N_AXES
from kata.motion.edit import Motion
from kata.motion.ilc import STEP_S, Correction, LearnedRepetition, next_correction
from kata.motion.method import reference
from kata.motion.tracking import MIN_MOTION_DEG

log = logging.getLogger(__name__)

COLUMNS: Final = (
    arrays.SampleColumn("time_s", "s", 1e-6),
    arrays.SampleColumn("correction_deg", "deg", 1e-6),
    arrays.SampleColumn("played_deg", "deg", 1e-6),
    arrays.SampleColumn("error_deg", "deg", 1e-6),
    arrays.SampleColumn("gain", "1", 1e-6),
    arrays.SampleColumn("fell_back", "1", 1e-6),
    arrays.SampleColumn("total_deg", "deg", 1e-6),
    arrays.SampleColumn("peak_deg", "deg", 1e-6),
)
"""The columns from ``error_deg`` on have the same value in each row. Corrections of earlier versions lack the last ones."""


@dataclass(frozen=True)
class Learner:
    """The station that learns, and the share of its axes' torque that the run's resistance level allows."""

    config: StationConfig
    resistance_share: float


@dataclass(frozen=True)
class Learned:
    """Columns of the run by name, and the correction as it is stored; None if nothing was learned."""

    run: dict[str, Any]
    data: bytes | None = None


def learn(
    run_id: str, before: Correction | None, motion: Motion, journal: Journal, outcome: str, learner: Learner
) -> Learned:
    """Learn from a run that was played to its end on this station.

    :param before: correction that the run played.
    """
    config = learner.config
    if outcome != "completed":
        return _nothing(texts.NOT_LEARNED_NOT_COMPLETED())
    if journal.station != config.name:
        return _nothing(texts.NOT_LEARNED_OTHER_STATION())
    try:
        correction = next_correction(
            before,
            reference("learned", motion.times_s, motion.angles_deg),
            journal.repetition,
            config.servo_model,
            np.array([axis.max_torque_nm * learner.resistance_share for axis in config.axes]),
            np.array(config.mechanism_deg),
        )
    except ValueError as error:
        log.warning("nothing is learned from run %s: %s", run_id, error)
        return _nothing(texts.NOT_LEARNED_NO_FIT())
    repetition = correction.learned_from
    assert repetition is not None
    if repetition.fell_back:
        log.warning(
            "an error grew in run %s: motors %s use their earlier correction",
            repetition.fell_back,
            run_id,
        )
    count = len(correction.angles_deg)
    stored = {
        "time_s": np.arange(count) * STEP_S,
        "correction_deg": correction.angles_deg,
        "played_deg": repetition.played_deg,
        "error_deg": np.tile(repetition.error_deg, (count, 1)),
        "gain": np.tile(repetition.gain, (count, 1)),
        "fell_back": np.tile(np.isin(np.arange(N_AXES) + 1, repetition.fell_back).astype(np.float64), (count, 1)),
        "total_deg": np.full(count, repetition.total_deg),
        "peak_deg": np.tile(repetition.peak_deg, (count, 1)),
    }
    run = {
        "learning": _stored(fall_back(repetition) + _not_compared(repetition, motion)),
        "learned_rms_deg": float(np.sqrt(np.mean(correction.angles_deg**2, axis=0)).max()),
    }
    return Learned(run, arrays.encode(stored, COLUMNS))


def fall_back(repetition: LearnedRepetition) -> list[Text]:
    """Return why motors use an earlier correction; empty if none does."""
    return [texts.LEARNING_FELL_BACK(motors=_numbers(repetition.fell_back))] if repetition.fell_back else []


def _not_compared(repetition: LearnedRepetition, motion: Motion) -> list[Text]:
    """Return which motors could not be compared with the previous playback. A motor that hardly moves has nothing to learn."""
    moves = np.ptp(motion.angles_deg, axis=0) >= MIN_MOTION_DEG
    motors = tuple(int(axis) + 1 for axis in np.flatnonzero(np.isnan(repetition.error_deg) & moves))
    return [texts.LEARNING_DISTURBED(motors=_numbers(motors))] if motors else []


def _numbers(motors: tuple[int, ...]) -> str:
    return ", ".join(str(motor) for motor in motors)


def _nothing(reason: Text) -> Learned:
    return Learned({"learning": _stored([reason])})


def _stored(messages: list[Text]) -> list[dict[str, Any]]:
    return [{"message": str(text), "message_key": sent_key(text)} for text in messages]
