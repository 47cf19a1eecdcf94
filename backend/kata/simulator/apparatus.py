"""The simulated apparatus as a whole: five drives on one mechanism, a hand, a pedal, a switch, and time.

The emergency stop is wired as in the apparatus: normally closed, to external port 1 of drive 1. It is a signal only;
nothing but the control software cuts the torque here. The pedal is normally open, on port 2.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, Literal

import msgspec

from kata.simulator.drive import Drive, Noticed
from kata.simulator.hand import Hand, HandRefusedError, Motion
from kata.simulator.plant import STEP_S, Plant

_STEP_NS: Final = int(STEP_S * 1e9)
_CATCH_UP_NS: Final = 500_000_000
"""After a longer gap (the process was stopped) time is let go: nobody saw it."""
ESTOP_PORT: Final = 1
PEDAL_PORT: Final = 2
_EVENTS_KEPT: Final = 200
_LINE_SILENT_NS: Final = 100_000_000
_STRENGTHS: Final = (1.0, 1.0, 1.0, 1.0, 0.8)

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
    """One axis as it really is, whatever its drive reports."""

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


Witness = Callable[[int, int, Noticed, float], None]
"""Told of what the drives have accepted: time in ns, motor 1-5, "goal" with degrees or "torque" with 1 or 0."""


class Apparatus:
    """Everything between the wire and the patient. Time is what :meth:`advance` was told last."""

    def __init__(
        self,
        seed: int | None = None,
        now_ns: int | None = None,
        *,
        witness: Witness | None = None,
        still: bool = False,
    ) -> None:
        """``now_ns``: where a stepped clock begins; without it time is real. ``still``: without mechanics."""
        self.seed = seed
        self.drives = [Drive(n + 1, strength, self._told) for n, strength in enumerate(_STRENGTHS)]
        self._witness = witness
        self._still = still
        self._plant = Plant(seed)
        self._hand = Hand()
        self._foot_down = False
        self._estop_pressed = False
        self._estop_wire_broken = False
        self._events: deque[Happening] = deque(maxlen=_EVENTS_KEPT)
        self._catch_up_ns = _CATCH_UP_NS if now_ns is None else None
        self._now_ns = time.monotonic_ns() if now_ns is None else now_ns
        self._stepped_ns = self._now_ns
        self._heard_ns: int | None = None
        self._pedal_down = False
        self._set_contacts()
        self._feel()

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, now_ns: int) -> None:
        """Let the world go on until ``now_ns``."""
        self._now_ns = max(self._now_ns, now_ns)
        if self._still:
            return
        if self._catch_up_ns is not None:
            self._stepped_ns = max(self._stepped_ns, now_ns - self._catch_up_ns)
        if self._stepped_ns + _STEP_NS > now_ns:
            return
        while self._stepped_ns + _STEP_NS <= now_ns:
            self._stepped_ns += _STEP_NS
            self._step()
        self._feel()

    def _step(self) -> None:
        plant = self._plant
        for drive, angle, speed in zip(self.drives, plant.angle, plant.speed, strict=True):
            was_tripped = drive.tripped
            drive.control(angle, speed, STEP_S)
            if drive.tripped and not was_tripped:
                self._events.append(Happening(self._stepped_ns, "watchdog_tripped", drive.motor))
        torques: Sequence[float] = [drive.torque_nm for drive in self.drives]
        if self._hand.phase != "away":
            pull = self._hand.torques_nm(plant.angle, plant.speed, STEP_S)
            if pull is None:
                self._happened("hand_left", self._stepped_ns)
            else:
                torques = [motor + hand for motor, hand in zip(torques, pull, strict=True)]
            self._settle_pedal(self._stepped_ns)
        plant.step(torques)
        if self._heard_ns is not None and self._stepped_ns - self._heard_ns > _LINE_SILENT_NS:
            self._happened("line_silent", self._heard_ns)
            self._heard_ns = None

    def _feel(self) -> None:
        for drive, angle, speed in zip(self.drives, self._plant.angle, self._plant.speed, strict=True):
            drive.feel(angle, speed)

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

    def guide(self, name: str, motion: Motion, pedal: bool) -> None:
        """Let the hand take the arm along a motion.

        :raises HandRefusedError: while torque is on, while the hand is busy, or when the motion is none.
        """
        if any(drive.torque_on for drive in self.drives):
            raise HandRefusedError("the motors hold the arm: the hand guides only while torque is off")
        if self._hand.phase != "away":
            raise HandRefusedError("the hand is still guiding the arm")
        if motion.rows < 2:
            raise HandRefusedError("a motion needs two or more rows")
        self._hand.guide(name, motion, [math.degrees(angle) for angle in self._plant.angle], pedal)
        self._happened("hand_started")

    def let_go(self) -> None:
        """The hand leaves the arm where it is."""
        if self._hand.phase != "away":
            self._hand.let_go()
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
                AxisNow(n + 1, math.degrees(angle), math.degrees(speed), drive.torque_on, drive.torque_nm)
                for n, (drive, angle, speed) in enumerate(
                    zip(self.drives, self._plant.angle, self._plant.speed, strict=True)
                )
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
            ESTOP_PORT: not self._estop_pressed and not self._estop_wire_broken,
            PEDAL_PORT: self._pedal_down,
        }

    def _happened(self, what: What, t_ns: int | None = None) -> None:
        self._events.append(Happening(self._now_ns if t_ns is None else t_ns, what))
