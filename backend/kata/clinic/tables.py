"""Every table of the clinic, for whoever needs them all: migrations."""

from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings.tables import RecordingRow, RecordingSamplesRow, TeachingRow
from kata.clinic.sessions.tables import MotorTrackingRow, RunRow, RunSamplesRow, SessionRow

__all__ = [
    "MotorTrackingRow",
    "PatientRow",
    "RecordingRow",
    "RecordingSamplesRow",
    "RunRow",
    "RunSamplesRow",
    "SessionRow",
    "TeachingRow",
]
