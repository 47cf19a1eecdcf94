"""Defines every physical number of the simulated apparatus, with its unit and reason. Values are in axis order 1-5.

No number was measured on the apparatus. The paper (Sun et al. 2025, Table 1) only states torques, voltage, current, speed and supplies of
motors 1-4. The figures of motor 5 are not published; in the paper it has the largest errors. The other numbers reproduce the paper's
statements: a motor of 4 Nm carries the arm at 60 deg/s with half of its torque; a released arm sinks instead of falling, because a
balancer carries most of it; motor 5 is weak, has much play and follows late. No number is fitted to a motion.

A seed varies the parameters that differ between patients, gears and days (:data:`VARIED`), but not the settings of a drive's maker.
"""

import math
import random
from dataclasses import dataclass, fields, replace
from typing import Final

from kata.motion.axes import APPARATUS_SIGNS

STEP_S: Final = 0.001
"""Step of the drives' control and of the mechanics."""
SLOW_STEPS: Final = 10
"""Number of steps between updates of slow values (weight, stiffness, tone, the hand's target, the supplies). In this time the arm moves
0.6 deg at 60 deg/s, which changes the torque of its weight by 0.01 Nm."""

VARIATION: Final = 0.3
"""Largest relative change, up or down, with which a seed varies each parameter independently."""

# -- drives: construction, and tuning by their maker ---------------------------------------------------------------------

COUNTS_A_TURN: Final = 4096
"""Counts of the position encoder on the output shaft. The speed is measured on the rotor, before the gear, with a high resolution."""
GOAL_SMOOTHING_S: Final = 0.008
"""Time constant with which a drive smooths a new goal, so that the steps between goals do not reach its gear."""

NM_AN_AMPERE: Final = 2.0
"""Source: Table 1, 10 Nm at 5 A. The same number is the generated voltage in V s/rad."""
RESISTANCE_OHM: Final = 1.26
"""Source: Table 1. At 75 rpm (7.85 rad/s, which generates 15.7 V) a voltage of 22 V gives 5 A."""
SUPPLY_V: Final = 24.0
SUPPLY_W: Final = 240.0
"""Source: Table 1, three supplies of 24 V and 10 A."""
DRIVER_EFFICIENCY: Final = 0.9
"""Efficiency of a drive's electronics. With this value two motors at 75 rpm and 10 Nm need slightly more than 240 W."""
SUPPLIES: Final = ((0, 1), (2, 3), (4,))
"""Axes (from 0) of each supply."""
HEATING_S: Final = 30.0
"""Time constant of a winding's temperature. A cold motor can exceed its rated torque for about this time."""


@dataclass(frozen=True)
class DriveParameters:
    """One drive: its torques, and the gains of its position control, tuned beforehand as in the paper (Section 2.1)."""

    rated_nm: float
    maximum_nm: float
    p_nm_rad: float
    i_nm_rad_s: float
    d_nm_s_rad: float
    """Gain of the measured speed. D divided by P is the drive's lag behind a moving goal, in seconds."""


_STRONG: Final = DriveParameters(rated_nm=4.0, maximum_nm=10.0, p_nm_rad=160.0, i_nm_rad_s=400.0, d_nm_s_rad=7.2)
"""This gives a lag of 45 ms and damping of 0.8 to 1 of critical, the fastest control that 4 Nm allow on this arm. A step of 4 deg, as at
10 Hz and 40 deg/s, already needs more torque than available."""
_WEAK: Final = DriveParameters(rated_nm=2.0, maximum_nm=5.0, p_nm_rad=12.0, i_nm_rad_s=60.0, d_nm_s_rad=1.50)
"""Gains of motor 5. A small motor with a pinion and much backlash is only stable with a low P. Its lag is 125 ms."""

DRIVES: Final = (_STRONG, _STRONG, _STRONG, _STRONG, _WEAK)

# -- mechanics and the patient: varied by a seed -------------------------------------------------------------------------


