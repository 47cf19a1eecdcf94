"""Simulates the mechanics: five drives' shafts, the backlash of their gears, and the patient. Internal angles are in radians.

Each axis has two bodies, rotor and arm, with the gear's backlash between them. Touching flanks transmit torque. The encoder is on the
rotor's side, so it does not measure the backlash. In each step Coulomb friction reduces a body's speed by at most that speed. This
models sticking and slipping without a separate case. The numbers are in :mod:`kata.simulator.parameters`.
"""

import math
from collections.abc import Sequence
from itertools import repeat
from typing import Final

from kata.simulator.drive import COUNTS_A_RAD, Drive
from kata.simulator.mechanics import Hand
from kata.simulator.parameters import (
    GOAL_SMOOTHING_S,
    REST_DEG,
    ROM_DEG,
    SLOW_STEPS,
    STEP_S,
    STIFFENING_RANGE_DEG,
    STOP_NM_RAD,
    STOP_NM_S,
    STOPS_DEG,
    TONE_HZ,
    TONE_SPEED_DEG_S,
    TURNED,
    JointParameters,
    Waves,
    joints,
    random_stream,
)

_RAD_A_COUNT: Final = 1 / COUNTS_A_RAD
_GOAL_SHARE: Final = STEP_S / GOAL_SMOOTHING_S
_STIFFENING_RANGE: Final = math.radians(STIFFENING_RANGE_DEG)
_TONE_SPEED: Final = math.radians(TONE_SPEED_DEG_S)


class Joint:
    """One axis: angles and speeds of rotor and arm, and the loads on the arm."""

    def __init__(self, axis: int, parameters: JointParameters, turned: bool) -> None:
        """Create an axis at rest. ``axis``: counted from 0. ``turned``: True if the apparatus is set up for the other side."""
        sign = TURNED[axis] if turned else 1.0
        self.parameters = parameters
        self.angle = self.arm_angle = sign * math.radians(REST_DEG[axis])
        """Angles in radians of the drive's shaft, and of the arm after the backlash."""
        self.speed = self.arm_speed = 0.0
        self.jammed = False
        self.load_nm = 0.0
        """Slowly changing load: weight, stiffness and muscle tone."""
        self.hand: Hand | None = None
        self.rom = _ends(ROM_DEG[axis], sign)
        self.stops = _ends(STOPS_DEG[axis], sign)
        self.play = math.radians(parameters.play_deg) / 2
        """Half of the backlash."""
        self.at_rest: tuple[object, ...] = ()
        """State without torque in which the last steps changed nothing, see :meth:`Plant.advance`; empty if there is none."""

    def stiffness_nm(self) -> float:
        """Return the capsule's torque towards the middle of the ROM."""
        low, high = self.rom
        if (depth := self.arm_angle - high + _STIFFENING_RANGE) > 0.0:
            return -self.parameters.stiffness_nm * (depth / _STIFFENING_RANGE) ** 2
        if (depth := low + _STIFFENING_RANGE - self.arm_angle) > 0.0:
            return self.parameters.stiffness_nm * (depth / _STIFFENING_RANGE) ** 2
        return 0.0


