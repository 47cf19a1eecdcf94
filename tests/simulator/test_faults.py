"""Faults are visible on the bus, and gone after they are cleared."""

import struct
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import serial
from dynamixel_sdk import (
    COMM_RX_CORRUPT,
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    PacketHandler,
)
from fastcrc import crc16
from hypothesis import given
from hypothesis import strategies as st

from kata.simulator import modbus, protocol
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.bus_answer import BusAnswer
from kata.simulator.client import SimulatorClient
from kata.simulator.drive import DriveEvent
from kata.simulator.fault_injector import FaultKind, SimulatedFault
from kata.simulator.modbus import ModbusRequest
from kata.simulator.modbus_bus import SimulatedModbusBus
from kata.simulator.process import SimulatorProcess
from kata.simulator.protocol import Instruction, InstructionParser
from tests.support.sdk_port import open_port

TORQUE_ENABLE, HARDWARE_ERROR, P_GAIN, GOAL_POSITION, PRESENT_POSITION = 64, 70, 84, 116, 132
BAUD = 1_000_000
packets = PacketHandler(2.0)


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[SimulatorProcess]:
    with closing(SimulatorProcess(tmp_path)) as running:
        yield running


@pytest.fixture
def hand(simulator: SimulatorProcess) -> Iterator[SimulatorClient]:
    with closing(simulator.client()) as client:
        yield client


@pytest.fixture
def port(simulator: SimulatorProcess) -> Iterator[Any]:
    with open_port(simulator.port, BAUD) as opened:
        yield opened


def comes(port: Any, drive_id: int = 3) -> int:
    """Return the result of reading a position with the maker's library."""
    result: int = packets.read4ByteTxRx(port, drive_id, PRESENT_POSITION)[1]
    return result


def test_drive_without_power_is_absent_and_returns_without_torque(port: Any, hand: SimulatorClient) -> None:
    packets.write2ByteTxRx(port, 3, P_GAIN, 1600)
    packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1)
    state = hand.fault("off", motor=3)
    assert not state.axes[2].torque_on
    assert state.events[-1].what == "torque_off"
    assert comes(port) == COMM_RX_TIMEOUT
    packets.write1ByteTxOnly(port, 3, TORQUE_ENABLE, 1)
    assert comes(port, 4) == COMM_SUCCESS
    hand.clear_faults()
    assert packets.read1ByteTxRx(port, 3, TORQUE_ENABLE)[:2] == (0, COMM_SUCCESS)
    assert packets.read2ByteTxRx(port, 3, P_GAIN)[0] == 800


def test_silent_drive_still_executes_commands(port: Any, hand: SimulatorClient) -> None:
    hand.fault("silent", motor=3)
    assert packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1)[0] == COMM_RX_TIMEOUT
    assert hand.state().axes[2].torque_on
    hand.clear_faults()
    assert comes(port) == COMM_SUCCESS


def test_corrupt_answer_is_rejected(port: Any, hand: SimulatorClient) -> None:
    kinds: tuple[FaultKind, ...] = ("garbage", "wrong_crc", "duplicate_id")
    for kind in kinds:
        hand.fault(kind, motor=3)
        assert comes(port) in (COMM_RX_CORRUPT, COMM_RX_TIMEOUT), kind
        assert comes(port, 4) == COMM_SUCCESS, kind
        hand.clear_faults()
        assert comes(port) == COMM_SUCCESS, kind


def test_an_answer_may_be_late(simulator: SimulatorProcess, hand: SimulatorClient) -> None:
    ask = instruction(3, protocol.PING)
    with closing(serial.Serial(simulator.port, BAUD, timeout=1.0)) as line:
        hand.fault("delayed", motor=3, value=60.0)
        began = time.monotonic()
        line.write(ask)
        assert len(line.read(14)) == 14
        assert time.monotonic() - began >= 0.06


def test_some_answers_are_missing(port: Any, hand: SimulatorClient) -> None:
    hand.fault("intermittent", motor=3, value=0.5)
    seen: set[int] = set()
    for _ in range(20):
        seen.add(comes(port))
        if len(seen) == 2:
            break
    assert seen == {COMM_SUCCESS, COMM_RX_TIMEOUT}


