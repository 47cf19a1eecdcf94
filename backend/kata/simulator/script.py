"""Faults in time: what is broken now, set and cleared while the apparatus works.

Some faults sit in the mechanics, a drive or a wire and are put there; the others spoil answers on their way out, and are
asked for then.
"""

import random
from collections.abc import Sequence
from typing import Final, Literal, Protocol, get_args

import msgspec

from kata.simulator.apparatus import Apparatus
from kata.simulator.drive import Drive

DriveKind = Literal[
    "off",
    "silent",
    "stuck",
    "frozen",
    "garbage",
    "wrong_crc",
    "delayed",
    "intermittent",
    "duplicate_id",
    "hardware_error",
    "reboot",
    "exchanged",
    "exchanged_id",
    "exchanged_model",
]
Kind = (
    DriveKind
    | Literal["noise", "echo", "gone", "estop_wire_broken", "second_wire_broken", "contact_welded", "inputs_silent"]
)  # fmt: skip
_LARGEST: Final = {
    "delayed": 10_000.0,
    "intermittent": 1.0,
    "hardware_error": 255.0,
    "noise": 256.0,
    "exchanged_id": 252.0,
    "exchanged_model": 65_535.0,
}
_NEEDS_VALUE: Final = frozenset({"delayed", "intermittent", "hardware_error", "exchanged_id"})
_OTHER_MODEL: Final = 1030.0
"""An XM430: it looks alike and has another torque constant."""
_MOST_NOISE: Final = 8


class Fault(msgspec.Struct, frozen=True):
    """One thing that is broken.

    Of a drive, with its ``motor`` 1-5: ``off`` (power lost; comes back with torque off and RAM at its defaults), ``silent``
    (works, never answers), ``stuck`` (the shaft is jammed), ``frozen`` (repeats what it measured last), ``garbage`` (its
    answers are random bytes), ``wrong_crc``, ``delayed`` (``value`` in ms), ``intermittent`` (answers with probability
    ``value``), ``duplicate_id`` (a second drive answers at the same time), ``hardware_error`` (``value`` is its code), ``reboot`` (once:
    torque off, RAM at its defaults), ``exchanged`` (once: a factory-default drive with the same id is in its place), ``exchanged_id`` (the
    same, with ``value`` as its id until it is mended), ``exchanged_model`` (the same, with the model number ``value`` until it is mended).
    Of the bus: ``noise`` (before each answer; ``value`` bytes, else a few), ``echo`` (the adapter gives back what was sent),
    ``gone`` (the adapter is pulled out). Of the inputs: ``estop_wire_broken`` (the normally closed contact's), ``second_wire_broken`` (the
    normally open one's), ``contact_welded`` (the normally closed contact stays closed), ``inputs_silent``.
    """

    kind: Kind
    motor: int | None = None
    value: float | None = None

    def __post_init__(self) -> None:
        """:raises ValueError: when motor or value do not go with the kind."""
        if self.kind in get_args(DriveKind):
            if self.motor not in range(1, 6):
                raise ValueError(f"{self.kind} is one drive's fault: a motor from 1 to 5")
        elif self.motor is not None:
            raise ValueError(f"{self.kind} is not one drive's fault")
        if self.kind in _NEEDS_VALUE and self.value is None:
            raise ValueError(f"{self.kind} needs a value")
        if self.value is not None and not 0.0 <= self.value <= _LARGEST.get(self.kind, 0.0):
            raise ValueError(f"{self.kind} cannot have the value {self.value:g}")


