"""The simulated servos on the wire, with the maker's own library at the other end."""

import fcntl
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
)
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.dynamixel.packets import StatusParser, encode
from kata.motion.taught import Taught
from kata.simulator import protocol
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.client import SimulatorClient
from kata.simulator.control import ControlReply, ControlRequest, Guide, Rows
from kata.simulator.hand import HandRefusedError
from kata.simulator.process import SimulatorError, SimulatorProcess
from kata.simulator.protocol import Instruction
from tests.support.sdk_port import open_port

IDS = (1, 2, 3, 4, 5)
TORQUE_ENABLE, GOAL_POSITION, PRESENT_POSITION = 64, 116, 132
TCGETS2, TCSETS2 = 0x802C542A, 0x402C542B
CBAUD, BOTHER = 0o10017, 0o10000


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[SimulatorProcess]:
    with closing(SimulatorProcess(tmp_path)) as running:
        yield running


@pytest.fixture
def port(simulator: SimulatorProcess) -> Iterator[Any]:
    with open_port(simulator.port) as opened:
        yield opened


packets = PacketHandler(2.0)


def test_all_five_answer_a_ping_with_their_model(port: Any) -> None:
    for drive_id in IDS:
        model, result, error = packets.ping(port, drive_id)
        assert (model, result, error) == (1120, COMM_SUCCESS, 0)
    assert packets.ping(port, 6)[1] == COMM_RX_TIMEOUT


def test_registers_keep_their_values(port: Any) -> None:
    assert packets.write2ByteTxRx(port, 3, 84, 1234) == (COMM_SUCCESS, 0)
    assert packets.read2ByteTxRx(port, 3, 84) == (1234, COMM_SUCCESS, 0)
    assert packets.read2ByteTxRx(port, 4, 84)[0] != 1234


def test_the_eeprom_is_locked_while_torque_is_on(port: Any) -> None:
    packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 1)
    assert packets.write1ByteTxRx(port, 1, 11, 3) == (COMM_SUCCESS, protocol.ACCESS_ERROR)
    packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 0)
    assert packets.write1ByteTxRx(port, 1, 11, 5) == (COMM_SUCCESS, 0)


def test_sync_write_moves_and_sync_read_reports(port: Any) -> None:
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


def test_silent_servo_silences_later_ones(port: Any) -> None:
    port.writePort(encode(protocol.BROADCAST, 0x82, struct.pack("<HH", PRESENT_POSITION, 4) + bytes([1, 9, 2])))
    port.writePort(encode(5, 0x01))
    parser = StatusParser()
    answered: list[int] = []
    limit = time.monotonic() + 5
    while 5 not in answered:
        assert time.monotonic() < limit
        answered += [drive_id for drive_id, _, _ in parser.feed(bytes(port.readPort(100)))]
    assert answered == [1, 5]


def test_wrong_baud_rate_gets_no_answer(port: Any) -> None:
    port.setBaudRate(57_600)
    assert packets.ping(port, 1)[1] == COMM_RX_TIMEOUT
    port.setBaudRate(1_000_000)
    assert packets.ping(port, 1)[1] == COMM_SUCCESS


def test_numeric_baud_rate_is_accepted(port: Any) -> None:
    # As Rust libraries set it: BOTHER in the flags, and the rate as a number.
    settings = bytearray(fcntl.ioctl(port.ser.fileno(), TCGETS2, bytes(44)))
    flags, *_ = struct.unpack_from("@I", settings, 8)
    struct.pack_into("@I", settings, 8, flags & ~CBAUD | BOTHER)
    for baud, result in ((57_600, COMM_RX_TIMEOUT), (1_000_000, COMM_SUCCESS)):
        struct.pack_into("@2I", settings, 36, baud, baud)
        fcntl.ioctl(port.ser.fileno(), TCSETS2, bytes(settings))
        assert packets.ping(port, 1)[1] == result


def test_a_damaged_packet_does_nothing(simulator: SimulatorProcess, port: Any) -> None:
    packet = bytearray(encode(1, 0x03, struct.pack("<HB", TORQUE_ENABLE, 1)))
    packet[-1] ^= 0x40
    port.writePort(bytes(packet))
    assert packets.ping(port, 1)[1] == COMM_SUCCESS
    with closing(simulator.client()) as hand:
        assert not hand.state().axes[0].torque_on


def test_a_packet_cut_short_is_given_up(port: Any) -> None:
    """Otherwise a damaged length byte would swallow the next packets."""
    port.writePort(protocol.HEADER + bytes([1, 0, 3]))
    pings = 1
    while packets.ping(port, 1)[1] != COMM_SUCCESS:
        pings += 1
        assert pings < 5
    assert packets.ping(port, 1)[1] == COMM_SUCCESS


