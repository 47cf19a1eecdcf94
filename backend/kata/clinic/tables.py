"""All tables of the clinic, for migrations."""

from kata.audit.tables import AuditRow
from kata.auth.tables import AccessTokenRow, AccountRow, AccountStationRow, LoginSessionRow, RecoveryCodeRow
from kata.backups.tables import BackupRow
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.commissionings.tables import CommissioningRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patient_mode.tables import PatientModeRow
from kata.clinic.patients.tables import ErasureRow, ExportedStatementRow, PatientRow
from kata.clinic.profile.tables import ClinicProfileRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow
from kata.clinic.recordings.tables import RecordingRow, RecordingSamplesRow, TeachingRow
from kata.clinic.restricted.tables import BreakGlassAccessRow, CareTeamRow
from kata.clinic.sessions.tables import (
    AddendumRow,
    EndFeelRow,
    GoniometerReadingRow,
    MotionTrackingRow,
    MotorTrackingRow,
    RunCorrectionRow,
    RunRow,
    RunSamplesRow,
    SessionRow,
    SessionStopRow,
)
from kata.clinic.stations.tables import StationRow, StationVersionRow
from kata.clinic.statistics.tables import EpisodeOutcomeRow, StationHourRow
from kata.database.delivery import SpoolRow
from kata.database.upgrade import SchemaRow

__all__ = [
    "AccessTokenRow",
    "AccountRow",
    "AccountStationRow",
    "AddendumRow",
    "AssessmentRow",
    "AuditRow",
    "BackupRow",
    "BreakGlassAccessRow",
    "CareTeamRow",
    "ClinicProfileRow",
    "CommissioningRow",
    "ContraindicationRow",
    "DeviceEventRow",
    "EndFeelRow",
    "EpisodeOutcomeRow",
    "EpisodeRow",
    "ErasureRow",
    "ExportedStatementRow",
    "GoniometerReadingRow",
    "LoginSessionRow",
    "MotionTrackingRow",
    "MotorTrackingRow",
    "PatientModeRow",
    "PatientRow",
    "ProgrammeItemRow",
    "ProgrammeRow",
    "ProgrammeVersionRow",
    "QuestionnaireTextsRow",
    "RecordingRow",
    "RecordingSamplesRow",
    "RecoveryCodeRow",
    "RomRow",
    "RunCorrectionRow",
    "RunRow",
    "RunSamplesRow",
    "SchemaRow",
    "SessionRow",
    "SessionStopRow",
    "SpoolRow",
    "StageRow",
    "StationHourRow",
    "StationRow",
    "StationVersionRow",
    "TeachingRow",
]
