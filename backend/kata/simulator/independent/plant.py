"""Implements the independent plant: MuJoCo mechanics, documented servo control, and a patient with a frozen or a healthy shoulder.

It shares no mechanics with :mod:`kata.simulator.plant`. Both implement :class:`kata.simulator.mechanics.Mechanics`.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import mujoco
import numpy as np

from kata.simulator.drive import Drive
from kata.simulator.independent.model import mjcf
from kata.simulator.independent.parameters import IndependentParameters, independent_parameters, with_nominal_arm
from kata.simulator.independent.patients import DUMMY, PATIENTS, PassiveShoulder, PatientName, SimulatedPatient
from kata.simulator.mechanics import Hand
from kata.simulator.motors import MOTORS, PositionControl, PositionGains
from kata.simulator.parameters import (
    NM_AN_AMPERE,
    REST_DEG,
    SLOW_STEPS,
    STEP_S,
    TONE_HZ,
    TURNED,
    Waves,
    random_stream,
)
from kata.simulator.servo_motion import D_NM_S_RAD, I_NM_RAD_S, P_NM_RAD

_JAMMED_NM_S: Final = 1e5
_PLACING: Final = ((400.0, 20.0),) * 4 + ((100.0, 3.0),)
"""Stiffness (Nm/rad) and damping (Nm s/rad) with which the axes are moved to a place."""
_PLACING_STEPS: Final = 1500
_mj_step: Final = mujoco.mj_step


class _Axis:
    """One axis; see :class:`~kata.simulator.mechanics.MechanicalAxis`."""

    def __init__(self, angle: float, values: IndependentParameters, n: int) -> None:
        self.angle = self.arm_angle = angle
        self.speed = self.arm_speed = 0.0
        self.hand: Hand | None = None
        self.control = PositionControl(MOTORS["PX-320"])
        self.goals: deque[float] = deque(maxlen=round(values.goal_delay_ms[n]) + 1)
        self.was_on = False
        self._tuned = (math.nan,) * 3
        self._gains = PositionGains(0.0, 0.0, 0.0)
        self.resistance_nm = 0.0
        """Resistance of tone and guarding against a movement."""

    def gains(self, drive: Drive) -> PositionGains | None:
        """Return the drive's gains; None while its torque is off."""
        if not drive.torque_on:
            self.was_on = False
            return None
        if not self.was_on:
            self.control.reset()
            self.goals.clear()
            self.was_on = True
        tuned = (drive.p_nm_rad, drive.i_nm_rad_s, drive.lag_s)
        if tuned != self._tuned:
            self._tuned = tuned
            p_nm_rad, i_nm_rad_s, lag_s = tuned
            self._gains = PositionGains(p_nm_rad / P_NM_RAD, i_nm_rad_s / I_NM_RAD_S, lag_s * p_nm_rad / D_NM_S_RAD)
        return self._gains

    def drive_nm(self, gains: PositionGains, goal: float, supply: tuple[float, float]) -> float:
        """Advance the control by 1 ms. Return the torque that the drive reports: current times nominal factor. ``supply``: V and A."""
        self.goals.append(goal)
        return self.control.step(gains, self.goals[0], self.angle, self.speed, supply)

    def hand_nm(self) -> float:
        """Move the hand's target by 1 ms. Return the hand's torque."""
        assert self.hand is not None
        angle, step, stiffness, damping, strength = self.hand
        angle += step
        self.hand = (angle, step, stiffness, damping, strength)
        grip = stiffness * (angle - self.arm_angle) + damping * (step / STEP_S - self.arm_speed)
        return max(-strength, min(strength, grip))


