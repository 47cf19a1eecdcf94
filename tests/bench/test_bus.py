"""The benchmark of the bus. It takes as long as all others of a test run, so it has a module, which another process can run."""

from pathlib import Path

import pytest

from kata.bench import bus
from kata.bench.other_libraries import installed
from kata.bench.report import Report
from tests.support.bench_command import bench


def test_bus(tmp_path: Path) -> None:
    report = bench("bus", "--seconds", "0.05", "--rounds", "1", out=tmp_path / "bus.json")
    wanted = {
        "ceiling_ratio_115200",
        "ceiling_ratio_1000000",
        "vs_dynamixel_sdk_1000000",
        "vs_rustypot_1000000",
        "vs_pymodbus_115200",
        "cpu_percent_115200",
        "silent_servo_lost_ms",
        "noise_wasted_bytes",
        "modbus_ceiling_ratio_115200",
        "dynamixel_sdk_cpu_percent_115200",
        "dynamixel_sdk_silent_servo_lost_ms",
    }
    # Other libraries are development dependencies; the table names a missing one.
    missing = [name for name in ("dynamixel_sdk", "rustypot", "pymodbus") if not installed(name)]
    assert {name for name in wanted if not any(peer in name for peer in missing)} <= set(report["figures"])


def test_missing_library_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus, "installed", lambda module: module != "rustypot")
    table = Report("Bus", ("Wire, library",))
    found = bus._select_installed(table, "dynamixel 115200", bus.DYNAMIXEL)
    assert [row[:2] for row in table.rows] == [
        ("dynamixel 115200, rustypot, Sync Read of a block", "not installed"),
    ]
    assert "rustypot" not in {contender.host for contender in found}
