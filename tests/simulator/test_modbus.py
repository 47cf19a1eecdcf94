"""The simulated Modbus drives on the wire, with pymodbus at the other end."""

import struct
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import pytest
import serial
from fastcrc import crc16
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.client import ModbusSerialClient
from pymodbus.pdu import ModbusPDU

from kata.simulator import modbus
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.lines import ModbusLine
from kata.simulator.modbus import ModbusRequest
from kata.simulator.modbus_bus import SimulatedModbusBus
from kata.simulator.process import SimulatorProcess

TORQUE_ENABLE, CLEAR, WATCHDOG_MS, TORQUE_LIMIT, MIN_POSITION, MAX_POSITION, GOAL = 0, 1, 2, 3, 4, 6, 0x10
STATUS, ERROR, PRESENT = 0x20, 0x21, 0x22
BAUD = 1_000_000


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[SimulatorProcess]:
    with closing(SimulatorProcess(tmp_path, protocol="modbus")) as running:
        yield running


@pytest.fixture
def client(simulator: SimulatorProcess) -> Iterator[ModbusSerialClient]:
    with closing(ModbusSerialClient(simulator.port, baudrate=BAUD, timeout=0.3, retries=0)) as opened:
        assert opened.connect()
        yield opened


def long(value: int) -> list[int]:
    """Return a value as two registers."""
    return list(struct.unpack(">HH", struct.pack(">i", value)))


def signed(registers: Sequence[int]) -> int:
    (value,) = struct.unpack(">i", struct.pack(">HH", *registers))
    assert isinstance(value, int)
    return value


def refused(answer: ModbusPDU) -> int:
    assert answer.isError()
    code = answer.exception_code
    assert isinstance(code, int)
    return code


def position(client: ModbusSerialClient, motor: int) -> int:
    return signed(client.read_holding_registers(PRESENT, count=2, device_id=motor).registers)


def reach(client: ModbusSerialClient, goal: int) -> None:
    """Wait until motor 4 is within 0.2 deg of a goal in 0.01 deg, at most 10 s."""
    limit = time.monotonic() + 10
    while abs(position(client, 4) - goal) > 20:
        assert time.monotonic() < limit, f"motor 4 is at {position(client, 4)}"


def test_registers_keep_their_values(client: ModbusSerialClient) -> None:
    assert client.read_holding_registers(TORQUE_ENABLE, count=9, device_id=3).registers == [
        *(0, 0, 0, 1000),
        *long(-180_000),
        *long(180_000),
        500,
    ]
    assert not client.write_register(TORQUE_LIMIT, 400, device_id=3).isError()
    assert not client.write_registers(MIN_POSITION, [*long(-1000), *long(12_500)], device_id=3).isError()
    assert client.read_holding_registers(TORQUE_LIMIT, count=5, device_id=3).registers == [
        *(400, *long(-1000)),
        *long(12_500),
    ]
    assert client.read_holding_registers(TORQUE_LIMIT, count=1, device_id=4).registers == [1000]


def test_one_request_writes_and_reads(client: ModbusSerialClient) -> None:
    answer = client.readwrite_registers(
        read_address=STATUS, read_count=6, write_address=GOAL, values=long(-4200), device_id=2
    )
    assert answer.registers[:4] == [0, 0, *long(10_890)]
    assert signed(client.read_holding_registers(GOAL, count=2, device_id=2).registers) == -4200


def test_drive_refuses_unsupported_requests(client: ModbusSerialClient) -> None:
    assert refused(client.read_input_registers(0, count=1, device_id=1)) == modbus.ILLEGAL_FUNCTION
    assert refused(client.read_holding_registers(11, count=2, device_id=1)) == modbus.ILLEGAL_ADDRESS
    assert refused(client.write_register(STATUS, 0, device_id=1)) == modbus.ILLEGAL_ADDRESS
    assert refused(client.write_register(GOAL, 0, device_id=1)) == modbus.ILLEGAL_ADDRESS  # Half of a frame.
    assert refused(client.read_discrete_inputs(2, count=2, device_id=1)) == modbus.ILLEGAL_ADDRESS
    assert refused(client.read_discrete_inputs(0, count=2, device_id=2)) == modbus.ILLEGAL_ADDRESS
    assert refused(client.write_register(TORQUE_ENABLE, 2, device_id=1)) == modbus.ILLEGAL_VALUE
    assert refused(client.write_register(TORQUE_LIMIT, 1001, device_id=1)) == modbus.ILLEGAL_VALUE
    client.write_registers(MAX_POSITION, long(9000), device_id=1)
    assert refused(client.write_registers(GOAL, long(9001), device_id=1)) == modbus.ILLEGAL_VALUE
    assert not client.write_registers(GOAL, long(9000), device_id=1).isError()


