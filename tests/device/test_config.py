"""A station's configuration: what it refuses, and that what is written is what is read."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from kata.device.ceiling import ceiling_hz
from kata.device.config import NO_REGISTER, ConfigError, Inputs, ModbusMap, StationConfig, at_rate, read, write

MODBUS: dict[str, Any] = {"protocol": "modbus", "baud": 115_200}


@pytest.mark.parametrize(
    "config",
    [
        StationConfig(),
        StationConfig(inputs=Inputs(usb_pedal="/dev/input/by-id/a-pedal")),
        StationConfig(**MODBUS, rate_hz=25, cycle_hz=50, modbus=ModbusMap(clear=NO_REGISTER, speed_per_deg_s=100.0)),
    ],
)
def test_what_is_written_is_what_is_read(tmp_path: Path, config: StationConfig) -> None:
    write(config, tmp_path / "station.toml")
    assert read(tmp_path / "station.toml") == config


@pytest.mark.parametrize(
    ("settings", "at_most"),
    [
        ({"baud": 115_200}, 43),
        (MODBUS, 50),
        (MODBUS | {"modbus": ModbusMap(function_23=False)}, 35),
        ({"return_delay_us": 500, "rate_hz": 200, "cycle_hz": 200}, 162),
    ],
)
def test_a_rate_that_the_bus_cannot_carry_is_refused_and_the_ceiling_told(settings: Any, at_most: int) -> None:
    with pytest.raises(ConfigError, match=rf"at most {at_most} cycles a second"):
        StationConfig(**settings)
    fits = StationConfig(**settings | {"rate_hz": at_most, "cycle_hz": at_most})
    assert ceiling_hz(fits) >= at_most


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"rate_hz": 30}, "rate_hz"),
        ({"rate_hz": 10, "cycle_hz": 10}, "cycle_hz"),
        ({"bus_watchdog_ms": 10}, "bus_watchdog_ms"),
        ({"bus_watchdog_ms": 250}, "bus_watchdog_ms"),
        ({"baud": 0}, "baud"),
        ({"return_delay_us": -1}, "return_delay_us"),
        ({"inputs": Inputs(drive_id=9)}, "inputs.drive_id"),
        ({"inputs": Inputs(max_age_cycles=0)}, "inputs.max_age_cycles"),
        ({"axes": StationConfig().axes[:4]}, "axes: 5 are needed"),
    ],
)
def test_what_cannot_be_is_refused_by_name(settings: Any, field: str) -> None:
    with pytest.raises(ConfigError, match=field):
        StationConfig(**settings)


@pytest.mark.parametrize(
    "line",
    [
        "max_torque_nm = 5.0",
        "max_speed_deg_s = 0.0",
        "min_deg = 50.0",
        "min_deg = -inf",
        "direction = 0",
        "max_acceleration_deg_s2 = nan",
        "lag_s = -0.01",
        "lag_s = 0.31",
        "lag_s = nan",
        "lag2_s2 = 0.021",
        "friction_deg = 5.1",
    ],
)
def test_an_axis_that_cannot_be_is_refused_by_its_number(tmp_path: Path, line: str) -> None:
    name = line.split()[0]
    axes = [{"id": n, "min_deg": -10.0, "max_deg": 10.0} for n in range(1, 6)]
    text = ""
    for n, axis in enumerate(axes):
        values = {key: str(value) for key, value in axis.items()}
        if n == 2:
            values[name] = line.split(" = ")[1]
        text += "[[axes]]\n" + "\n".join(f"{key} = {value}" for key, value in values.items()) + "\n"
    (tmp_path / "station.toml").write_text(text)
    with pytest.raises(ConfigError, match=r"axes\[3\]"):
        read(tmp_path / "station.toml")


@pytest.mark.parametrize(("rate_hz", "cycle_hz"), [(10, 100), (100, 100), (30, 120), (200, 200)])
def test_at_another_rate_the_bus_is_read_as_often_as_before_or_a_little_oftener(rate_hz: int, cycle_hz: int) -> None:
    changed = at_rate(StationConfig(), rate_hz)
    assert (changed.rate_hz, changed.cycle_hz) == (rate_hz, cycle_hz)


@pytest.mark.parametrize("rate_hz", [0, -5, 400])
def test_a_rate_that_cannot_be_is_refused(rate_hz: int) -> None:
    with pytest.raises(ConfigError, match="_hz"):
        at_rate(StationConfig(), rate_hz)


def test_a_turned_apparatus_has_drives_that_see_motors_3_and_4_the_other_way_round() -> None:
    right = StationConfig()
    left = msgspec.structs.replace(right, side="left")
    assert [axis.direction for axis in right.as_it_stands.axes] == [1, 1, 1, 1, 1]
    assert [axis.direction for axis in left.as_it_stands.axes] == [1, 1, -1, -1, 1]
    assert [axis.direction for axis in left.axes] == [1, 1, 1, 1, 1]
    assert left.as_it_stands.mechanism_deg == right.mechanism_deg


def test_a_setting_that_nobody_knows_is_refused(tmp_path: Path) -> None:
    (tmp_path / "station.toml").write_text("rate = 100\n")
    with pytest.raises(ConfigError, match="rate"):
        read(tmp_path / "station.toml")


def test_how_the_drives_lag_is_told_axis_by_axis() -> None:
    lags = [(0.06, 0.002, 0.3), (0.05, 0.001, 0.2), (0.0, 0.0, 0.0), (0.3, 0.02, 5.0), (0.1, 0.003, 1.0)]
    axes = tuple(
        msgspec.structs.replace(axis, lag_s=a1, lag2_s2=a2, friction_deg=friction)
        for axis, (a1, a2, friction) in zip(StationConfig().axes, lags, strict=True)
    )
    lag = StationConfig(axes=axes).lag
    assert lag.first_s.tolist() == [a1 for a1, _, _ in lags]
    assert lag.second_s2.tolist() == [a2 for _, a2, _ in lags]
    assert lag.friction_deg.tolist() == [friction for _, _, friction in lags]


def test_until_a_station_has_been_identified_nothing_is_known_of_its_lag() -> None:
    lag = StationConfig().lag
    assert not np.any([lag.first_s, lag.second_s2, lag.friction_deg])
