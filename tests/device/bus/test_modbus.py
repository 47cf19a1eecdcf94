"""The Modbus RTU driver: conformance and its protocol."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.modbus.frames import encode, find_answer
from kata.device.config import ModbusMap, StationConfig
from kata.testing.conformance import Conformance
from tests.support.drive_registers import Registers, expected_registers


class ModbusConformance(Conformance):
    """What all configurations of the driver have in common."""

    protocol = "modbus"
    arming_request = 7
    resolution_deg = 0.1

    def expected_registers(self, config: StationConfig, motor: int) -> Registers:
        return expected_registers(config, motor)


class TestModbus(ModbusConformance):
    """With function 23."""


class TestModbusWithoutFunction23(ModbusConformance):
    """Drives that need separate reads and writes."""

    settings = {"modbus": ModbusMap(function_23=False)}  # noqa: RUF012


class TestModbusWithHealth(ModbusConformance):
    """Drives whose voltage and temperature the map names."""

    reports_health = True
    settings = {  # noqa: RUF012
        "modbus": ModbusMap(supply_voltage=0x26, temperature=0x27, voltage_limits=0x09, temperature_limit=0x0B)
    }


# In every run, test_drives_are_read_from_single_bytes reads the same answers.
@pytest.mark.campaign
class TestModbusInPieces(ModbusConformance):
    """Behind an adapter that delivers every byte separately."""

    byte_by_byte = True


@pytest.mark.campaign
class TestSlowModbus(ModbusConformance):
    """At 115,200 bit/s."""

    settings = {"baud": 115_200, "rate_hz": 20, "cycle_hz": 20}  # noqa: RUF012


def test_the_checksum_is_the_specifications_example() -> None:
    assert encode(0x02, 0x07, b"") == bytes.fromhex("02 07 41 12")


@given(st.binary(max_size=60), st.integers(0, 255), st.sampled_from([0x02, 0x03, 0x10, 0x17]), st.integers(5, 40))
def test_random_bytes_raise_nothing_and_are_rejected(received: bytes, slave: int, function: int, size: int) -> None:
    found = find_answer(received, slave, function, size)
    assert found is None or any(
        received[n : n + len(found) + 3] == encode(slave, found[0], found[1:]) for n in range(len(received))
    )


@given(st.binary(min_size=12, max_size=12), st.binary(max_size=10), st.data())
def test_answer_with_one_wrong_byte_is_never_accepted(block: bytes, noise: bytes, data: st.DataObject) -> None:
    frame = bytearray(encode(3, 0x03, b"\x0c" + block))
    assert find_answer(noise + bytes(frame), 3, 0x03, 17) is not None
    frame[data.draw(st.integers(0, 16))] ^= data.draw(st.integers(1, 255))
    assert find_answer(bytes(frame), 3, 0x03, 17) is None


def test_an_exception_is_an_answer() -> None:
    assert find_answer(encode(2, 0x90, b"\x02"), 2, 0x10, 8) == b"\x90\x02"


def test_echo_of_the_request_is_rejected() -> None:
    request = encode(1, 0x10, struct.pack(">HHB", 0x10, 2, 4) + b"\0\0\0\0")
    answer = encode(1, 0x10, struct.pack(">HH", 0x10, 2))
    assert find_answer(request + answer, 1, 0x10, 8) == answer[1:-2]
