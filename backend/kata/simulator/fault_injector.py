"""Simulates faults, which are set and cleared while the apparatus runs.

Some faults change the mechanics, a drive or a wire when they are set. The others change the drives' answers.
"""

import random
from collections.abc import Sequence
from typing import Final, Literal, Protocol, get_args

import msgspec

from kata.simulator.apparatus import SimulatedApparatus
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
    "hot",
    "supply_voltage",
]
FaultKind = (
    DriveKind
    | Literal["noise", "echo", "gone", "estop_wire_broken", "second_wire_broken", "contact_welded", "inputs_silent"]
)  # fmt: skip
_MAX_VALUE: Final = {
    "delayed": 10_000.0,
    "intermittent": 1.0,
    "hardware_error": 255.0,
    "noise": 256.0,
    "exchanged_id": 252.0,
    "exchanged_model": 65_535.0,
    "hot": 150.0,
    "supply_voltage": 40.0,
}
_NEEDS_VALUE: Final = frozenset({"delayed", "intermittent", "hardware_error", "exchanged_id", "hot", "supply_voltage"})
_OTHER_MODEL: Final = 1030.0
"""Default model of an exchanged drive: an XM430, which looks the same and has another torque constant."""
_MAX_NOISE_BYTES: Final = 8


class SimulatedFault(msgspec.Struct, frozen=True):
    """One fault.

    Faults of a drive, which need its ``motor`` (1-5): ``off`` (power is lost; it returns with torque off and RAM at its defaults),
    ``silent`` (the drive works but never answers), ``stuck`` (the shaft is jammed), ``frozen`` (the drive repeats its last measurement),
    ``garbage`` (its answers are random bytes), ``wrong_crc``, ``delayed`` (by ``value`` ms), ``intermittent`` (it answers with the
    probability ``value``), ``duplicate_id`` (a second drive answers at the same time), ``hardware_error`` (with the code ``value``),
    ``reboot`` (once: torque off, RAM at its defaults), ``exchanged`` (once: replaced by a drive with factory settings and the same id),
    ``exchanged_id`` (replaced by a drive with the id ``value`` until it is cleared), ``exchanged_model`` (replaced by a drive
    with the model
    number ``value`` until it is cleared), ``hot`` (``value`` in degrees Celsius), ``supply_voltage`` (``value`` in V).

    Faults of the bus: ``noise`` (``value`` bytes, or a few, before each answer), ``echo`` (the adapter returns the sent bytes), ``gone``
    (the adapter is unplugged). Faults of the inputs: ``estop_wire_broken`` (wire of the normally closed contact), ``second_wire_broken``
    (wire of the normally open contact), ``contact_welded`` (the normally closed contact stays closed), ``inputs_silent``.
    """

    kind: FaultKind
    motor: int | None = None
    value: float | None = None

    def __post_init__(self) -> None:
        """Check the fault.

        :raises ValueError: when motor or value do not fit the kind.
        """
        if self.kind in get_args(DriveKind):
            if self.motor not in range(1, 6):
                raise ValueError(f"{self.kind} is one drive's fault: a motor from 1 to 5")
        elif self.motor is not None:
            raise ValueError(f"{self.kind} is not one drive's fault")
        if self.kind in _NEEDS_VALUE and self.value is None:
            raise ValueError(f"{self.kind} needs a value")
        if self.value is not None and not 0.0 <= self.value <= _MAX_VALUE.get(self.kind, 0.0):
            raise ValueError(f"{self.kind} cannot have the value {self.value:g}")


