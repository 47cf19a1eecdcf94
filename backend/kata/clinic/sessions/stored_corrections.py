"""Reads corrections that were learned from repeated playback. They are stored with the run that taught them and used by the next similar
run (:mod:`kata.clinic.sessions.correction_learning` calculates them).

A correction belongs to one recording, station, speed, range and number of repetitions, because other settings make another motion. The
caller commits.
"""

import logging
from datetime import datetime
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.sessions.tables import RunCorrectionRow, RunRow, SessionRow
from kata.clinic.stations import service as stations
from kata.database import arrays
from kata.motion.edit import PlaybackSettings
from kata.motion.ilc import Correction, LearnedRepetition

log = logging.getLogger(__name__)


def newest(
    session: DatabaseSession, recording_id: UUID, settings: PlaybackSettings, station: str, at: datetime
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
            RunRow.speed_percent == settings.speed_percent,
            RunRow.repetitions == settings.repetitions,
            RunRow.pause_s == settings.pause_s,
            RunRow.range_percent == settings.range_percent,
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
    repetition = None
    if "peak_deg" in columns:  # Those of earlier versions are learned from, but not compared.
        repetition = LearnedRepetition(
            played_deg=columns["played_deg"],
            total_deg=float(columns["total_deg"][0]),
            error_deg=columns["error_deg"][0],
            peak_deg=columns["peak_deg"][0],
            gain=columns["gain"][0],
            fell_back=tuple(int(axis) + 1 for axis in np.flatnonzero(columns["fell_back"][0])),
        )
    return Correction(float(columns["time_s"][1]), columns["correction_deg"], repetition)
