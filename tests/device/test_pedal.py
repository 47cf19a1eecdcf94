"""The USB pedal, with a pipe instead of the kernel's device file. The data has the kernel's format."""

import os
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from kata.device.config import Inputs, StationConfig
from kata.device.ipc_messages import Teach
from kata.device.pedal import UsbPedal
from tests.support.stepped import Stepped


class Foot:
    """The kernel's end of the pipe."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)

    def key(self, value: int, code: int = 30) -> None:
        self.event(1, code, value)
        self.event(0, 0, 0)

    def event(self, kind: int, code: int, value: int) -> None:
        os.write(self._file, struct.pack("@llHHi", 0, 0, kind, code, value))

    def unplug(self) -> None:
        os.close(self._file)


class Clock:
    t_ns = 0


@pytest.fixture
def path(tmp_path: Path) -> Path:
    os.mkfifo(tmp_path / "pedal")
    return tmp_path / "pedal"


@pytest.fixture
def foot(path: Path) -> Foot:
    return Foot(path)


@pytest.fixture
def pedal(path: Path) -> Iterator[UsbPedal]:
    opened = UsbPedal(path, lambda: Clock.t_ns)
    yield opened
    opened.close()


def test_pedal_is_unknown_before_its_first_event(foot: Foot, pedal: UsbPedal) -> None:
    assert pedal.down() is None


def test_held_pedal_stays_down_and_repetitions_change_nothing(foot: Foot, pedal: UsbPedal) -> None:
    foot.key(1)
    assert pedal.down() is True
    foot.key(2)
    assert pedal.down() is True
    assert pedal.down() is True
    foot.key(0)
    assert pedal.down() is False


def test_any_of_three_pedals_in_one_counts(foot: Foot, pedal: UsbPedal) -> None:
    foot.key(1, code=48)
    foot.key(1, code=49)
    foot.key(0, code=48)
    assert pedal.down() is True
    foot.key(0, code=49)
    assert pedal.down() is False


def test_dropped_kernel_events_make_the_pedal_unknown(foot: Foot, pedal: UsbPedal) -> None:
    """A pipe cannot report held keys; the kernel's own file can."""
    foot.key(1)
    foot.event(0, 3, 0)
    assert pedal.down() is None


def test_unplugged_pedal_is_unknown_and_found_when_plugged_in(path: Path, foot: Foot, pedal: UsbPedal) -> None:
    foot.key(1)
    assert pedal.down() is True
    foot.unplug()
    assert pedal.down() is None
    again = Foot(path)
    again.key(1)
    assert pedal.down() is None
    Clock.t_ns += 1_000_000_000
    pedal.down()
    again.key(1)
    assert pedal.down() is True
    again.unplug()


def test_missing_pedal_is_unknown(tmp_path: Path) -> None:
    assert UsbPedal(tmp_path / "none", lambda: Clock.t_ns).down() is None


def test_configured_pedal_records(path: Path, foot: Foot, tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, StationConfig(inputs=Inputs(usb_pedal=str(path))))
    stepped.apparatus.pedal_down = True
    stepped.send(Teach(teaching_id="t"))
    foot.key(0)
    stepped.forward(0.5)
    shown = [stepped.snapshot.pedal]
    foot.key(1)
    stepped.forward(0.5)
    assert stepped.snapshot.teaching is not None
    assert stepped.snapshot.teaching.samples == pytest.approx(45, abs=5)
    foot.unplug()
    stepped.forward(0.2)
    shown.append(stepped.snapshot.pedal)
    assert shown == ["up", "unknown"]
    assert not stepped.snapshot.teaching.recording
