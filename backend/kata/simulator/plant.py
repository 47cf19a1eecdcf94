"""The mechanics: five drives' shafts, the play of their gears, and the patient behind them. Radians inside.

Each axis is two bodies, rotor and arm, with the gear's play between them: flanks that touch push, those that do not, do
nothing. The drive's encoder sits on the rotor's side, so that what the play hides from it is hidden here too. Coulomb
friction takes from a body's speed what it can in a step and never more, which lets it stick and slip without a case of
its own. Numbers: :mod:`kata.simulator.parameters`.
"""

import math
from itertools import repeat
from typing import Final

from kata.simulator.drive import COUNTS_A_RAD, Drive
from kata.simulator.parameters import (
    GOAL_SMOOTHING_S,
    REST_DEG,
    ROM_DEG,
    SLOW_STEPS,
    STEP_S,
    STIFFENS_OVER_DEG,
    STOP_NM_RAD,
    STOP_NM_S,
    STOPS_DEG,
    TONE_HZ,
    TONE_SPEED_DEG_S,
    TURNED,
    JointParameters,
    Waves,
    joints,
    stream,
)

_RAD_A_COUNT: Final = 1 / COUNTS_A_RAD
_TAKEN_UP: Final = STEP_S / GOAL_SMOOTHING_S
_STIFFENS_OVER: Final = math.radians(STIFFENS_OVER_DEG)
_TONE_SPEED: Final = math.radians(TONE_SPEED_DEG_S)


class Joint:
    """One axis: where rotor and arm are, how fast, and what pulls at the arm besides its drive."""

    def __init__(self, axis: int, parameters: JointParameters, turned: bool) -> None:
        """``axis`` from 0; ``turned``: the apparatus stands for the other side."""
        sign = TURNED[axis] if turned else 1.0
        self.parameters = parameters
        self.angle = self.arm_angle = sign * math.radians(REST_DEG[axis])
        """Radians, of the drive's shaft and of the arm behind the gear's play."""
        self.speed = self.arm_speed = 0.0
        self.jammed = False
        self.load_nm = 0.0
        """Weight, stiffness and tone: what changes slowly."""
        self.hand: tuple[float, float, float, float, float] | None = None
        """Where a hand wants the arm, by how much more each step, its stiffness, damping and strength."""
        self.rom = _ends(ROM_DEG[axis], sign)
        self.stops = _ends(STOPS_DEG[axis], sign)
        self.play = math.radians(parameters.play_deg) / 2
        """Either way from the middle."""

    def stiffness_nm(self) -> float:
        """Of the capsule, towards the middle of the ROM."""
        low, high = self.rom
        if (depth := self.arm_angle - high + _STIFFENS_OVER) > 0.0:
            return -self.parameters.stiffness_nm * (depth / _STIFFENS_OVER) ** 2
        if (depth := low + _STIFFENS_OVER - self.arm_angle) > 0.0:
            return self.parameters.stiffness_nm * (depth / _STIFFENS_OVER) ** 2
        return 0.0


class Plant:
    """The five axes, and what the patient does to them."""

    def __init__(self, seed: int | None = None, *, turned: bool = False) -> None:
        """``seed``: another patient and other gears, see :data:`~kata.simulator.parameters.VARIED`."""
        self.joints = tuple(Joint(n, parameters, turned) for n, parameters in enumerate(joints(seed)))
        self._rest = tuple(joint.angle for joint in self.joints)
        self._girdle_side = -1.0 if turned else 1.0
        chance = stream("tone", seed)
        # Half of the most, and as much up and down again: never below nothing.
        self._tone = tuple(Waves.drawn(chance, 0.5 / math.sqrt(6), TONE_HZ) for _ in self.joints)
        self._slow_s = 0.0

    def jam(self, axis: int, *, jammed: bool) -> None:
        """A jammed shaft stays where it is, whatever pulls. ``axis`` from 0."""
        joint = self.joints[axis]
        joint.jammed = jammed
        joint.speed = joint.arm_speed = 0.0

    def settle(self) -> None:
        """Work out anew what changes slowly: weight by pose, stiffness and tone. Due every :data:`SLOW_STEPS`."""
        one, two, three, four, five = self.joints
        cos3, cos4 = math.cos(three.arm_angle), math.cos(four.arm_angle)
        # Motor 4 is carried by motor 3: the arm points to (sin 4, cos 4 sin 3, -cos 4 cos 3), and its height is what weighs.
        # On the other side both angles have the other sign, and so have their torques.
        weights = (
            # The girdle's weight turns the scapula downwards; on the other side that is motors 1 and 2 the other way.
            self._girdle_side * one.parameters.weight_nm
            - one.parameters.girdle_nm * math.sin(one.arm_angle - self._rest[0]),
            -self._girdle_side * two.parameters.weight_nm
            - two.parameters.girdle_nm * math.sin(two.arm_angle - self._rest[1]),
            -three.parameters.weight_nm * cos4 * math.sin(three.arm_angle),
            -four.parameters.weight_nm * math.sin(four.arm_angle) * cos3,
            # The forearm weighs on motor 5 as far as the upper arm is raised.
            -five.parameters.weight_nm * math.sqrt(max(0.0, 1.0 - (cos3 * cos4) ** 2)) * math.sin(five.arm_angle),
        )
        self._slow_s += SLOW_STEPS * STEP_S
        for joint, weight, tone in zip(self.joints, weights, self._tone, strict=True):
            tone_nm = joint.parameters.tone_nm * (0.5 + tone.at(self._slow_s))
            joint.load_nm = weight + joint.stiffness_nm() - tone_nm * math.tanh(joint.arm_speed / _TONE_SPEED)


