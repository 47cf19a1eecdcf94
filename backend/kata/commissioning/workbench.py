"""Holds the objects that the steps of commissioning share: the port, the technician, the clock, and the configuration so far."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final, Literal, Protocol

from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.drive_line import DriveLine, LineError
from kata.commissioning.gains_review import GainsChoice, GainsReview
from kata.commissioning.record import RecordedCurve, RecordedValue
from kata.device import texts as device_texts
from kata.device.bus.serial_transport import Transport
from kata.device.config import Axis, ConfigError, StationConfig
from kata.messages import Text

LOOK_S: Final = 0.02
"""Time between two reads of the drives while the technician acts."""
_INSTRUCTION_TIMEOUT_S: Final = 120
"""Longest time for one instruction."""
FACTORY_BAUD: Final = 57_600
"""A new X-series drive has this rate and id 1 (e-Manual, addresses 7 and 8)."""

ManualActionKind = Literal[
    "connect_only",
    "connect_all",
    "move_axis",
    "push_axis",
    "release_estop",
    "press_estop",
    "unplug_estop",
    "plug_in_estop",
    "press_pedal",
    "release_pedal",
    "stand_clear",
    "support_arm",
    "fit_pose",
    "free_arm",
    "empty_arm",
    "turn",
    "sweep_axis",
    "tune_gains",
]


@dataclass(frozen=True)
class ManualAction:
    """An instruction to the technician. ``number``: number of the motor or the pose; 0 for neither."""

    kind: ManualActionKind
    text: Text
    number: int = 0
    seen: bool = False
    """True if the drives show when the action is done. False if the technician confirms it."""
    review: GainsReview | None = None
    """The responses and gains to choose from, with the kind ``tune_gains`` only."""


class Technician(Protocol):
    """The person at the apparatus. A terminal, a page or a test implements this interface."""

    def instruct(self, instruction: ManualAction) -> None:
        """Show an instruction. Return at once."""

    def has_confirmed(self) -> bool:
        """Return True if the last instruction was confirmed.

        :raises StepError: when the technician ends the step.
        """

    def gains_choice(self) -> GainsChoice:
        """Return the answer to the last instruction of the kind ``tune_gains``, after it was confirmed."""


class StepError(Exception):
    """A step found a fault. The message names the fault."""

    def __init__(self, fault: Text) -> None:
        super().__init__(fault)
        self.fault = fault


class UnstableError(StepError):
    """A motor moved far away from its setpoint. Torque is off."""


@dataclass
class Workbench:
    """The workplace of the steps. ``draft`` is the configuration so far. Each passed step may replace it."""

    draft: StationConfig
    technician: Technician
    open_transport: Callable[[str, int], Transport]
    sleep: Callable[[float], None]
    now_ns: Callable[[], int]
    values: list[RecordedValue] = field(default_factory=list)
    """Recorded values of the present step."""
    curves: list[RecordedCurve] = field(default_factory=list)
    """Recorded curves of the present step."""

    @contextmanager
    def line(self, baud: int | None = None) -> Iterator[DriveLine]:
        """Open the port for single requests. ``baud``: the station's by default."""
        baud = baud or self.draft.baud
        transport = self.open_transport(self.draft.port, baud)
        try:
            yield DriveLine(transport, baud)
        finally:
            transport.close()

    def add_value(
        self, name: str, motor: int = 0, *, before: float | str | None = None, after: float | str | None = None
    ) -> None:
        """Add a value to the record."""
        self.values.append(RecordedValue(name, motor, before, after))

    def confirm(self, instruction: ManualAction) -> None:
        """Show an instruction, and wait until the technician confirms it."""
        self.technician.instruct(instruction)
        while not self.technician.has_confirmed():
            self.sleep(LOOK_S)

    def choose_gains(self, review: GainsReview) -> GainsChoice:
        """Show the responses, and return what the technician chooses. A choice outside the limits is asked again."""
        while True:
            self.confirm(ManualAction("tune_gains", texts.TUNE_GAINS(), review=review))
            choice = self.technician.gains_choice()
            if review.accepts(choice):
                return choice

    def watch(self, instruction: ManualAction, is_done: Callable[[], bool], fault: Text | None = None) -> None:
        """Show an instruction, and wait until ``is_done`` returns True. ``is_done`` reads the drives. If it returns True at
        once, no instruction is shown.

        :raises StepError: with ``fault``, when nothing is detected in time.
        """
        if is_done():
            return
        self.technician.instruct(replace(instruction, seen=True))
        end_ns = self.now_ns() + _INSTRUCTION_TIMEOUT_S * 1_000_000_000
        while not is_done():
            self.technician.has_confirmed()
            if self.now_ns() > end_ns:
                raise StepError(fault or texts.NOTHING_HAPPENED(seconds=_INSTRUCTION_TIMEOUT_S))
            self.sleep(LOOK_S)

    def change(self, **changes: object) -> None:
        """Replace fields of the draft.

        :raises StepError: when the configuration would be invalid.
        """
        try:
            self.draft = structs.replace(self.draft, **changes)
        except ConfigError as error:
            raise StepError(texts.CONFIGURATION_REFUSED(reason=str(error))) from error

    def change_axes(self, change: Callable[[int, Axis], Axis]) -> None:
        """Replace the draft's axes. ``change`` receives the motor's number and its axis, and returns the new axis."""
        self.change(axes=tuple(change(motor, axis) for motor, axis in enumerate(self.draft.axes, start=1)))


@contextmanager
def naming_drive(motor: int, drive_id: int) -> Iterator[None]:
    """Convert a LineError in the block into a StepError that names the motor.

    :raises StepError: when a LineError occurs in the block.
    """
    try:
        yield
    except LineError as error:
        problem = device_texts.DRIVE_ANSWERS_DAMAGED if error.damaged else device_texts.DRIVE_DOES_NOT_ANSWER
        raise StepError(problem(motor=motor, drive_id=drive_id)) from error


def wrapped_deg(angle_deg: float) -> float:
    """Return an angle within -180 to 180 deg."""
    return math.remainder(angle_deg, 360.0)