def test_fast_sync_read_returns_everything_in_one_packet(port: Any) -> None:
    present = GroupSyncRead(port, packets, 126, 10)
    for drive_id in IDS:
        present.addParam(drive_id)
    assert present.fastSyncRead() == COMM_SUCCESS
    fast = [present.getData(drive_id, PRESENT_POSITION, 4) for drive_id in IDS]
    assert present.txRxPacket() == COMM_SUCCESS
    assert fast == [present.getData(drive_id, PRESENT_POSITION, 4) for drive_id in IDS]
    assert fast[1] == round(2048 + 108.94 * 4096 / 360)


def test_bulk_instructions_reach_each_drive_at_its_own_address(port: Any) -> None:
    write = GroupBulkWrite(port, packets)
    write.addParam(1, 84, 2, [0x34, 0x12])
    write.addParam(2, 65, 1, [1])
    assert write.txPacket() == COMM_SUCCESS
    read = GroupBulkRead(port, packets)
    read.addParam(1, 84, 2)
    read.addParam(2, 65, 1)
    assert read.txRxPacket() == COMM_SUCCESS
    assert (read.getData(1, 84, 2), read.getData(2, 65, 1)) == (0x1234, 1)


def test_drive_refuses_unsupported_requests(port: Any) -> None:
    assert packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 2) == (COMM_SUCCESS, protocol.DATA_RANGE_ERROR)
    assert packets.write1ByteTxRx(port, 1, 11, 2) == (COMM_SUCCESS, protocol.DATA_RANGE_ERROR)
    assert packets.write1ByteTxRx(port, 1, 98, 200) == (COMM_SUCCESS, protocol.DATA_RANGE_ERROR)
    assert packets.write2ByteTxRx(port, 1, 102, 2048) == (COMM_SUCCESS, protocol.DATA_LIMIT_ERROR)
    assert packets.write4ByteTxRx(port, 1, GOAL_POSITION, 4267) == (COMM_SUCCESS, protocol.DATA_LIMIT_ERROR)
    assert packets.write1ByteTxRx(port, 1, 11, 5) == (COMM_SUCCESS, 0)
    assert packets.write4ByteTxRx(port, 1, GOAL_POSITION, 4267) == (COMM_SUCCESS, 0)
    assert packets.write2ByteTxRx(port, 1, 132, 1) == (COMM_SUCCESS, protocol.ACCESS_ERROR)


def test_servo_is_cleared_reset_and_rebooted(port: Any) -> None:
    assert packets.clearMultiTurn(port, 2) == (COMM_SUCCESS, 0)
    assert packets.write2ByteTxRx(port, 2, 84, 100) == (COMM_SUCCESS, 0)
    for manage in (packets.reboot, lambda opened, drive_id: packets.factoryReset(opened, drive_id, 0x02)):
        assert manage(port, 2) == (COMM_SUCCESS, 0)
        assert packets.ping(port, 2)[1] == COMM_RX_TIMEOUT
        limit = time.monotonic() + 5
        while packets.ping(port, 2)[1] != COMM_SUCCESS:
            assert time.monotonic() < limit
    assert packets.read2ByteTxRx(port, 2, 84)[0] == 800


def test_clock_of_the_drives_continues(port: Any) -> None:
    first = packets.read2ByteTxRx(port, 1, 120)[0]
    limit = time.monotonic() + 5
    while packets.read2ByteTxRx(port, 1, 120)[0] == first:
        assert time.monotonic() < limit


def test_bus_watchdog_trips_and_refuses_goals_until_cleared(port: Any) -> None:
    packets.write1ByteTxRx(port, 2, TORQUE_ENABLE, 1)
    packets.write1ByteTxRx(port, 2, 98, 1)
    quiet_until = time.monotonic() + 0.1  # five times the watchdog's 20 ms
    while time.monotonic() < quiet_until:
        time.sleep(0.01)
    assert packets.read1ByteTxRx(port, 2, 98)[0] == 255
    position = packets.read4ByteTxRx(port, 2, PRESENT_POSITION)[0]
    assert packets.write4ByteTxRx(port, 2, GOAL_POSITION, position)[1] == protocol.DATA_RANGE_ERROR
    assert packets.write1ByteTxRx(port, 2, 98, 5) == (COMM_SUCCESS, protocol.DATA_RANGE_ERROR)
    assert packets.write4ByteTxRx(port, 2, 112, 30) == (COMM_SUCCESS, 0)
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


