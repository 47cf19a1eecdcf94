"""The simulated servos on the wire, with the maker's own library at the other end."""

import os
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.dynamixel import StatusParser, encode
from kata.simulator import protocol
from kata.simulator.process import SimulatorError, SimulatorProcess

IDS = (1, 2, 3, 4, 5)
TORQUE_ENABLE, GOAL_POSITION, PRESENT_POSITION = 64, 116, 132


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[SimulatorProcess]:
    with closing(SimulatorProcess(tmp_path)) as running:
        yield running


@pytest.fixture
def port(simulator: SimulatorProcess) -> Iterator[Any]:
    opened = PortHandler(simulator.port)
    assert opened.openPort()
    assert opened.setBaudRate(1_000_000)
    yield opened
    opened.closePort()


packets = PacketHandler(2.0)


def test_all_five_answer_a_ping_with_their_model(port: Any) -> None:
    for drive_id in IDS:
        model, result, error = packets.ping(port, drive_id)
        assert (model, result, error) == (1120, COMM_SUCCESS, 0)
    assert packets.ping(port, 6)[1] == COMM_RX_TIMEOUT


def test_registers_keep_what_is_written(port: Any) -> None:
    assert packets.write2ByteTxRx(port, 3, 84, 1234) == (COMM_SUCCESS, 0)
    assert packets.read2ByteTxRx(port, 3, 84) == (1234, COMM_SUCCESS, 0)
    assert packets.read2ByteTxRx(port, 4, 84)[0] != 1234


def test_the_eeprom_is_locked_while_torque_is_on(port: Any) -> None:
    packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 1)
    assert packets.write1ByteTxRx(port, 1, 11, 3) == (COMM_SUCCESS, protocol.ACCESS_ERROR)
    packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 0)
    assert packets.write1ByteTxRx(port, 1, 11, 5) == (COMM_SUCCESS, 0)


def test_sync_write_moves_and_sync_read_tells(port: Any) -> None:
    for drive_id in IDS:
        packets.write2ByteTxRx(port, drive_id, 84, 1600)
        packets.write2ByteTxRx(port, drive_id, 82, 400)
        packets.write2ByteTxRx(port, drive_id, 80, 60)
        packets.write1ByteTxRx(port, drive_id, TORQUE_ENABLE, 1)
    start, result, _ = packets.read4ByteTxRx(port, 4, PRESENT_POSITION)
    assert result == COMM_SUCCESS
    goals = GroupSyncWrite(port, packets, GOAL_POSITION, 4)
    goals.addParam(4, struct.pack("<i", start + 200))
    assert goals.txPacket() == COMM_SUCCESS

    present = GroupSyncRead(port, packets, PRESENT_POSITION, 4)
    for drive_id in IDS:
        present.addParam(drive_id)
    limit = time.monotonic() + 10
    while True:
        assert present.txRxPacket() == COMM_SUCCESS
        if abs(present.getData(4, PRESENT_POSITION, 4) - (start + 200)) <= 2:
            break
        assert time.monotonic() < limit


def test_a_silent_servo_silences_the_ones_after_it(port: Any) -> None:
    port.writePort(encode(protocol.BROADCAST, 0x82, struct.pack("<HH", PRESENT_POSITION, 4) + bytes([1, 9, 2])))
    port.writePort(encode(5, 0x01))
    parser = StatusParser()
    answered: list[int] = []
    limit = time.monotonic() + 5
    while 5 not in answered:
        assert time.monotonic() < limit
        answered += [drive_id for drive_id, _, _ in parser.feed(bytes(port.readPort(100)))]
    assert answered == [1, 5]


def test_at_another_baud_rate_nobody_hears(port: Any) -> None:
    port.setBaudRate(57_600)
    assert packets.ping(port, 1)[1] == COMM_RX_TIMEOUT
    port.setBaudRate(1_000_000)
    assert packets.ping(port, 1)[1] == COMM_SUCCESS


def test_a_damaged_packet_does_nothing(simulator: SimulatorProcess, port: Any) -> None:
    packet = bytearray(encode(1, 0x03, struct.pack("<HB", TORQUE_ENABLE, 1)))
    packet[-1] ^= 0x40
    port.writePort(bytes(packet))
    assert packets.ping(port, 1)[1] == COMM_SUCCESS
    with closing(simulator.client()) as hand:
        assert not hand.state().axes[0].torque_on


