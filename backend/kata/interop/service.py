"""Database access of import and export. The caller commits."""

from uuid import UUID, uuid4

from sqlalchemy.orm import Session

from kata.clinic import texts as clinic_texts
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RECORDING_SAMPLES, RecordingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RUN_SAMPLES, SessionRow
from kata.database.base import utc_now
from kata.database.series import Series
from kata.errors import ProblemError
from kata.interop import texts
from kata.interop.fhir_import import ImportedPatient
from kata.interop.motion_csv import DONE, ParsedMotion
from kata.interop.sample_file import Origin
from kata.messages import sent_key


def identified_patient(session: Session, patient_id: UUID) -> PatientRow:
    """Return a patient whose record is not erased.

    :raises ProblemError: 404; 409 when the record was erased.
    """
    row = patients.get(session, patient_id)
    if row.erased_at:
        raise ProblemError(
            409,
            "erased",
            texts.RECORD_WITHOUT_PATIENT(),
            texts.DOWNLOAD_ONE_BY_ONE(),
        )
    return row


def of_recording(session: Session, recording_id: UUID) -> tuple[Series, Origin]:
    """Return a recording's stored samples and their origin.

    :raises ProblemError: 404.
    """
    row = recordings.get(session, recording_id)
    origin = Origin(
        "recording",
        str(row.id),
        str(row.patient_id),
        row.side,
        row.station,
        row.rate_hz,
        row.taught_at.isoformat(),
        row.simulated,
    )
    return recordings.stored_samples(session, recording_id), origin


def of_run(session: Session, run_id: UUID) -> tuple[Series, Origin]:
    """Return a run's stored samples and their origin.

    :raises ProblemError: 404; 409 when nothing was measured in the run.
    """
    if samples_and_origin := measured(session, run_id):
        return samples_and_origin
    raise ProblemError(409, "nothing_played", texts.NOTHING_MEASURED(), texts.NOTHING_TO_DOWNLOAD())


def measured(session: Session, run_id: UUID) -> tuple[Series, Origin] | None:
    """Return the result of :func:`of_run`, or None if nothing was measured.

    :raises ProblemError: 404.
    """
    row = runs.get(session, run_id)
    series = RUN_SAMPLES.read(session, run_id)
    if not series.head:
        return None
    clinic_session = session.get_one(SessionRow, row.session_id)
    origin = Origin(
        "run",
        str(row.id),
        str(clinic_session.patient_id),
        row.recording.side,
        clinic_session.station or row.recording.station,
        row.rate_hz,
        row.started_at.isoformat(),
        clinic_session.simulated,
    )
    return series, origin


def register_patients(session: Session, patients_in: list[ImportedPatient]) -> list[PatientRow]:
    """Register all patients or none. An import never changes an existing record.

    :raises ProblemError: 409 when a clinic number is taken. The problem contains the number's path.
    """
    registered = []
    for imported in patients_in:
        try:
            registered.append(patients.create(session, imported.patient))
        except ProblemError as error:
            raise error.at(imported.path, texts.IMPORTED_PLACE(place=imported.path, problem=error.message)) from error
    return registered


def store_imported_motion(
    session: Session, patient_id: UUID, parsed: ParsedMotion, *, name: str, taught_by: str, station: str
) -> RecordingRow:
    """Store an imported motion as a recording that has neither a teaching nor a parent.

    :raises ProblemError: 404; 409 for an archived patient.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(
            409, "archived", clinic_texts.PATIENT_ARCHIVED(patient=patient.name), clinic_texts.RESTORE_PATIENT_FIRST()
        )
    row = RecordingRow(
        id=uuid4(),
        patient_id=patient_id,
        teaching_id=None,
        take=None,
        parent_id=None,
        done=[str(DONE)],
        done_keys=[sent_key(DONE)],
        name=name,
        side=parsed.side,
        station=station,
        taught_by=taught_by,
        taught_at=utc_now(),
        duration_s=parsed.duration_s,
        rate_hz=parsed.rate_hz,
        samples=parsed.samples,
        simulated=parsed.simulated,
        note="",
        archived_at=None,
    )
    session.add(row)
    session.flush()
    RECORDING_SAMPLES.store(session, row.id, parsed.series, parsed.downsampled)
    return row