def test_servos_can_start_at_another_baud_rate(tmp_path: Path) -> None:
    with closing(SimulatorProcess(tmp_path, baud=57_600)) as running, open_port(running.port, 57_600) as opened:
        assert packets.read1ByteTxRx(opened, 5, 8) == (1, COMM_SUCCESS, 0)
    with pytest.raises(SimulatorError, match="do not support 12345 baud"):
        SimulatorProcess(tmp_path, baud=12_345)


def test_for_benchmarks_nothing_moves_and_the_wire_works(tmp_path: Path) -> None:
    with closing(SimulatorProcess(tmp_path, plant="none")) as running, open_port(running.port) as opened:
        before = packets.read4ByteTxRx(opened, 4, PRESENT_POSITION)[0]
        packets.write2ByteTxRx(opened, 4, 84, 1600)
        packets.write1ByteTxRx(opened, 4, TORQUE_ENABLE, 1)
        assert packets.write4ByteTxRx(opened, 4, GOAL_POSITION, before + 500) == (COMM_SUCCESS, 0)
        time.sleep(0.1)
        assert packets.read4ByteTxRx(opened, 4, PRESENT_POSITION) == (before, COMM_SUCCESS, 0)


def test_simulator_ends_with_its_parent_process(tmp_path: Path) -> None:
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


def test_failed_start_reports_its_reason(tmp_path: Path) -> None:
    with pytest.raises(SimulatorError, match=r"the simulated apparatus did not start: [\s\S]*invalid int value"):
        SimulatorProcess(tmp_path, seed="not a number")  # type: ignore[arg-type]


def test_its_folder_may_have_a_long_name(tmp_path: Path) -> None:
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    with closing(SimulatorProcess(folder)) as running, closing(running.client()) as hand:
        assert hand.state().hand.phase == "away"


def test_client_reports_when_the_simulator_has_ended(tmp_path: Path) -> None:
    with closing(SimulatorProcess(tmp_path)) as running, closing(running.client()) as hand:
        os.kill(running.pid, signal.SIGKILL)
        with pytest.raises(ConnectionError, match=r"the simulated apparatus (has ended|does not answer)"):
            hand.state()


def ask_without_end(deaf: socket.socket) -> None:
    """The client never reads an answer."""
    while True:
        deaf.sendall(b'{"do":"state"}\n' * 100)


def test_slow_client_delays_no_other(simulator: SimulatorProcess, port: Any) -> None:
    with closing(simulator.client()) as deaf, closing(simulator.client()) as hand:
        with pytest.raises(ConnectionError):
            ask_without_end(deaf._socket)
        assert hand.state().hand.phase == "away"
        assert packets.ping(port, 1)[1] == COMM_SUCCESS


def test_a_long_motion_is_handed_over_in_short_lines(tmp_path: Path) -> None:
    """The simulator processes one line at a time, and the servos answer in between."""
    n = 2345
    motion = Taught("long", np.arange(n) / 100, np.zeros((n, 5)))
    lines: list[bytes] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(str(tmp_path / "s"))
        listener.listen()
        with closing(SimulatorClient(tmp_path / "s")) as hand:
            there, _ = listener.accept()
            reply = msgspec.json.encode(ControlReply(ok=True, state=SimulatedApparatus().state())) + b"\n"
            guiding = threading.Thread(target=hand.guide, args=(motion,))
            with there, there.makefile("rb") as stream:
                guiding.start()
                while b'"guide"' not in (lines[-1] if lines else b""):
                    lines.append(stream.readline())
                    there.sendall(reply)
                guiding.join()
    given = [msgspec.json.decode(line, type=ControlRequest) for line in lines]
    assert all(isinstance(wish, Rows | Guide) and len(wish.times_s) <= 100 for wish in given)
    assert [t for wish in given if isinstance(wish, Rows | Guide) for t in wish.times_s] == motion.times_s.tolist()


def test_motion_given_in_several_lines_is_traced_as_one(simulator: SimulatorProcess) -> None:
    n = 1234
    motion = Taught("long", np.arange(n) / 100, np.zeros((n, 5)))
    with closing(simulator.client()) as hand:
        begun = hand.guide(motion, pedal=False)
        assert begun.hand.motion == "long"
        assert begun.hand.left_s > motion.duration_s
        assert hand.release().hand.phase == "away"
        # The rows before a refused line are dropped.
        with pytest.raises(HandRefusedError, match="must increase"):
            hand.guide(Taught("back in time", np.arange(n)[::-1] / 100, np.zeros((n, 5))))
        assert hand.guide(motion, pedal=False).hand.phase == "reaching"


