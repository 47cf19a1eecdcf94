"""An adapter may deliver every byte of an answer separately."""

import numpy as np
import pytest
from msgspec import structs

from kata.device.bus.factory import make_bus
from kata.device.config import simulated
from kata.testing.conformance import Conformance
from kata.testing.world import RecordingWorld


@pytest.mark.parametrize("protocol", ["dynamixel", "modbus"])
def test_drives_are_read_from_single_bytes(protocol: str) -> None:
    world = RecordingWorld.of(structs.replace(simulated("memory"), protocol=protocol), seed=1)
    world.byte_by_byte = True
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    world.place(1, 12.0)
    *_, sample = Conformance.cycles(world, bus, 100)
    assert sample.inputs is not None
    measured_deg = [drive.position_deg for drive in sample.drives]
    assert measured_deg[0] == pytest.approx(12.0, abs=0.1)
    assert np.isfinite(measured_deg).all()
    bus.write_setpoints(measured_deg)
    assert all(Conformance.cycles(world, bus, 1)[0].drives)
