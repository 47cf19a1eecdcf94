"""Defines the interface of a bus and its data types: degrees and newton metres for every servo protocol."""

from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

from msgspec import Struct

from kata.device.config import Inputs


class BusError(Exception):
    """The bus or a drive cannot be used; the message says which and why. A missing answer is not an error."""


class OtherAdapterError(BusError):
    """The port belongs to another adapter than before, and so perhaps to another apparatus."""


class DriveSample(Struct, frozen=True):
    """One drive's answer with its arrival time (``time.monotonic_ns``)."""

    t_ns: int
    position_deg: float
    speed_deg_s: float
    torque_nm: float
    alert: bool = False
    """The drive reports a hardware error in this answer (Dynamixel: bit 0x80 of the error byte)."""


class InputSample(Struct, frozen=True):
    """The contacts of the emergency stop and the pedal."""

    t_ns: int
    estop_open: bool
    """True if a contact reports the emergency stop as pressed or a broken wire."""
    pedal_down: bool | None
    """None if unknown."""
    contacts_disagree: bool = False
    """True if the two antivalent contacts report the same state. Always False on a station with one contact."""


def input_sample(t_ns: int, inputs: Inputs, closed: Mapping[int, bool]) -> InputSample:
    """Return the input sample. ``closed``: True for each port whose contact is closed.

    The emergency stop counts as pressed if either contact says so. Antivalent contacts must differ.
    """
    first_closed = closed[inputs.estop_port]
    second_closed = None if inputs.estop_second_port is None else closed[inputs.estop_second_port]
    return InputSample(
        t_ns=t_ns,
        estop_open=not first_closed or second_closed is True,
        pedal_down=closed[inputs.pedal_port],
        contacts_disagree=second_closed is not None and first_closed == second_closed,
    )


class DriveStatus(Struct, frozen=True):
    """The status of one drive (axis 0-4). A driver may read one drive each cycle, or all."""

    t_ns: int
    axis: int
    torque_on: bool
    hardware_error: int
    watchdog_tripped: bool
    verified: bool = True
    """True if every configured register was read with its configured value since the drive was last configured or found."""
    mismatch: str = ""
    """Name of a configured register with another value; empty if there is none."""


class DriveHealth(Struct, frozen=True):
    """Supply voltage and temperature of one drive (axis 0-4), and the limits in its registers. None if unknown or not reported
    by the drive.
    """

    t_ns: int
    axis: int
    voltage_v: float | None = None
    temperature_c: float | None = None
    min_voltage_v: float | None = None
    max_voltage_v: float | None = None
    max_temperature_c: float | None = None


class BusSample(Struct, frozen=True):
    """All answers of one cycle. A missing answer is None."""

    drives: tuple[DriveSample | None, ...]
    inputs: InputSample | None
    statuses: tuple[DriveStatus, ...]
    corrupt: frozenset[int] = frozenset()
    """Axes (0-4) from which bytes arrived that are not a valid answer."""
    timed_out: frozenset[int] = frozenset()
    """Axes (0-4) that were polled and sent nothing."""
    health: tuple[DriveHealth, ...] = ()
    """Health of the drives whose voltage and temperature came with this cycle's answers. Each drive's health comes at least
    once a second. The driver sends no separate request for them.
    """


class Bus(Protocol):
    """A driver. Every call returns within a time that is determined by the number of bytes and the baud rate. No call retries.

    The conformance tests in `kata.testing.conformance` define the requirements. docs/how-to/write-a-driver.md explains how to add
    a driver.
    """

    errors: int
    """Missing and damaged answers since the start."""

    def open(self) -> None:
        """Open the port. Write no register and change no torque, because a drive may be holding an arm.

        :raises BusError: when the port cannot be opened.
        """

    def configure(self, axes: Collection[int]) -> None:
        """Write every configured register of these drives (axes 0-4) and read it back. Their torque must be off.

        The call takes the transmission time, which may be several cycles. The loop runs no cycle during the call.

        :raises BusError: naming the motor that does not answer, shares its id, is another model, or refuses a register.
        """

    def read(self) -> BusSample:
        """Read the drives, their status and the inputs. A silent drive must not suppress the inputs of another drive.

        :raises BusError: when the port is gone.
        """

    def read_inputs(self) -> InputSample | None:
        """Read the inputs alone, between two cycles.

        :raises BusError: when the port is gone.
        """

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """Send five goal positions, degrees, axis order.

        :raises BusError: when the port is gone.
        """

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """Set these five angles as goals, then switch the torque on.

        :raises BusError: when the port is gone.
        """

    def torque_off(self) -> None:
        """Switch off the torque of all drives at once.

        :raises BusError: when the port is gone.
        """

    def close(self) -> None:
        """Close the port; never raises."""