def test_the_bus_watchdog_trips_and_refuses_goals_until_it_is_cleared(port: Any) -> None:
    packets.write1ByteTxRx(port, 2, TORQUE_ENABLE, 1)
    packets.write1ByteTxRx(port, 2, 98, 1)
    quiet_until = time.monotonic() + 0.1  # five times the watchdog's 20 ms
    while time.monotonic() < quiet_until:
        time.sleep(0.01)
    assert packets.read1ByteTxRx(port, 2, 98)[0] == 255
    position = packets.read4ByteTxRx(port, 2, PRESENT_POSITION)[0]
    assert packets.write4ByteTxRx(port, 2, GOAL_POSITION, position)[1] == protocol.DATA_RANGE_ERROR
    packets.write1ByteTxRx(port, 2, 98, 0)
    assert packets.write4ByteTxRx(port, 2, GOAL_POSITION, position) == (COMM_SUCCESS, 0)


def test_emergency_stop_and_pedal_are_contacts_on_drive_one(simulator: SimulatorProcess, port: Any) -> None:
    for address in (56, 57):
        packets.write1ByteTxRx(port, 1, address, 2)
    with closing(simulator.client()) as hand:
        assert packets.read2ByteTxRx(port, 1, 152)[0] == 0
        assert packets.read2ByteTxRx(port, 1, 154)[0] == 1
        hand.estop(pressed=True)
        hand.pedal(down=True)
        assert packets.read2ByteTxRx(port, 1, 152)[0] == 1
        assert packets.read2ByteTxRx(port, 1, 154)[0] == 0
        happened = [event.what for event in hand.state().events]
        assert happened[-2:] == ["estop_pressed", "pedal_down"]


def test_a_reply_takes_at_least_its_bytes_time(port: Any) -> None:
    for drive_id in IDS:
        packets.write1ByteTxRx(port, drive_id, 8, 2)
    port.setBaudRate(115_200)
    present = GroupSyncRead(port, packets, 126, 10)
    for drive_id in IDS:
        present.addParam(drive_id)
    began = time.monotonic()
    assert present.txRxPacket() == COMM_SUCCESS
    sent, received = 14 + 5, 5 * (11 + 10)
    assert time.monotonic() - began >= (sent + received) * 10 / 115_200


def test_it_ends_with_whoever_started_it(tmp_path: Path) -> None:
    script = (
        "import sys, time; from pathlib import Path; from kata.simulator.process import SimulatorProcess\n"
        f"print(SimulatorProcess(Path({str(tmp_path)!r})).pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    parent.stdout.close()
    limit = time.monotonic() + 10
    while os.path.exists(f"/proc/{pid}") and "Z" not in Path(f"/proc/{pid}/stat").read_text().split():  # noqa: PTH110
        assert time.monotonic() < limit
        time.sleep(0.02)


def test_one_that_cannot_start_says_why(tmp_path: Path) -> None:
    (tmp_path / "simulator.sock").mkdir()
    with pytest.raises(SimulatorError, match=r"the simulated apparatus did not start: [\s\S]*Error"):
        SimulatorProcess(tmp_path)


@given(st.binary(max_size=60), st.integers(0, 252))
def test_two_readings_of_the_protocol_agree(parameters: bytes, drive_id: int) -> None:
    """The device's codec and the simulator's were written apart; stuffing is where they would differ."""
    heard = list(protocol.InstructionParser().feed(encode(drive_id, 0x03, parameters)))
    assert [(one.drive_id, one.code, one.parameters, one.sound) for one in heard] == [(drive_id, 3, parameters, True)]
    answered = list(StatusParser().feed(protocol.status(drive_id, 0, parameters)))
    assert answered == [(drive_id, 0, parameters)]


@given(st.binary(max_size=20), st.binary(max_size=40), st.data())
def test_packets_are_found_in_noise_and_in_pieces(noise: bytes, parameters: bytes, data: st.DataObject) -> None:
    stream = noise.replace(b"\xff\xff\xfd\x00", b"") + protocol.status(7, 0, parameters)
    cut = data.draw(st.integers(0, len(stream)))
    parser = StatusParser()
    found = [*parser.feed(stream[:cut]), *parser.feed(stream[cut:])]
    assert (7, 0, parameters) in found


def test_the_manuals_own_example() -> None:
    """Write of goal position 512 to id 1, as the protocol's manual prints it."""
    assert encode(1, 3, bytes([0x74, 0x00, 0x00, 0x02, 0x00, 0x00])).hex(" ") == (
        "ff ff fd 00 01 09 00 03 74 00 00 02 00 00 ca 89"
    )
