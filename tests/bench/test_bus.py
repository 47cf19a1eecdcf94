"""The benchmark of the bus. It takes as long as all others of a test run, so it has a module, which another process can run."""

import json
from pathlib import Path

import pytest

from kata.bench import bus
from kata.bench.other_libraries import installed
from kata.bench.report import Report
from tests.support.bench_command import bench
from tests.support.kata_command import kata_here


def test_bus_with_one_other_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every bus, and each kind of figure. Each of the other libraries takes two seconds on each bus."""
    measured = {"kata", "kata_cycle", "dynamixel_sdk"}
    monkeypatch.setattr(bus, "DYNAMIXEL", [one for one in bus.DYNAMIXEL if one.host in measured])
    monkeypatch.setattr(bus, "MODBUS", [one for one in bus.MODBUS if one.host in measured])
    monkeypatch.setattr(bus, "LATENCIES_MS", bus.LATENCIES_MS[:1])
    out = tmp_path / "bus.json"
    done = kata_here("bench", "bus", "--seconds", "0.05", "--rounds", "1", "--json", out)
    assert done.returncode == 0, done.stderr
    wanted = {
        "ceiling_ratio_115200",
        "ceiling_ratio_1000000",
        "cpu_percent_115200",
        "latency_0.25_0.25_inputs_lost_1000000",
        "modbus_ceiling_ratio_115200",
        "silent_servo_lost_ms",
        "noise_wasted_bytes",
    }
    theirs = {"vs_dynamixel_sdk_1000000", "dynamixel_sdk_cpu_percent_115200", "dynamixel_sdk_silent_servo_lost_ms"}
    figures = set(json.loads(out.read_text())["figures"])
    assert (wanted | theirs if installed("dynamixel_sdk") else wanted) <= figures


@pytest.mark.campaign
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
