"""Simulates a factory-new apparatus on a stepped clock, and a technician who follows the instructions of commissioning.

The drives have factory settings (id 1 at 57,600 baud), but some used drives have other values. Encoders are mounted at any angle and in
either direction. Motors, gears and mechanical ends differ. The seed determines all of these.
"""

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from kata.commissioning.gains_review import GainsChoice
from kata.commissioning.procedure import first_draft
from kata.commissioning.workbench import ManualAction, Workbench
from kata.commissioning.zero import POSES_DEG
from kata.evaluation.world import World
from kata.motion.axes import N_AXES, Side
from kata.motion.linkage import motor_angles_deg
from kata.simulator.control_table import BAUD, BAUDS, ID
from kata.simulator.parameters import COUNTS_A_TURN, REST_DEG, STOPS_DEG, TURNED
from kata.simulator.plant import Plant
from kata.simulator.servos import Servo

_RESET_ALL: Final = 0xFF
"""Option of a factory reset that also resets id and baud rate."""
_USED_SHARE: Final = 0.3
"""Share of drives that were used before."""
_STOPS_VARY_DEG: Final = 4.0
_GAINS_VARY: Final = 0.25
_SEATED_DEG: Final = 0.05
"""Largest deviation of an axis in the fixture."""
_GRIP: Final = (500.0, 10.0, 6.0)
"""Stiffness (Nm/rad), damping (Nm s) and strength (Nm) of a hand on a joint. About the arm's own axis ``_SOFT_GRIP`` applies."""
_SOFT_GRIP: Final = (150.0, 2.0, 3.0)
_FIXTURE: Final = (3_000.0, 12.0, 100.0)
_SPEED_DEG_S: Final = 40.0
_PUSH_NM: Final = (1.5, 1.5, 1.5, 1.5, 0.7)
_SWEEP_NM: Final = (3.0, 3.0, 3.5, 3.5, 1.5)


@dataclass
class Mistakes:
    """Mistakes and defects that a test simulates. Motors are counted from 1."""

    connects: dict[int, int] = field(default_factory=dict)
    """The motor that is connected instead, by the motor that was requested."""
    moves_wrong_way: set[int] = field(default_factory=set)
    pushes_wrong_way: set[int] = field(default_factory=set)
    wire_stays_broken: bool = False
    jams_before_torque: int | None = None


class FactoryNewApparatus:
    """A simulated world with drives as delivered. ``direction`` and ``zero_count`` are the true values."""

    def __init__(self, seed: int) -> None:
        """Create the apparatus. ``seed``: determines everything that differs between two apparatus."""
        source = random.Random(f"factory-new {seed}")
        vary = source.uniform
        self.stops_deg = tuple(
            (low + vary(-_STOPS_VARY_DEG, _STOPS_VARY_DEG), high + vary(-_STOPS_VARY_DEG, _STOPS_VARY_DEG))
            for low, high in STOPS_DEG
        )
        self.world = World(first_draft(f"Station {seed}", "virtual"), seed, make_mechanics=self._mechanics)
        self.direction: list[int] = []
        self.zero_count: list[float] = []
        for servo in self.servos:
            sign, count = source.choice((1, -1)), source.randrange(COUNTS_A_TURN)
            servo.reset(_RESET_ALL, 0)
            if source.random() < _USED_SHARE:
                servo.table[ID], servo.table[BAUD] = source.randrange(1, 253), source.choice(sorted(BAUDS))
            servo.gain_share = 1 + vary(-_GAINS_VARY, _GAINS_VARY)
            servo.mount(count, sign)
            self.direction.append(sign)
            self.zero_count.append(sign * count % COUNTS_A_TURN)

    @property
    def servos(self) -> list[Servo]:
        """The five servos, in motor order."""
        return [servo for servo in self.world.drives if isinstance(servo, Servo)]

    def workbench(self, technician: "SimulatedTechnician") -> Workbench:
        """Return the workbench on which the steps run."""
        world = self.world
        return Workbench(world.config, technician, world.open_transport, world.wait, lambda: world.t_ns)

    def _mechanics(self, seed: int | None = None, *, turned: bool = False) -> Plant:
        plant = Plant(seed, turned=turned)
        for joint, ends, sign in zip(plant.joints, self.stops_deg, TURNED, strict=True):
            low, high = sorted(math.radians((sign if turned else 1) * end) for end in ends)
            joint.stops = (low, high)
        return plant


