"""A register that weakens or delays a drive is noticed as a reset is. Another program may have left it so."""

import struct
from pathlib import Path
from typing import Final

import pytest
from msgspec import structs

from kata.device.config import Inputs, simulated
from tests.support.simulated_loop import SimulatedLoop

_MOTOR: Final = 4
_REGISTERS: Final = {
    "current limit": (38, struct.pack("<H", 100)),
    "PWM limit": (36, struct.pack("<H", 100)),
    "goal PWM": (100, struct.pack("<H", 100)),
    "profile acceleration": (108, struct.pack("<I", 1)),
    "profile velocity": (112, struct.pack("<I", 10)),
}
"""Address and value (XM540 e-manual): 0.27 A, twice 11 % of the voltage, 21 deg/s2, and 14 deg/s."""


@pytest.mark.parametrize("name", _REGISTERS)
def test_register_that_weakens_or_delays_a_drive_is_a_fault(tmp_path: Path, name: str) -> None:
    inputs = Inputs(estop_second_port=3, max_age_cycles=10)
    station = SimulatedLoop(tmp_path, structs.replace(simulated("memory"), silence_ms=100, inputs=inputs))
    address, data = _REGISTERS[name]
    station.world.set_registers(_MOTOR, address, data)
    station.run(2.2)
    assert "drive_reset" in station.causes()
