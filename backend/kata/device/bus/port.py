"""What the control loop wants of a bus, in degrees and newton metres, whatever the servos speak."""

from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

from msgspec import Struct

from kata.device.config import Inputs


class BusError(Exception):
    """The bus or a drive on it cannot be used; the message says which and why. Absent replies are not errors."""


class DriveSample(Struct, frozen=True):
    """One drive's answer, with the time it came (``time.monotonic_ns``)."""

    t_ns: int
    position_deg: float
    speed_deg_s: float
    torque_nm: float
    alert: bool = False
    """The drive reports a hardware error with this very answer (Dynamixel: bit 0x80 of the error byte)."""


class InputSample(Struct, frozen=True):
    """The emergency stop's contacts and the pedal."""

    t_ns: int
    estop_open: bool
    """One contact says that the emergency stop is pressed, or that its wire is broken."""
    pedal_down: bool | None
    """None: unknown."""
    contacts_disagree: bool = False
    """The two antivalent contacts say the same. False where the station has one contact."""


def input_sample(t_ns: int, inputs: Inputs, closed: Mapping[int, bool]) -> InputSample:
    """Return what the contacts say. ``closed``: by port, whether the contact there is closed.

    Either contact of the emergency stop is enough to call it pressed. Antivalent contacts must differ.
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
    """What one drive (axis 0-4) says of itself. A driver may ask one of them a cycle, or all."""

    t_ns: int
    axis: int
    torque_on: bool
    hardware_error: int
    watchdog_tripped: bool
    verified: bool = True
    """Every configured register has been read since the drive was last configured or found, and has its value."""
    mismatch: str = ""
    """Name of a configured register that has another value; empty where there is none."""


class BusSample(Struct, frozen=True):
    """All that came back in one cycle; None where a reply stayed away."""

    drives: tuple[DriveSample | None, ...]
    inputs: InputSample | None
    statuses: tuple[DriveStatus, ...]
    corrupt: frozenset[int] = frozenset()
    """Axes (0-4) from which something came that is no sound answer."""
    timed_out: frozenset[int] = frozenset()
    """Axes that were asked, and nothing came."""


class Bus(Protocol):
    """A driver. Every call returns within a limit worked out from bytes and baud rate, and retries nothing.

    What a driver has to do is written down as tests: `tests/support/driver_conformance.py`; docs/how-to/write-a-driver.md says how to add one.
    """

    errors: int
    """Replies that stayed away or came damaged, since the start."""

    def open(self) -> None:
        """Open the port. Writes no register and changes no torque: a drive may hold an arm.

        :raises BusError: when the port cannot be opened.
        """

    def configure(self, axes: Collection[int]) -> None:
        """Write every configured register of these drives (axes 0-4) and read it back. Their torque must be off.

        Takes as long as its bytes do, up to some cycles; no cycle is due meanwhile.

        :raises BusError: naming the motor that does not answer, shares its id, is another model, or refuses a register.
        """

    def read(self) -> BusSample:
        """Ask drives, their status, and the inputs last: what the emergency stop says is to be the youngest word.

        :raises BusError: when the port is gone.
        """

    def read_inputs(self) -> InputSample | None:
        """Ask the inputs alone, between two cycles.

        :raises BusError: when the port is gone.
        """

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """Send five goal positions, degrees, axis order.

        :raises BusError: when the port is gone.
        """

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """Make the drives hold these five angles, then energise them.

        :raises BusError: when the port is gone.
        """

    def torque_off(self) -> None:
        """De-energise all drives at once.

        :raises BusError: when the port is gone.
        """

    def close(self) -> None:
        """Close the port; never raises."""