def test_hardware_error_cuts_torque_until_the_drive_restarts(port: Any, hand: SimulatorClient) -> None:
    packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1)
    assert not hand.fault("hardware_error", motor=3, value=32).axes[2].torque_on  # Overload.
    assert packets.read1ByteTxRx(port, 3, HARDWARE_ERROR) == (32, COMM_SUCCESS, protocol.ALERT)
    packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1)
    assert packets.read1ByteTxRx(port, 3, TORQUE_ENABLE) == (0, COMM_SUCCESS, protocol.ALERT)
    packets.reboot(port, 3)
    assert packets.ping(port, 3)[1] == COMM_RX_TIMEOUT
    while packets.ping(port, 3)[1] != COMM_SUCCESS:
        pass
    assert packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1) == (COMM_SUCCESS, 0)


def test_an_input_voltage_error_only_alerts(port: Any, hand: SimulatorClient) -> None:
    packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1)
    assert hand.fault("hardware_error", motor=3, value=1).axes[2].torque_on
    hand.clear_faults()
    assert packets.read1ByteTxRx(port, 3, HARDWARE_ERROR) == (0, COMM_SUCCESS, 0)


def test_inputs_alone_may_be_missing(port: Any, hand: SimulatorClient) -> None:
    hand.fault("inputs_silent")
    assert packets.read2ByteTxRx(port, 1, 152)[1] == COMM_RX_TIMEOUT
    assert comes(port, 1) == COMM_SUCCESS
    hand.clear_faults()
    assert packets.read2ByteTxRx(port, 1, 152)[1] == COMM_SUCCESS


def test_a_broken_wire_looks_like_a_pressed_switch(port: Any, hand: SimulatorClient) -> None:
    packets.write1ByteTxRx(port, 1, 56, 2)
    assert packets.read2ByteTxRx(port, 1, 152)[0] == 0
    assert not hand.fault("estop_wire_broken").estop_pressed
    assert packets.read2ByteTxRx(port, 1, 152)[0] == 1
    hand.clear_faults()
    assert packets.read2ByteTxRx(port, 1, 152)[0] == 0


def test_noise_and_echo_come_before_the_answer(simulator: SimulatorProcess, hand: SimulatorClient) -> None:
    ask = instruction(3, protocol.PING)
    with closing(serial.Serial(simulator.port, BAUD, timeout=0.1)) as line:
        line.write(ask)
        answer = line.read(100)
        hand.fault("noise", value=7)
        line.write(ask)
        noisy = line.read(100)
        assert len(noisy) == 7 + len(answer) and noisy.endswith(answer)
        hand.clear_faults()
        hand.fault("echo")
        line.write(ask)
        assert line.read(100) == ask + answer


def test_a_pulled_adapter_comes_back_under_the_same_path(simulator: SimulatorProcess, hand: SimulatorClient) -> None:
    ask = instruction(3, protocol.PING)
    with closing(serial.Serial(simulator.port, BAUD, timeout=0.1)) as line:
        hand.fault("gone")
        until(lambda: not Path(simulator.port).exists())
        with pytest.raises(OSError):  # noqa: PT011 - pyserial's own error is one, and so is the system's
            ask_and_read(line, ask)
    hand.clear_faults()
    until(Path(simulator.port).exists)
    with closing(serial.Serial(simulator.port, BAUD, timeout=0.1)) as line:
        assert len(ask_and_read(line, ask)) == 14


def ask_and_read(line: serial.Serial, ask: bytes) -> bytes:
    line.write(ask)
    return bytes(line.read(14))


def until(condition: Any) -> None:
    limit = time.monotonic() + 5
    while not condition():
        assert time.monotonic() < limit


def instruction(drive_id: int, code: int) -> bytes:
    packet = protocol.HEADER + bytes([drive_id, 3, 0, code])
    return packet + crc16.umts(packet).to_bytes(2, "little")


# -- without a wire, with a stepped clock ---------------------------------------------------------------------------


