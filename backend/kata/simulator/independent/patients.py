"""Simulates the patients of the independent plant: passive range, stiffness, tone, pain and guarding on motors 3 to 5, in deg and Nm."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

PatientName = Literal["healthy", "freezing", "frozen", "thawing", "large", "small"]
Ends = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
_LARGEST: Final = 3.0
"""Largest exponent of the passive torque. It limits this torque to 20 times the torque at the peak."""


@dataclass(frozen=True)
class SimulatedPatient:
    """One patient's shoulder.

    Beyond its peak the passive torque grows exponentially. ``end_feel_deg`` is the movement over which it grows by the factor e: a small
    value is a hard end-feel. The exponential form and all values without a source are assumed.
    """

    peaks_deg: Ends
    """Ends of abduction, flexion and external rotation at which the passive torque is ``peak_torque_nm``."""
    end_feel_deg: float
    damping_nm_s: float
    """Damping of the capsule."""
    tone_nm: float
    """Mean torque of muscle tone against a movement."""
    irritability: float
    """Strength, 0 to 1, with which pain near the end of range makes the patient guard."""
    guarding_nm: float
    """Torque of full guarding against a movement."""
    arm_scale: float = 1.0


_HEALTHY_PEAKS: Final[Ends] = ((-60.0, 130.0), (-60.0, 200.0), (-100.0, 50.0))
"""The paper's healthy subject reached the apparatus' range (Table 2). We assume that the peaks are 10 deg beyond it."""
_FROZEN_PEAKS: Final[Ends] = ((-60.0, 98.4), (-50.0, 116.9), (-54.3, 4.5))
"""Source: Rundquist et al., Arch Phys Med Rehabil 2003, 84, 1473: mean peaks of ten subjects with idiopathic adhesive capsulitis, humerus
to trunk: abduction 98.4, flexion 116.9, external and internal rotation at the side 4.5 and 54.3 deg. They are peaks of active motion.
Adduction and extension are assumed."""


def _between(share: float) -> Ends:
    """Return interpolated peaks. ``share``: 0 for a frozen shoulder, 1 for a healthy one."""
    found = [
        (low + share * (free_low - low), high + share * (free_high - high))
        for (low, high), (free_low, free_high) in zip(_FROZEN_PEAKS, _HEALTHY_PEAKS, strict=True)
    ]
    return found[0], found[1], found[2]


PATIENTS: Final[dict[PatientName, SimulatedPatient]] = {
    "healthy": SimulatedPatient(_HEALTHY_PEAKS, 8.0, 0.10, 0.10, 0.0, 0.0),
    # Pain limits the motion before the capsule does, hence a soft end-feel and strong guarding.
    "freezing": SimulatedPatient(_between(0.15), 15.0, 0.30, 0.25, 1.0, 2.0),
    "frozen": SimulatedPatient(_FROZEN_PEAKS, 6.0, 0.50, 0.20, 0.5, 1.0),
    "thawing": SimulatedPatient(_between(0.5), 10.0, 0.30, 0.15, 0.2, 0.5),
    "large": SimulatedPatient(_HEALTHY_PEAKS, 8.0, 0.15, 0.15, 0.0, 0.0, arm_scale=1.12),
    "small": SimulatedPatient(_HEALTHY_PEAKS, 8.0, 0.08, 0.08, 0.0, 0.0, arm_scale=0.88),
}
DUMMY: Final = SimulatedPatient(((-720.0, 720.0),) * 3, 1.0, 0.0, 0.0, 0.0, 0.0)
"""No shoulder: its ends are never reached."""


class PassiveShoulder:
    """Calculates the passive and reflex torques of one patient. Angles are the drives' angles in radians."""

    def __init__(self, patient: SimulatedPatient, peak_nm: float, signs: tuple[int, ...]) -> None:
        """Prepare the ends of the range. ``signs``: signs of the drives' angles of motors 3 to 5 on this side."""
        self._patient = patient
        self._soft = 1.0 / math.radians(patient.end_feel_deg)
        ends = [
            sorted(sign * math.radians(end) for end in pair)
            for pair, sign in zip(patient.peaks_deg, signs, strict=True)
        ]
        self._ends = tuple((low, high) for low, high in ends)
        self._passive = tuple(_capsule(end, self._soft, peak_nm, patient.damping_nm_s) for end in self._ends)
        self.guarding = 0.0
        """Present guarding, 0 to 1."""

    def passive_nm(self, n: int, angle: float, speed: float) -> float:
        """Return the torque of the capsule in Nm on axis ``n`` (0 is motor 3)."""
        return self._passive[n](angle, speed)

    def passive(self, n: int) -> Callable[[float, float], float]:
        """Return the function of axis ``n`` that gives the capsule's torque for angle and speed. A simulation calls it in every step."""
        return self._passive[n]

    def pain(self, angles: list[float]) -> float:
        """Return the pain of a posture, 0 to 1. It is 0 up to one ``end_feel_deg`` before a peak and 1 at the peak."""
        width = 1.0 / self._soft
        return max(
            min(1.0, max(0.0, 1.0 - min(high - angle, angle - low) / width))
            for angle, (low, high) in zip(angles, self._ends, strict=True)
        )

    def update_guarding(self, angles: list[float], fastest: float, half_speed: float, share: float) -> float:
        """Move guarding by ``share`` towards the value for this pain and speed. Return the torque in Nm against movement."""
        demand = self._patient.irritability * self.pain(angles) * (0.5 + 0.5 * fastest / (fastest + half_speed))
        self.guarding += (demand - self.guarding) * share
        return self.guarding * self._patient.guarding_nm


def _capsule(
    end: tuple[float, float], soft: float, peak_nm: float, damping_nm_s: float
) -> Callable[[float, float], float]:
    """Return the function that gives an axis' passive torque in Nm for its angle and speed. ``soft``: growth per rad beyond the ends."""
    (low, high), limit, exp = end, _LARGEST, math.exp

    def passive_nm(angle: float, speed: float) -> float:
        beyond_low, beyond_high = (low - angle) * soft, (angle - high) * soft
        push = exp(beyond_low if beyond_low < limit else limit) - exp(beyond_high if beyond_high < limit else limit)
        return peak_nm * push - damping_nm_s * speed

    return passive_nm
