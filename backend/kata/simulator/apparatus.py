"""The simulated apparatus as a whole: five drives on one mechanism, a hand, a pedal, a switch, and time.

The emergency stop has antivalent contacts: a normally closed one at external port 1 of drive 1, a normally open one at port 3. They are
signals only; nothing but the control software cuts the torque here. The pedal is normally open, on port 2.
"""

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Literal

import msgspec

from kata.simulator import texts
from kata.simulator.drive import Drive, Noticed, share_supply
from kata.simulator.hand import STRIDE_S, Hand, HandRefusedError, Motion
from kata.simulator.parameters import DRIVES, SLOW_STEPS, STEP_S, SUPPLIES
from kata.simulator.plant import Plant, turn

_STEP_NS: Final = int(STEP_S * 1e9)
_CATCH_UP_NS: Final = 500_000_000
"""After a longer gap (the process was stopped) time is let go: nobody saw it."""
ESTOP_PORT: Final = 1
PEDAL_PORT: Final = 2
ESTOP_SECOND_PORT: Final = 3
_EVENTS_KEPT: Final = 200
_LINE_SILENT_NS: Final = 100_000_000
_GUARDING_NM_RAD: Final = 60.0
_GUARDING_NM_S: Final = 1.0
"""Stiffness and damping of a patient who guards the arm: a 3 Nm guard is full after 3 deg."""

