"""Station configurations and the limits within which the supervisor must act."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec
from hypothesis import strategies as st

from kata.device.bus.factory import make_bus
from kata.device.bus.interface import BusSample, DriveSample, DriveStatus, InputSample
from kata.device.config import Axis, ConfigError, Inputs, ModbusMap, StationConfig, read
from kata.device.config_rules import RANGES, Range
from kata.device.cycle_state import CycleStateBuilder, LoopContext
from kata.device.faults import evaluate_faults
from tests.support.answering_line import AnsweringLine

ESTOP_PRESSED_MS: Final = 100.0


ESTOP_UNKNOWN_MS: Final = 400.0


DRIVE_SILENT_MS: Final = 500.0


SERVICE_SILENT_MS: Final = 1000.0


OVERSPEED_MS: Final = 100.0


OVERSPEED_DEG_S: Final = 226.0
"""Too fast for every station: half of the motors' maximum."""


OVERTORQUE_MS: Final = 250.0


OVERTORQUE_NM: Final = 4.5


BEYOND_DEG: Final = 10.0
"""Too far beyond its range for every station."""


BEYOND_MS: Final = 100.0


STUCK_DEG: Final = 10.0
"""Distance of a stuck drive's setpoint until the fault is detected."""


HELD_DEG: Final = 45.0
"""The same for a drive that trembles by one count of its encoder, at 20 deg/s."""


HELD_DEG_S: Final = 20.0


WATCHDOG: Final = 98
"""Dynamixel register, steps of 20 ms."""


MS: Final = 1_000_000


WATCHED: Final = 3
"""The axis with the fault."""


@dataclass
class Apparatus:
    """Readings of the drives and inputs, which a test changes."""

    config: StationConfig
    t_ns: int = 1_000_000_000
    position_deg: float = field(init=False)
    setpoint_deg: float = field(init=False)
    speed_deg_s: float = 0.0
    torque_nm: float = 0.0
    drive_silent: bool = False
    inputs_silent: bool = False
    estop_open: bool = False
    service_age_ms: float = 0.0

    def __post_init__(self) -> None:
        axis = self.config.axes[WATCHED]
        self.position_deg = self.setpoint_deg = (axis.min_deg + axis.max_deg) / 2
        self._state_builder = CycleStateBuilder(self.config)
        self._command()
        for _ in range(10):
            assert self.faults() == set(), "nothing is wrong yet"

    @property
    def cycle_ms(self) -> float:
        return 1000 / self.config.cycle_hz

    def faults(self) -> set[str]:
        """Return the faults of the next cycle."""
        self.t_ns += round(self.cycle_ms * MS)
        context = LoopContext(
            late_ms=0.0,
            service_age_ms=self.service_age_ms,
            run_id_mismatches=0,
            journal_ok=True,
            limits_deg=self.config.mechanism_deg,
            rate_hz=self.config.rate_hz,
        )
        found = evaluate_faults(self._state_builder.build(self.t_ns, self._reading(), context), self.config)
        self._command()
        return {code for code, _ in found}

    def after_ms(self, codes: set[str], limit_ms: float, change: Callable[[float], None] | None = None) -> float:
        """Let time pass until one of these faults holds, with ``change(ms)`` before each cycle; return the duration."""
        passed_ms = 0.0
        while passed_ms <= limit_ms:
            passed_ms += self.cycle_ms
            if change:
                change(passed_ms)
            if self.faults() & codes:
                return passed_ms
        return math.inf

    def _command(self) -> None:
        setpoints = [*self._rest()]
        setpoints[WATCHED] = self.setpoint_deg
        self._state_builder.record_command(self.t_ns, True, tuple(setpoints), self.t_ns)

    def _reading(self) -> BusSample:
        drives: list[DriveSample | None] = [DriveSample(self.t_ns, angle, 0.0, 0.0) for angle in self._rest()]
        drives[WATCHED] = DriveSample(self.t_ns, self.position_deg, self.speed_deg_s, self.torque_nm)
        if self.drive_silent:
            drives[WATCHED] = None
        inputs = InputSample(self.t_ns, estop_open=self.estop_open, pedal_down=False)
        return BusSample(
            drives=tuple(drives),
            inputs=None if self.inputs_silent else inputs,
            statuses=tuple(DriveStatus(self.t_ns, n, True, 0, False) for n in range(5)),
        )

    def _rest(self) -> Iterator[float]:
        return ((axis.min_deg + axis.max_deg) / 2 for axis in self.config.axes)


def hold_effective(config: StationConfig) -> None:
    """Assert all requirements of an accepted configuration."""
    hold_supervisor_effective(config)
    hold_stuck_drives_noticed(config)
    hold_registers_fit(config)


def hold_supervisor_effective(config: StationConfig) -> None:
    """Assert that every dangerous failure is detected in time."""
    pressed = Apparatus(config, estop_open=False)
    pressed.estop_open = True
    assert pressed.after_ms({"estop_pressed"}, ESTOP_PRESSED_MS) <= ESTOP_PRESSED_MS

    unknown = Apparatus(config)
    unknown.inputs_silent = True
    assert unknown.after_ms({"estop_unknown"}, ESTOP_UNKNOWN_MS) <= ESTOP_UNKNOWN_MS

    silent = Apparatus(config)
    silent.drive_silent = True
    assert silent.after_ms({"drive_silent"}, DRIVE_SILENT_MS) <= DRIVE_SILENT_MS

    alone = Apparatus(config)

    def age(passed_ms: float) -> None:
        alone.service_age_ms = passed_ms

    assert alone.after_ms({"service_silent"}, SERVICE_SILENT_MS, age) <= SERVICE_SILENT_MS

    for direction in (1, -1):
        fast = Apparatus(config)
        fast.speed_deg_s = direction * OVERSPEED_DEG_S
        assert fast.after_ms({"overspeed"}, OVERSPEED_MS) <= OVERSPEED_MS

        strong = Apparatus(config)
        strong.torque_nm = direction * OVERTORQUE_NM
        assert strong.after_ms({"overtorque"}, OVERTORQUE_MS) <= OVERTORQUE_MS

        axis = config.axes[WATCHED]
        beyond = Apparatus(config)
        beyond.position_deg = axis.max_deg + BEYOND_DEG if direction > 0 else axis.min_deg - BEYOND_DEG
        assert beyond.after_ms({"position_limit"}, BEYOND_MS) <= BEYOND_MS


