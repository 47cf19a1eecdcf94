"""Provides the simulated apparatus with a stepped clock and a record of the values that its drives accepted."""

import math
from dataclasses import dataclass
from typing import Literal

import msgspec

from kata.device.config import Inputs, StationConfig, simulated
from kata.evaluation import world
from kata.motion.axes import N_AXES, Side
from kata.simulator.drives import MakeDrives
from kata.simulator.fault_injector import FaultKind, SimulatedFault
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.parameters import TURNED
from kata.simulator.plant import Plant
from kata.simulator.servos import ZERO_COUNT, Servo
from kata.testing.mounted_modbus import MountedModbusDrive, mounted_modbus_drives


@dataclass(frozen=True)
class Seen:
    """A value that a drive has accepted: a goal in degrees of motor angle, or torque 1 or 0."""

    t_ns: int
    motor: int
    what: Literal["goal", "torque"]
    value: float


class _LossyLine(world.MemoryLine):
    """A transport on which requests can be lost."""

    def __init__(self, lossy: "RecordingWorld", baud: int) -> None:
        super().__init__(lossy, baud)
        self._lossy = lossy

    def send(self, data: bytes) -> None:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        if not self._lossy.loses_this():
            super().send(data)


class RecordingWorld(world.World):
    """The simulated apparatus at the serial port, with a record of accepted values."""

    def __init__(
        self,
        protocol: str = "dynamixel",
        *,
        seed: int | None = None,
        make_drives: MakeDrives | None = None,
        make_mechanics: MakeMechanics = Plant,
        **settings: object,
    ) -> None:
        """Create the apparatus. ``make_drives``: makes drives of a protocol that the simulator does not have. ``make_mechanics``:
        makes the simulated mechanics. ``settings``: fields of the station's configuration.
        """
        # Use short time-outs. No kernel delays bytes here, and the long time-outs for a pseudo-terminal would hide silent drives.
        cycle_hz = settings.get("cycle_hz", 100)
        assert isinstance(cycle_hz, int)
        age_cycles = min(10, 3 * cycle_hz // 10)
        patience = {"silence_ms": 100, "inputs": Inputs(max_age_cycles=age_cycles, estop_second_port=3)}
        config = msgspec.structs.replace(simulated("memory"), protocol=protocol, **{**patience, **settings})
        self._begin(config, seed, make_drives, make_mechanics)

    @classmethod
    def of(cls, config: StationConfig, seed: int | None = None) -> "RecordingWorld":
        """Return an apparatus for a configuration: set up for its side, with encoders mounted as its zeros and directions say."""
        made = cls.__new__(cls)
        made._begin(config, seed, mounted_modbus_drives if config.protocol == "modbus" else None)
        for drive, axis in zip(made.drives, config.axes, strict=True):
            if isinstance(drive, Servo):
                zero = ZERO_COUNT if axis.zero_count is None else axis.zero_count
                drive.mount(axis.direction * zero, axis.direction)
            elif isinstance(drive, MountedModbusDrive):
                drive.mount(axis.zero_count or 0, axis.direction)
        made.turn(config.side)
        return made

    def _begin(
        self,
        config: StationConfig,
        seed: int | None,
        make_drives: MakeDrives | None = None,
        make_mechanics: MakeMechanics = Plant,
    ) -> None:
        super().__init__(config, seed, self._saw, make_drives=make_drives, make_mechanics=make_mechanics)
        for drive, axis in zip(self.drives, config.axes, strict=True):
            if isinstance(drive, Servo) and axis.zero_count is not None:
                drive.mount(axis.zero_count)
        self.seen: list[Seen] = []
        self._signs: tuple[int, ...] = (1,) * N_AXES
        """Signs from the angle of each shaft to the motor angle."""
        self._lost = [0, 0]
        """Number of requests that still pass, and number of lost requests after them."""

    def turn(self, side: Side) -> None:
        """Turn the apparatus for a shoulder, and change the configuration accordingly. No drive may have torque. The arm is at rest then."""
        self.config = msgspec.structs.replace(self.config, side=side)
        turned = side == "left"
        self.apparatus.turn(turned=turned)
        self._signs = TURNED if turned else (1,) * N_AXES

    def open_transport(self, port: str, baud: int) -> world.MemoryLine:
        """Open the port. Requests that :meth:`lose_requests` selects do not reach the drives."""
        super().open_transport(port, baud)
        self.opened = _LossyLine(self, baud)
        return self.opened

    def lose_requests(self, count: int, after: int) -> None:
        """Lose ``count`` requests after the next ``after`` requests, so that no drive receives them."""
        self._lost = [after, count]

    def loses_this(self) -> bool:
        """Return True if the request that is being sent is lost, and count it."""
        passing, losing = self._lost
        if passing:
            self._lost[0] -= 1
        elif losing:
            self._lost[1] -= 1
            return True
        return False

    def registers(self, motor: int, address: int, length: int) -> bytes:
        """Return the contents of a drive's registers: little-endian bytes (Dynamixel) or big-endian registers (Modbus)."""
        return self.drives[motor - 1].stored(address, length)

    def set_registers(self, motor: int, address: int, data: bytes) -> None:
        """Change a drive's registers without the driver."""
        self.drives[motor - 1].store(address, data)

    def place(self, motor: int, angle_deg: float) -> None:
        """Put a shaft and its arm at an angle, at rest and without torque, as if a hand had guided them."""
        self.apparatus.place(motor, math.radians(self._signs[motor - 1] * angle_deg))

    def speaks_untruth(self, motor: int) -> bool:
        """Return True if a fault prevents a drive from reporting its shaft's true angle."""
        return any(self.faults.has(kind, motor) for kind in ("off", "silent", "frozen", "garbage", "exchanged_id"))

    def fault(self, kind: FaultKind, motor: int | None = None, value: float | None = None) -> None:
        """Set a fault."""
        self.faults.fault(SimulatedFault(kind, motor, value))

    def goals(self, motor: int, since_ns: int = 0) -> list[float]:
        """Return the goals in degrees that a drive has accepted since ``since_ns``."""
        return [
            seen.value for seen in self.seen if seen.what == "goal" and seen.motor == motor and seen.t_ns > since_ns
        ]

    @property
    def torque(self) -> list[bool]:
        """Return the true torque state of each drive."""
        return [drive.torque_on for drive in self.apparatus.drives]

    @property
    def angles_deg(self) -> list[float]:
        """Return the true motor angle of each shaft."""
        return [
            sign * math.degrees(drive.angle) for sign, drive in zip(self._signs, self.apparatus.drives, strict=True)
        ]

    def _saw(self, t_ns: int, motor: int, what: Literal["goal", "torque"], value: float) -> None:
        motor_value = self._signs[motor - 1] * value if what == "goal" else value
        self.seen.append(Seen(t_ns, motor, what, motor_value))