class SimulatedTechnician:
    """Follows every instruction with the hands of the simulation."""

    def __init__(self, apparatus: FactoryNewApparatus, mistakes: Mistakes | None = None) -> None:
        """Prepare the technician. ``mistakes``: none by default."""
        self._apparatus = apparatus
        self._world = apparatus.world
        self._mistakes = mistakes or Mistakes()
        self._random = random.Random(0)
        self._turned = False
        self._until_ns = 0
        self._acting: Iterator[float] = iter(())
        self.instructions: list[ManualAction] = []

    def instruct(self, instruction: ManualAction) -> None:
        """Begin to follow an instruction."""
        self.instructions.append(instruction)
        self._until_ns = self._world.t_ns
        self._acting = self._act(instruction)

    def has_confirmed(self) -> bool:
        """Continue to act. Return True when the instruction is done."""
        while self._world.t_ns >= self._until_ns:
            pause_s = next(self._acting, None)
            if pause_s is None:
                return True
            self._until_ns = self._world.t_ns + round(pause_s * 1e9)
        return False

    def gains_choice(self) -> GainsChoice:
        """Measure with the proposed gains, if there are any. Take them back if they are faulty."""
        review = self.instructions[-1].review
        assert review is not None
        proposed = tuple(motor.proposed for motor in review.motors)
        if review.fault and review.motors[0].former_gains is not None:
            return GainsChoice("take_back")
        if review.motors[0].former_gains is None and proposed != tuple(motor.gains for motor in review.motors):
            return GainsChoice("measure", proposed)
        return GainsChoice("keep")

    def _act(self, instruction: ManualAction) -> Iterator[float]:
        """Follow an instruction in parts. Yield the seconds until the next part."""
        motor, apparatus, mistakes = instruction.number, self._world.apparatus, self._mistakes
        yield 0.2
        match instruction.kind:
            case "connect_only":
                connected = mistakes.connects.get(motor, motor)
                for n, servo in enumerate(self._apparatus.servos, start=1):
                    _plug(servo, into=n == connected)
                yield 0.5
            case "connect_all":
                for servo in self._apparatus.servos:
                    _plug(servo, into=True)
                yield 0.5
            case "move_axis":
                yield from self._move(motor, -20.0 if motor in mistakes.moves_wrong_way else 20.0)
            case "push_axis":
                yield from self._push(motor, -1.0 if motor in mistakes.pushes_wrong_way else 1.0)
            case "sweep_axis":
                yield from self._sweep(motor)
            case "press_estop" | "release_estop":
                apparatus.press_estop(instruction.kind == "press_estop")
            case "unplug_estop" | "plug_in_estop":
                broken = instruction.kind == "unplug_estop"
                apparatus.break_estop_wire(broken=broken or mistakes.wire_stays_broken)
                apparatus.break_second_wire(broken=broken)
            case "press_pedal" | "release_pedal":
                apparatus.step_on_pedal(instruction.kind == "press_pedal")
            case "stand_clear":
                self._let_go()
                if mistakes.jams_before_torque:
                    apparatus.jam(mistakes.jams_before_torque, jammed=True)
            case "fit_pose":
                self._fit(instruction.number - 1)
            case "free_arm":
                self._let_go()
                for n, angle in enumerate(REST_DEG):
                    apparatus.place(n + 1, math.radians(angle))
            case "empty_arm":
                self._let_go()
            case "turn":
                self._let_go()
                self._turned = not self._turned
                apparatus.turn(turned=self._turned)
        yield 0.2

    # -- hands ------------------------------------------------------------------------------------------------------

    def _let_go(self) -> None:
        for motor in range(1, N_AXES + 1):
            self._world.apparatus.hold(motor, None)

    def _grip_all(self) -> None:
        for axis, angle in enumerate(self._world.apparatus.arm_deg):
            self._world.apparatus.hold(axis + 1, (math.radians(angle), 0.0, *_grip(axis)))

    def _move(self, motor: int, by_deg: float) -> Iterator[float]:
        """Support the arm and move one axis."""
        self._grip_all()
        begin = math.radians(self._world.apparatus.arm_deg[motor - 1])
        yield from self._go(motor, begin, begin + math.radians(by_deg), _grip(motor - 1))
        yield 1.0
        yield from self._go(motor, begin + math.radians(by_deg), begin + math.radians(by_deg / 4), _grip(motor - 1))
        yield 1.0

    def _go(self, motor: int, begin: float, end: float, grip: tuple[float, float, float]) -> Iterator[float]:
        """Move the hand at a constant speed, then hold the axis."""
        duration_s = abs(end - begin) / math.radians(_SPEED_DEG_S)
        step = (end - begin) / max(1, round(duration_s * 1000))
        self._world.apparatus.hold(motor, (begin, step, *grip))
        yield duration_s
        self._world.apparatus.hold(motor, (end, 0.0, *grip))

    def _push(self, motor: int, sign: float) -> Iterator[float]:
        angle = math.radians(self._world.apparatus.arm_deg[motor - 1] + sign * 20.0)
        self._world.apparatus.hold(motor, (angle, 0.0, 60.0, 1.0, _PUSH_NM[motor - 1]))
        yield 0.6
        self._world.apparatus.hold(motor, None)

    def _sweep(self, motor: int) -> Iterator[float]:
        """Move the axis gently against both ends, then to its rest angle."""
        self._grip_all()
        stiff, damped, _ = _grip(motor - 1)
        grip = (stiff, damped, _SWEEP_NM[motor - 1])
        sign = TURNED[motor - 1] if self._turned else 1
        low, high = sorted(sign * end for end in self._apparatus.stops_deg[motor - 1])
        angle_deg = self._world.apparatus.arm_deg[motor - 1]
        for begin, end in ((angle_deg, low - 2.0), (low - 2.0, high + 2.0), (high + 2.0, REST_DEG[motor - 1])):
            yield from self._go(motor, math.radians(begin), math.radians(end), grip)
            yield 0.5

    def _fit(self, pose: int) -> None:
        """Put the arm into the fixture."""
        side: Side = "left" if self._turned else "right"
        signs = TURNED if self._turned else (1,) * N_AXES
        angles = motor_angles_deg(np.array(POSES_DEG[pose]), side)
        for n, (angle, sign) in enumerate(zip(angles.tolist(), signs, strict=True)):
            seated = math.radians(sign * angle + self._random.uniform(-_SEATED_DEG, _SEATED_DEG))
            self._world.apparatus.place(n + 1, seated)
            self._world.apparatus.hold(n + 1, (seated, 0.0, *_FIXTURE))


def _grip(axis: int) -> tuple[float, float, float]:
    return _SOFT_GRIP if axis == N_AXES - 1 else _GRIP


def _plug(servo: Servo, *, into: bool) -> None:
    """Connect a drive to power and bus, or disconnect the drive."""
    if into != servo.plugged_in:
        servo.plugged_in = into
        servo.reboot()
