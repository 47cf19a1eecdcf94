"""Clinical signature of a session's note, and addenda. The caller commits."""

from uuid import UUID, uuid4

from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.sessions import ending, service
from kata.clinic.sessions.schemas import AddendumCreate, SessionSign
from kata.clinic.sessions.tables import AddendumRow, SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError


def sign(session: DatabaseSession, session_id: UUID, signature: SessionSign) -> SessionRow:
    """Sign the note of a session. The note cannot change afterwards.

    :raises ProblemError: 404; 409 when the note is already signed, the session has not ended, a playback's result has not been
        imported, or the note has changed since the signer saw it.
    """
    row = service.to_change(session, session_id, signature.updated_at)
    if row.ended_at is None:
        raise ProblemError(409, "session_open", texts.SESSION_NOT_ENDED(), texts.END_FIRST())
    ending.check_results(row.runs)
    row.note = signature.note
    row.signed_at = row.updated_at = utc_now()
    row.signed_by = signature.signed_by
    return row


def add(session: DatabaseSession, session_id: UUID, addendum: AddendumCreate) -> SessionRow:
    """Add an addendum to a signed note.

    :raises ProblemError: 404; 409 while the note is not signed.
    """
    row = service.get(session, session_id)
    if row.signed_at is None:
        raise ProblemError(409, "not_signed", texts.NOTE_NOT_SIGNED(), texts.CHANGE_NOTE_ITSELF())
    addendum_row = AddendumRow(
        id=uuid4(), session_id=session_id, written_at=utc_now(), written_by=addendum.written_by, text=addendum.text
    )
    session.add(addendum_row)
    session.flush()
    session.refresh(row)
    return row
