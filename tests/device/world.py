"""The simulated apparatus under a stepped clock, and what its drives have accepted, which is what tests judge by."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from kata.device.config import Inputs, simulated
from kata.evaluate import world
from kata.simulator.script import Fault, Kind


@dataclass(frozen=True)
class Seen:
    """What a drive has accepted: a goal in degrees, or torque 1 or 0."""

    t_ns: int
    motor: int
    what: Literal["goal", "torque"]
    value: float


class World(world.World):
    """Everything beyond the serial port, and everything seen there."""

    def __init__(
        self,
        protocol: Literal["dynamixel", "modbus"] = "dynamixel",
        *,
        seed: int | None = None,
        **settings: object,
    ) -> None:
        # No kernel stands between, and the patience that a pseudo-terminal needs would hide what is silent.
        patience = {"silence_ms": 100, "inputs": Inputs(max_age_cycles=10)}
        config = msgspec.structs.replace(simulated("memory"), protocol=protocol, **{**patience, **settings})
        super().__init__(config, seed, self._saw)
        self.seen: list[Seen] = []

    def fault(self, kind: Kind, motor: int | None = None, value: float | None = None) -> None:
        """Break something."""
        self.script.fault(Fault(kind, motor, value))

    def goals(self, motor: int, since_ns: int = 0) -> list[float]:
        """Goals that a drive has accepted, degrees."""
        return [
            seen.value for seen in self.seen if seen.what == "goal" and seen.motor == motor and seen.t_ns > since_ns
        ]

    @property
    def torque(self) -> list[bool]:
        """Of each drive, as it really is."""
        return [drive.torque_on for drive in self.apparatus.drives]

    @property
    def angles_deg(self) -> list[float]:
        """Of each shaft, as it really is."""
        return [axis.angle_deg for axis in self.apparatus.state().axes]

    def _saw(self, t_ns: int, motor: int, what: Literal["goal", "torque"], value: float) -> None:
        self.seen.append(Seen(t_ns, motor, what, value))
