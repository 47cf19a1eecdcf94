"""The Dynamixel driver: conformance and its protocol."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.drivers import make_bus
from kata.device.bus.dynamixel.packets import FastParser, StatusParser, encode
from kata.device.bus.port import Bus, BusError
from kata.device.bus.serial_transport import Transport
from kata.device.config import Inputs
from kata.simulator import protocol
from kata.simulator.protocol import Instruction
from tests.support.driver_conformance import Conformance
from tests.support.simulated_world import World

_INSTRUCTION_AT = 7


class TestDynamixel(Conformance):
    """With Fast Sync Read."""

    protocol = "dynamixel"
    arming_request = 3
    alerts = True
    resolution_deg = 0.1


class TestOlderDynamixel(Conformance):
    """Drives without Fast Sync Read."""

    protocol = "dynamixel"
    arming_request = 3
    alerts = True
    resolution_deg = 0.1

    @pytest.fixture(autouse=True)
    def _older(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(
            "kata.simulator.bus.ServoBus._fast_sync_read", lambda self, listening, parameters, now_ns: []
        )


class TestDynamixelInPieces(Conformance):
    """Behind an adapter that delivers every byte separately."""

    protocol = "dynamixel"
    arming_request = 3
    alerts = True
    resolution_deg = 0.1
    byte_by_byte = True


class TestSlowDynamixel(Conformance):
    """At 115,200 bit/s, with the drives' own return delay."""

    protocol = "dynamixel"
    arming_request = 3
    alerts = True
    resolution_deg = 0.1
    settings = {"baud": 115_200, "return_delay_us": 500, "rate_hz": 20, "cycle_hz": 20}  # noqa: RUF012


@pytest.mark.parametrize("cycles", [1, 3])
def test_answer_late_by_whole_cycles_is_recognized_by_its_length(cycles: int) -> None:
    world = World()
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    Conformance.cycles(world, bus, 5)
    world.fault("delayed", 1, cycles * 10.0)
    for reading in Conformance.cycles(world, bus, 20):
        assert reading.inputs is None


@given(st.lists(st.binary(max_size=80), max_size=12))
def test_whatever_comes_the_parsers_raise_nothing(chunks: list[bytes]) -> None:
    status, fast = StatusParser(), FastParser([1, 2, 3, 4, 5], 10)
    for chunk in chunks:
        list(status.feed(chunk))
        list(fast.feed(chunk))


class _Twice:
    """A transport that delivers the answer to a ping twice, this many times."""

    def __init__(self, line: Transport, times: int) -> None:
        self._line = line
        self._left = times
        self._pinged = False

    def now_ns(self) -> int:
        return self._line.now_ns()

    def send(self, data: bytes) -> None:
        self._pinged = data[_INSTRUCTION_AT] == protocol.PING
        self._line.send(data)

    def receive(self, earliest_ns: int, deadline_ns: int) -> bytes:
        data = self._line.receive(earliest_ns, deadline_ns)
        if not (data and self._pinged and self._left):
            return data
        self._left -= 1
        return data * 2

    def close(self) -> None:
        self._line.close()


def test_late_duplicate_ping_answer_is_no_second_drive() -> None:
    world = World()
    bus = make_bus(world.config, lambda port, baud: _Twice(world.open_transport(port, baud), times=1))
    bus.open()
    bus.configure([0])


def test_two_drives_that_answer_one_after_another_are_found() -> None:
    world = World()
    bus = make_bus(world.config, lambda port, baud: _Twice(world.open_transport(port, baud), times=2))
    bus.open()
    with pytest.raises(BusError, match="two drives answer to id 1, motor 1's"):
        bus.configure([0])


_ANSWER = st.tuples(st.integers(0, 252), st.integers(0, 255), st.binary(max_size=20))


@given(st.lists(_ANSWER, max_size=5), st.binary(max_size=8), st.data())
def test_every_valid_packet_is_found_in_any_pieces(
    answers: list[tuple[int, int, bytes]], noise: bytes, data: st.DataObject
) -> None:
    stream = noise + b"".join(protocol.status(*answer) for answer in answers)
    parser = StatusParser()
    found = []
    while stream:
        count = data.draw(st.integers(1, len(stream)))
        found += list(parser.feed(stream[:count]))
        stream = stream[count:]
    # Noise may look like a header and swallow the following bytes; without such noise, every packet is found.
    if b"\xff" not in noise:
        assert found == answers


@given(_ANSWER, st.data())
def test_packet_with_one_wrong_byte_is_never_accepted(answer: tuple[int, int, bytes], data: st.DataObject) -> None:
    packet = bytearray(protocol.status(*answer))
    at = data.draw(st.integers(0, len(packet) - 1))
    packet[at] ^= data.draw(st.integers(1, 255))
    assert list(StatusParser().feed(bytes(packet))) == []


@given(st.integers(0, 5), st.data())
def test_parts_before_a_damaged_part_of_a_packet_are_accepted(count: int, data: st.DataObject) -> None:
    answers = [(n, 0, bytes([n] * 10)) for n in range(1, count + 1)]
    blocks = protocol.fast_blocks(answers, 5, 10)
    good = data.draw(st.integers(0, count))
    stream = bytearray(b"".join(blocks))
    if good < count:
        first = sum(len(block) for block in blocks[:good])
        at = data.draw(st.integers(first, first + len(blocks[good]) - 1))
        stream[at] ^= data.draw(st.integers(1, 255))
    found = list(FastParser([1, 2, 3, 4, 5], 10).feed(bytes(stream)))
    assert found == answers[: good if good < count else count]