class DriveRegisters(Protocol):
    """A drive's registers in any protocol, as faults and tests use them."""

    drive: Drive

    @property
    def environment(self) -> tuple[float, int]:
        """The supply's voltage in V, and the drive's temperature in degrees Celsius."""

    def expose(self, volt: float | None = None, temperature_c: int | None = None) -> None:
        """Change the supply's voltage and the drive's temperature."""

    def reboot(self) -> None:
        """Switch torque off and reset the drive to its power-up state."""

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Replace the drive with another drive that has factory settings."""

    def fail(self, code: int) -> None:
        """Set the hardware error; 0 means none."""

    def stored(self, address: int, size: int) -> bytes:
        """Return the contents of registers, without a request on the bus."""

    def store(self, address: int, data: bytes) -> None:
        """Change the contents of registers, without a request on the bus."""


class FaultInjector:
    """Holds the present faults. Random effects depend only on the apparatus' seed."""

    def __init__(self, apparatus: SimulatedApparatus, registers: Sequence[DriveRegisters]) -> None:
        """Start without faults. ``registers``: those of the drives, in motor order."""
        self._apparatus = apparatus
        self._registers = registers
        self._faults: dict[tuple[FaultKind, int | None], SimulatedFault] = {}
        self.times_gone = 0
        """How often the adapter was pulled out. A connection that was open then stays lost."""
        self._random = random.Random(apparatus.seed or 0)
        self._nominal = [register.environment for register in registers]
        """Voltage and temperature of each drive without a fault."""

    def fault(self, fault: SimulatedFault) -> None:
        """Set a fault. It replaces a fault of the same kind and motor."""
        self._faults[fault.kind, fault.motor] = fault
        self.times_gone += fault.kind == "gone"
        self._set_wire_fault(fault.kind, broken=True)
        if fault.motor is None:
            return
        registers = self._registers[fault.motor - 1]
        match fault.kind:
            case "off" | "reboot":
                registers.reboot()
            case "exchanged":
                registers.exchange(fault.motor)
            case "exchanged_id":
                registers.exchange(int(fault.value or 0))
            case "exchanged_model":
                registers.exchange(fault.motor, int(fault.value or _OTHER_MODEL))
            case "stuck":
                self._apparatus.jam(fault.motor, jammed=True)
            case "frozen":
                registers.drive.frozen = registers.drive.report
            case "hardware_error":
                registers.fail(int(fault.value or 0))
            case "hot":
                registers.expose(temperature_c=int(fault.value or 0))
            case "supply_voltage":
                registers.expose(volt=fault.value)
            case _:
                pass

    def clear(self) -> None:
        """Clear all faults. A drive without power gets power again."""
        for kind, motor in self._faults:
            self._set_wire_fault(kind, broken=False)
            if kind in ("exchanged_id", "exchanged_model") and motor is not None:
                self._registers[motor - 1].exchange(motor)
            elif kind == "off" and motor is not None:
                # The shaft may have been moved. After power-up the encoder knows its position only within one turn.
                self._registers[motor - 1].reboot()
            elif kind == "stuck" and motor is not None:
                self._apparatus.jam(motor, jammed=False)
            elif kind == "frozen" and motor is not None:
                self._registers[motor - 1].drive.frozen = None
            elif kind == "hardware_error" and motor is not None:
                self._registers[motor - 1].fail(0)
            elif kind in ("hot", "supply_voltage") and motor is not None:
                volt, temperature_c = self._nominal[motor - 1]
                self._registers[motor - 1].expose(volt=volt, temperature_c=temperature_c)
        self._faults.clear()

    def _set_wire_fault(self, kind: FaultKind, *, broken: bool) -> None:
        match kind:
            case "estop_wire_broken":
                self._apparatus.break_estop_wire(broken=broken)
            case "second_wire_broken":
                self._apparatus.break_second_wire(broken=broken)
            case "contact_welded":
                self._apparatus.weld_contact(welded=broken)
            case _:
                pass

    def has(self, kind: FaultKind, motor: int | None = None) -> bool:
        """Return True if this fault is set."""
        return (kind, motor) in self._faults

    @property
    def off(self) -> set[int | None]:
        """Motors whose drives have no power."""
        return {motor for kind, motor in self._faults if kind == "off"} if self._faults else set()

    @property
    def any(self) -> bool:
        """True if a fault is set."""
        return bool(self._faults)

    def answers(self, motor: int, *, inputs: bool = False) -> bool:
        """Return True if this drive answers now. ``inputs``: True if the request reads the contacts."""
        if not self._faults:
            return True
        if self.has("silent", motor) or (inputs and self.has("inputs_silent")):
            return False
        intermittent = self._faults.get(("intermittent", motor))
        return intermittent is None or self._random.random() < (intermittent.value or 0.0)

    def corrupt(self, motor: int, answer: bytes) -> tuple[float, bytes]:
        """Return the delay of a drive's answer, in seconds, and its changed bytes."""
        if not self._faults:
            return 0.0, answer
        if self.has("garbage", motor):
            answer = self._random.randbytes(len(answer))
        if self.has("wrong_crc", motor):
            answer = answer[:-1] + bytes([answer[-1] ^ 0x55])
        if self.has("duplicate_id", motor):
            # Two senders drive the same line, so a bit is 0 if either of them sends 0. At least one bit changes.
            other = bytearray(self._random.randbytes(len(answer)))
            other[next(n for n, byte in enumerate(answer) if byte)] = 0
            answer = bytes(a & b for a, b in zip(answer, other, strict=True))
        if noise := self._faults.get(("noise", None)):
            count = self._random.randint(1, _MAX_NOISE_BYTES) if noise.value is None else int(noise.value)
            answer = self._random.randbytes(count) + answer
        delayed = self._faults.get(("delayed", motor))
        return (delayed.value or 0.0) / 1000 if delayed else 0.0, answer
