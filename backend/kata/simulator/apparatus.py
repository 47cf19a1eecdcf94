"""Simulates the whole apparatus: five drives on one mechanism, a hand, a pedal, an emergency stop, and a clock.

The emergency stop has antivalent contacts: a normally closed contact at external port 1 of drive 1, and a normally open contact at port
3. The contacts are only signals: in this simulation only the control software switches torque off. The pedal is normally open, on port 2.
"""

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Literal

import msgspec

from kata.simulator import texts
from kata.simulator.drive import Drive, DriveEvent, share_supply
from kata.simulator.effort import PatientEffort
from kata.simulator.hand import STRIDE_S, GuidedMotion, HandRefusedError, SimulatedHand
from kata.simulator.mechanics import Hand, MakeMechanics
from kata.simulator.parameters import DRIVES, SLOW_STEPS, STEP_S, SUPPLIES
from kata.simulator.plant import Plant

_STEP_NS: Final = int(STEP_S * 1e9)
_CATCH_UP_NS: Final = 500_000_000
"""A longer gap is skipped: the process was suspended."""
ESTOP_PORT: Final = 1
PEDAL_PORT: Final = 2
ESTOP_SECOND_PORT: Final = 3
_MAX_EVENTS: Final = 200
_LINE_SILENT_NS: Final = 100_000_000
_GUARDING_NM_RAD: Final = 60.0
_GUARDING_NM_S: Final = 1.0
"""Stiffness and damping of a patient who resists. The resistance reaches 3 Nm after 3 deg."""

EventName = Literal[
    "estop_pressed",
    "estop_released",
    "pedal_down",
    "pedal_up",
    "torque_on",
    "torque_off",
    "hand_started",
    "hand_left",
    "watchdog_tripped",
    "line_silent",
]


class SimulatorEvent(msgspec.Struct, frozen=True):
    """A physical event at ``time.monotonic_ns``. A silent line is reported later, with the time of its last message."""

    t_ns: int
    what: EventName
    motor: int | None = None


class SimulatedAxis(msgspec.Struct, frozen=True):
    """The true state of an axis' shaft, independent of the drive's report. The arm's angle differs from the shaft's by the backlash."""

    motor: int
    angle_deg: float
    speed_deg_s: float
    torque_on: bool
    torque_nm: float


class HandState(msgspec.Struct, frozen=True):
    """The hand, and the time until it lets go."""

    phase: Literal["away", "reaching", "tracing", "leaving"]
    motion: str | None
    left_s: float


class State(msgspec.Struct, frozen=True):
    """State of the whole simulated apparatus, and its latest events."""

    t_ns: int
    pedal_down: bool
    estop_pressed: bool
    hand: HandState
    axes: tuple[SimulatedAxis, ...]
    events: tuple[SimulatorEvent, ...]
    effort_nm: float = 0.0
    """Effort of the simulated patient along the path; below 0 the patient resists."""


DriveCallback = Callable[[int, int, DriveEvent, float], None]
"""Callback for each accepted change of a drive. Its arguments: time in ns, motor 1-5, and "goal" with degrees or "torque" with 1 or 0."""


