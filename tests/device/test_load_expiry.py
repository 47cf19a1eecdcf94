"""A loaded recording expires: the next press could otherwise move the arm hours later, with another patient in the apparatus."""

import tempfile
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from kata.device.bus.interface import BusSample, DriveStatus
from kata.device.ipc_messages import Approach, Pause, Play, Unload
from tests.support.stepped import Stepped, SteppedApparatus
from tests.support.trajectories import LOAD, a_trajectory

_LIMIT_S: Final = 600


class PolledApparatus(SteppedApparatus):
    """Each cycle reads every drive's status, so that minutes can pass between two cycles."""

    def read(self) -> BusSample:
        statuses = [DriveStatus(self.t_ns, n, on, 0, False) for n, on in enumerate(self.torque)]
        return structs.replace(super().read(), statuses=tuple(statuses))


def loaded(folder: Path) -> Stepped:
    stepped = Stepped(folder, apparatus=PolledApparatus())
    assert stepped.send(LOAD, a_trajectory()) is None
    return stepped


def wait(stepped: Stepped, seconds: float) -> None:
    """Let time pass between two cycles."""
    stepped._t_ns += int(seconds * 1e9)
    stepped.cycle()


def test_recording_is_unloaded_after_ten_minutes_without_a_command(tmp_path: Path) -> None:
    stepped = loaded(tmp_path)
    wait(stepped, _LIMIT_S - 1)
    assert stepped.mode == "ready"
    wait(stepped, 1)
    assert (stepped.mode, stepped.snapshot.run) == ("idle", None)
    (event,) = [event for event in stepped.link.events if event.code == "unloaded"]
    assert event.message == "The recording was unloaded, because no command came for 10 minutes."
    assert stepped.link.journals[0]._finished
    refusal = stepped.send(Approach())
    assert refusal is not None and refusal.code == "is_idle"
    assert not stepped.torque


def test_held_arm_does_not_expire(tmp_path: Path) -> None:
    stepped = loaded(tmp_path)
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    wait(stepped, 2 * _LIMIT_S)
    assert stepped.mode == "paused"
    assert stepped.send(Play()) is None


@pytest.mark.counted
def test_suspension_of_the_computer_counts(tmp_path: Path) -> None:
    stepped = loaded(tmp_path)
    stepped.cycle(late_ms=(_LIMIT_S - 1) * 1000.0)
    assert stepped.mode == "ready"
    stepped.cycle(late_ms=1000.0)
    assert stepped.mode == "idle"


@pytest.mark.parametrize(("left_ns", "mode"), [(1, "ready"), (0, "idle")])
def test_recording_expires_exactly_at_its_time(tmp_path: Path, left_ns: int, mode: str) -> None:
    stepped = loaded(tmp_path)
    machine = stepped.loop._machine
    stepped._t_ns = machine._ready_until_ns - 1_000_000_000 // stepped.config.cycle_hz - left_ns
    stepped.cycle()
    assert stepped.mode == mode


@pytest.mark.parametrize(("late_ms", "counted_ms"), [(250.0, 0.0), (250.5, 250.5)])
def test_only_lateness_of_a_suspension_counts_as_waiting(tmp_path: Path, late_ms: float, counted_ms: float) -> None:
    stepped = loaded(tmp_path)
    before_ns = stepped.loop._machine._ready_until_ns
    stepped.cycle(late_ms=late_ms)
    assert before_ns - stepped.loop._machine._ready_until_ns == counted_ms * 1e6


@given(
    st.lists(
        st.tuples(st.sampled_from([1.0, 300.0, 599.0, 601.0, 7200.0]), st.booleans(), st.booleans()),
        min_size=1,
        max_size=6,
    )
)
def test_recording_stays_loaded_as_long_as_commands_come(waits: list[tuple[float, bool, bool]]) -> None:
    """Each wait is spent awake or suspended, and a refused command may follow it."""
    with tempfile.TemporaryDirectory() as folder:
        stepped, without_s = loaded(Path(folder)), 0.0
        for seconds, suspended, command in waits:
            if suspended:
                stepped.cycle(late_ms=seconds * 1000.0)
            else:
                wait(stepped, seconds)
            without_s += seconds
            assert (stepped.mode == "ready") is (without_s < _LIMIT_S)
            if stepped.mode != "ready":
                assert stepped.send(Unload()) is not None
                return
            if command:
                assert stepped.send(Pause()) is not None
                without_s = 0.0