def test_drive_turns_to_the_goal_given_before_torque(client: ModbusSerialClient) -> None:
    """Unlike the X series, which holds its position when torque comes on."""
    start = position(client, 4)
    for goal in (start + 4000, start + 2000):
        client.write_register(TORQUE_ENABLE, 0, device_id=4)
        client.write_registers(GOAL, long(goal), device_id=4)
        client.write_register(TORQUE_ENABLE, 1, device_id=4)
        assert signed(client.read_holding_registers(GOAL, count=2, device_id=4).registers) == goal
        assert client.read_holding_registers(STATUS, count=1, device_id=4).registers == [1]
        reach(client, goal)


def test_drive_with_torque_moves_to_goals(client: ModbusSerialClient) -> None:
    start = position(client, 4)
    client.write_registers(GOAL, long(start), device_id=4)
    client.write_register(TORQUE_ENABLE, 1, device_id=4)
    client.write_registers(GOAL, long(start + 2000), device_id=4)
    reach(client, start + 2000)


def test_silence_trips_the_watchdog_until_it_is_cleared(client: ModbusSerialClient) -> None:
    client.write_register(TORQUE_ENABLE, 1, device_id=2)
    client.write_register(WATCHDOG_MS, 27, device_id=2)
    assert client.read_holding_registers(WATCHDOG_MS, count=1, device_id=2).registers == [20]
    time.sleep(0.1)
    assert client.read_holding_registers(STATUS, count=1, device_id=2).registers == [0b11]
    client.write_register(WATCHDOG_MS, 2000, device_id=2)
    here = long(position(client, 2))
    assert refused(client.write_registers(GOAL, here, device_id=2)) == modbus.DEVICE_FAILURE
    client.write_register(CLEAR, 1, device_id=2)
    assert client.read_holding_registers(CLEAR, count=1, device_id=2).registers == [0]
    assert client.read_holding_registers(STATUS, count=1, device_id=2).registers == [0b01]
    assert not client.write_registers(GOAL, here, device_id=2).isError()


def test_inputs_are_closed_contacts(simulator: SimulatorProcess, client: ModbusSerialClient) -> None:
    with closing(simulator.client()) as hand:
        assert client.read_discrete_inputs(0, count=2, device_id=1).bits[:2] == [True, False]
        hand.estop(pressed=True)
        hand.pedal(down=True)
        assert client.read_discrete_inputs(0, count=2, device_id=1).bits[:2] == [False, True]
        hand.estop(pressed=False)
        hand.fault("estop_wire_broken")
        assert client.read_discrete_inputs(0, count=1, device_id=1).bits[0] is False


def test_a_broadcast_acts_everywhere_and_is_not_answered(simulator: SimulatorProcess) -> None:
    # Written directly: pymodbus does not wait for the silence after a broadcast, which has no answer.
    with closing(serial.Serial(simulator.port, BAUD, timeout=0.1)) as line, closing(simulator.client()) as hand:
        line.write(modbus.frame(0, 6, bytes([0, TORQUE_ENABLE, 0, 1])))
        assert line.read(1) == b""
        assert all(axis.torque_on for axis in hand.state().axes)


def test_only_a_sound_frame_between_silences_is_heard(simulator: SimulatorProcess) -> None:
    ask = modbus.frame(1, 3, bytes([0, STATUS, 0, 1]))
    with closing(serial.Serial(simulator.port, BAUD, timeout=0.1)) as line:
        for unheard in (ask[:-1], ask[:-1] + bytes([ask[-1] ^ 1]), ask + ask, b"\x01", b"\0" * 300):
            line.write(unheard)
            assert line.read(1) == b""
        line.write(ask)
        assert line.read(7) == modbus.frame(1, 3, bytes([2, 0, 0]))
        assert line.read(1) == b""


