"""Store and remove goniometer readings of a session. The caller commits."""

from uuid import UUID, uuid4

from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.sessions import service
from kata.clinic.sessions.schemas import GoniometerReadingCreate
from kata.clinic.sessions.tables import GoniometerReadingRow, SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError, not_found
from kata.motion.axes import BASIC_MOTIONS
from kata.station.schemas import Live


def measured_deg(live: Live, motion: int) -> float | None:
    """Return the present apparatus angle of a basic motion of the shoulder joint, or None if its motor does not answer.

    Motors 3 to 5 turn with the body, so their angles are the angles of the motions.
    """
    if live.device != "running":
        return None
    axis = BASIC_MOTIONS[motion - 1].axis
    return next((status.measured_deg for status in live.axes if status.motor == axis), None)


def add(
    session: DatabaseSession,
    session_id: UUID,
    reading: GoniometerReadingCreate,
    *,
    station: str,
    measured_deg: float | None,
) -> SessionRow:
    """Store a reading. In a session that has ended, its time is the end of the session.

    :param station: station at which ``measured_deg``, the present apparatus angle of the motion, was measured.
    :raises ProblemError: 404; 409 when the session is signed, or no apparatus angle is given or measured in this session.
    """
    row = service.to_change(session, session_id)
    apparatus_deg = reading.apparatus_deg
    if apparatus_deg is None and row.ended_at is None and row.station == station:
        apparatus_deg = measured_deg
    if apparatus_deg is None:
        raise ProblemError(409, "no_apparatus_angle", texts.NO_APPARATUS_ANGLE(), texts.ENTER_APPARATUS_ANGLE())
    now = utc_now()
    session.add(
        GoniometerReadingRow(
            id=uuid4(),
            session_id=session_id,
            motion=reading.motion,
            apparatus_deg=apparatus_deg,
            patient_deg=reading.patient_deg,
            read_at=row.ended_at or now,
            read_by=reading.read_by,
        )
    )
    return _changed(session, row)


def remove(session: DatabaseSession, session_id: UUID, reading_id: UUID) -> SessionRow:
    """Remove a reading that was entered by mistake.

    :raises ProblemError: 404; 409 when the session is signed.
    """
    row = service.to_change(session, session_id)
    reading = next((reading for reading in row.goniometer_readings if reading.id == reading_id), None)
    if reading is None:
        raise not_found(texts.READING_NOT_FOUND)
    session.delete(reading)
    return _changed(session, row)


def _changed(session: DatabaseSession, row: SessionRow) -> SessionRow:
    row.updated_at = utc_now()
    session.flush()
    session.refresh(row)
    return row
