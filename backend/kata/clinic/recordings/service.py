"""What is done with recordings. Commits nothing: the request does."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid5

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.problems import ProblemError, not_found
from kata.clinic.recordings.schemas import MotorRange, RecordingUpdate
from kata.clinic.recordings.tables import SAMPLE_COLUMNS, RecordingRow, RecordingSamplesRow, TeachingRow
from kata.database import arrays
from kata.database.base import utc_now
from kata.device.journal import Journal

SHORTEST_TAKE_S: Final = 0.5
"""A shorter press of the pedal was none."""
_SPEED_WINDOW_S: Final = 0.1


@dataclass(frozen=True)
class Samples:
    """``times_s`` is ``(n,)`` from 0, ``angles_deg`` is ``(n, 5)`` motor angles in axis order."""

    times_s: NDArray[np.float64]
    angles_deg: NDArray[np.float64]


def of_patient(session: Session, patient_id: UUID) -> list[RecordingRow]:
    """A patient's recordings, newest first, archived ones last."""
    query = select(RecordingRow).where(RecordingRow.patient_id == patient_id)
    order = (RecordingRow.archived_at.is_not(None), RecordingRow.taught_at.desc(), RecordingRow.take.desc())
    return list(session.scalars(query.order_by(*order)))


def get(session: Session, recording_id: UUID) -> RecordingRow:
    """One recording, without its samples.

    :raises ProblemError: 404.
    """
    row = session.get(RecordingRow, recording_id)
    if row is None:
        raise not_found("recording")
    return row


def samples(session: Session, recording_id: UUID) -> Samples:
    """A recording's samples.

    :raises ProblemError: 404; 410 when they are damaged.
    """
    try:
        columns = arrays.decode(samples_blob(session, recording_id))
    except arrays.UnreadableError as error:
        raise ProblemError(
            410,
            "unreadable_samples",
            "This recording's samples are damaged and cannot be read.",
            "Restore them from a backup, or teach the motion again.",
        ) from error
    return Samples(columns["time_s"], columns["angle_deg"])


def samples_blob(session: Session, recording_id: UUID) -> bytes:
    """A recording's samples as they are stored; empty when they are missing.

    :raises ProblemError: 404.
    """
    get(session, recording_id)
    row = session.get(RecordingSamplesRow, recording_id)
    return row.data if row else b""


def ranges(taught: Samples) -> list[MotorRange]:
    """What each motor does."""
    step = max(1, round(_SPEED_WINDOW_S / float(np.median(np.diff(taught.times_s)))))
    spans = taught.times_s[step:] - taught.times_s[:-step]
    speeds = np.abs(taught.angles_deg[step:] - taught.angles_deg[:-step]) / spans[:, None]
    return [
        MotorRange(
            motor=axis + 1,
            min_deg=float(angles.min()),
            max_deg=float(angles.max()),
            max_speed_deg_s=float(speeds[:, axis].max(initial=0.0)),
        )
        for axis, angles in enumerate(taught.angles_deg.T)
    ]


def update(session: Session, recording_id: UUID, change: RecordingUpdate) -> RecordingRow:
    """Rename, annotate, archive or restore.

    :raises ProblemError: 404.
    """
    row = get(session, recording_id)
    if change.name is not None:
        row.name = change.name
    if change.note is not None:
        row.note = change.note
    if change.archived is not None:
        row.archived_at = (row.archived_at or utc_now()) if change.archived else None
    return row


def keep_teaching(session: Session, journal: Journal) -> list[RecordingRow] | None:
    """Turn a teaching's journal into recordings, one a take; those that are there already are left alone.

    :returns: what is new; None when nobody knows this teaching.
    """
    teaching = session.get(TeachingRow, UUID(journal.id))
    if teaching is None:
        return None
    new = []
    for take in np.unique(journal.take).tolist():
        taken = journal.take == take
        times_s = (journal.t_ns[taken] - journal.t_ns[taken][0]) / 1e9
        recording_id = uuid5(teaching.id, str(take))
        if times_s[-1] < SHORTEST_TAKE_S or session.get(RecordingRow, recording_id):
            continue
        data = arrays.encode({"time_s": times_s, "angle_deg": journal.measured_deg[taken]}, SAMPLE_COLUMNS)
        row = RecordingRow(
            id=recording_id,
            patient_id=teaching.patient_id,
            teaching_id=teaching.id,
            take=take,
            name=teaching.name if take == 1 else f"{teaching.name[:90]} ({take})",
            side=teaching.side,
            station=journal.station,
            taught_at=_wall_time(journal, int(journal.t_ns[taken][0])),
            duration_s=float(times_s[-1]),
            rate_hz=journal.rate_hz,
            samples=len(times_s),
            note="",
            archived_at=None,
        )
        session.add(row)
        session.flush()
        session.add(RecordingSamplesRow(recording_id=recording_id, data=data))
        new.append(row)
    return new


def _wall_time(journal: Journal, t_ns: int) -> datetime:
    """UTC of a sample: the journal was begun at a known time, a little before its first sample."""
    return journal.started_at + timedelta(seconds=(t_ns - journal.started_ns) / 1e9)