@dataclass(frozen=True)
class JointParameters:
    """One axis from the rotor to the patient. Inertia and friction apply at the drive's shaft."""

    rotor_kg_m2: float
    """Inertia of rotor and gear, before the backlash."""
    arm_kg_m2: float
    """Inertia of link and patient, after the backlash."""
    rotor_viscous_nm_s: float
    rotor_coulomb_nm: float
    """Friction of gear and seals, which is the largest part of the friction."""
    arm_viscous_nm_s: float
    arm_coulomb_nm: float
    play_deg: float
    """Backlash, from flank to flank."""
    gear_nm_rad: float
    """Stiffness of teeth, belt and cuff while flanks touch."""
    gear_nm_s: float
    """Damping of teeth, belt and cuff: about a fifth of critical, so that flanks do not vibrate for long."""
    weight_nm: float
    """Largest torque of the arm's weight, without the part that the balancer carries."""
    girdle_nm: float
    """Torque that returns the shoulder girdle to its rest position (motors 1 and 2), like that of a pendulum."""
    stiffness_nm: float
    """Passive resistance of the capsule at the end of the ROM. It grows quadratically over the last 15 degrees."""
    tone_nm: float
    """Largest torque with which muscle tone resists a movement. It varies within seconds, differently each time."""


_SCAPULA: Final = JointParameters(
    rotor_kg_m2=0.03,
    arm_kg_m2=0.05,  # 3 kg of girdle and links at 0.13 m
    rotor_viscous_nm_s=0.25,
    rotor_coulomb_nm=0.20,  # a tenth of the remaining torque at half the rated torque
    arm_viscous_nm_s=0.10,
    arm_coulomb_nm=0.08,
    play_deg=0.10,  # 6 arc minutes: an ordinary planetary gear
    gear_nm_rad=1500.0,
    gear_nm_s=2.0,
    weight_nm=0.15,
    girdle_nm=0.25,
    stiffness_nm=0.25,
    tone_nm=0.08,
)
_SHOULDER: Final = JointParameters(
    rotor_kg_m2=0.03,
    arm_kg_m2=0.10,  # 2.5 kg of arm and links at 0.2 m, elbow bent
    rotor_viscous_nm_s=0.30,
    rotor_coulomb_nm=0.25,
    arm_viscous_nm_s=0.12,
    arm_coulomb_nm=0.10,
    play_deg=0.10,
    gear_nm_rad=1500.0,
    gear_nm_s=2.4,
    weight_nm=0.70,  # about 5 Nm of arm, of which the balancer (1 to 2 kg) carries most
    girdle_nm=0.0,
    stiffness_nm=0.40,
    tone_nm=0.12,
)
_ROTATION: Final = JointParameters(
    rotor_kg_m2=0.005,
    arm_kg_m2=0.02,  # 1.2 kg of forearm at 0.13 m
    rotor_viscous_nm_s=0.03,
    rotor_coulomb_nm=0.08,
    arm_viscous_nm_s=0.02,
    arm_coulomb_nm=0.04,  # three rolling balls in a printed rail
    play_deg=0.50,  # a pinion on a printed spur gear
    gear_nm_rad=300.0,  # resin, foam and skin
    gear_nm_s=0.5,
    weight_nm=0.12,
    girdle_nm=0.0,
    stiffness_nm=0.12,
    tone_nm=0.03,
)

JOINTS: Final = (_SCAPULA, _SCAPULA, _SHOULDER, _SHOULDER, _ROTATION)
VARIED: Final = tuple(field.name for field in fields(JointParameters))

# -- geometry, degrees of motor angle, of the unturned apparatus ---------------------------------------