@given(st.binary(max_size=60), st.integers(0, 252))
def test_two_readings_of_the_protocol_agree(parameters: bytes, drive_id: int) -> None:
    """The codecs of device and simulator are independent; stuffing is their most likely difference."""
    heard = list(protocol.InstructionParser().feed(encode(drive_id, 0x03, parameters)))
    assert [(packet.drive_id, packet.code, packet.parameters, packet.valid) for packet in heard] == [
        (drive_id, 3, parameters, True)
    ]
    answered = list(StatusParser().feed(protocol.status(drive_id, 0, parameters)))
    assert answered == [(drive_id, 0, parameters)]


@given(st.binary(max_size=20), st.binary(max_size=40), st.data())
def test_packets_are_found_in_noise_and_in_pieces(noise: bytes, parameters: bytes, data: st.DataObject) -> None:
    stream = noise.replace(b"\xff\xff\xfd\x00", b"") + protocol.status(7, 0, parameters)
    cut = data.draw(st.integers(0, len(stream)))
    parser = StatusParser()
    found = [*parser.feed(stream[:cut]), *parser.feed(stream[cut:])]
    assert (7, 0, parameters) in found


@pytest.mark.parametrize(
    ("drive_id", "data", "packet"),
    [
        (1, "a6 00 00 00", "ff ff fd 00 01 08 00 55 00 a6 00 00 00 8c c0"),
        (2, "1f 08 00 00", "ff ff fd 00 02 08 00 55 00 1f 08 00 00 ba be"),
        (1, "", "ff ff fd 00 01 04 00 55 00 a1 0c"),
    ],
)
def test_answers_are_the_manuals_examples(drive_id: int, data: str, packet: str) -> None:
    """The answers to Sync Read and Reboot are those in the protocol's manual."""
    assert protocol.status(drive_id, 0, bytes.fromhex(data)).hex(" ") == packet


def test_the_manuals_own_example() -> None:
    """The write of goal position 512 to id 1 is that of the protocol's manual."""
    assert encode(1, 3, bytes([0x74, 0x00, 0x00, 0x02, 0x00, 0x00])).hex(" ") == (
        "ff ff fd 00 01 09 00 03 74 00 00 02 00 00 ca 89"
    )


def answers_to(bus: ServoBus, code: int, parameters: bytes = b"", *, sound: bool = True) -> list[bytes]:
    """Return the answers of drive 1, or of all drives, at their baud rate."""
    drive_id = protocol.BROADCAST if code >= protocol.SYNC_READ else 1
    instruction = Instruction(drive_id, code, parameters, len(parameters) + 10, sound)
    return [answer.data for answer in bus.execute(instruction, 1_000_000, 0)]


def test_a_damaged_instruction_is_answered_with_a_crc_error() -> None:
    bus = ServoBus(SimulatedApparatus())
    assert answers_to(bus, protocol.PING, sound=False) == [protocol.status(1, protocol.CRC_ERROR)]
    assert answers_to(bus, protocol.SYNC_READ, bytes([132, 0, 4, 0, 1]), sound=False) == []


def test_a_standing_hardware_error_shows_in_every_answer() -> None:
    bus = ServoBus(SimulatedApparatus())
    bus.servos[0].table[70] = 32  # overload
    (answer,) = answers_to(bus, protocol.WRITE, bytes([65, 0, 1]))
    assert answer == protocol.status(1, protocol.ALERT)
    (answer,) = answers_to(bus, protocol.WRITE, bytes([132, 0, 1]))
    assert answer == protocol.status(1, protocol.ALERT | protocol.ACCESS_ERROR)
    (answer, _) = answers_to(bus, protocol.SYNC_READ, bytes([65, 0, 1, 0, 1, 2]))
    assert answer == protocol.status(1, protocol.ALERT, b"\1")


def test_a_silent_drive_cuts_a_fast_sync_read_short() -> None:
    blocks = answers_to(ServoBus(SimulatedApparatus()), protocol.FAST_SYNC_READ, bytes([132, 0, 4, 0, 1, 9, 2]))
    assert len(blocks) == 1
    promised = 7 + int.from_bytes(blocks[0][5:7], "little")
    assert promised == 8 + 3 * (4 + 4)
    assert len(b"".join(blocks)) < promised


def test_drive_set_to_answer_pings_only_does_so() -> None:
    bus = ServoBus(SimulatedApparatus())
    bus.servos[0].table[68] = 0
    assert len(answers_to(bus, protocol.PING)) == 1
    assert answers_to(bus, protocol.READ, bytes([132, 0, 4, 0])) == []
    assert answers_to(bus, protocol.SYNC_READ, bytes([132, 0, 4, 0, 1, 2])) == []
