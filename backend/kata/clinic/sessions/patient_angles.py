"""The patient's angles during a session's runs, estimated from the session's goniometer readings (:mod:`kata.motion.patient_angle`)."""

from collections.abc import Sequence
from datetime import datetime

from kata.clinic.sessions.tables import GoniometerReadingRow, MotionTrackingRow, RunRow, SessionRow
from kata.motion.patient_angle import PatientAngle, PatientAngleEstimator, PoseReading, at_two_poses


class PatientAngles:
    """Estimates the patient's angles in one session."""

    def __init__(self, readings: Sequence[GoniometerReadingRow], started_at: datetime) -> None:
        """``readings``: readings of the session, which began at ``started_at``."""
        self._started_at = started_at
        by_motion: dict[int, list[PoseReading]] = {}
        for row in readings:
            reading = PoseReading(row.apparatus_deg, row.patient_deg, self._minutes(row.read_at))
            by_motion.setdefault(row.motion, []).append(reading)
        self._estimators = {
            motion: PatientAngleEstimator(readings_of_motion)
            for motion, readings_of_motion in by_motion.items()
            if at_two_poses([reading.apparatus_deg for reading in readings_of_motion])
        }

    def at(self, motion: int, apparatus_deg: float | None, moment: datetime) -> PatientAngle | None:
        """Return the patient's angle when the apparatus had this angle. Return None without readings of the motion at two poses."""
        estimator = self._estimators.get(motion)
        return estimator.at(apparatus_deg, self._minutes(moment)) if estimator and apparatus_deg is not None else None

    def of_run(self, run: RunRow, row: MotionTrackingRow) -> tuple[PatientAngle, PatientAngle] | None:
        """Return the patient's angles at the lowest and the highest apparatus angle of a run, or None if they are unknown.

        The estimate is for the end of the run, when the arm may have slipped most.
        """
        moment = run.ended_at or run.started_at
        low, high = self.at(row.motion, row.played_min_deg, moment), self.at(row.motion, row.played_max_deg, moment)
        return None if low is None or high is None else (low, high)

    def _minutes(self, moment: datetime) -> float:
        return (moment - self._started_at).total_seconds() / 60


def of_session(row: SessionRow) -> PatientAngles:
    """Return the estimates of a session."""
    return PatientAngles(row.goniometer_readings, row.started_at)
