"""Teaching with a stepped clock: torque off, and the pedal determines what is recorded."""

from pathlib import Path

import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import FinishTeaching, Teach
from tests.support.stepped import Stepped

TEACH = Teach(teaching_id="teaching")


def test_records_only_while_the_pedal_is_down(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.5)
    for take in (1, 2):
        stepped.apparatus.pedal_down = True
        stepped.apparatus.angles_deg[2] = 10.0 * take
        stepped.forward(1.0)
        stepped.apparatus.pedal_down = False
        stepped.forward(0.5)
    stepped.send(FinishTeaching())

    recorded = stepped.journal()
    assert recorded.kind == "teaching"
    assert list(np.unique(recorded.take)) == [1, 2]
    for take in (1, 2):
        # The contact must be steady for two cycles before it counts, at both ends.
        assert np.count_nonzero(recorded.take == take) == pytest.approx(100, abs=1)
        assert recorded.measured_deg[recorded.take == take, 2] == pytest.approx(10.0 * take)
    assert not np.any(np.diff(recorded.t_ns[recorded.take == 1]) != 10_000_000)


def test_torque_is_off_throughout(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.apparatus.pedal_down = True
    for _ in range(100):
        stepped.cycle()
        assert not stepped.torque


def test_pedal_held_from_before_records_nothing_until_released(stepped: Stepped) -> None:
    stepped.apparatus.pedal_down = True
    stepped.forward(0.2)
    stepped.send(TEACH)
    stepped.forward(0.5)
    held = stepped.snapshot
    assert held.pedal == "stuck"
    assert held.teaching is not None
    assert held.teaching.samples == 0

    stepped.apparatus.pedal_down = False
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    stepped.forward(0.5)
    assert stepped.snapshot.pedal == "down"
    assert stepped.snapshot.teaching is not None
    assert stepped.snapshot.teaching.takes == 1


def test_a_bouncing_contact_makes_no_take(stepped: Stepped) -> None:
    stepped.send(TEACH)
    for _ in range(20):
        stepped.apparatus.pedal_down = not stepped.apparatus.pedal_down
        stepped.cycle()
    stepped.apparatus.pedal_down = False
    stepped.forward(0.2)

    assert stepped.snapshot.teaching is not None
    assert stepped.snapshot.teaching.takes == 0


def test_contact_closed_for_ten_milliseconds_is_no_press(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    stepped.cycle()
    stepped.cycle()
    stepped.apparatus.pedal_down = False
    stepped.forward(0.2)

    assert stepped.snapshot.teaching is not None
    assert stepped.snapshot.teaching.takes == 0


def test_sample_times_at_ten_hertz_are_0_1_seconds_apart(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, StationConfig(rate_hz=10))
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    stepped.forward(1.0)

    assert np.diff(stepped.journal().t_ns) == pytest.approx(0.1e9)


def test_cycle_without_all_angles_is_a_gap_and_not_invented(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    stepped.forward(0.5)
    stepped.apparatus.silent = {3}
    stepped.cycle()
    stepped.apparatus.silent = set()
    stepped.forward(0.5)

    gaps = np.diff(stepped.journal().t_ns)
    assert sorted(gaps)[-2:] == [10_000_000, 20_000_000]


def test_emergency_stop_ends_teaching_and_keeps_what_was_taught(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    stepped.forward(1.0)
    stepped.apparatus.estop_open = True
    stepped.forward(0.1)

    assert stepped.mode == "stopped"
    recorded = stepped.journal()
    assert len(recorded.t_ns) > 90
    assert recorded.end is not None


def test_stop_in_teaching_latches(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.link.request_stop()
    stepped.forward(0.1)

    assert stepped.mode == "stopped"
    assert stepped.causes() == ["operator_stop"]


def test_each_take_is_reported_at_its_start_and_end(stepped: Stepped) -> None:
    def messages() -> list[str]:
        return [event.message for event in stepped.link.events if event.code.startswith("take_")]

    stepped.send(TEACH)
    stepped.forward(0.1)
    assert messages() == []
    stepped.apparatus.pedal_down = True
    stepped.forward(1.0)
    assert messages() == ["Take 1 is being recorded."]
    stepped.apparatus.pedal_down = False
    stepped.forward(0.5)
    assert messages()[1:] == ["Take 1 has ended after 1.0 s."]
    stepped.apparatus.pedal_down = True
    stepped.forward(0.5)
    assert messages()[2:] == ["Take 2 is being recorded."]
    stepped.send(FinishTeaching())
    assert messages()[3:] == ["Take 2 has ended after 0.5 s."]


def test_teaching_ended_between_takes_reports_no_further_take(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.send(FinishTeaching())
    assert [event.code for event in stepped.link.events if event.code.startswith("take_")] == []


def test_snapshot_reports_the_current_take(stepped: Stepped) -> None:
    stepped.send(TEACH)
    stepped.forward(0.1)
    teaching = stepped.snapshot.teaching
    assert teaching is not None
    assert (teaching.teaching_id, teaching.takes, teaching.recording) == ("teaching", 0, False)
    assert (teaching.take_s, teaching.samples) == (0.0, 0)

    stepped.apparatus.pedal_down = True
    stepped.forward(0.5)
    teaching = stepped.snapshot.teaching
    assert teaching is not None
    assert (teaching.takes, teaching.recording) == (1, True)
    assert teaching.take_s == pytest.approx(0.5, abs=0.11)
    assert teaching.samples == round(teaching.take_s * 100) + 1
    recorded = stepped.journal()
    # A take's clock begins with the take.
    assert recorded.path_s[:3] == pytest.approx([0.0, 0.01, 0.02])
    assert set(recorded.phase) == {0}
    assert recorded.setpoint_deg == pytest.approx(recorded.measured_deg)


@pytest.mark.counted
def test_at_ten_hertz_each_take_begins_with_a_sample(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, StationConfig(rate_hz=10))
    stepped.send(TEACH)
    stepped.forward(0.1)
    for _ in range(3):
        stepped.apparatus.pedal_down = True
        stepped.forward(0.25)
        stepped.apparatus.pedal_down = False
        stepped.forward(0.13)
    stepped.send(FinishTeaching())

    recorded = stepped.journal()
    for take in (1, 2, 3):
        assert recorded.path_s[recorded.take == take] == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.counted
def test_pedal_reading_is_reported_during_teaching(stepped: Stepped) -> None:
    taken_for: list[str] = []

    def look() -> None:
        stepped.forward(0.1)
        taken_for.append(stepped.snapshot.pedal)

    look()
    stepped.send(TEACH)
    stepped.forward(0.1)
    stepped.apparatus.pedal_down = True
    look()
    stepped.send(FinishTeaching())
    look()
    stepped.send(TEACH)
    look()
    stepped.apparatus.inputs_silent = True
    look()
    assert taken_for == ["up", "down", "down", "stuck", "unknown"]