class SimulatedApparatus:
    """The apparatus between bus and patient. :meth:`advance` sets the time."""

    def __init__(
        self,
        seed: int | None = None,
        now_ns: int | None = None,
        *,
        on_drive_event: DriveCallback | None = None,
        still: bool = False,
        turned: bool = False,
        make_mechanics: MakeMechanics = Plant,
    ) -> None:
        """Create the apparatus. ``seed``: chooses another patient, other gears and another therapist. ``now_ns``: start of a stepped clock;
        None: real time. ``still``: without mechanics. ``turned``: turned by 180 deg about X, for the other shoulder.
        """
        self.seed = seed
        self._supported = False
        self._make_mechanics = make_mechanics
        self._turned = turned
        self.drives = [Drive(n + 1, parameters, self._on_drive_change) for n, parameters in enumerate(DRIVES)]
        self._on_drive_event = on_drive_event
        self._still = still
        self._supplied = tuple([self.drives[n] for n in axes] for axes in SUPPLIES)
        self._set_up()
        self._foot_down = False
        self._estop_pressed = False
        self._estop_wire_broken = False
        self._second_wire_broken = False
        self._contact_welded = False
        self._events: deque[SimulatorEvent] = deque(maxlen=_MAX_EVENTS)
        self._catch_up_ns = _CATCH_UP_NS if now_ns is None else None
        self._now_ns = time.monotonic_ns() if now_ns is None else now_ns
        self._stepped_ns = self._now_ns
        self._steps_to_slow_update = 0
        """Number of steps until :meth:`_update_slow_values` is called again."""
        self._heard_ns: int | None = None
        self._pedal_down = False
        self._set_contacts()

    def _set_up(self) -> None:
        """Create mechanics, patient and therapist for the apparatus' present side."""
        self._plant = self._make_mechanics(self.seed, turned=self._turned)
        for drive, joint in zip(self.drives, self._plant.joints, strict=True):
            drive.angle = joint.angle
        self._hand = SimulatedHand(self.seed, turned=self._turned)
        self._effort = PatientEffort()
        self._patient_acts = False
        self._supports = [False] * len(self.drives)

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, now_ns: int) -> None:
        """Advance the simulation until ``now_ns``."""
        self._now_ns = max(self._now_ns, now_ns)
        if self._still:
            return
        if self._catch_up_ns is not None:
            self._stepped_ns = max(self._stepped_ns, now_ns - self._catch_up_ns)
        while (steps := (now_ns - self._stepped_ns) // _STEP_NS) > 0:
            if self._steps_to_slow_update == 0:
                self._update_slow_values()
                self._steps_to_slow_update = SLOW_STEPS
            self._advance(min(steps, self._steps_to_slow_update))

    def _advance(self, steps: int) -> None:
        """Advance by at most ``steps`` steps, without external events. A watchdog that trips ends the advance early."""
        watching = [drive for drive in self.drives if drive.watchdog_active]
        for drive in watching:
            steps = min(steps, drive.steps_to_trip)
        for drive in [drive for drive in self.drives if drive.moves_its_goal]:
            steps = 1
            drive.move_goal(STEP_S)
        self._plant.advance(self.drives, steps)
        self._stepped_ns += steps * _STEP_NS
        self._steps_to_slow_update -= steps
        for drive in watching:
            if drive.count_silent_steps(steps):
                self._events.append(SimulatorEvent(self._stepped_ns, "watchdog_tripped", drive.motor))
        if self._heard_ns is not None and self._stepped_ns - self._heard_ns > _LINE_SILENT_NS:
            self._add_event("line_silent", self._heard_ns)
            self._heard_ns = None

    def _update_slow_values(self) -> None:
        """Update slow loads, the supplies' voltage, the hand's target and the pedal."""
        self._plant.update_slow_loads()
        for drives in self._supplied:
            share_supply(drives, STRIDE_S)
        if self._hand.phase != "away":
            targets = self._hand.next_target()
            if targets is None:
                self._take_hand_off()
                self._add_event("hand_left", self._stepped_ns)
            else:
                self._move_hand(targets)
            self._update_pedal(self._stepped_ns)
        else:
            self._support_arm()
            self._let_patient_act()

    def _support_arm(self) -> None:
        """Hold the arm on the axes without torque, and let go of the others."""
        if not self._supported:
            return
        hand = self._hand.parameters
        for n, (drive, joint) in enumerate(zip(self.drives, self._plant.joints, strict=True)):
            if not drive.torque_on and joint.hand is None:
                joint.hand = (joint.arm_angle, 0.0, hand.stiffness_nm_rad[n], hand.damping_nm_s[n], hand.strength_nm)
                self._supports[n] = True
            elif drive.torque_on and self._supports[n]:
                joint.hand = None
                self._supports[n] = False

    def _let_patient_act(self) -> None:
        """Add the patient's effort to the arm while the drives hold or move it."""
        hands = None
        if any(drive.torque_on for drive in self.drives):
            hands = self._effort.hands([drive.followed_goal for drive in self.drives])
        if hands:
            for joint, hand in zip(self._plant.joints, hands, strict=True):
                joint.hand = hand
        elif self._patient_acts:
            self._take_hand_off()
        self._patient_acts = hands is not None

    def _move_hand(self, targets: list[float]) -> None:
        """Let the hand pull the arm from its last target to its next target."""
        hand = self._hand.parameters
        for n, (joint, target) in enumerate(zip(self._plant.joints, targets, strict=True)):
            begins = joint.hand[0] if joint.hand else joint.arm_angle
            step = (target - begins) / SLOW_STEPS
            joint.hand = (begins, step, hand.stiffness_nm_rad[n], hand.damping_nm_s[n], hand.strength_nm)

    def _take_hand_off(self) -> None:
        for n, joint in enumerate(self._plant.joints):
            joint.hand = None
            self._supports[n] = False

    # -- the drives -----------------------------------------------------------------------------------------------

    def heard(self, now_ns: int) -> None:
        """Note the time of a valid message on the bus."""
        self._heard_ns = now_ns

    def _on_drive_change(self, motor: int, what: DriveEvent, value: float) -> None:
        """Note an accepted change of a drive."""
        if what == "torque":
            self._events.append(SimulatorEvent(self._now_ns, "torque_on" if value else "torque_off", motor))
        if self._on_drive_event:
            self._on_drive_event(self._now_ns, motor, what, value)

    def jam(self, motor: int, *, jammed: bool) -> None:
        """Jam a shaft, or free it."""
        self._plant.jam(motor - 1, jammed=jammed)

    def break_estop_wire(self, *, broken: bool) -> None:
        """Break the wire of the normally closed contact, so that the stop reads as pressed, or repair it."""
        self._estop_wire_broken = broken
        self._set_contacts()

    def break_second_wire(self, *, broken: bool) -> None:
        """Break the wire of the normally open contact, so that it never reads closed, or repair it."""
        self._second_wire_broken = broken
        self._set_contacts()

    def weld_contact(self, *, welded: bool) -> None:
        """Weld the normally closed contact, so that it stays closed when the stop is pressed, or repair it."""
        self._contact_welded = welded
        self._set_contacts()

    # -- the people -----------------------------------------------------------------------------------------------

    def step_on_pedal(self, down: bool) -> None:
        """Press or release the pedal, independently of the guiding therapist's foot."""
        self._foot_down = down
        self._update_pedal()

    def press_estop(self, pressed: bool) -> None:
        """Press the emergency stop, or release it."""
        if pressed != self._estop_pressed:
            self._estop_pressed = pressed
            self._add_event("estop_pressed" if pressed else "estop_released")
            self._set_contacts()

    def turn(self, *, turned: bool) -> None:
        """Turn the apparatus by 180 deg about X for the other shoulder, or turn it back. The patient changes the arm.

        :raises HandRefusedError: while torque is on, or while the hand is busy.
        """
        if turned == self._turned:
            return
        if any(drive.torque_on for drive in self.drives):
            raise HandRefusedError(texts.TURN_WHILE_MOTORS_HOLD())
        if self._hand.phase != "away":
            raise HandRefusedError(texts.HAND_STILL_GUIDING())
        self._turned = turned
        self._set_up()

    def guide(self, name: str, motion: GuidedMotion, pedal: bool) -> None:
        """Let the hand guide the arm along a motion.

        :raises HandRefusedError: while torque is on, while the hand is busy, or when the motion has fewer than two rows.
        """
        if any(drive.torque_on for drive in self.drives):
            raise HandRefusedError(texts.GUIDE_WHILE_MOTORS_HOLD())
        if self._hand.phase != "away":
            raise HandRefusedError(texts.HAND_STILL_GUIDING())
        if motion.rows < 2:
            raise HandRefusedError(texts.MOTION_NEEDS_ROWS())
        self._hand.guide(name, motion, [math.degrees(joint.arm_angle) for joint in self._plant.joints], pedal)
        self._add_event("hand_started")

    def support(self) -> None:
        """Let the therapist's hands hold the arm where it is, from now on, on each axis whose drive has no torque."""
        self._supported = True
        self._support_arm()

    def hold_against(self, motor: int, strength_nm: float) -> None:
        """Let the patient resist movement of motor 1-5 with at most ``strength_nm``. 0 ends the resistance."""
        angle = self._plant.joints[motor - 1].arm_angle
        self.hold(motor, (angle, 0.0, _GUARDING_NM_RAD, _GUARDING_NM_S, strength_nm) if strength_nm else None)

    def set_effort(self, effort_nm: float) -> None:
        """Let the patient help with a torque along the path, or resist with a torque below 0. 0: the patient is relaxed."""
        self._effort.effort_nm = effort_nm

    def hold(self, motor: int, hand: Hand | None) -> None:
        """Hold the arm of motor 1-5 with a hand or a fixture, or let go."""
        self._plant.joints[motor - 1].hand = hand
        self._supports[motor - 1] = False

    def place(self, motor: int, angle: float) -> None:
        """Put the shaft of motor 1-5 and the arm at an angle (rad), at rest, as if a hand had guided them."""
        self._plant.place(motor - 1, angle)
        for drive, joint in zip(self.drives, self._plant.joints, strict=True):
            drive.angle, drive.speed = joint.angle, joint.speed

    @property
    def arm_deg(self) -> tuple[float, ...]:
        """Angles of the patient's arm on the five axes in degrees, after play and soft parts. No encoder measures them."""
        return tuple(math.degrees(joint.arm_angle) for joint in self._plant.joints)

    @property
    def hand_is_away(self) -> bool:
        """True while no hand guides the arm."""
        return self._hand.phase == "away"

    def let_go(self) -> None:
        """Let the hand release the arm."""
        if self._hand.phase != "away":
            self._hand.let_go()
            self._take_hand_off()
            self._add_event("hand_left")
        self._foot_down = False
        self._update_pedal()

    def state(self) -> State:
        """Return the present state."""
        return State(
            t_ns=self._now_ns,
            pedal_down=self._pedal_down,
            estop_pressed=self._estop_pressed,
            hand=HandState(self._hand.phase, self._hand.motion, self._hand.left_s),
            axes=tuple(
                SimulatedAxis(
                    drive.motor,
                    math.degrees(joint.angle),
                    math.degrees(joint.speed),
                    drive.torque_on,
                    drive.torque_nm,
                )
                for drive, joint in zip(self.drives, self._plant.joints, strict=True)
            ),
            events=tuple(self._events),
            effort_nm=self._effort.effort_nm,
        )

    def _update_pedal(self, t_ns: int | None = None) -> None:
        down = self._foot_down or self._hand.wants_pedal
        if down != self._pedal_down:
            self._pedal_down = down
            self._add_event("pedal_down" if down else "pedal_up", t_ns)
            self._set_contacts()

    def _set_contacts(self) -> None:
        self.drives[0].contacts = {
            ESTOP_PORT: (not self._estop_pressed or self._contact_welded) and not self._estop_wire_broken,
            ESTOP_SECOND_PORT: self._estop_pressed and not self._second_wire_broken,
            PEDAL_PORT: self._pedal_down,
        }

    def _add_event(self, what: EventName, t_ns: int | None = None) -> None:
        self._events.append(SimulatorEvent(self._now_ns if t_ns is None else t_ns, what))
