"""Estimate the patient's angle of a basic motion from apparatus angles and goniometer readings, with its uncertainty.

The patient's angle ``p`` differs from the apparatus angle ``x``, depending on the arm's position in the cuff:

    p = x + offset + slope x + slip(t) + shape(x),        reading = p + error

All terms are normal and independent; ``slip`` is a random walk from the start of the session. The estimate is the mean of ``p`` given the
readings (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, Eq. 2.25 and 2.26). Its uncertainty is 1.96 standard
deviations: 95 of 100 patient's angles lie within it if the terms have the sizes stated here.

Sources. ``offset`` and ``slope``: root mean squares of Cortés et al. 2016, BioMed Research International 2581924, Table 5. It compares the
angles of an arm exoskeleton with motion capture in three movements of the shoulder (intercepts 25.6, -22.3, -17.8 deg; slopes 0.35, 1.69,
0.85). ``shape``: Table 4 of the same paper; 3.3 deg was the smallest error of its own estimator, and we do not assume less. ``error``: de
Winter et al. 2004, BMC Musculoskeletal Disorders 5:18; two physical therapists differed by +-19.6 deg (95 %) with an inclinometer in 155
patients, so the error of one therapist is 19.6 / 1.96 / sqrt(2). ``slip``: assumed; Sun et al. 2025 mentions slip (Section 4.8) without a
figure.

Limits. The model is linear in one motion. It does not cover an arm that slips suddenly by more than the random walk, or that was fastened
again after the readings. No estimate has been compared with a real patient.
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
"""Standard deviation of the slope of the difference that grows with the angle, in deg per deg."""
SHAPE_DEG: Final = 3.3
"""Standard deviation of the part of the difference that a straight line does not explain."""
READING_DEG: Final = 7.1
"""Standard deviation of the error of a goniometer reading."""
SLIP_DEG_PER_ROOT_MIN: Final = 1.0
"""Standard deviation of the slip after one minute. It grows with the square root of time, to 5.5 deg after half an hour."""
APART_DEG: Final = 10.0
"""Minimum difference of the apparatus angles of two poses with readings. This value is our choice."""
_ROUNDING_DEG: Final = 1e-9
"""Angles that were added and subtracted differ from the exact ones by less than this."""
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
    """Estimate of the patient's angle, and half width of the interval that covers the angle in 95 of 100 cases. Degrees."""

    angle_deg: float
    uncertainty_deg: float


class PatientAngleEstimator:
    """Estimates the patient's angle of one motion from readings at two or more poses in a session."""

    def __init__(self, readings: Sequence[PoseReading]) -> None:
        """Fit the model to the readings. :raises ValueError: when the readings are not at two poses."""
        if not at_two_poses([reading.apparatus_deg for reading in readings]):
            raise ValueError(f"readings at two poses are needed, {APART_DEG:g} deg apart")
        self._x = np.array([reading.apparatus_deg for reading in readings])
        self._t = np.array([max(0.0, reading.at_min) for reading in readings])
        differences = np.array([reading.patient_deg for reading in readings]) - self._x
        own = READING_DEG**2 + SHAPE_DEG**2
        self._covariance = _covariance(self._x, self._t, self._x, self._t) + own * np.eye(len(readings))
        self._weights = np.linalg.solve(self._covariance, differences)

    def at(self, apparatus_deg: float, at_min: float) -> PatientAngle:
        """Return the patient's angle at this apparatus angle, ``at_min`` minutes after the session began."""
        x, t = np.array([apparatus_deg]), np.array([max(0.0, at_min)])
        shared = _covariance(x, t, self._x, self._t)[0]
        variance = float(_covariance(x, t, x, t)[0, 0]) - float(shared @ np.linalg.solve(self._covariance, shared))
        return PatientAngle(
            apparatus_deg + float(shared @ self._weights), _COVERS * math.sqrt(max(0.0, variance) + SHAPE_DEG**2)
        )


def at_two_poses(apparatus_deg: Sequence[float]) -> bool:
    """Return True if the readings are at two or more poses: their apparatus angles differ by at least :data:`APART_DEG`."""
    return len(apparatus_deg) >= 2 and max(apparatus_deg) - min(apparatus_deg) >= APART_DEG - _ROUNDING_DEG


def _covariance(x: Floats, t_min: Floats, other_x: Floats, other_t_min: Floats) -> Floats:
    """Return the covariance ``(n, m)`` in deg2 of the differences at the angles ``(n,)`` and at the other angles ``(m,)``."""
    covariance: Floats = (
        OFFSET_DEG**2
        + SLOPE**2 * np.outer(x, other_x)
        + SLIP_DEG_PER_ROOT_MIN**2 * np.minimum.outer(t_min, other_t_min)
    )
    return covariance