REST_DEG: Final = (15.05, 108.94, 8.0, 0.0, 0.0)
"""Motor angles with the scapula in its middle position and the arm hanging."""
ROM_DEG: Final = ((-19.0, 43.0), (88.0, 129.0), (0.0, 120.0), (-20.0, 190.0), (-90.0, 40.0))
"""The patient's passive range of motion (Table 2; motors 1 and 2 through the linkage)."""
STIFFENING_RANGE_DEG: Final = 15.0
STOPS_DEG: Final = ((-24.0, 47.0), (84.0, 133.0), (-5.0, 125.0), (-25.0, 195.0), (-95.0, 45.0))
"""The mechanical stops: 5 degrees beyond the ROM."""
STOP_NM_RAD: Final = 300.0
STOP_NM_S: Final = 6.0
"""Stiffness and damping of the rubber stops. 4 Nm compress them by less than a degree, and an arm does not bounce."""
TURNED: Final = (1, 1, *APPARATUS_SIGNS["left"][2:])
"""Signs of the drives' angles when the apparatus is turned to the other side (:mod:`kata.motion.sides`)."""

TONE_HZ: Final = (0.05, 0.3)
"""Frequencies of the muscle tone."""
TONE_SPEED_DEG_S: Final = 5.0
"""Speed below which tone hardly resists a movement."""

# -- the therapist's hand --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HandParameters:
    """Stiffness and steadiness of the guiding hand."""

    stiffness_nm_rad: tuple[float, ...] = (500.0, 500.0, 500.0, 500.0, 150.0)
    damping_nm_s: tuple[float, ...] = (15.0, 15.0, 15.0, 15.0, 2.5)
    """Stiffness and damping of two hands on the arm. They are lower about the arm's own axis, where the lever is the forearm."""
    strength_nm: float = 15.0
    reach_deg_s: float = 30.0
    """Speed at which the hand moves the arm to the start of a motion."""
    rest_s: float = 0.3
    """Pause before and after a motion, in which the pedal is pressed and released."""
    tremor_deg: float = 0.04
    """Root mean square of the tremor. Physiological tremor is a few tenths of a millimetre at the hand, half a metre from the joint."""
    tremor_hz: tuple[float, float] = (8.0, 12.0)
    wander_deg: float = 0.2
    """Root mean square of the slow deviation from the motion."""
    wander_hz: tuple[float, float] = (0.05, 0.3)


HAND: Final = HandParameters()


def random_stream(name: str, seed: int | None) -> random.Random:
    """Return the random source of one part of the simulation. The sources of different parts are independent."""
    return random.Random(f"{name} {seed}")


def joints(seed: int | None) -> tuple[JointParameters, ...]:
    """Return the five joints of a seed; without a seed, the nominal joints."""
    if seed is None:
        return JOINTS
    vary = random_stream("plant", seed).uniform
    return tuple(
        replace(joint, **{name: getattr(joint, name) * vary(1 - VARIATION, 1 + VARIATION) for name in VARIED})
        for joint in JOINTS
    )


def hand(seed: int | None) -> HandParameters:
    """Return the therapist's hand of a seed; without a seed, the nominal hand."""
    if seed is None:
        return HAND
    vary = random_stream("hand's ways", seed).uniform
    low, high = 1 - VARIATION, 1 + VARIATION
    return replace(
        HAND,
        stiffness_nm_rad=tuple(value * vary(low, high) for value in HAND.stiffness_nm_rad),
        damping_nm_s=tuple(value * vary(low, high) for value in HAND.damping_nm_s),
        tremor_deg=HAND.tremor_deg * vary(low, high),
        wander_deg=HAND.wander_deg * vary(low, high),
    )


@dataclass(frozen=True)
class Waves:
    """A sum of sines that does not repeat within a session. ``parts``: frequencies in rad/s and phases."""

    amplitude: float
    parts: tuple[tuple[float, float], ...]

    @classmethod
    def drawn(cls, random_source: random.Random, rms: float, band_hz: tuple[float, float]) -> "Waves":
        """Return three sines of equal amplitude within a band."""
        parts = tuple(
            (math.tau * random_source.uniform(*band_hz), random_source.uniform(0.0, math.tau)) for _ in range(3)
        )
        return cls(rms * math.sqrt(2 / len(parts)), parts)

    def at(self, time_s: float) -> float:
        """Return the value at a time."""
        return self.amplitude * sum([math.sin(rate * time_s + phase) for rate, phase in self.parts])