def test_echo_of_our_instruction_is_neither_answer_nor_noise() -> None:
    parser = StatusParser()
    assert list(parser.feed(encode(1, 0x02, b"\x84\x00\x04\x00"))) == []
    assert (parser.skipped, parser.pending) == (0, 0)


def test_both_implementations_reproduce_the_checksum_of_the_specification() -> None:
    ping = encode(1, 0x01)
    assert ping == bytes.fromhex("ff ff fd 00 01 03 00 01 19 4e")
    assert [one.valid for one in protocol.InstructionParser().feed(ping)] == [True]


def test_drives_support_fast_sync_read_and_it_is_used() -> None:
    world = World()
    heard: list[int] = []
    execute = world.line._bus.execute  # type: ignore[attr-defined]

    def listen(instruction: Instruction, baud: int, now_ns: int) -> object:
        heard.append(instruction.code)
        return execute(instruction, baud, now_ns)

    world.line._bus.execute = listen  # type: ignore[attr-defined]
    bus = ready(world)
    heard.clear()
    bus.read()
    assert heard == [protocol.FAST_SYNC_READ, protocol.READ, protocol.READ]


def ready(world: World) -> Bus:
    """Return a bus whose drives are configured and verified."""
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    for _ in range(80):
        bus.read()
        world.wait(0.01)
    return bus


def mismatches(world: World, bus: Bus, cycles: int) -> set[tuple[int, str]]:
    """Return the motors with their mismatched registers."""
    found = set()
    for _ in range(cycles):
        found |= {(status.axis + 1, status.mismatch) for status in bus.read().statuses if status.mismatch}
        world.wait(0.01)
    return found


def test_missing_marker_is_found_although_every_register_is_right() -> None:
    world = World()
    bus = ready(world)
    world.set_registers(3, 65, b"\0")
    assert mismatches(world, bus, 8) == {(3, "configured marker (LED)")}


def test_ports_not_known_as_inputs_say_nothing_about_the_switch() -> None:
    """A factory-default drive's ports read 0: with one contact that is "closed", with two it is "pressed"."""
    world = World()
    bus = ready(world)
    assert bus.read().inputs is not None
    world.fault("exchanged", world.config.inputs.drive_id)
    world.faults.clear()
    bus.close()
    bus.open()
    for _ in range(50):
        assert bus.read().inputs is None
        world.wait(0.01)
    bus.configure([world.config.inputs.drive_id - 1])
    assert any(bus.read().inputs for _ in range(3))


def test_mismatch_of_another_register_hides_no_pressed_switch() -> None:
    """The position limits lie in the block with the modes of the ports. A held arm waits for a press of the switch."""
    world = World()
    bus = ready(world)
    inputs_motor = world.config.inputs.drive_id
    world.set_registers(inputs_motor, 48, b"\xff\x0f\0\0\0\0\0\0")
    bus.close()
    bus.open()
    assert (inputs_motor, "position limits") in mismatches(world, bus, 50)
    world.apparatus.press_estop(True)
    read = bus.read().inputs
    assert read is not None
    assert read.estop_open


def test_single_drive_without_an_armed_watchdog_is_found() -> None:
    world = World()
    bus = ready(world)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    bus.read()
    world.set_registers(4, 98, b"\0")
    assert mismatches(world, bus, 8) == {(4, "bus watchdog")}


@pytest.mark.parametrize(
    ("estop", "second", "pedal"), [(1, 3, 2), (3, 1, 2), (2, None, 1), (1, None, 3), (3, None, 2), (2, 3, 1)]
)
def test_the_contacts_may_be_at_any_port(estop: int, second: int | None, pedal: int) -> None:
    world = World(inputs=Inputs(estop_port=estop, estop_second_port=second, pedal_port=pedal, max_age_cycles=30))
    bus = ready(world)
    drive = world.apparatus.drives[world.config.inputs.drive_id - 1]
    for pressed in (False, True):
        # The simulator's wiring is fixed: the test puts contacts at the ports that are read.
        drive.contacts.clear()
        drive.contacts[estop] = not pressed
        if second:
            drive.contacts[second] = pressed
        drive.contacts[pedal] = pressed
        inputs = bus.read().inputs
        assert inputs is not None
        assert (inputs.estop_open, inputs.pedal_down, inputs.contacts_disagree) == (pressed, pressed, False)


def test_silent_drive_is_no_noise_and_fast_reads_remain() -> None:
    world = World()
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    bus.read()
    heard: list[int] = []
    execute = world.line._bus.execute  # type: ignore[attr-defined]

    def listen(instruction: Instruction, baud: int, now_ns: int) -> object:
        heard.append(instruction.code)
        return execute(instruction, baud, now_ns)

    world.line._bus.execute = listen  # type: ignore[attr-defined]
    world.fault("silent", 3)
    for reading in Conformance.cycles(world, bus, 20):
        assert reading.corrupt == frozenset()
    assert protocol.FAST_SYNC_READ in heard
    assert protocol.SYNC_READ not in heard