class Plant:
    """The five axes with the patient's loads."""

    def __init__(self, seed: int | None = None, *, turned: bool = False) -> None:
        """Create the axes. ``seed``: chooses another patient and other gears; see :data:`~kata.simulator.parameters.VARIED`."""
        self.joints = tuple(Joint(n, parameters, turned) for n, parameters in enumerate(joints(seed)))
        self._rest = tuple(joint.angle for joint in self.joints)
        self._girdle_side = -1.0 if turned else 1.0
        random_source = random_stream("tone", seed)
        # Mean and amplitude are half of the maximum, so that the tone is never negative.
        self._tone = tuple(Waves.drawn(random_source, 0.5 / math.sqrt(6), TONE_HZ) for _ in self.joints)
        self._slow_s = 0.0

    def advance(self, drives: Sequence[Drive], steps: int) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        for drive, joint in zip(drives, self.joints, strict=True):
            if drive.torque_on:
                step_axis(drive, joint, steps)
                continue
            # Without torque an axis soon rests in its friction. The same state then leads to itself, so its steps are left out.
            before = _state(drive, joint)
            if before != joint.at_rest:
                step_axis(drive, joint, steps)
                joint.at_rest = before if _state(drive, joint) == before else ()

    def place(self, axis: int, angle: float) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        joint = self.joints[axis]
        joint.angle = joint.arm_angle = angle
        joint.speed = joint.arm_speed = 0.0

    def jam(self, axis: int, *, jammed: bool) -> None:
        """Jam a shaft, so that it does not move, or free it. ``axis``: counted from 0."""
        joint = self.joints[axis]
        joint.jammed = jammed
        joint.speed = joint.arm_speed = 0.0

    def update_slow_loads(self) -> None:
        """Update the slow loads: weight by pose, stiffness and tone. The caller calls this every :data:`SLOW_STEPS` steps."""
        one, two, three, four, five = self.joints
        cos3, cos4 = math.cos(three.arm_angle), math.cos(four.arm_angle)
        # Motor 3 carries motor 4. The arm's direction is (sin 4, cos 4 sin 3, -cos 4 cos 3), and its height determines the weight.
        # On the other side both angles and their torques change their sign.
        weights = (
            # The girdle's weight turns the scapula downwards. On the other side the angles of motors 1 and 2 have the opposite sign.
            self._girdle_side * one.parameters.weight_nm
            - one.parameters.girdle_nm * math.sin(one.arm_angle - self._rest[0]),
            -self._girdle_side * two.parameters.weight_nm
            - two.parameters.girdle_nm * math.sin(two.arm_angle - self._rest[1]),
            -three.parameters.weight_nm * cos4 * math.sin(three.arm_angle),
            -four.parameters.weight_nm * math.sin(four.arm_angle) * cos3,
            # The torque of the forearm's weight on motor 5 increases as the upper arm is raised.
            -five.parameters.weight_nm * math.sqrt(max(0.0, 1.0 - (cos3 * cos4) ** 2)) * math.sin(five.arm_angle),
        )
        self._slow_s += SLOW_STEPS * STEP_S
        for joint, weight, tone in zip(self.joints, weights, self._tone, strict=True):
            joint.load_nm = weight + joint.stiffness_nm()
            if joint.arm_speed:
                tone_nm = joint.parameters.tone_nm * (0.5 + tone.at(self._slow_s))
                joint.load_nm -= tone_nm * math.tanh(joint.arm_speed / _TONE_SPEED)


def step_axis(drive: Drive, joint: Joint, steps: int) -> None:
    """Advance one axis (its drive's control and its mechanics) by ``steps`` ms.

    The function is one flat loop on local floats, because a simulation spends most of its time here.
    """
    parameters = joint.parameters
    angle, speed, arm_angle, arm_speed = joint.angle, joint.speed, joint.arm_angle, joint.arm_speed
    on, free, play = drive.torque_on, not joint.jammed, joint.play
    goal, smoothed, p, lag = drive.followed_goal, drive.smoothed_goal, drive.p_nm_rad, drive.lag_s
    lead = drive.lead
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
            smoothed += (goal - smoothed) * _GOAL_SHARE
            wanted = smoothed + lead - (angle * COUNTS_A_RAD + 0.5) // 1.0 * _RAD_A_COUNT - lag * speed
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


def _state(drive: Drive, joint: Joint) -> tuple[object, ...]:
    """Return everything that determines an axis' next step without torque."""
    return (
        joint.angle,
        joint.arm_angle,
        joint.speed,
        joint.arm_speed,
        joint.load_nm,
        joint.hand,
        joint.jammed,
        drive.angle,
        drive.torque_nm,
    )


def _ends(ends_deg: tuple[float, float], sign: float) -> tuple[float, float]:
    low, high = sorted(sign * math.radians(end) for end in ends_deg)
    return low, high
