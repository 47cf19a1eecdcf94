"""Estimate the patient's angle of a basic motion from apparatus angles and goniometer readings, with its uncertainty.

The patient's angle ``p`` differs from the apparatus angle ``x`` by how the arm lies in the cuff:

    p = x + offset + slope x + slip(t) + shape(x),        reading = p + error

All terms are normal and independent; ``slip`` is a random walk from the start of the session. The estimate is the mean of ``p`` given the
readings (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, Eq. 2.25 and 2.26), its uncertainty 1.96 standard
deviations: 95 of 100 patient's angles lie within it if the terms are as large as stated here.

Sources. ``offset`` and ``slope``: Cortés et al. 2016, BioMed Research International 2581924, Table 5, where an arm exoskeleton's angles
stood against motion capture in three movements of the shoulder (intercepts 25.6, -22.3, -17.8 deg; slopes 0.35, 1.69, 0.85): their root mean
squares. ``shape``: its Table 4; 3.3 deg was the least error that its own estimator left, and we claim no less. ``error``: de Winter et al.
2004, BMC Musculoskeletal Disorders 5:18; two physical therapists differed by +-19.6 deg (95 %) with an inclinometer in 155 patients, so one of
them errs by 19.6 / 1.96 / sqrt(2). ``slip``: assumed; Sun et al. 2025 names slip (Section 4.8) without a figure.

Limits. The model is linear in one motion; an arm that slips at once by more than the random walk, or that was refitted after the
readings, is outside of it. No estimate has been compared with a real patient.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.motion.linkage import Floats

OFFSET_DEG: Final = 22.1
"""Standard deviation of the constant difference."""
SLOPE: Final = 0.55
"""Standard deviation of the difference that grows with the angle, deg per deg."""
SHAPE_DEG: Final = 3.3
"""Standard deviation of what a straight line does not explain."""
READING_DEG: Final = 7.1
"""Standard deviation of the error of a goniometer reading."""
SLIP_DEG_PER_ROOT_MIN: Final = 1.0
"""Standard deviation of the slip after one minute; it grows with the root of the time: 5.5 deg after half an hour."""
APART_DEG: Final = 10.0
"""Readings at two poses are at least so far apart in the apparatus angle; ours."""
_COVERS: Final = 1.96


@dataclass(frozen=True)
class PoseReading:
    """One reading of a goniometer, and the apparatus angle of the same motion at that moment."""

    apparatus_deg: float
    patient_deg: float
    at_min: float
    """Minutes since the session began."""


@dataclass(frozen=True)
class PatientAngle:
    """The patient's angle: an estimate, and the half width of the interval that covers it in 95 of 100 cases. Degrees."""

    angle_deg: float
    uncertainty_deg: float


class PatientAngleEstimator:
    """Estimates one motion's patient's angle from readings at two or more poses of a session."""

    def __init__(self, readings: Sequence[PoseReading]) -> None:
        """:raises ValueError: when the readings are not at two poses."""
        if not at_two_poses([reading.apparatus_deg for reading in readings]):
            raise ValueError(f"readings at two poses are needed, {APART_DEG:g} deg apart")
        self._x = np.array([reading.apparatus_deg for reading in readings])
        self._t = np.array([max(0.0, reading.at_min) for reading in readings])
        differences = np.array([reading.patient_deg for reading in readings]) - self._x
        own = READING_DEG**2 + SHAPE_DEG**2
        self._covariance = _covariance(self._x, self._t, self._x, self._t) + own * np.eye(len(readings))
        self._weights = np.linalg.solve(self._covariance, differences)

    def at(self, apparatus_deg: float, at_min: float) -> PatientAngle:
        """Return the patient's angle where the apparatus had this angle, ``at_min`` minutes after the session began."""
        x, t = np.array([apparatus_deg]), np.array([max(0.0, at_min)])
        shared = _covariance(x, t, self._x, self._t)[0]
        variance = float(_covariance(x, t, x, t)[0, 0]) - float(shared @ np.linalg.solve(self._covariance, shared))
        return PatientAngle(
            apparatus_deg + float(shared @ self._weights), _COVERS * math.sqrt(max(0.0, variance) + SHAPE_DEG**2)
        )


def at_two_poses(apparatus_deg: Sequence[float]) -> bool:
    """True if the apparatus angles of the readings are of two poses or more."""
    return len(apparatus_deg) >= 2 and max(apparatus_deg) - min(apparatus_deg) >= APART_DEG


def _covariance(x: Floats, t_min: Floats, other_x: Floats, other_t_min: Floats) -> Floats:
    """Return the covariance of the difference at angles ``(n,)`` and others ``(m,)``: ``(n, m)``, deg2."""
    found: Floats = (
        OFFSET_DEG**2
        + SLOPE**2 * np.outer(x, other_x)
        + SLIP_DEG_PER_ROOT_MIN**2 * np.minimum.outer(t_min, other_t_min)
    )
    return found
