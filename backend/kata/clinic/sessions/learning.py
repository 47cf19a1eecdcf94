"""Corrections that are learned from repeated playback. They are stored with the run that taught them and used by the next similar run.

A correction belongs to one recording, station, speed, range and number of repetitions, because other settings make another motion. The
caller commits.
"""

import logging
from datetime import datetime
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.sessions.tables import RunCorrectionRow, RunRow, SessionRow
from kata.clinic.stations import service as stations
from kata.database import arrays
from kata.device.config import StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.device.journal import Journal
from kata.messages import Text, sent_key
from kata.motion.axes import N_AXES
from kata.motion.edit import Motion, PlaybackSettings
from kata.motion.ilc import STEP_S, Correction, Lesson, next_correction
from kata.motion.method import reference
from kata.motion.tracking import MOVES_DEG

log = logging.getLogger(__name__)

COLUMNS: Final = (
    arrays.SampleColumn("time_s", "s", 1e-6),
    arrays.SampleColumn("correction_deg", "deg", 1e-6),
    arrays.SampleColumn("played_deg", "deg", 1e-6),
    arrays.SampleColumn("error_deg", "deg", 1e-6),
    arrays.SampleColumn("gain", "1", 1e-6),
    arrays.SampleColumn("fell_back", "1", 1e-6),
)
"""The last three columns have the same value in each row. Corrections of earlier versions have only the first two or five columns."""


def newest(
    session: DatabaseSession, recording_id: UUID, asked: PlaybackSettings, station: str, at: datetime
) -> UUID | None:
    """Return the newest run with the same settings that has a correction for a run at this time, or None.

    A correction that was learned on a simulated apparatus is never played on a real one, nor one of a real apparatus on a simulated one.
    """
    simulated = stations.is_simulated(session, station, at)
    query = (
        select(RunRow.id)
        .join(RunCorrectionRow, RunCorrectionRow.run_id == RunRow.id)
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .where(
            SessionRow.simulated == simulated,
            RunCorrectionRow.station == station,
            RunRow.recording_id == recording_id,
            RunRow.speed_percent == asked.speed_percent,
            RunRow.repetitions == asked.repetitions,
            RunRow.pause_s == asked.pause_s,
            RunRow.range_percent == asked.range_percent,
        )
        .order_by(RunRow.started_at.desc())
    )
    return session.scalars(query).first()


def correction(session: DatabaseSession, run_id: UUID | None) -> Correction | None:
    """Return a run's correction, or None if there is no run or its correction is damaged. A damaged correction is learned again."""
    row = session.get(RunCorrectionRow, run_id) if run_id else None
    if row is None:
        return None
    try:
        columns = arrays.decode(row.data)
    except arrays.UnreadableError as error:
        log.warning("the correction of run %s is ignored: %s", run_id, error)
        return None
    lesson = None
    if "gain" in columns:
        fell_back = columns["fell_back"][0] if "fell_back" in columns else np.zeros(N_AXES)
        motors = tuple(int(axis) + 1 for axis in np.flatnonzero(fell_back))
        lesson = Lesson(columns["played_deg"], columns["error_deg"][0], columns["gain"][0], motors)
    return Correction(float(columns["time_s"][1]), columns["correction_deg"], lesson)


def learn_from_run(
    session: DatabaseSession, row: RunRow, journal: Journal, motion: Motion, config: StationConfig
) -> None:
    """Learn from a run of the learned method that was played to its end on this station, and store with the run what was learned."""
    if row.method != "learned":
        return
    if row.outcome != "completed":
        row.learning = _stored([texts.NOT_LEARNED_NOT_COMPLETED()])
        return
    if journal.station != config.name:
        row.learning = _stored([texts.NOT_LEARNED_OTHER_STATION()])
        return
    level = (row.load_level or RESISTANCE_LEVELS) / RESISTANCE_LEVELS
    try:
        learned = next_correction(
            correction(session, row.corrected_by),
            reference("learned", motion.times_s, motion.angles_deg),
            journal.repetition,
            config.servo_model,
            np.array([axis.max_torque_nm * level for axis in config.axes]),
            np.array(config.mechanism_deg),
        )
    except ValueError as error:
        log.warning("nothing is learned from run %s: %s", row.id, error)
        row.learning = _stored([texts.NOT_LEARNED_NO_FIT()])
        return
    assert learned.lesson is not None
    row.learning = _stored(fall_back(learned.lesson) + _not_compared(learned.lesson, motion))
    if learned.lesson.fell_back:
        log.warning(
            "the error of motors %s grew in run %s: the earlier correction is used", learned.lesson.fell_back, row.id
        )
    count = len(learned.angles_deg)
    stored = {
        "time_s": np.arange(count) * STEP_S,
        "correction_deg": learned.angles_deg,
        "played_deg": learned.lesson.played_deg,
        "error_deg": np.tile(learned.lesson.error_deg, (count, 1)),
        "gain": np.tile(learned.lesson.gain, (count, 1)),
        "fell_back": np.tile(np.isin(np.arange(N_AXES) + 1, learned.lesson.fell_back).astype(np.float64), (count, 1)),
    }
    data = arrays.encode(stored, COLUMNS)
    row.learned_rms_deg = float(np.sqrt(np.mean(learned.angles_deg**2, axis=0)).max())
    session.add(RunCorrectionRow(run_id=row.id, station=config.name, data=data))


def fall_back(lesson: Lesson) -> list[Text]:
    """Return why motors use an earlier correction; empty if none does."""
    return [texts.LEARNING_FELL_BACK(motors=_numbers(lesson.fell_back))] if lesson.fell_back else []


def _not_compared(lesson: Lesson, motion: Motion) -> list[Text]:
    """Return which motors could not be compared with the previous playback. A motor that hardly moves has nothing to learn."""
    moves = np.ptp(motion.angles_deg, axis=0) >= MOVES_DEG
    motors = tuple(int(axis) + 1 for axis in np.flatnonzero(np.isnan(lesson.error_deg) & moves))
    return [texts.LEARNING_DISTURBED(motors=_numbers(motors))] if motors else []


def _numbers(motors: tuple[int, ...]) -> str:
    return ", ".join(str(motor) for motor in motors)


def _stored(found: list[Text]) -> list[dict[str, Any]]:
    return [{"message": str(text), "message_key": sent_key(text)} for text in found]