def hold_stuck_drives_noticed(config: StationConfig) -> None:
    """Assert that a drive which does not follow is detected, whether its encoder is still or trembles."""
    step_deg = HELD_DEG_S * (1 / config.cycle_hz)
    for trembles, furthest_deg in ((False, STUCK_DEG), (True, HELD_DEG)):
        stuck = Apparatus(config)
        held_deg = stuck.position_deg

        def move(passed_ms: float, stuck: Apparatus = stuck, held_deg: float = held_deg, on: bool = trembles) -> None:
            stuck.setpoint_deg += step_deg
            stuck.position_deg = held_deg + (0.088 if on and round(passed_ms / stuck.cycle_ms) % 2 else 0.0)

        stuck.after_ms({"position_frozen", "following_error"}, 5000.0, move)
        assert stuck.setpoint_deg - held_deg <= furthest_deg


def hold_registers_fit(config: StationConfig) -> None:
    """Assert that the driver can write everything which follows from the configuration, and that the watchdog is armed with it."""
    line = AnsweringLine(config)
    bus = make_bus(config, lambda port, baud: line)
    bus.open()
    bus.configure(range(len(config.axes)))
    lowest, highest = zip(*config.mechanism_deg, strict=True)
    bus.torque_on(lowest)
    bus.write_setpoints(highest)
    bus.read()
    if config.protocol == "dynamixel":
        assert {line.registers[axis.id][WATCHDOG] for axis in config.axes} == {config.bus_watchdog_ms // 20}


ROOMY: Final[dict[str, Any]] = {
    "approach_speed_deg_s": 1.0,
    "axes": tuple(msgspec.structs.replace(axis, max_acceleration_deg_s2=6_000.0) for axis in StationConfig().axes),
}
"""Settings with which an axis may have any maximum speed."""


BASES: Final[dict[str, StationConfig]] = {
    "dynamixel": StationConfig(**ROOMY),
    "modbus": StationConfig(protocol="modbus", baud=115_200, rate_hz=20, cycle_hz=20, **ROOMY),
}


INTEGERS: Final = {
    f"{holder}{attribute.name}"
    for holder, struct in (("", StationConfig), ("inputs.", Inputs), ("axes.", Axis), ("modbus.", ModbusMap))
    for attribute in msgspec.structs.fields(struct)
    if attribute.type in (int, int | None)
}


def set_value(fields: dict[str, Any], row: Range, value: float) -> None:
    """Set the value of a table row."""
    holder, _, name = row.field.rpartition(".")
    if row.field in INTEGERS and math.isfinite(value):
        value = round(value)
    if not holder:
        fields[name] = value
    elif holder == "axes":
        fields["axes"][WATCHED][name] = value
    elif holder.startswith("axes["):
        fields["axes"][int(holder[5:-1]) - 1][name] = value
    else:
        fields[holder][name] = value


def fields_of(base: str) -> dict[str, Any]:
    """Return a configuration in its file form."""
    fields: dict[str, Any] = msgspec.toml.decode(msgspec.toml.encode(_without_none(msgspec.to_builtins(BASES[base]))))
    return fields


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(part) for key, part in value.items() if part is not None}
    return [_without_none(part) for part in value] if isinstance(value, list | tuple) else value


def accepted(folder: Path, fields: dict[str, Any]) -> StationConfig | None:
    """Read a configuration from a file; only ConfigError may refuse it."""
    (folder / "station.toml").write_bytes(msgspec.toml.encode(fields))
    try:
        return read(folder / "station.toml")
    except ConfigError:
        return None


def rows(protocol: str) -> list[Range]:
    return [row for row in RANGES if row.protocol in (None, protocol)]


def inside(row: Range) -> st.SearchStrategy[float]:
    """Draw values within the range, often at its ends."""
    if row.choices:
        return st.sampled_from(row.choices)
    step = row.step or 1
    between = st.floats(row.low, row.high).map(lambda value: step * round(value / step) if row.step else value)
    return st.one_of(between, st.sampled_from([row.low, row.high]))


def outside(row: Range) -> st.SearchStrategy[float]:
    """Draw values just beyond the range, far beyond it, or not a number."""
    beyond = [row.low - 1, row.high + 1, math.nextafter(row.high, math.inf), 0.0, -1.0, 1e6, 2e9]
    return st.sampled_from([math.nan, math.inf, -math.inf]) | st.sampled_from(beyond)


@st.composite
def changes(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a configuration with some changed fields. In each third one a field is out of its range."""
    base = draw(st.sampled_from(sorted(BASES)))
    fields = fields_of(base)
    for row in draw(st.lists(st.sampled_from(rows(base)), min_size=1, max_size=5)):
        set_value(fields, row, draw(inside(row)))
    if draw(st.booleans()):
        fields["rate_hz"] = fields["cycle_hz"]
    if draw(st.integers(0, 2)) == 0:
        row = draw(st.sampled_from(rows(base)))
        set_value(fields, row, draw(outside(row)))
    return fields