class Face(Protocol):
    """What is wanted of a drive's registers, whatever it speaks."""

    drive: Drive

    def reboot(self) -> None:
        """Torque off, and back to what it is after power came."""

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Be another drive, as it comes from the factory."""

    def fail(self, code: int) -> None:
        """Set the hardware error, 0 for none."""


class Script:
    """The faults there are. Random ones repeat with the apparatus' seed."""

    def __init__(self, apparatus: Apparatus, faces: Sequence[Face]) -> None:
        """``faces`` in motor order."""
        self._apparatus = apparatus
        self._faces = faces
        self._faults: dict[tuple[Kind, int | None], Fault] = {}
        self._random = random.Random(apparatus.seed or 0)

    def fault(self, fault: Fault) -> None:
        """From now on; the same one with another value replaces it."""
        self._faults[fault.kind, fault.motor] = fault
        self._wire(fault.kind, broken=True)
        if fault.motor is None:
            return
        face = self._faces[fault.motor - 1]
        match fault.kind:
            case "off" | "reboot":
                face.reboot()
            case "exchanged":
                face.exchange(fault.motor)
            case "exchanged_id":
                face.exchange(int(fault.value or 0))
            case "exchanged_model":
                face.exchange(fault.motor, int(fault.value or _OTHER_MODEL))
            case "stuck":
                self._apparatus.jam(fault.motor, jammed=True)
            case "frozen":
                face.drive.frozen = face.drive.report
            case "hardware_error":
                face.fail(int(fault.value or 0))
            case _:
                pass

    def clear(self) -> None:
        """Nothing is broken any more. Whoever lost power has it again."""
        for kind, motor in self._faults:
            self._wire(kind, broken=False)
            if kind in ("exchanged_id", "exchanged_model") and motor is not None:
                self._faces[motor - 1].exchange(motor)
            elif kind == "off" and motor is not None:
                # Somebody may have moved the shaft since: the encoder knows its place within a turn when power comes.
                self._faces[motor - 1].reboot()
            elif kind == "stuck" and motor is not None:
                self._apparatus.jam(motor, jammed=False)
            elif kind == "frozen" and motor is not None:
                self._faces[motor - 1].drive.frozen = None
            elif kind == "hardware_error" and motor is not None:
                self._faces[motor - 1].fail(0)
        self._faults.clear()

    def _wire(self, kind: Kind, *, broken: bool) -> None:
        match kind:
            case "estop_wire_broken":
                self._apparatus.break_estop_wire(broken=broken)
            case "second_wire_broken":
                self._apparatus.break_second_wire(broken=broken)
            case "contact_welded":
                self._apparatus.weld_contact(welded=broken)
            case _:
                pass

    def has(self, kind: Kind, motor: int | None = None) -> bool:
        """Whether it is broken so."""
        return (kind, motor) in self._faults

    @property
    def off(self) -> set[int | None]:
        """The motors whose drives have lost their power."""
        return {motor for kind, motor in self._faults if kind == "off"}

    def answers(self, motor: int, *, inputs: bool = False) -> bool:
        """Whether this drive answers this time; ``inputs``: when it is asked for the contacts."""
        if not self._faults:
            return True
        if self.has("silent", motor) or (inputs and self.has("inputs_silent")):
            return False
        rarely = self._faults.get(("intermittent", motor))
        return rarely is None or self._random.random() < (rarely.value or 0.0)

    def spoil(self, motor: int, answer: bytes) -> tuple[float, bytes]:
        """How many seconds late a drive's answer comes, and what has become of it."""
        if not self._faults:
            return 0.0, answer
        if self.has("garbage", motor):
            answer = self._random.randbytes(len(answer))
        if self.has("wrong_crc", motor):
            answer = answer[:-1] + bytes([answer[-1] ^ 0x55])
        if self.has("duplicate_id", motor):
            # Two senders pull the same line: what either of them makes 0, mostly ends as 0. One bit does so surely.
            other = bytearray(self._random.randbytes(len(answer)))
            other[next(n for n, byte in enumerate(answer) if byte)] = 0
            answer = bytes(a & b for a, b in zip(answer, other, strict=True))
        if noise := self._faults.get(("noise", None)):
            count = self._random.randint(1, _MOST_NOISE) if noise.value is None else int(noise.value)
            answer = self._random.randbytes(count) + answer
        late = self._faults.get(("delayed", motor))
        return (late.value or 0.0) / 1000 if late else 0.0, answer
