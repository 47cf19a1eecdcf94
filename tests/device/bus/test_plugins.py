"""Drivers of other packages: the example package, built and installed as its users install it."""

import os
import select
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import msgspec
import pytest

from kata.cli.doctor import CheckResult, examine
from kata.commissioning.latency import measure_bus
from kata.device import config
from kata.device.bus.registry import find_driver, installed_drivers
from kata.device.config import ConfigError, Inputs, StationConfig
from kata.settings import Settings
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.ports import TerminalPort
from kata.simulator.wire import Wire
from kata.testing.world import RecordingWorld
from tests.support.paths import ROOT

EXAMPLE = ROOT / "backend/example-drive"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of packages with the example's wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(build, cwd=EXAMPLE, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


@pytest.fixture(autouse=True)
def _no_drivers_remembered() -> Iterator[None]:
    find_driver.cache_clear()
    yield
    find_driver.cache_clear()


@pytest.fixture
def installed(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(site))


def declare(folder: Path, package: str, target: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a package that is nothing but an entry point."""
    metadata = folder / f"{package}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[kata.drivers]\nother = {target}\n")
    monkeypatch.syspath_prepend(str(folder))


@pytest.mark.campaign
def test_the_example_package_passes_the_conformance_suite(site: Path) -> None:
    paths = os.pathsep.join([str(site), str(ROOT / "backend"), str(ROOT)])
    suite = [sys.executable, "-m", "pytest", "-q", "-p", "no:schemathesis", "-p", "no:cacheprovider", "tests"]
    done = subprocess.run(
        suite, cwd=EXAMPLE, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:]
    assert "passed" in done.stdout


def test_unknown_driver_is_refused_with_the_installed_ones(installed: None) -> None:
    with pytest.raises(
        ConfigError, match="protocol: no driver is named 'aspina'; installed are dynamixel, modbus, example"
    ):
        StationConfig(protocol="aspina")


def test_a_driver_that_is_not_installed_is_unknown() -> None:
    assert installed_drivers() == ["dynamixel", "modbus"]
    with pytest.raises(ConfigError, match="no driver is named 'example'"):
        StationConfig(protocol="example")


@pytest.mark.parametrize(
    ("station", "message"),
    [
        ("baud = 57600", "baud: 57600 is not within one of 115,200, 1,000,000 bit/s"),
        ("return_delay_us = 100", "return_delay_us: 100 is not within 0 to 0 us"),
        ("[inputs]\npedal_port = 9", "inputs.pedal_port: 9 is not within 1 to 8"),
        ("rate_hz = 500\ncycle_hz = 500", r"cycle_hz: this bus carries at most 4\d\d cycles a second \(example at"),
        ("[driver]\ntorque_per_nm = 1", "driver.torque_per_nm: 1 is not within 50 to 1,000 units a Nm"),
        ("[driver]\ntorque = 1", "driver: Object contains unknown field `torque`"),
    ],
)
def test_the_drivers_ranges_are_checked(installed: None, tmp_path: Path, station: str, message: str) -> None:
    file = tmp_path / "station.toml"
    file.write_text(f'protocol = "example"\n{station}\n')
    with pytest.raises(ConfigError, match=message):
        config.read(file)


def test_a_station_with_the_driver_keeps_its_settings(installed: None, tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    config.write(StationConfig(protocol="example", driver={"torque_per_nm": 200.0}), file)
    assert config.read(file).driver == {"torque_per_nm": 200.0}


def test_built_in_drivers_have_no_settings_table() -> None:
    with pytest.raises(ConfigError, match="driver: the driver 'modbus' has no settings of its own"):
        StationConfig(protocol="modbus", baud=115_200, rate_hz=20, cycle_hz=20, driver={"speed": 1})


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("not_there:DRIVER", r"the driver 'other' \(not_there:DRIVER\) cannot be loaded: ModuleNotFoundError"),
        ("math:pi", r"the driver 'other' \(math:pi\) is a float, not a kata.device.bus.plugin.Driver"),
    ],
)
def test_driver_that_cannot_be_loaded_is_refused_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str, message: str
) -> None:
    declare(tmp_path, "broken", target, monkeypatch)
    assert "other" in installed_drivers()
    with pytest.raises(ConfigError, match=message):
        StationConfig(protocol="other")


def test_two_packages_with_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(tmp_path / "a", "first", "math:pi", monkeypatch)
    declare(tmp_path / "b", "second", "math:e", monkeypatch)
    with pytest.raises(ConfigError, match="several packages have a driver named 'other'"):
        StationConfig(protocol="other")


def test_measured_cycles_show_silent_and_damaged_answers(installed: None) -> None:
    from kata_example_drive.simulated import example_drives

    world = RecordingWorld("example", make_drives=example_drives)
    whole = measure_bus(world.config, world.open_transport)
    assert (whole.silent, whole.damaged) == ((), 0)
    # Five requests of 9 bytes and answers of 31, at 10 us a byte.
    assert whole.median_ms == pytest.approx(2.0, abs=0.05)
    world.fault("silent", 3)
    world.fault("wrong_crc", 2)
    found = measure_bus(world.config, world.open_transport)
    assert found.silent == (2, 3)
    assert found.damaged > 10
    assert found.carried_hz < whole.carried_hz


@pytest.fixture
def port(installed: None, tmp_path: Path) -> Iterator[str]:
    """Yield a pseudo-terminal with simulated example drives behind it."""
    from kata_example_drive.simulated import example_drives

    apparatus = SimulatedApparatus()
    line, faults, _ = example_drives(apparatus, 1_000_000)
    wire = Wire(line, faults, partial(TerminalPort, tmp_path / "port"))
    ended = threading.Event()

    def serve() -> None:
        while not ended.is_set():
            if select.select(wire.sources, [], [], 0.0005)[0]:
                wire.receive()
            wire.serve(time.monotonic_ns())

    thread = threading.Thread(target=serve)
    thread.start()
    yield str(tmp_path / "port")
    ended.set()
    thread.join()
    wire.close()


def test_the_doctor_speaks_to_drives_of_any_protocol(port: str, tmp_path: Path) -> None:
    def drives(station: StationConfig) -> CheckResult:
        file = tmp_path / "station.toml"
        config.write(station, file)
        findings = examine(Settings(data=tmp_path, database_url="", station=file))
        return next(finding for finding in findings if finding.name == "Drives")

    station = StationConfig(protocol="example", port=port)
    assert drives(station).state == "ok"
    axes = tuple(msgspec.structs.replace(axis, id=axis.id + 10) for axis in station.axes)
    silent = drives(msgspec.structs.replace(station, axes=axes, inputs=Inputs(drive_id=11)))
    assert (silent.state, silent.message) == ("problem", "These motors do not answer at 1000000 bit/s: 1, 2, 3, 4, 5.")