What = Literal[
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


class Happening(msgspec.Struct, frozen=True):
    """Something physical, at ``time.monotonic_ns``; a silent line is told later, and when it was last heard."""

    t_ns: int
    what: What
    motor: int | None = None


class AxisNow(msgspec.Struct, frozen=True):
    """One axis' shaft as it really is, whatever its drive reports; the arm may be off it by the gear's play."""

    motor: int
    angle_deg: float
    speed_deg_s: float
    torque_on: bool
    torque_nm: float


class HandNow(msgspec.Struct, frozen=True):
    """The hand, and how long until it has let go."""

    phase: Literal["away", "reaching", "tracing", "leaving"]
    motion: str | None
    left_s: float


class State(msgspec.Struct, frozen=True):
    """The whole simulated apparatus, and what happened lately."""

    t_ns: int
    pedal_down: bool
    estop_pressed: bool
    hand: HandNow
    axes: tuple[AxisNow, ...]
    events: tuple[Happening, ...]


SessionHook = Callable[[int, int, Noticed, float], None]
"""Told of what the drives have accepted: time in ns, motor 1-5, "goal" with degrees or "torque" with 1 or 0."""


class Apparatus:
    """Everything between the wire and the patient. Time is what :meth:`advance` was told last."""

    def __init__(
        self,
        seed: int | None = None,
        now_ns: int | None = None,
        *,
        witness: SessionHook | None = None,
        still: bool = False,
        turned: bool = False,
    ) -> None:
        """``seed``: another patient, other gears, another therapist. ``now_ns``: where a stepped clock begins; without it time is
        real. ``still``: without mechanics. ``turned``: by 180 deg about X, for the other shoulder.
        """
        self.seed = seed
        self._turned = turned
        self.drives = [Drive(n + 1, parameters, self._told) for n, parameters in enumerate(DRIVES)]
        self._witness = witness
        self._still = still
        self._supplied = tuple([self.drives[n] for n in axes] for axes in SUPPLIES)
        self._set_up()
        self._foot_down = False
        self._estop_pressed = False
        self._estop_wire_broken = False
        self._second_wire_broken = False
        self._contact_welded = False
        self._events: deque[Happening] = deque(maxlen=_EVENTS_KEPT)
        self._catch_up_ns = _CATCH_UP_NS if now_ns is None else None
        self._now_ns = time.monotonic_ns() if now_ns is None else now_ns
        self._stepped_ns = self._now_ns
        self._until_slow = 0
        """Steps until what changes slowly is due."""
        self._heard_ns: int | None = None
        self._pedal_down = False
        self._set_contacts()

    def _set_up(self) -> None:
        """Mechanics, patient and therapist, as the apparatus stands."""
        self._plant = Plant(self.seed, turned=self._turned)
        self._moved = tuple(zip(self.drives, self._plant.joints, strict=True))
        for drive, joint in self._moved:
            drive.angle = joint.angle
        self._hand = Hand(self.seed, turned=self._turned)

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, now_ns: int) -> None:
        """Let the world go on until ``now_ns``."""
        self._now_ns = max(self._now_ns, now_ns)
        if self._still:
            return
        if self._catch_up_ns is not None:
            self._stepped_ns = max(self._stepped_ns, now_ns - self._catch_up_ns)
        while (steps := (now_ns - self._stepped_ns) // _STEP_NS) > 0:
            if self._until_slow == 0:
                self._go_on_slowly()
                self._until_slow = SLOW_STEPS
            self._go_on(min(steps, self._until_slow))

    def _go_on(self, steps: int) -> None:
        """Some milliseconds, in which nothing comes from outside."""
        watching = [drive for drive in self.drives if drive.watching]
        for drive in watching:
            steps = min(steps, drive.steps_to_trip)
        for drive, joint in self._moved:
            turn(drive, joint, steps)
        self._stepped_ns += steps * _STEP_NS
        self._until_slow -= steps
        for drive in watching:
            if drive.pass_steps(steps):
                self._events.append(Happening(self._stepped_ns, "watchdog_tripped", drive.motor))
        if self._heard_ns is not None and self._stepped_ns - self._heard_ns > _LINE_SILENT_NS:
            self._happened("line_silent", self._heard_ns)
            self._heard_ns = None

    def _go_on_slowly(self) -> None:
        """What need not be looked at every millisecond."""
        self._plant.settle()
        for drives in self._supplied:
            share_supply(drives, STRIDE_S)
        if self._hand.phase != "away":
            aims = self._hand.stride()
            if aims is None:
                self._take_hand_off()
                self._happened("hand_left", self._stepped_ns)
            else:
                self._lead(aims)
            self._settle_pedal(self._stepped_ns)

    def _lead(self, aims: list[float]) -> None:
        """Let the hand draw the arm from where it wanted it so far to where it wants it next."""
        ways = self._hand.parameters
        for n, (joint, aim) in enumerate(zip(self._plant.joints, aims, strict=True)):
            begins = joint.hand[0] if joint.hand else joint.arm_angle
            step = (aim - begins) / SLOW_STEPS
            joint.hand = (begins, step, ways.stiffness_nm_rad[n], ways.damping_nm_s[n], ways.strength_nm)

    def _take_hand_off(self) -> None:
        for joint in self._plant.joints:
            joint.hand = None

    # -- the drives -----------------------------------------------------------------------------------------------

    def heard(self, now_ns: int) -> None:
        """A sound word on the line, whatever it asks for."""
        self._heard_ns = now_ns

    def _told(self, motor: int, what: Noticed, value: float) -> None:
        """A drive has accepted something."""
        if what == "torque":
            self._events.append(Happening(self._now_ns, "torque_on" if value else "torque_off", motor))
        if self._witness:
            self._witness(self._now_ns, motor, what, value)

    def jam(self, motor: int, *, jammed: bool) -> None:
        """Let a shaft get stuck, or free it."""
        self._plant.jam(motor - 1, jammed=jammed)

    def break_estop_wire(self, *, broken: bool) -> None:
        """It then looks pressed, although nobody presses it."""
        self._estop_wire_broken = broken
        self._set_contacts()

    def break_second_wire(self, *, broken: bool) -> None:
        """The normally open contact's wire: it then never reads closed."""
        self._second_wire_broken = broken
        self._set_contacts()

    def weld_contact(self, *, welded: bool) -> None:
        """The normally closed contact then stays closed, however the switch is pressed."""
        self._contact_welded = welded
        self._set_contacts()

    # -- the people -----------------------------------------------------------------------------------------------

    def step_on_pedal(self, down: bool) -> None:
        """A foot of its own, besides the one that belongs to the guiding hand."""
        self._foot_down = down
        self._settle_pedal()

    def press_estop(self, pressed: bool) -> None:
        """Press the switch, or release it."""
        if pressed != self._estop_pressed:
            self._estop_pressed = pressed
            self._happened("estop_pressed" if pressed else "estop_released")
            self._set_contacts()

    def turn(self, *, turned: bool) -> None:
        """By 180 deg about X, for the other shoulder, or back; the patient takes the arm out and puts the other one in.

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

    def guide(self, name: str, motion: Motion, pedal: bool) -> None:
        """Let the hand take the arm along a motion.

        :raises HandRefusedError: while torque is on, while the hand is busy, or when the motion is none.
        """
        if any(drive.torque_on for drive in self.drives):
            raise HandRefusedError(texts.GUIDE_WHILE_MOTORS_HOLD())
        if self._hand.phase != "away":
            raise HandRefusedError(texts.HAND_STILL_GUIDING())
        if motion.rows < 2:
            raise HandRefusedError(texts.MOTION_NEEDS_ROWS())
        self._hand.guide(name, motion, [math.degrees(joint.arm_angle) for joint in self._plant.joints], pedal)
        self._happened("hand_started")

    def hold_against(self, motor: int, strength_nm: float) -> None:
        """Let the patient try to keep the arm of motor 1-5 where it is, with at most so much torque; 0: not any more."""
        joint = self._plant.joints[motor - 1]
        joint.hand = (joint.arm_angle, 0.0, _GUARDING_NM_RAD, _GUARDING_NM_S, strength_nm) if strength_nm else None

    def place(self, motor: int, angle: float) -> None:
        """Put the shaft of motor 1-5 and its arm to an angle (rad), at rest, as a hand would that led it there."""
        drive, joint = self._moved[motor - 1]
        drive.angle = joint.angle = joint.arm_angle = angle
        drive.speed = joint.speed = joint.arm_speed = 0.0

    @property
    def hand_is_away(self) -> bool:
        """Nobody guides the arm."""
        return self._hand.phase == "away"

    def let_go(self) -> None:
        """The hand leaves the arm where it is."""
        if self._hand.phase != "away":
            self._hand.let_go()
            self._take_hand_off()
            self._happened("hand_left")
        self._foot_down = False
        self._settle_pedal()

    def state(self) -> State:
        """As it is now."""
        return State(
            t_ns=self._now_ns,
            pedal_down=self._pedal_down,
            estop_pressed=self._estop_pressed,
            hand=HandNow(self._hand.phase, self._hand.motion, self._hand.left_s),
            axes=tuple(
                AxisNow(
                    drive.motor,
                    math.degrees(joint.angle),
                    math.degrees(joint.speed),
                    drive.torque_on,
                    drive.torque_nm,
                )
                for drive, joint in self._moved
            ),
            events=tuple(self._events),
        )

    def _settle_pedal(self, t_ns: int | None = None) -> None:
        down = self._foot_down or self._hand.wants_pedal
        if down != self._pedal_down:
            self._pedal_down = down
            self._happened("pedal_down" if down else "pedal_up", t_ns)
            self._set_contacts()

    def _set_contacts(self) -> None:
        self.drives[0].contacts = {
            ESTOP_PORT: (not self._estop_pressed or self._contact_welded) and not self._estop_wire_broken,
            ESTOP_SECOND_PORT: self._estop_pressed and not self._second_wire_broken,
            PEDAL_PORT: self._pedal_down,
        }

    def _happened(self, what: What, t_ns: int | None = None) -> None:
        self._events.append(Happening(self._now_ns if t_ns is None else t_ns, what))
