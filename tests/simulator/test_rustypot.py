"""The simulated servos on the wire, with rustypot at the other end: another implementation of the protocol, in Rust."""

import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import rustypot

from kata.simulator.process import SimulatorProcess

IDS = [1, 2, 3, 4, 5]
TIMEOUT_S = 0.2
MAX_SCANS = 10
HOMING_OFFSET, PRESENT_POSITION = 20, 132


@pytest.fixture
def servos(tmp_path: Path) -> Iterator[Any]:
    """Yield rustypot's controller for the control table that the X series shares."""
    with closing(SimulatorProcess(tmp_path)) as simulator:
        controller = rustypot.Xl430PyController(simulator.port, 1_000_000, TIMEOUT_S)
        yield controller
        controller.close()


def answers(servos: Any, drive_id: int) -> bool:
    try:
        return bool(servos.ping(drive_id))
    except (OSError, RuntimeError, ValueError):
        return False


def wait_for_answer(servos: Any, motor: int) -> None:
    """Wait until a servo has started, at most 10 s."""
    limit = time.monotonic() + 10.0
    while not answers(servos, motor):
        assert time.monotonic() < limit


def counts(servos: Any, drive_id: int) -> int:
    return int.from_bytes(bytes(servos.read_raw_data(drive_id, PRESENT_POSITION, 4)), "little", signed=True)


def test_a_scan_finds_every_servo_with_its_model(servos: Any) -> None:
    found: dict[int, int] = {}
    # A scan gives each id a few milliseconds. A busy computer can keep the simulated servos from running for longer.
    for _ in range(MAX_SCANS):
        found |= servos.scan(list(range(1, 9)))
        if len(found) >= len(IDS):
            break
    assert found == dict.fromkeys(IDS, 1120)
    assert servos.broadcast_scan(IDS) == dict.fromkeys(IDS, 1120)


def test_goals_are_written_and_positions_read_together(servos: Any) -> None:
    before = servos.sync_read_present_position(IDS)
    for drive_id in IDS:
        servos.write_torque_enable(drive_id, True)
    wanted = [position + 40 for position in before]
    servos.sync_write_goal_position(IDS, wanted)
    time.sleep(1.0)
    assert servos.sync_read_present_position(IDS)[3:] == pytest.approx(wanted[3:], abs=15)


def test_an_id_is_changed(servos: Any) -> None:
    servos.write_id(3, 12)
    assert (answers(servos, 12), answers(servos, 3)) == (True, False)


def test_half_turn_calibration_makes_the_present_position_2047(servos: Any) -> None:
    servos.write_operating_mode(4, 4)
    offset = 2047 - counts(servos, 4)
    servos.write_raw_data(4, HOMING_OFFSET, list(offset.to_bytes(4, "little", signed=True)))
    assert counts(servos, 4) == pytest.approx(2047, abs=2)


def test_limits_are_those_of_the_model(servos: Any) -> None:
    read = (
        servos.read_velocity_limit(1),
        servos.read_pwm_limit(1),
        servos.read_current_limit(1),
        servos.read_max_voltage_limit(1),
        servos.read_min_voltage_limit(1),
    )
    assert [value[0] for value in read] == [128, 885, 2047, 160, 95]


def test_rebooting_servo_is_silent_and_comes_back(servos: Any) -> None:
    servos.write_torque_enable(2, True)
    servos.set_timeout(0.02)
    servos.reboot(2)
    assert not answers(servos, 2)
    wait_for_answer(servos, 2)
    assert servos.read_torque_enable(2) == [False]


def test_factory_reset_keeps_id_and_baud_rate(servos: Any) -> None:
    servos.write_raw_data(5, 84, [100, 0])
    servos.factory_reset(5)
    wait_for_answer(servos, 5)
    assert bytes(servos.read_raw_data(5, 84, 2)) == (800).to_bytes(2, "little")
