"""Every physical number of the simulated apparatus, with its unit and why it is what it is. Axis order 1-5.

None of them is measured on the apparatus: the paper (Sun et al. 2025, Table 1) gives torques, voltage, current, speed and supplies
of motors 1-4 and nothing else; the figures of motor 5 are undisclosed, and it is said to follow worst. The rest is chosen
so that what the paper does tell comes out: a motor of 4 Nm carries the arm at 60 deg/s at half of its torque, an arm let go
sinks instead of falling (a balancer carries most of it), and motor 5 is weak, loose and late. Nothing is fitted to a motion.

A seed varies what differs between patients, gears and days (:data:`VARIED`); what a drive's maker has set does not vary.
"""

import math
import random
from dataclasses import dataclass, fields, replace
from typing import Final

from kata.motion.axes import APPARATUS_SIGNS

STEP_S: Final = 0.001
"""The drives control, and the mechanics move, a thousand times a second."""
SLOW_STEPS: Final = 10
"""What changes slowly (weight, stiffness, tone, the hand's wish, the supplies) is worked out anew every so many steps: at 60 deg/s the
arm has gone 0.6 deg in them, which is 0.01 Nm of its weight."""

VARIATION: Final = 0.3
"""A seed varies each parameter by up to this share, up and down, independently of the others."""

# -- drives: as their maker has built and tuned them ---------------------------------------------------------------------

COUNTS_A_TURN: Final = 4096
"""Of the position encoder, on the shaft that leaves the drive. The speed is measured on the rotor, in front of the gear, and is fine."""
GOAL_SMOOTHING_S: Final = 0.008
"""A drive takes up a new goal over about this long: goals come in steps, and its gear shall not hear each of them."""

NM_AN_AMPERE: Final = 2.0
"""Table 1: 10 Nm at 5 A. Also V s/rad: what turning generates."""
RESISTANCE_OHM: Final = 1.26
"""Table 1: at 75 rpm (7.85 rad/s, which generates 15.7 V) 22 V still drive 5 A."""
SUPPLY_V: Final = 24.0
SUPPLY_W: Final = 240.0
"""Table 1: three supplies of 24 V and 10 A."""
DRIVER_EFFICIENCY: Final = 0.9
"""What a drive's own electronics leave of its supply's power: with it two motors at 75 rpm and 10 Nm ask for a little more than 240 W."""
SUPPLIES: Final = ((0, 1), (2, 3), (4,))
"""Which axes (from 0) share one."""
HEATING_S: Final = 30.0
"""A winding takes about this long to warm up: for so long it may give more than its rated torque."""


@dataclass(frozen=True)
class DriveParameters:
    """One drive: its torques, and the gains of its position control, tuned beforehand as the paper says (Section 2.1)."""

    rated_nm: float
    maximum_nm: float
    p_nm_rad: float
    i_nm_rad_s: float
    d_nm_s_rad: float
    """On the measured speed. D over P is how late the drive is when it follows a moving goal, in seconds."""


_STRONG: Final = DriveParameters(rated_nm=4.0, maximum_nm=10.0, p_nm_rad=160.0, i_nm_rad_s=400.0, d_nm_s_rad=7.2)
"""45 ms late and damped at 0.8 to 1 of critical: as quick as 4 Nm on this arm allow. A step of 4 deg, as 10 Hz give at 40 deg/s,
already asks for more torque than there is."""
_WEAK: Final = DriveParameters(rated_nm=2.0, maximum_nm=5.0, p_nm_rad=12.0, i_nm_rad_s=60.0, d_nm_s_rad=1.50)
"""Motor 5: a small motor behind a pinion with much play stands no more than a low P. 125 ms late."""

DRIVES: Final = (_STRONG, _STRONG, _STRONG, _STRONG, _WEAK)

# -- mechanics and the patient: what a seed varies -----------------------------------------------------------------------


@dataclass(frozen=True)
class JointParameters:
    """One axis from the rotor to the patient. Inertias and friction as felt at the drive's shaft."""

    rotor_kg_m2: float
    """Rotor and gear, in front of the play."""
    arm_kg_m2: float
    """Link and patient, behind it."""
    rotor_viscous_nm_s: float
    rotor_coulomb_nm: float
    """Gear and seals: most of the friction is there."""
    arm_viscous_nm_s: float
    arm_coulomb_nm: float
    play_deg: float
    """From flank to flank."""
    gear_nm_rad: float
    """Stiffness of the teeth, belt and cuff where flanks touch."""
    gear_nm_s: float
    """Their damping: about a fifth of critical, so that flanks meet without ringing for long."""
    weight_nm: float
    """What the arm's weight, less what the balancer carries, pulls at most."""
    girdle_nm: float
    """How strongly the shoulder girdle is drawn back to its rest, motors 1 and 2: as a pendulum would be."""
    stiffness_nm: float
    """Passive resistance of the capsule at the end of the ROM; it grows from nothing over the last 15 degrees, as their square."""
    tone_nm: float
    """Most torque by which the muscles resist a movement; it comes and goes within seconds, otherwise each time."""


