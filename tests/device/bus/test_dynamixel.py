"""The Dynamixel driver: conformance and its protocol."""

import struct
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.dynamixel.cycle_block import AT
from kata.device.bus.dynamixel.packets import FastParser, StatusParser, encode
from kata.device.bus.dynamixel.registers import BLOCKS, BLOCKS_WITH_STATUS, ROTATION_BLOCKS, configured_registers
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import Bus, BusError
from kata.device.bus.serial_transport import Transport
from kata.device.config import Inputs, StationConfig, simulated
from kata.simulator import protocol
from kata.simulator.adapter import AdapterLatency
from kata.simulator.protocol import Instruction
from kata.testing.conformance import Conformance
from kata.testing.world import RecordingWorld
from tests.support.drive_registers import Registers, expected_registers
from tests.support.examples import examples

_INSTRUCTION_AT = 7


class DynamixelConformance(Conformance):
    """What all configurations of the driver have in common."""

    protocol = "dynamixel"
    arming_request = 3
    inputs_come_with_drive = True
    alerts = True
    reports_health = True
    resolution_deg = 0.1
    read_only = {"model number": r"is model 0, which Kata does not know; it knows .*1120 \(XM540"}  # noqa: RUF012

    def expected_registers(self, config: StationConfig, motor: int) -> Registers:
        return expected_registers(config, motor)


class TestDynamixel(DynamixelConformance):
    """With Fast Sync Read."""


