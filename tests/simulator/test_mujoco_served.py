"""The independent plant behind a pseudo-terminal in real time, and the message where MuJoCo is not installed."""

import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

import pytest
from msgspec import structs
from typer.testing import CliRunner

from kata.cli.main import app
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import Bus, BusSample
from kata.device.config import simulated
from kata.simulator.mechanics import NO_MUJOCO
from kata.simulator.process import SimulatorProcess

_LIMIT_S: Final = 60.0
_RAISE_DEG: Final = 10.0
_WITHOUT_MUJOCO: Final = (
    "import sys; sys.modules['mujoco'] = None; from kata.simulator.process import main; sys.exit(main())"
)


def until(bus: Bus, what: Callable[[BusSample], bool], goals: list[float] | None = None) -> BusSample:
    """Read, and send goals, until something is seen."""
    limit_s = time.monotonic() + _LIMIT_S
    while time.monotonic() < limit_s:
        if goals:
            bus.write_setpoints(goals)
        found = bus.read()
        if what(found):
            return found
        time.sleep(0.005)
    raise AssertionError("not seen")


def answered(sample: BusSample) -> bool:
    return all(sample.drives)


def angles(sample: BusSample) -> list[float]:
    return [drive.position_deg for drive in sample.drives if drive]


def test_the_real_driver_raises_the_arm_of_the_served_plant(tmp_path: Path) -> None:
    with closing(SimulatorProcess(tmp_path, plant="mujoco")) as apparatus, closing(apparatus.client()) as hand:
        # A busy computer may keep this process from sending for longer than a real station would.
        bus = make_bus(structs.replace(simulated(apparatus.port), bus_watchdog_ms=200))
        bus.open()
        try:
            bus.configure(range(5))
            rest = angles(until(bus, answered))
            bus.torque_on(rest)
            raised = [*rest[:2], rest[2] + _RAISE_DEG, *rest[3:]]
            until(bus, lambda sample: answered(sample) and abs(angles(sample)[2] - raised[2]) < 1.0, raised)
            assert all(axis.torque_on for axis in hand.state().axes)
            assert "mujoco" in Path(f"/proc/{apparatus.pid}/maps").read_text()
            bus.torque_off()
            until(bus, lambda _: not any(axis.torque_on for axis in hand.state().axes))
        finally:
            bus.close()


def test_without_mujoco_the_simulator_says_what_to_install(tmp_path: Path) -> None:
    command = [sys.executable, "-c", _WITHOUT_MUJOCO, "--control", str(tmp_path / "s.sock"), "--plant", "mujoco"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert NO_MUJOCO in ended.stderr


def test_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kata.simulator.process._MODULE", ["-c", _WITHOUT_MUJOCO])
    ended = CliRunner().invoke(app, ["simulate", "--plant", "mujoco"])
    assert ended.exit_code != 0
    assert NO_MUJOCO in ended.output