def turn(drive: Drive, joint: Joint, steps: int) -> None:
    """Let one axis go on for some milliseconds: its drive's control, and what it moves.

    One flat loop on local floats: this is where virtual time is spent.
    """
    parameters = joint.parameters
    angle, speed, arm_angle, arm_speed = joint.angle, joint.speed, joint.arm_angle, joint.arm_speed
    on, free, play = drive.torque_on, not joint.jammed, joint.play
    goal, smoothed, p, lag = drive.goal, drive.smoothed_goal, drive.p_nm_rad, drive.lag_s
    integral, i_step, limit, torque = drive.integral_nm, drive.i_nm_rad_s * STEP_S, drive.limit_nm, drive.torque_nm
    rotor_step, arm_step = STEP_S / parameters.rotor_kg_m2, STEP_S / parameters.arm_kg_m2
    rotor_viscous, arm_viscous = parameters.rotor_viscous_nm_s, parameters.arm_viscous_nm_s
    rotor_brakes, arm_brakes = parameters.rotor_coulomb_nm * rotor_step, parameters.arm_coulomb_nm * arm_step
    stiff, damped = parameters.gear_nm_rad, parameters.gear_nm_s
    load, (lowest, highest) = joint.load_nm, joint.stops
    hand = joint.hand
    if hand:
        hand_angle, hand_step, hand_stiff, hand_damped, hand_strength = hand
        hand_speed = hand_step / STEP_S

    for _ in repeat(None, steps):
        if on:
            smoothed += (goal - smoothed) * _TAKEN_UP
            wanted = smoothed - (angle * COUNTS_A_RAD + 0.5) // 1.0 * _RAD_A_COUNT - lag * speed
            torque = p * wanted + integral
            if torque > limit:
                torque = limit
                if wanted < 0.0:
                    integral += i_step * wanted
            elif torque < -limit:
                torque = -limit
                if wanted > 0.0:
                    integral += i_step * wanted
            else:
                integral += i_step * wanted
        if not free:
            continue

        gap = angle - arm_angle
        if gap > play:
            push = stiff * (gap - play) + damped * (speed - arm_speed)
            if push < 0.0:
                push = 0.0
        elif gap < -play:
            push = stiff * (gap + play) + damped * (speed - arm_speed)
            if push > 0.0:
                push = 0.0
        else:
            push = 0.0

        speed += (torque - push - rotor_viscous * speed) * rotor_step
        if speed > rotor_brakes:
            speed -= rotor_brakes
        elif speed < -rotor_brakes:
            speed += rotor_brakes
        else:
            speed = 0.0

        pull = push + load - arm_viscous * arm_speed
        if hand:
            hand_angle += hand_step
            grip = hand_stiff * (hand_angle - arm_angle) + hand_damped * (hand_speed - arm_speed)
            pull += hand_strength if grip > hand_strength else -hand_strength if grip < -hand_strength else grip
        if arm_angle < lowest:
            pull += (lowest - arm_angle) * STOP_NM_RAD - arm_speed * STOP_NM_S
        elif arm_angle > highest:
            pull += (highest - arm_angle) * STOP_NM_RAD - arm_speed * STOP_NM_S
        arm_speed += pull * arm_step
        if arm_speed > arm_brakes:
            arm_speed -= arm_brakes
        elif arm_speed < -arm_brakes:
            arm_speed += arm_brakes
        else:
            arm_speed = 0.0

        angle += speed * STEP_S
        arm_angle += arm_speed * STEP_S

    joint.angle, joint.speed, joint.arm_angle, joint.arm_speed = angle, speed, arm_angle, arm_speed
    if hand:
        joint.hand = (hand_angle, hand_step, hand_stiff, hand_damped, hand_strength)
    drive.angle, drive.speed, drive.torque_nm = angle, speed, torque
    drive.smoothed_goal, drive.integral_nm = smoothed, integral


def _ends(ends_deg: tuple[float, float], sign: float) -> tuple[float, float]:
    low, high = sorted(sign * math.radians(end) for end in ends_deg)
    return low, high