class World:
    """Five servos with a clock that the test advances."""

    def __init__(self, seed: int = 1) -> None:
        self.now_ns = 0
        self.noticed: list[tuple[int, int, DriveEvent, float]] = []
        self.apparatus = SimulatedApparatus(seed, now_ns=0, on_drive_event=lambda *event: self.noticed.append(event))
        self.bus = ServoBus(self.apparatus)

    def tell(self, drive_id: int, code: int, parameters: bytes = b"") -> list[BusAnswer]:
        return self.bus.execute(Instruction(drive_id, code, parameters, 0, valid=True), BAUD, self.now_ns)

    def write(self, drive_id: int, address: int, data: bytes) -> list[BusAnswer]:
        return self.tell(drive_id, protocol.WRITE, struct.pack("<H", address) + data)

    def position(self, drive_id: int) -> int:
        (answer,) = self.tell(drive_id, protocol.READ, struct.pack("<HH", PRESENT_POSITION, 4))
        return int.from_bytes(answer.data[9:13], "little", signed=True)

    def forward(self, seconds: float) -> None:
        self.now_ns += round(seconds * 1e9)
        self.apparatus.advance(self.now_ns)

    def energise(self, drive_id: int) -> None:
        self.write(drive_id, 80, struct.pack("<HHH", 60, 400, 1600))
        self.write(drive_id, TORQUE_ENABLE, b"\1")


def test_stuck_shaft_stays_although_pulled() -> None:
    world = World()
    world.energise(4)
    start = world.position(4)
    world.bus.faults.fault(SimulatedFault("stuck", 4))
    world.write(4, GOAL_POSITION, struct.pack("<i", start + 400))
    world.forward(2.0)
    axis = world.apparatus.state().axes[3]
    assert world.position(4) == start
    assert axis.torque_nm > 5.0
    world.bus.faults.clear()
    world.forward(2.0)
    assert abs(world.position(4) - start - 400) < 5


def test_frozen_drive_repeats_itself_and_moves_on() -> None:
    world = World()
    world.energise(4)
    start = world.position(4)
    world.bus.faults.fault(SimulatedFault("frozen", 4))
    world.write(4, GOAL_POSITION, struct.pack("<i", start + 400))
    world.forward(2.0)
    assert world.position(4) == start
    assert world.apparatus.state().axes[3].angle_deg > 30.0
    world.bus.faults.clear()
    assert abs(world.position(4) - start - 400) < 5


def test_simulation_time_follows_the_caller_even_after_long_gaps() -> None:
    world = World()
    world.energise(4)
    world.write(4, GOAL_POSITION, struct.pack("<i", 2048 + 1024))
    world.forward(20.0)  # In one step: with a real clock most of it would be skipped.
    assert world.apparatus.state().axes[3].angle_deg == pytest.approx(90.0, abs=0.5)
    world.apparatus.press_estop(pressed=True)
    world.apparatus.step_on_pedal(down=True)
    assert [(event.what, event.t_ns) for event in world.apparatus.state().events[-2:]] == [
        ("estop_pressed", 20_000_000_000),
        ("pedal_down", 20_000_000_000),
    ]


def test_goals_and_torque_are_reported_with_their_time() -> None:
    world = World()
    world.now_ns = 1_234_567
    world.write(4, GOAL_POSITION, struct.pack("<i", 2048 + 512))
    world.write(4, TORQUE_ENABLE, b"\1")
    world.now_ns = 2_000_001
    world.write(4, GOAL_POSITION, struct.pack("<i", 9999))  # Beyond its limits, so it is refused and not reported.
    world.bus.faults.fault(SimulatedFault("off", 4))
    assert world.noticed == [
        (1_234_567, 4, "goal", 45.0),
        (1_234_567, 4, "torque", 1.0),
        (2_000_001, 4, "torque", 0.0),
    ]


def test_modbus_drives_report_goals_and_torque_too() -> None:
    noticed: list[tuple[int, int, DriveEvent, float]] = []
    bus = SimulatedModbusBus(SimulatedApparatus(1, now_ns=0, on_drive_event=lambda *event: noticed.append(event)))
    bus.execute(ModbusRequest(4, 0x10, struct.pack(">HHBi", 0x10, 2, 4, 4500)), BAUD, 7_000_000)
    bus.execute(ModbusRequest(0, 6, struct.pack(">HH", 0, 1)), BAUD, 8_000_000)
    assert noticed == [(7_000_000, 4, "goal", 45.0), *((8_000_000, n, "torque", 1.0) for n in range(1, 6))]