class TestOlderDynamixel(DynamixelConformance):
    """Drives without Fast Sync Read."""

    @pytest.fixture(autouse=True)
    def _older(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("kata.simulator.bus.ServoBus._fast_read", lambda self, listening, wanted, now_ns: [])


# In every run, test_drives_are_read_from_single_bytes reads the same answers.
@pytest.mark.campaign
class TestDynamixelInPieces(DynamixelConformance):
    """Behind an adapter that delivers every byte separately."""

    byte_by_byte = True


class TestSlowDynamixel(DynamixelConformance):
    """At 115,200 bit/s, with the drives' own return delay."""

    settings = {"baud": 115_200, "return_delay_us": 500, "rate_hz": 20, "cycle_hz": 20}  # noqa: RUF012


@pytest.mark.parametrize("cycles", [1, 3])
def test_answer_late_by_whole_cycles_is_recognized_by_its_length(cycles: int) -> None:
    world = RecordingWorld()
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
    world = RecordingWorld()
    bus = make_bus(world.config, lambda port, baud: _Twice(world.open_transport(port, baud), times=1))
    bus.open()
    bus.configure([0])


def test_two_drives_that_answer_one_after_another_are_found() -> None:
    world = RecordingWorld()
    bus = make_bus(world.config, lambda port, baud: _Twice(world.open_transport(port, baud), times=2))
    bus.open()
    with pytest.raises(BusError, match="two drives answer to id 1 of motor 1"):
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
    blocks = protocol.fast_blocks(answers, [10] * 5)
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
    assert [instruction.valid for instruction in protocol.InstructionParser().feed(ping)] == [True]


def test_drive_of_another_model_is_named() -> None:
    world = RecordingWorld()
    world.fault("exchanged_model", 2, 1030)
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    with pytest.raises(BusError, match=r"motor 2 \(id 2\) is model 1030; the station.s file requires 1120"):
        bus.configure([1])


def test_drive_with_too_old_firmware_is_refused() -> None:
    world = RecordingWorld()
    world.set_registers(3, 6, b"\x25")
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    with pytest.raises(BusError, match=r"motor 3 \(id 3\) has firmware 37; Kata needs 38 or newer"):
        bus.configure([2])


@pytest.mark.parametrize(
    ("model", "nm_a"), [(1100, 9.9 / 4.9), (1120, 10.6 / 4.4), (1140, 9.2 / 2.4), (1020, 4.1 / 2.3)]
)
def test_torque_is_the_models(model: int, nm_a: float) -> None:
    """The current limit written to a drive, and the torque read from it, follow from the model's data sheet."""
    config = RecordingWorld().config
    *others, last = config.axes
    # The XM430 has no external ports, so the last drive reads the inputs.
    changed = [msgspec.structs.replace(axis, model=model, max_torque_nm=2.0) for axis in others]
    inputs = msgspec.structs.replace(config.inputs, drive_id=last.id)
    world = RecordingWorld(axes=(*changed, last), inputs=inputs)
    for servo in world.drives[:-1]:
        servo.exchange(servo.drive.motor, model)
    bus = ready(world)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    (current,) = struct.unpack("<H", world.registers(1, 38, 2))
    assert current == round(2.0 / nm_a / 0.00269)
    bus.write_setpoints([25.0, 109.0, 8.0, 0.0, 0.0])
    world.wait(0.03)
    drive = bus.read().drives[0]
    assert drive is not None
    assert drive.torque_nm == pytest.approx(world.apparatus.drives[0].torque_nm, abs=0.1)
    assert drive.torque_nm > 0.5


def test_one_fast_sync_read_a_cycle_reads_everything() -> None:
    world = RecordingWorld()
    heard: list[int] = []
    execute = world.line._bus.execute  # type: ignore[attr-defined]

    def listen(instruction: Instruction, baud: int, now_ns: int) -> object:
        heard.append(instruction.code)
        return execute(instruction, baud, now_ns)

    world.line._bus.execute = listen  # type: ignore[attr-defined]
    bus = ready(world)
    heard.clear()
    for sample in Conformance.cycles(world, bus, 100):
        assert all(sample.drives)
        assert sample.inputs is not None
        assert [status.axis for status in sample.statuses] == [0, 1, 2, 3, 4]
    assert heard.count(protocol.FAST_SYNC_READ) == 100
    # The rotation reads five blocks of five drives in two seconds.
    assert 12.5 <= heard.count(protocol.READ) == len(heard) - 100 <= 17


@pytest.mark.parametrize("kind", ["reboot", "exchanged"])
def test_restarted_drive_says_nothing_until_it_is_read(kind: Any) -> None:
    """Its Indirect Data reads 0, and a closed contact reads 0 too."""
    world = RecordingWorld()
    bus = ready(world)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    world.apparatus.press_estop(True)
    world.fault(kind, 1)
    (sample,) = Conformance.cycles(world, bus, 1)
    assert (sample.drives[0], sample.inputs) == (None, None)
    assert all(sample.drives[1:])
    assert [status.axis for status in sample.statuses] == [1, 2, 3, 4]
    later = Conformance.cycles(world, bus, 3)
    assert all(sample.drives[0] for sample in later)
    # An exchanged drive has other limits too. The drive names the register that happens to be read first.
    named = {status.mismatch for sample in later for status in sample.statuses if status.axis == 0 and status.mismatch}
    assert named in ({"configured marker (LED)"}, {"current limit"})


def test_changed_map_is_never_read_as_registers() -> None:
    world = RecordingWorld()
    bus = ready(world)
    true_deg = Conformance.cycles(world, bus, 1)[0].drives[3].position_deg
    world.set_registers(4, 168, bytes(56))
    for sample in Conformance.cycles(world, bus, 20):
        assert sample.drives[3] is None or sample.drives[3].position_deg == pytest.approx(true_deg, abs=1.0)


def test_drives_without_a_map_are_read_and_not_written() -> None:
    world = RecordingWorld()
    bus = ready(world)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    for motor in range(1, 6):
        world.set_registers(motor, 168, bytes(56))
    again = make_bus(world.config, world.open_transport)
    again.open()
    samples = Conformance.cycles(world, again, 60)
    assert all(all(sample.drives) for sample in samples)
    assert all(world.torque)
    assert [world.registers(motor, 168, 56) for motor in range(1, 6)] == [bytes(56)] * 5


def test_silent_drive_silences_no_inputs() -> None:
    """The drive of the inputs answers first."""
    inputs = Inputs(drive_id=4, estop_second_port=3, max_age_cycles=10)
    world = RecordingWorld(inputs=inputs)
    drive = world.apparatus.drives[3]
    drive.contacts, world.apparatus.drives[0].contacts = dict(world.apparatus.drives[0].contacts), {}
    bus = ready(world)
    for motor in (1, 2, 3, 5):
        world.fault("silent", motor)
        for sample in Conformance.cycles(world, bus, 15):
            assert sample.inputs is not None
        world.faults.clear()
        Conformance.cycles(world, bus, 60)


def ready(world: RecordingWorld) -> Bus:
    """Return a bus whose drives are configured and verified."""
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    for _ in range(80):
        bus.read()
        world.wait(0.01)
    return bus


def mismatches(world: RecordingWorld, bus: Bus, cycles: int) -> set[tuple[int, str]]:
    """Return the motors with their mismatched registers."""
    found = set()
    for _ in range(cycles):
        found |= {(status.axis + 1, status.mismatch) for status in bus.read().statuses if status.mismatch}
        world.wait(0.01)
    return found


def test_missing_marker_is_found_although_every_register_is_right() -> None:
    world = RecordingWorld()
    bus = ready(world)
    world.set_registers(3, 65, b"\0")
    assert mismatches(world, bus, 8) == {(3, "configured marker (LED)")}


def test_ports_not_known_as_inputs_say_nothing_about_the_switch() -> None:
    """A factory-default drive's ports read 0: with one contact that is "closed", with two it is "pressed"."""
    world = RecordingWorld()
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
    world = RecordingWorld()
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
    world = RecordingWorld()
    bus = ready(world)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    bus.read()
    world.set_registers(4, 98, b"\0")
    assert mismatches(world, bus, 8) == {(4, "bus watchdog")}


@pytest.mark.parametrize(
    ("estop", "second", "pedal"), [(1, 3, 2), (3, 1, 2), (2, None, 1), (1, None, 3), (3, None, 2), (2, 3, 1)]
)
def test_the_contacts_may_be_at_any_port(estop: int, second: int | None, pedal: int) -> None:
    world = RecordingWorld(
        inputs=Inputs(estop_port=estop, estop_second_port=second, pedal_port=pedal, max_age_cycles=30)
    )
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
    world = RecordingWorld()
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


@pytest.mark.parametrize(("fixed_ms", "jitter_ms"), [(0.25, 0.0), (1.0, 0.5), (2.0, 0.0), (1.0, 1.0), (4.0, 0.0)])
def test_late_adapter_loses_no_inputs(fixed_ms: float, jitter_ms: float) -> None:
    """From the first read after opening, through configuration, to verified drives with torque."""
    world = RecordingWorld()
    world.latency = AdapterLatency(fixed_ms, jitter_ms)
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    samples = Conformance.cycles(world, bus, 300)
    verified = next(n for n in range(300) if samples[n].inputs is not None)
    assert all(sample.inputs is not None for sample in samples[verified:])
    assert verified < 20
    assert all(all(sample.drives) for sample in samples[200:])
    assert all(status.verified for sample in samples[200:] for status in sample.statuses)
    bus.torque_on([15.0, 109.0, 8.0, 0.0, 0.0])
    for sample in Conformance.cycles(world, bus, 100):
        assert sample.inputs is not None
        assert all(sample.drives)
        assert bus.read_inputs() is not None


_LOST_MS = 30.0
"""An answer as late as this belongs to no cycle."""


@examples(few=12, many=100)
@given(
    segments=st.lists(
        st.tuples(
            st.integers(0, 6).map(lambda lost: [_LOST_MS] * lost),
            st.lists(st.floats(0.0, 5.2), min_size=1, max_size=4),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_timely_drives_are_read_soon_after_lost_answers(
    segments: list[tuple[list[float], list[float]]],
) -> None:
    """A busy computer loses some answers and stays slow: no drive may stay unread because it was silent once."""
    world = RecordingWorld()
    bus = ready(world)
    for lost, late in segments:
        for latency_ms in lost:
            world.latency = AdapterLatency(latency_ms)
            bus.read()
            world.wait(0.004)
        for latency_ms in late:
            world.latency = AdapterLatency(latency_ms)
            samples = Conformance.cycles(world, bus, 30)[20:]
            assert all(sample.inputs for sample in samples)
            for before, after in pairwise(samples):
                assert all(a or b for a, b in zip(before.drives, after.drives, strict=True))


@pytest.mark.parametrize(("fixed_ms", "jitter_ms"), [(2.0, 0.0), (1.0, 1.0)])
def test_cycle_with_a_late_adapter_fits_100_hz(fixed_ms: float, jitter_ms: float) -> None:
    world = RecordingWorld()
    world.latency = AdapterLatency(fixed_ms, jitter_ms)
    bus = ready(world)
    for _ in range(200):
        began_ns = world.t_ns
        bus.read()
        bus.write_setpoints([15.0, 109.0, 8.0, 0.0, 0.0])
        assert world.t_ns - began_ns < 8_000_000
        world.wait(max(0.0, 0.01 - (world.t_ns - began_ns) / 1e9))


@pytest.mark.parametrize("latency_ms", [0.25, 1.0, 2.0, 4.0])
def test_cycles_take_what_bytes_and_latency_take(latency_ms: float) -> None:
    """Without a pause: 95 % of the cycles that bytes, and one latency for each answer, allow."""
    world = RecordingWorld()
    world.latency = AdapterLatency(latency_ms)
    bus = ready(world)
    assert world.opened is not None
    carried, began_ns, answers = world.opened.carried, world.t_ns, 0
    execute = world.line._bus.execute  # type: ignore[attr-defined]

    def listen(instruction: Instruction, baud: int, now_ns: int) -> object:
        nonlocal answers
        answers += instruction.code != protocol.SYNC_WRITE
        return execute(instruction, baud, now_ns)

    world.line._bus.execute = listen  # type: ignore[attr-defined]
    for _ in range(200):
        assert bus.read().inputs is not None
        bus.write_setpoints([15.0, 109.0, 8.0, 0.0, 0.0])
    assert answers <= 200 * 1.2
    least_ns = (world.opened.carried - carried) * 10_000 + answers * latency_ms * 1e6
    assert least_ns / (world.t_ns - began_ns) >= 0.95


def test_health_adds_no_request() -> None:
    """Voltage and temperature come with the block of the cycle, their limits with a verified block."""
    world = RecordingWorld()
    bus = ready(world)
    heard: list[tuple[int, int]] = []
    execute = world.line._bus.execute  # type: ignore[attr-defined]

    def listen(instruction: Instruction, baud: int, now_ns: int) -> object:
        heard.append((instruction.code, int.from_bytes(instruction.parameters[:2], "little")))
        return execute(instruction, baud, now_ns)

    world.line._bus.execute = listen  # type: ignore[attr-defined]
    reported = [health for sample in Conformance.cycles(world, bus, 200) for health in sample.health]
    assert len(reported) >= 5 * 10
    cycles = [address for code, address in heard if code == protocol.FAST_SYNC_READ]
    assert cycles == [224] * 200
    rotation = {address for code, address in heard if code != protocol.FAST_SYNC_READ}
    assert rotation == {block.start for block in ROTATION_BLOCKS}


@pytest.mark.parametrize("inputs_at", [1, 5])
def test_every_configured_register_is_read_again(inputs_at: int) -> None:
    """A register outside the verified blocks would be written once and never compared; one that the mapped block lacks could not be."""
    config = msgspec.structs.replace(simulated("memory"), inputs=Inputs(drive_id=inputs_at, estop_second_port=3))
    for axis in config.axes:
        for register in configured_registers(config, axis):
            ends = {register.address, register.address + len(register.data) - 1}
            blocks = [n for n, block in enumerate(BLOCKS) if register.address in block]
            assert blocks, register.name
            for block in blocks:
                assert ends <= set(BLOCKS[block]), register.name
                if block < BLOCKS_WITH_STATUS:
                    assert ends <= set(AT), register.name
