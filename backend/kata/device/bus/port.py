"""What the control loop wants of a bus, in degrees and newton metres, whatever the servos speak."""

from collections.abc import Sequence
from typing import Protocol

from msgspec import Struct


class BusError(Exception):
    """The bus or a drive on it cannot be used; the message says which and why. Absent replies are not errors."""


class DriveReading(Struct, frozen=True):
    """One drive's answer, with the time it came (``time.monotonic_ns``)."""

    t_ns: int
    position_deg: float
    speed_deg_s: float
    torque_nm: float


class InputReading(Struct, frozen=True):
    """The two contacts. ``estop_open``: the normally closed emergency stop is open, so pressed or its wire broken."""

    t_ns: int
    estop_open: bool
    pedal_down: bool | None
    """None: unknown."""


class DriveStatus(Struct, frozen=True):
    """What one drive (axis 0-4) says of itself. A driver may ask one of them a cycle, or all."""

    t_ns: int
    axis: int
    torque_on: bool
    hardware_error: int
    watchdog_tripped: bool


class Reading(Struct, frozen=True):
    """All that came back in one cycle; None where a reply stayed away."""

    drives: tuple[DriveReading | None, ...]
    inputs: InputReading | None
    statuses: tuple[DriveStatus, ...]
    garbled: frozenset[int] = frozenset()
    """Axes (0-4) from which something came that is no sound answer."""
    silent: frozenset[int] = frozenset()
    """Axes that were asked, and nothing came."""


class Bus(Protocol):
    """A driver. Every call returns within a limit worked out from bytes and baud rate, and retries nothing.

    What a driver has to do is written down as tests: `tests/device/bus/conformance.py`; docs/drivers.md says how to add one.
    """

    errors: int
    """Replies that stayed away or came damaged, since the start."""

    def open(self) -> None:
        """Open the port, switch torque off, set every drive up.

        :raises BusError: when the port cannot be opened or a drive does not answer.
        """

    def read(self) -> Reading:
        """Ask drives, their status, and the inputs last: what the emergency stop says is to be the youngest word.

        :raises BusError: when the port is gone.
        """

    def read_inputs(self) -> InputReading | None:
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