def test_modbus_drives_break_in_the_same_ways() -> None:
    bus = SimulatedModbusBus(SimulatedApparatus(1, now_ns=0))
    ask = ModbusRequest(3, 3, struct.pack(">HH", 0x20, 6))

    def answers(request: ModbusRequest = ask) -> list[bytes]:
        return [answer.data for answer in bus.execute(request, BAUD, 0)]

    (whole,) = answers()
    kinds: tuple[FaultKind, ...] = ("garbage", "wrong_crc", "duplicate_id")
    for kind in kinds:
        bus.faults.fault(SimulatedFault(kind, 3))
        (damaged,) = answers()
        assert modbus.parse(damaged) is None, kind
        bus.faults.clear()
    bus.faults.fault(SimulatedFault("silent", 3))
    assert answers() == []
    assert answers(ModbusRequest(3, 6, struct.pack(">HH", 3, 400))) == []
    bus.faults.clear()
    assert answers(ModbusRequest(3, 3, struct.pack(">HH", 3, 1))) == [modbus.frame(3, 3, struct.pack(">BH", 2, 400))]
    bus.faults.fault(SimulatedFault("off", 3))
    assert answers() == []
    bus.faults.clear()
    assert answers(ModbusRequest(3, 3, struct.pack(">HH", 3, 1))) == [modbus.frame(3, 3, struct.pack(">BH", 2, 1000))]
    bus.faults.fault(SimulatedFault("hardware_error", 3, 5))
    assert answers(ModbusRequest(3, 3, struct.pack(">HH", 0x21, 1))) == [modbus.frame(3, 3, struct.pack(">BH", 2, 5))]
    assert answers(ModbusRequest(3, 6, struct.pack(">HH", 0, 1))) == [modbus.exception(3, 6, modbus.DEVICE_FAILURE)]
    bus.faults.clear()
    bus.faults.fault(SimulatedFault("inputs_silent"))
    assert answers(ModbusRequest(1, 2, struct.pack(">HH", 0, 2))) == []
    bus.faults.clear()
    assert answers() == [whole]


def test_silent_drive_silences_those_after_it_in_sync_reads() -> None:
    world = World()
    ask = struct.pack("<HH", PRESENT_POSITION, 4) + bytes([1, 2, 3, 4, 5])
    world.bus.faults.fault(SimulatedFault("silent", 3))
    assert len(world.tell(protocol.BROADCAST, protocol.SYNC_READ, ask)) == 2
    assert len(world.tell(protocol.BROADCAST, protocol.PING)) == 4


def test_the_same_seed_spoils_in_the_same_way() -> None:
    def spoilt(seed: int) -> list[bytes]:
        world = World(seed)
        world.bus.faults.fault(SimulatedFault("intermittent", 3, 0.5))
        world.bus.faults.fault(SimulatedFault("garbage", 3))
        return [answer.data for _ in range(20) for answer in world.tell(3, protocol.PING)]

    assert spoilt(1) == spoilt(1) != spoilt(2)


@pytest.mark.parametrize(
    ("kind", "motor", "value"),
    [("silent", None, None), ("silent", 6, None), ("gone", 1, None), ("delayed", 1, None), ("intermittent", 1, 1.5)],
)
def test_a_fault_that_cannot_be_is_refused(kind: FaultKind, motor: int | None, value: float | None) -> None:
    with pytest.raises(ValueError, match=kind):
        SimulatedFault(kind, motor, value)


@given(st.lists(st.binary(max_size=80), max_size=6), st.booleans())
def test_no_bytes_upset_the_servos(pieces: list[bytes], headed: bool) -> None:
    """A packet taken as valid has a correct checksum."""
    world = World()
    parser = InstructionParser()
    heard = b""
    for piece in pieces:
        data = protocol.HEADER + piece if headed else piece
        heard += data
        for packet in parser.feed(data):
            if packet.valid:
                assert packet.size <= len(heard)
                assert any(
                    crc16.umts(heard[n : n + packet.size - 2]).to_bytes(2, "little")
                    == heard[n + packet.size - 2 : n + packet.size]
                    for n in range(len(heard) - packet.size + 1)
                )
            world.bus.execute(packet, BAUD, 0)


codes = st.sampled_from([1, 2, 3, 4, 5, 8, 0x82, 0x83, 0x8A, 0x92, 0x93]) | st.integers(0, 255)


@given(st.lists(st.tuples(st.integers(0, 255), codes, st.binary(max_size=40)), max_size=8))
def test_no_sound_instruction_upsets_the_servos(instructions: list[tuple[int, int, bytes]]) -> None:
    world = World()
    for drive_id, code, parameters in instructions:
        world.tell(drive_id, code, parameters)
        world.forward(0.003)