def test_drives_listen_at_the_changed_baud_rate(tmp_path: Path) -> None:
    ask = modbus.frame(1, 3, bytes([0, STATUS, 0, 6]))
    with closing(SimulatorProcess(tmp_path, protocol="modbus", baud=19_200)) as running:
        with closing(serial.Serial(running.port, BAUD, timeout=0.1)) as line:
            line.write(ask)
            assert line.read(1) == b""
        with closing(serial.Serial(running.port, 19_200, timeout=1.0)) as line:
            began = time.monotonic()
            line.write(ask)
            assert len(line.read(17)) == 17
            assert time.monotonic() - began >= (8 + 17) * 10 / 19_200 + 3.5 * 11 / 19_200 + 500e-6


@pytest.mark.parametrize(
    ("frame", "known"),
    [
        (modbus.frame(0x11, 3, bytes.fromhex("006b0003")), "11 03 00 6b 00 03 76 87"),
        (modbus.frame(1, 4, bytes.fromhex("02ffff")), "01 04 02 ff ff b8 80"),
    ],
)
def test_checksum_matches_the_published_one(frame: bytes, known: str) -> None:
    assert frame.hex(" ") == known


def bus() -> SimulatedModbusBus:
    return SimulatedModbusBus(SimulatedApparatus(0, now_ns=0))


@given(st.binary(max_size=300), st.booleans())
def test_no_bytes_upset_a_drive(noise: bytes, sound: bool) -> None:
    heard = noise + crc16.modbus(noise).to_bytes(2, "little") if sound else noise
    request = modbus.parse(heard)
    if request is None:
        return
    assert crc16.modbus(heard) == 0
    for answer in bus().execute(request, BAUD, 0):
        assert modbus.parse(answer.data)


functions = st.sampled_from([2, 3, 6, 0x10, 0x17]) | st.integers(0, 255)
blocks = st.builds(
    lambda at, words: struct.pack(">HHB", at, len(words), 2 * len(words)) + struct.pack(f">{len(words)}H", *words),
    st.integers(0, 0x30),
    st.lists(st.integers(0, 0xFFFF), max_size=12),
)
parts = st.builds(lambda at, count: struct.pack(">HH", at, count), st.integers(0, 0x30), st.integers(0, 8))


@given(st.lists(st.tuples(st.integers(0, 6), functions, st.binary(max_size=20) | blocks | parts | st.tuples(parts, blocks).map(b"".join)), max_size=8))  # fmt: skip
def test_no_sound_request_upsets_a_drive(requests: list[tuple[int, int, bytes]]) -> None:
    drives = bus()
    now_ns = 0
    for slave, function, data in requests:
        now_ns += 3_000_000
        for answer in drives.execute(ModbusRequest(slave, function, data), BAUD, now_ns):
            answers = modbus.parse(answer.data)
            assert answers and answers.slave == slave and answers.function in (function, function | 0x80)
            if answers.function & 0x80 and not function & 0x80:
                assert answers.data[0] in (1, 2, 3, 4)


@given(st.binary(max_size=40), st.data())
def test_frame_received_in_pieces_without_a_pause_is_one_frame(noise: bytes, data: st.DataObject) -> None:
    ask = modbus.frame(1, 3, bytes([0, STATUS, 0, 6]))
    line = ModbusLine(bus())
    line.receive(noise, 0, BAUD)
    after_noise = line.due_ns or 0
    assert list(line.execute(after_noise)) == [] or modbus.parse(noise)
    cut = data.draw(st.integers(1, len(ask) - 1))
    line.receive(ask[:cut], after_noise, BAUD)
    line.receive(ask[cut:], after_noise + 20_000, BAUD)
    assert line.due_ns is not None
    assert list(line.execute(line.due_ns - 1)) == []
    ((at_ns, answer),) = line.execute(line.due_ns)
    assert at_ns - after_noise >= 8 * 10_000 + 38_500
    assert len(answer.data) == 17