class IndependentPlant:
    """Five axes of a MuJoCo model."""

    def __init__(
        self,
        seed: int | None = None,
        *,
        turned: bool = False,
        patient: PatientName | SimulatedPatient = "healthy",
        balancer_kg: float | None = None,
        dummy: bool = False,
    ) -> None:
        """Build the model. ``seed``: chooses another patient, other gears and drives. ``balancer_kg`` replaces the balancer of
        the parameters. ``dummy``: a weight in the form of the nominal arm is in the fixers instead of a patient's arm.
        """
        person = DUMMY if dummy else patient if isinstance(patient, SimulatedPatient) else PATIENTS[patient]
        values = independent_parameters(seed, person.arm_scale, balancer_kg)
        if dummy:
            values = with_nominal_arm(values)
        self.parameters = values
        self.model: Any = mujoco.MjModel.from_xml_string(mjcf(values, turned=turned))
        self.data: Any = mujoco.MjData(self.model)
        signs = TURNED if turned else (1,) * 5
        rest = [sign * math.radians(angle) for sign, angle in zip(signs, REST_DEG, strict=True)]
        self.axes = tuple(_Axis(angle, values, n) for n, angle in enumerate(rest))
        self._rotor_q = np.array([self.model.joint(f"rotor{n}").qposadr[0] for n in range(1, 6)])
        self._rotor_v = np.array([self.model.joint(f"rotor{n}").dofadr[0] for n in range(1, 6)])
        self._chains = tuple(self._chain(n) for n in range(5))
        self._ctrl, self._qpos, self._qvel = self.data.ctrl, self.data.qpos, self.data.qvel
        """Views of MuJoCo's memory. They are stored because getting them takes a fifth of a step's time."""
        self._tone_speed = math.radians(values.tone_speed_deg_s)
        self._jammed_damping = self.model.dof_damping[self._rotor_v].copy()
        self.shoulder = PassiveShoulder(person, values.peak_torque_nm, signs[2:])
        self._shares = values.output_share
        self._loaded = tuple(
            (axis, self.shoulder.passive(n - 2) if n >= 2 else None) for n, axis in enumerate(self.axes)
        )
        """Each axis with the torque of its capsule."""
        self._tone_nm = person.tone_nm
        random_source = random_stream("tone", seed)
        self._tone = tuple(Waves.drawn(random_source, 0.5 / math.sqrt(6), TONE_HZ) for _ in range(5))
        self._slow_s = 0.0
        self._constant = [0.0, 0.0, -values.balancer_kg * 9.81]
        """Torques of the girdle and force of the balancer."""
        self.data.qpos[self._rotor_q] = rest
        self._settle_girdle()
        self._read()

    @property
    def joints(self) -> Sequence[_Axis]:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        return self.axes

    def advance(self, drives: Sequence[Drive], steps: int) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        working = [
            (n, axis, gains, drive.followed_goal, (self.parameters.supply_v, drive.limit_nm / NM_AN_AMPERE))
            for n, (axis, drive) in enumerate(zip(self.axes, drives, strict=True))
            if (gains := axis.gains(drive))
        ]
        torques, shares = [0.0] * 5, self._shares
        for _ in range(steps):
            for n, axis, gains, goal, supply in working:
                torques[n] = axis.drive_nm(gains, goal, supply)
            self.step([share * torque for share, torque in zip(shares, torques, strict=True)])
        for axis, drive, torque in zip(self.axes, drives, torques, strict=True):
            drive.angle, drive.speed, drive.torque_nm = axis.angle, axis.speed, torque

    def step(self, torques_nm: Sequence[float]) -> None:
        """Advance the mechanics by 1 ms with these torques at the drives' shafts."""
        loads = []
        tone_speed = self._tone_speed
        for axis, passive_nm in self._loaded:
            speed = axis.arm_speed
            # Without resistance the product is a signed zero, which changes no sum of the loads.
            load = -axis.resistance_nm * math.tanh(speed / tone_speed) if axis.resistance_nm else 0.0
            if passive_nm:
                load += passive_nm(axis.arm_angle, speed)
            if axis.hand:
                load += axis.hand_nm()
            loads.append(load)
        self._ctrl[:] = [*torques_nm, *loads, *self._constant]
        _mj_step(self.model, self.data)
        self._read()

    def update_slow_loads(self) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        values = self.parameters
        self._slow_s += SLOW_STEPS * STEP_S
        moved = self.axes[2:]
        guarding_nm = self.shoulder.update_guarding(
            [axis.arm_angle for axis in moved],
            max(abs(axis.arm_speed) for axis in moved),
            math.radians(values.guarding_speed_deg_s),
            SLOW_STEPS * STEP_S / values.guarding_s,
        )
        for n, (axis, tone) in enumerate(zip(self.axes, self._tone, strict=True)):
            axis.resistance_nm = self._tone_nm * (0.5 + tone.at(self._slow_s)) + (guarding_nm if n >= 2 else 0.0)

    def place(self, axis: int, angle: float) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`. Motors 1 and 2 are moved there by torque, so that the linkage stays closed."""
        goals = [axis.angle for axis in self.axes]
        goals[axis] = angle
        if axis >= 2:
            self.data.qpos[self._rotor_q[axis]] = angle
        hands = [axis.hand for axis in self.axes]
        for one in self.axes:
            one.hand = None
        self._read_positions()
        for _ in range(_PLACING_STEPS if axis < 2 else 0):
            self.step(
                [
                    stiffness * (goal - one.angle) - damping * one.speed
                    for goal, one, (stiffness, damping) in zip(goals, self.axes, _PLACING, strict=True)
                ]
            )
        for one, hand in zip(self.axes, hands, strict=True):
            one.hand = hand
        self.data.qvel[:] = 0.0
        self._read_positions()

    def jam(self, axis: int, *, jammed: bool) -> None:
        """See :class:`~kata.simulator.mechanics.Mechanics`."""
        dof = self._rotor_v[axis]
        self.model.dof_damping[dof] = _JAMMED_NM_S if jammed else self._jammed_damping[axis]
        self.data.qvel[dof] = 0.0

    def closure_error_m(self) -> float:
        """Return the largest opening of the scapula's linkage, metres."""
        found = []
        for n in (1, 2):
            rod = self.data.site(f"q{n}").xpos
            board = self.data.body("board")
            on_board = self.model.equality(f"closure{n}").data[3:6]
            found.append(float(np.linalg.norm(board.xpos + board.xmat.reshape(3, 3) @ on_board - rod)))
        return max(found)

    def _settle_girdle(self) -> None:
        """Set the girdle's constant torques so that it is in balance with its load at rest."""
        dofs = [self.model.joint(name).dofadr[0] for name in ("phi", "psi")]
        self.data.ctrl[:] = [*[0.0] * 10, *self._constant]
        mujoco.mj_forward(self.model, self.data)
        carried = self.data.qfrc_bias[dofs] - self.data.qfrc_actuator[dofs]
        self._constant[:2] = carried.tolist()

    def _read_positions(self) -> None:
        mujoco.mj_forward(self.model, self.data)
        self._read()

    def _chain(self, n: int) -> tuple[_Axis, int, int, tuple[int, ...]]:
        """Return axis ``n`` (from 0) with the indices of its rotor, its gap, and the joints behind it. Each joint has one degree of freedom."""
        names = (f"{kind}{n + 1}" for kind in ("rotor", "gap", "tissue", "slip"))
        known = {self.model.joint(number).name for number in range(self.model.njnt)}
        rotor, gap, *more = [int(self.model.joint(name).qposadr[0]) for name in names if name in known]
        return self.axes[n], rotor, gap, tuple(more)

    def _read(self) -> None:
        """Read the state of the axes from the model."""
        angles, speeds = self._qpos.tolist(), self._qvel.tolist()
        for axis, rotor, gap, more in self._chains:
            axis.angle, axis.speed = angle, speed = angles[rotor], speeds[rotor]
            angle, speed = angle + angles[gap], speed + speeds[gap]
            for joint in more:
                angle += angles[joint]
                speed += speeds[joint]
            axis.arm_angle, axis.arm_speed = angle, speed
