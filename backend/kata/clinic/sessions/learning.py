"""Corrections learned from repeated playback, stored with the run that taught them and used by the next similar run.

A correction belongs to one recording on one station with one speed, range and number of repetitions: with other settings it is another
motion. The caller commits.
"""

import logging
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.sessions.tables import RunCorrectionRow, RunRow
from kata.database import arrays
from kata.device.config import StationConfig
from kata.device.journal import Journal
from kata.device.messages import LOAD_LEVELS
from kata.motion.edit import Motion
from kata.motion.ilc import STEP_S, Correction, next_correction
from kata.motion.method import reference

log = logging.getLogger(__name__)

COLUMNS: Final = (arrays.SampleColumn("time_s", "s", 1e-6), arrays.SampleColumn("correction_deg", "deg", 1e-6))


def newest(session: DatabaseSession, like: RunRow, station: str) -> UUID | None:
    """Return the newest run with the same settings that has a correction, None if there is none."""
    query = (
        select(RunRow.id)
        .join(RunCorrectionRow, RunCorrectionRow.run_id == RunRow.id)
        .where(
            RunCorrectionRow.station == station,
            RunRow.recording_id == like.recording_id,
            RunRow.speed_percent == like.speed_percent,
            RunRow.repetitions == like.repetitions,
            RunRow.pause_s == like.pause_s,
            RunRow.range_percent == like.range_percent,
        )
        .order_by(RunRow.started_at.desc())
    )
    return session.scalars(query).first()


def correction(session: DatabaseSession, run_id: UUID | None) -> Correction | None:
    """Return a run's correction. None without a run or if the correction is damaged; it is then learned again."""
    row = session.get(RunCorrectionRow, run_id) if run_id else None
    if row is None:
        return None
    try:
        columns = arrays.decode(row.data)
    except arrays.UnreadableError as error:
        log.warning("the correction of run %s is ignored: %s", run_id, error)
        return None
    return Correction(float(columns["time_s"][1]), columns["correction_deg"])


def learn_from_run(
    session: DatabaseSession, row: RunRow, journal: Journal, motion: Motion, config: StationConfig
) -> None:
    """Learn from a run of the learned method that was played to its end on this station. Ignore other runs."""
    if row.method != "learned" or row.outcome != "completed" or journal.station != config.name:
        return
    level = (row.load_level or LOAD_LEVELS) / LOAD_LEVELS
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
        return
    times_s = np.arange(len(learned.angles_deg)) * STEP_S
    data = arrays.encode({"time_s": times_s, "correction_deg": learned.angles_deg}, COLUMNS)
    row.learned_rms_deg = float(np.sqrt(np.mean(learned.angles_deg**2, axis=0)).max())
    session.add(RunCorrectionRow(run_id=row.id, station=config.name, data=data))
