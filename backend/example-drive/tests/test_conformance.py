"""The driver passes Kata's conformance suite."""

import struct

from kata.device.config import StationConfig
from kata.testing.conformance import Conformance
from kata_example_drive.simulated import example_drives


class TestExampleDrive(Conformance):
    """At the default rate of a station."""

    protocol = "example"
    make_drives = staticmethod(example_drives)
    arming_request = 3
    inputs_come_with_drive = True
    resolution_deg = 0.1

    def expected_registers(self, config: StationConfig, motor: int) -> dict[int, bytes]:
        """Return torque limit and marker."""
        return {2: struct.pack("<H", round(config.axes[motor - 1].max_torque_nm * 100)), 4: b"\1"}


class TestSlowExampleDrive(TestExampleDrive):
    """At 115,200 bit/s."""

    settings = {"baud": 115_200, "rate_hz": 20, "cycle_hz": 20}  # noqa: RUF012
