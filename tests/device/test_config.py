"""A station's configuration: refused values, and reading what was written."""

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.config import (
    NO_REGISTER,
    Axis,
    ConfigError,
    Inputs,
    ModbusMap,
    StationConfig,
    as_toml,
    at_rate,
    read,
    write,
)
from kata.device.config_rules import RANGES
from kata.motion.arm_load import ArmLoad
from kata.motion.axes import AXES

MODBUS: dict[str, Any] = {"protocol": "modbus", "baud": 115_200}
MODBUS_SLOW: dict[str, Any] = {**MODBUS, "rate_hz": 20, "cycle_hz": 20}


@pytest.mark.parametrize(
    "config",
    [
        StationConfig(),
        StationConfig(inputs=Inputs(usb_pedal="/dev/input/by-id/a-pedal")),
        StationConfig(**MODBUS, rate_hz=20, cycle_hz=40, modbus=ModbusMap(clear=NO_REGISTER, speed_per_deg_s=100.0)),
    ],
)
def test_configuration_is_read_back_as_written(tmp_path: Path, config: StationConfig) -> None:
    write(config, tmp_path / "station.toml")
    assert read(tmp_path / "station.toml") == config


@pytest.mark.parametrize(
    ("settings", "at_most"),
    [
        ({"baud": 115_200}, 40),
        (MODBUS, 43),
        (MODBUS | {"modbus": ModbusMap(function_23=False)}, 31),
        ({"return_delay_us": 500, "rate_hz": 200, "cycle_hz": 200}, 157),
    ],
)
def test_rate_above_the_bus_capacity_is_refused_with_its_limit(settings: Any, at_most: int) -> None:
    with pytest.raises(ConfigError, match=rf"at most {at_most} cycles a second"):
        StationConfig(**settings)
    fits = StationConfig(**settings | {"rate_hz": at_most, "cycle_hz": at_most})
    assert max_cycle_hz(fits) >= at_most