_SCAPULA: Final = JointParameters(
    rotor_kg_m2=0.03,
    arm_kg_m2=0.05,  # 3 kg of girdle and links at 0.13 m
    rotor_viscous_nm_s=0.25,
    rotor_coulomb_nm=0.20,  # a tenth of what is left at half the rated torque
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
    weight_nm=0.70,  # some 5 Nm of arm, of which the balancer (1 to 2 kg) carries most
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

# -- geometry, degrees of motor angle, of the apparatus that is not turned -----------------------------

REST_DEG: Final = (15.05, 108.94, 8.0, 0.0, 0.0)
"""Scapula in the middle, the arm hanging."""
ROM_DEG: Final = ((-19.0, 43.0), (88.0, 129.0), (0.0, 120.0), (-20.0, 190.0), (-90.0, 40.0))
"""Where the patient's passive range ends (Table 2; motors 1 and 2 through the linkage)."""
STIFFENS_OVER_DEG: Final = 15.0
STOPS_DEG: Final = ((-24.0, 47.0), (84.0, 133.0), (-5.0, 125.0), (-25.0, 195.0), (-95.0, 45.0))
"""Where the mechanism's own stops are: 5 degrees behind the ROM."""
STOP_NM_RAD: Final = 300.0
STOP_NM_S: Final = 6.0
"""Of rubber: 4 Nm press it in by less than a degree, and an arm does not bounce."""
TURNED: Final = (1, 1, *APPARATUS_SIGNS["left"][2:])
"""The sense in which the drives turn when the apparatus is turned to the other side (:mod:`kata.motion.sides`)."""

TONE_HZ: Final = (0.05, 0.3)
"""Tone rises and falls in some seconds."""
TONE_SPEED_DEG_S: Final = 5.0
"""A movement slower than this is hardly resisted."""

# -- the therapist's hand --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HandParameters:
    """How firmly the hand leads each axis, and how steadily."""

    stiffness_nm_rad: tuple[float, ...] = (500.0, 500.0, 500.0, 500.0, 150.0)
    damping_nm_s: tuple[float, ...] = (15.0, 15.0, 15.0, 15.0, 2.5)
    """Two hands on the arm; less about its own axis, where the lever is the forearm."""
    strength_nm: float = 15.0
    reach_deg_s: float = 30.0
    """How fast it takes the arm to where a motion begins."""
    rest_s: float = 0.3
    """It waits so long before a motion and after it; the foot goes down and comes up meanwhile."""
    tremor_deg: float = 0.04
    """Root mean square. Physiological tremor is a few tenths of a millimetre at the hand, half a metre from the joint."""
    tremor_hz: tuple[float, float] = (8.0, 12.0)
    wander_deg: float = 0.2
    """Root mean square of slow straying from what was meant."""
    wander_hz: tuple[float, float] = (0.05, 0.3)


HAND: Final = HandParameters()


def stream(name: str, seed: int | None) -> random.Random:
    """Chance for one part of the world alone: what one part draws does not change another."""
    return random.Random(f"{name} {seed}")


def joints(seed: int | None) -> tuple[JointParameters, ...]:
    """The five joints of this seed; without one, as they are above."""
    if seed is None:
        return JOINTS
    vary = stream("plant", seed).uniform
    return tuple(
        replace(joint, **{name: getattr(joint, name) * vary(1 - VARIATION, 1 + VARIATION) for name in VARIED})
        for joint in JOINTS
    )


def hand(seed: int | None) -> HandParameters:
    """The therapist of this seed."""
    if seed is None:
        return HAND
    vary = stream("hand's ways", seed).uniform
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
    """A sum of sines that never repeats within a session: frequencies in rad/s and phases."""

    height: float
    parts: tuple[tuple[float, float], ...]

    @classmethod
    def drawn(cls, chance: random.Random, rms: float, band_hz: tuple[float, float]) -> "Waves":
        """Three sines within a band, of equal height."""
        parts = tuple((math.tau * chance.uniform(*band_hz), chance.uniform(0.0, math.tau)) for _ in range(3))
        return cls(rms * math.sqrt(2 / len(parts)), parts)

    def at(self, time_s: float) -> float:
        """Its value at a time."""
        return self.height * sum([math.sin(rate * time_s + phase) for rate, phase in self.parts])