def changed(**axis: object) -> tuple[Axis, ...]:
    """Return the default axes with the third one changed."""
    axes = list(StationConfig().axes)
    axes[2] = msgspec.structs.replace(axes[2], **axis)
    return tuple(axes)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"limit_tolerance_deg": math.inf}, "limit_tolerance_deg: inf is not within 1 to 6 deg"),
        ({"limit_tolerance_deg": math.nan}, "limit_tolerance_deg: nan is not within 1 to 6 deg"),
        ({"following_error_deg": math.nan}, "following_error_deg: nan is not within 2 to 30 deg"),
        ({"service_silence_ms": 2_000_000_000}, "service_silence_ms: 2000000000 is not within 200 to 900 ms"),
        ({"inputs": Inputs(max_age_cycles=1_000_000)}, "inputs.max_age_cycles: 1000000 is not within 1 to 150 cycles"),
        ({"inputs": Inputs(max_age_cycles=0)}, "inputs.max_age_cycles: 0 is not within 1 to 150 cycles"),
        ({"approach_speed_deg_s": 0.0}, "approach_speed_deg_s: 0 is not within 1 to 45 deg/s"),
        ({"approach_speed_deg_s": -15.0}, "approach_speed_deg_s: -15 is not within 1 to 45 deg/s"),
        ({"approach_speed_deg_s": 400.0}, "approach_speed_deg_s: 400 is not within 1 to 45 deg/s"),
        ({"axes": changed(id=254)}, r"axes\[3\].id: 254 is not within 0 to 252"),
        (MODBUS_SLOW | {"axes": changed(id=248)}, r"axes\[3\].id: 248 is not within 1 to 247"),
        ({"axes": changed(position_p_gain=-1)}, r"axes\[3\].position_p_gain: -1 is not within 0 to 16,383"),
        ({"axes": changed(position_d_gain=16_384)}, r"axes\[3\].position_d_gain: 16384 is not within 0 to 16,383"),
        ({"axes": changed(zero_count=4_096)}, r"axes\[3\].zero_count: 4096 is not within 0 to 4,095 counts"),
        ({"axes": changed(model=1060)}, r"axes\[3\].model: 1,?060 is not .*known are .*1140 \(XH540-V270\)"),
        (
            {"axes": changed(model=1030, max_torque_nm=4.0)},
            r"axes\[3\].max_torque_nm: 4 is more than the stall torque of a XM430-W210 \(3\)",
        ),
        ({"axes": changed(model=0)}, r"axes\[3\].model: 0 is not within one of"),
        (
            {"axes": changed(max_speed_deg_s=500.0)},
            r"axes\[3\].max_speed_deg_s: 500 is not within 1 to 150 deg/s \(.*75 rpm",
        ),
        ({"axes": changed(max_deg=131.0)}, r"axes\[3\].max_deg: 131 is not within -10 to 130 deg"),
        ({"bus_watchdog_ms": 250}, "bus_watchdog_ms: 250 is not within 40 to 200 ms in steps of 20"),
        ({"bus_watchdog_ms": 50}, "bus_watchdog_ms: 50 is not within"),
        ({"return_delay_us": 600}, "return_delay_us: 600 is not within 0 to 508 us in steps of 2"),
        ({"return_delay_us": 7}, "return_delay_us: 7 is not within"),
        ({"return_delay_us": -2}, "return_delay_us: -2 is not within"),
        ({"baud": 0}, "baud: 0 is not within one of 9,600"),
        ({"baud": 250_000}, "baud: 250000 is not within one of 9,600"),
        ({"inputs": Inputs(estop_port=4)}, "inputs.estop_port: 4 is not within 1 to 3"),
        ({"inputs": Inputs(estop_second_port=0)}, "inputs.estop_second_port: 0 is not within 1 to 3"),
        ({"inputs": Inputs(contacts_disagree_ms=1)}, "inputs.contacts_disagree_ms: 1 is not within 20 to 200 ms"),
        ({"silence_ms": 5_000}, "silence_ms: 5000 is not within 20 to 300 ms"),
        ({"reversal_s": math.inf}, "reversal_s: inf is not within 0.2 to 10 s"),
        ({"modbus": ModbusMap(torque_enable=-1)}, "modbus.torque_enable: -1 is not within 0 to 65,535"),
        ({"modbus": ModbusMap(clear=65_536)}, "modbus.clear: 65536 is not within 0 to 65,535, or -1"),
        ({"modbus": ModbusMap(torque_per_nm=0.0)}, "modbus.torque_per_nm: 0 is not within 50 to 10,000"),
        ({"modbus": ModbusMap(position_per_deg=math.nan)}, "modbus.position_per_deg: nan is not within"),
        ({"name": ""}, "name: '' must have 1 to 100 printable characters"),
        ({"name": "n" * 101}, "must have 1 to 100 printable characters"),
        ({"port": " "}, "port: ' ' must be the path of a serial port"),
        ({"inputs": Inputs(usb_pedal="pedal")}, "inputs.usb_pedal: 'pedal' must be an absolute path"),
    ],
)
def test_out_of_range_value_is_refused_with_field_and_range(settings: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        StationConfig(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rate_hz": 30}, r"rate_hz: 30 must divide cycle_hz \(100\)"),
        ({"rate_hz": 20, "cycle_hz": 20, "bus_watchdog_ms": 40}, "bus_watchdog_ms: 40 is less than 104 ms"),
        ({"rate_hz": 20, "cycle_hz": 20, "silence_ms": 99}, "silence_ms: 99 is less than 100 ms, 2 cycles at 20 Hz"),
        ({"rate_hz": 20, "cycle_hz": 20, "following_error_ms": 99}, "following_error_ms: 99 is less than 100 ms"),
        (
            {"rate_hz": 20, "cycle_hz": 20, "inputs": Inputs(contacts_disagree_ms=99)},
            "inputs.contacts_disagree_ms: 99 is less than 100 ms",
        ),
        (
            {"inputs": Inputs(max_age_cycles=31)},
            "inputs.max_age_cycles: 31 are 310 ms at 100 Hz; the maximum is 300 ms",
        ),
        ({"inputs": Inputs(drive_id=9)}, "inputs.drive_id: 9 must be the id of one of the axes"),
        ({"inputs": Inputs(pedal_port=1)}, "inputs.pedal_port: 1 is also inputs.estop_port"),
        ({"inputs": Inputs(estop_second_port=1)}, "inputs.estop_second_port: 1 is also inputs.estop_port"),
        ({"inputs": Inputs(estop_second_port=2)}, "inputs.estop_second_port: 2 is also inputs.pedal_port"),
        (MODBUS_SLOW | {"inputs": Inputs(pedal_port=9)}, r"the ports \[1, 9\] must lie within 8 consecutive inputs"),
        ({"axes": StationConfig().axes[:4]}, "axes: 5 are needed, but 4 are given"),
        ({"axes": changed(id=2)}, "axes: ids must differ"),
        ({"axes": changed(min_deg=50.0, max_deg=50.0)}, r"axes\[3\].min_deg: 50 must be below max_deg \(50\)"),
        (
            {"axes": changed(max_speed_deg_s=14.0)},
            r"approach_speed_deg_s: 15 is above axes\[3\].max_speed_deg_s \(14\)",
        ),
        (
            {"axes": changed(max_acceleration_deg_s2=3_571.0)},
            r"axes\[3\].max_acceleration_deg_s2: 3571 is less than the 3571.43",
        ),
        (
            {"modbus": ModbusMap(goal_position=0x0007)},
            "modbus.goal_position: register 7 overlaps modbus.position_limits",
        ),
        ({"modbus": ModbusMap(clear=0x0000)}, r"modbus.clear: register 0 overlaps modbus.torque_enable \(0\)"),
        ({"modbus": ModbusMap(torque=0x0020 + 125)}, "modbus: status to torque span 126 registers"),
        (
            {"modbus": ModbusMap(status_watchdog_bit=0)},
            "modbus.status_watchdog_bit: 0 is also modbus.status_torque_bit",
        ),
        (
            MODBUS_SLOW | {"modbus": ModbusMap(speed_per_deg_s=220.0)},
            "modbus.speed_per_deg_s: a register holds at most 148.9",
        ),
        (
            MODBUS_SLOW | {"modbus": ModbusMap(torque_per_nm=7_500.0)},
            "modbus.torque_per_nm: a register holds at most 4.36",
        ),
    ],
)
def test_contradictory_fields_are_refused(settings: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        StationConfig(**settings)


def test_registers_that_a_drive_does_not_have_overlap_nothing() -> None:
    absent: Any = dict.fromkeys(
        ["clear", "watchdog_ms", "torque_limit", "position_limits", "response_delay_us"], NO_REGISTER
    )
    assert StationConfig(**MODBUS_SLOW, modbus=ModbusMap(**absent)).modbus.clear == NO_REGISTER


def test_every_number_has_a_range_for_each_protocol() -> None:
    """A new field needs a row in the table."""
    for protocol in ("dynamixel", "modbus"):
        ranged = {row.field for row in RANGES if row.protocol in (None, protocol)}
        for holder, struct in (
            ("", StationConfig),
            ("inputs.", Inputs),
            ("axes.", Axis),
            ("arm.", ArmLoad),
            ("modbus.", ModbusMap),
        ):
            for field in msgspec.structs.fields(struct):
                if field.type in (int, float, int | None, float | None):
                    names = {f"{holder}{field.name}"}
                    if field.name in ("min_deg", "max_deg"):
                        names = {f"axes[{motor}].{field.name}" for motor in AXES}
                    assert names <= ranged


def test_widest_axis_spans_less_than_one_turn() -> None:
    """A Dynamixel drive reports one turn after power-up: a wider range would be ambiguous."""
    tolerance = next(row.high for row in RANGES if row.field == "limit_tolerance_deg")
    for motor in AXES:
        low, high = (
            next(row for row in RANGES if row.field == f"axes[{motor}].{end}") for end in ("min_deg", "max_deg")
        )
        assert high.high - low.low + 2 * tolerance < 360.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("baud = 'fast'", "baud: Expected `int`, got `str`"),
        ("[inputs]\nestop_port = 1.5", "inputs.estop_port: Expected `int"),
        ("[[axes]]\nid = 1\nmin_deg = 0\nmax_deg = 'far'", r"axes\[1\].max_deg: Expected `float`, got `str`"),
        ("[[axes]]\nid = true\nmin_deg = 0\nmax_deg = 1", r"axes\[1\].id: Expected `int`, got `bool`"),
        ("[[axes]]\nid = 1\nmin_deg = -10.0\nmax_deg = inf", r"axes\[1\].max_deg: inf is not within -29 to 53 deg"),
        ("axes = []", "axes: 5 are needed, but 0 are given"),
        (f"[arm]\ninertia = {[0.0] * 9 + [21.0]}", "arm.inertia: number 10, 21, is more than 20"),
        ("[arm]\ngirdle_nm_rad = [61.0, 0.0]", "arm.girdle_nm_rad: number 1, 61, is more than 60"),
        ("[arm]\nbalancer_m = [0.0, 0.0, nan]", "arm.balancer_m: number 3, nan, is more than 2"),
        (f"[[axes]]\nid = 1\nmin_deg = 0\nmax_deg = 1\nweight_nm = {[1.0] * 6}", "unknown field `weight_nm`"),
        ("rate = 100", "unknown field `rate`"),
        ("baud = ", "station.toml: "),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_field(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "station.toml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        read(tmp_path / "station.toml")


@pytest.mark.parametrize("limit_deg_s", [1.0, 14.0, 150.0])
def test_a_patients_speed_limit_slows_every_axis_and_the_approach(limit_deg_s: float) -> None:
    limited = StationConfig().with_speed_limit(limit_deg_s)
    assert {axis.max_speed_deg_s for axis in limited.axes} == {min(limit_deg_s, 100.0)}
    assert limited.approach_speed_deg_s == min(limit_deg_s, 15.0)
    assert StationConfig().with_speed_limit(None) == StationConfig()


@pytest.mark.parametrize(("rate_hz", "cycle_hz"), [(10, 100), (100, 100), (30, 120), (200, 200)])
def test_bus_reads_as_often_as_before_or_slightly_more_often(rate_hz: int, cycle_hz: int) -> None:
    changed = at_rate(StationConfig(), rate_hz)
    assert (changed.rate_hz, changed.cycle_hz) == (rate_hz, cycle_hz)


@pytest.mark.parametrize("rate_hz", [0, -5, 400])
def test_a_rate_that_cannot_be_is_refused(rate_hz: int) -> None:
    with pytest.raises(ConfigError, match="_hz"):
        at_rate(StationConfig(), rate_hz)


def test_turned_apparatus_mirrors_motors_3_and_4() -> None:
    right = StationConfig()
    left = msgspec.structs.replace(right, side="left")
    assert [axis.direction for axis in right.with_side_directions.axes] == [1, 1, 1, 1, 1]
    assert [axis.direction for axis in left.with_side_directions.axes] == [1, 1, -1, -1, 1]
    assert [axis.direction for axis in left.axes] == [1, 1, 1, 1, 1]
    assert left.with_side_directions.mechanism_deg == right.mechanism_deg


def test_drive_lag_is_given_axis_by_axis() -> None:
    lags = [(0.06, 0.002, 0.3), (0.05, 0.001, 0.2), (0.0, 0.0, 0.0), (0.3, 0.02, 5.0), (0.1, 0.003, 1.0)]
    axes = tuple(
        msgspec.structs.replace(axis, lag_s=a1, lag2_s2=a2, friction_deg=friction)
        for axis, (a1, a2, friction) in zip(StationConfig().axes, lags, strict=True)
    )
    lag = StationConfig(axes=axes).servo_model
    assert lag.first_s.tolist() == [a1 for a1, _, _ in lags]
    assert lag.second_s2.tolist() == [a2 for _, a2, _ in lags]
    assert lag.friction_deg.tolist() == [friction for _, _, friction in lags]


def test_a_file_with_the_former_weight_stays_valid(tmp_path: Path) -> None:
    """Earlier releases wrote six zeros for each axis."""
    fields = msgspec.toml.decode(as_toml(StationConfig()))
    for axis in fields["axes"]:
        axis["weight_nm"] = [0.0] * 6
    (tmp_path / "station.toml").write_bytes(msgspec.toml.encode(fields))
    assert read(tmp_path / "station.toml") == StationConfig()


def test_unidentified_station_has_no_known_lag() -> None:
    lag = StationConfig().servo_model
    assert not np.any([lag.first_s, lag.second_s2, lag.friction_deg])
