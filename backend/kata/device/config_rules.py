"""Defines the accepted configurations of a station: the range of every number, and the rules between fields.

The check (:func:`problems`) and the reference page (:mod:`kata.device.config_page`) use the same tables. Each accepted
configuration keeps the supervisor effective: ``tests/device/test_config_effective.py`` states the times and distances.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.bus.dynamixel.models import MODELS, known_models
from kata.device.bus.registry import DriverError, driver_settings, find_driver
from kata.motion.axes import N_AXES, POSE_RANGE_DEG

if TYPE_CHECKING:
    from kata.device.config import StationConfig

NO_REGISTER: Final = -1
"""The address of a register that a Modbus drive does not have."""

MOTOR_RANGES_DEG: Final = ((-19.0, 43.0), (88.0, 129.0), *POSE_RANGE_DEG[2:])
"""Motor ranges of the paper's apparatus (Table 2). Motors 1 and 2: the image of the scapula's +-20 deg square under the linkage, rounded
outwards (a test compares them)."""
_MECHANISM_MARGIN_DEG: Final = 10.0
"""Distance by which a station's range may exceed :data:`MOTOR_RANGES_DEG`. The linkage closes up to 4 deg beyond; the rest is for the
mounting."""

LARGEST_LAG_S: Final = 0.3
LARGEST_LAG2_S2: Final = 0.02
LARGEST_FRICTION_DEG: Final = 5.0
LARGEST_INTEGRAL_S: Final = 60.0
LARGEST_DROOP_DEG_NM: Final = 10.0
LARGEST_DAMPING_NM_S_DEG: Final = 0.1
LARGEST_INERTIA_NM_S2_DEG: Final = 0.05
LARGEST_COULOMB_NM: Final = 4.0
LARGEST_INERTIA: Final = (*[4.0] * 6, *[8.0] * 3, 20.0)
"""kg m2, kg m and kg; order as in :class:`kata.motion.arm_load.ArmLoad`."""
LARGEST_GIRDLE_NM_RAD: Final = 60.0
LARGEST_BALANCER_M: Final = (0.5, 0.6, 2.0)
LARGEST_BALANCER_N: Final = 60.0
LARGEST_LINK_NM: Final = 5.0
"""An arm of 8 kg at half a metre."""

_LOST_CYCLES: Final = 2
"""Minimum length of a timeout in cycles. One lost answer is noise, so a timeout must last at least two cycles."""
_LATE_REPLY_MS: Final = 4.0
"""Longest time in one cycle that the drivers wait in addition to the transmission time."""
_LONGEST_INPUT_AGE_MS: Final = 300.0
"""A pseudo-terminal on a busy computer needs this long (decision 0006). An emergency stop that is unknown for longer stops the arm."""
REVERSAL_RAMP_S: Final = 0.08
"""Time in which a movement that met resistance comes to rest from its highest speed."""
RAMP_SHARE: Final = 0.35
"""Share of the acceleration limit that a change of the speed override at an axis' highest speed uses. The reference itself uses half of the
limit. The rest is the margin for speeds that are checked as averages over 0.1 s and may be higher by a third within that time.
"""
OVERSPEED_FACTOR: Final = 1.5
"""A measured speed is a fault above this multiple of the limit."""
OVERTORQUE_FACTOR: Final = 1.1
"""A measured torque is a fault above this multiple of the limit. The torque that a drive reports may slightly exceed its own limit."""
_LARGEST_WORD: Final = 32_767
"""Largest value of a signed Modbus register."""
_MODBUS_BLOCK: Final = 125
"""Maximum number of registers in one Modbus read request."""
_INPUTS_BYTE: Final = 8
"""Number of inputs in one byte of a Modbus answer. The cycle time is calculated with one byte of inputs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """The accepted values of one number, both ends included. Values that are not finite are outside every range."""

    field: str
    """``axes.`` means each axis, ``axes[4].`` one axis."""
    low: float
    high: float
    unit: str = ""
    reason: str
    protocol: str | None = None
    """Name of the driver to which the range applies; None: all drivers."""
    step: int | None = None
    choices: tuple[float, ...] = ()
    """The accepted values if only some values are possible, else empty."""
    or_none: bool = False
    """True if NO_REGISTER is accepted too."""

    def accepts(self, value: float) -> bool:
        """Return True if the value is finite, within the range, and one of the choices or steps."""
        if self.or_none and value == NO_REGISTER:
            return True
        if self.choices:
            return value in self.choices
        return self.low <= value <= self.high and (self.step is None or value % self.step == 0)

    @property
    def none(self) -> int | None:
        """NO_REGISTER if it is accepted, else None."""
        return NO_REGISTER if self.or_none else None

    @property
    def shown(self) -> str:
        """The accepted values in words: ``1 to 150 deg/s``."""
        if self.choices:
            span = "one of " + ", ".join(_number(choice) for choice in self.choices)
        else:
            span = f"{_number(self.low)} to {_number(self.high)}"
        unit = f" {self.unit}" if self.unit else ""
        steps = f" in steps of {self.step}" if self.step else ""
        return span + unit + steps + (f", or {NO_REGISTER}" if self.or_none else "")


def _number(value: float) -> str:
    return f"{value:,.10g}"


def _one_turn(motor: int) -> str:
    low, high = MOTOR_RANGES_DEG[motor - 1]
    return (
        f"the range of the mechanism ({low:g} to {high:g} deg) and {_MECHANISM_MARGIN_DEG:g} deg for mounting; with the tolerances this is less than one turn, "
        "so the position after power-up is unambiguous"
    )


_REGISTER: Final = "Modbus addresses have 16 bits"
_PAIR: Final = "Modbus addresses have 16 bits, and this value takes two registers"
_GAIN: Final = "the drive's register holds no larger value (XH540 e-manual, addresses 80 to 84)"

RANGES: Final[tuple[Range, ...]] = (
    Range(
        field="baud",
        low=9_600,
        high=4_500_000,
        unit="bit/s",
        protocol="dynamixel",
        choices=(9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000),
        reason="the servos know no other rates (XH540 e-manual, address 8)",
    ),
    Range(
        field="baud",
        low=9_600,
        high=4_000_000,
        unit="bit/s",
        protocol="modbus",
        reason="a lower rate does not allow 20 cycles a second; serial adapters support no higher rate",
    ),
    Range(
        field="return_delay_us",
        low=0,
        high=508,
        unit="us",
        protocol="dynamixel",
        step=2,
        reason="the drive's register holds 0 to 254 steps of 2 us (XH540 e-manual, address 9)",
    ),
    Range(
        field="return_delay_us",
        low=0,
        high=10_000,
        unit="us",
        protocol="modbus",
        reason="with a longer delay, the six answers of a cycle take longer than the cycle",
    ),
    Range(
        field="rate_hz",
        low=10,
        high=500,
        unit="Hz",
        reason="the paper's rate is the lowest; a setpoint that stays the same for three of its periods (300 ms at 10 Hz) is a fault",
    ),
    Range(
        field="cycle_hz",
        low=20,
        high=500,
        unit="Hz",
        reason="at a lower rate the emergency stop is noticed later than after 50 ms; no bus and no computer reach a higher rate",
    ),
    Range(
        field="limit_tolerance_deg",
        low=1.0,
        high=6.0,
        unit="deg",
        reason="an encoder with its gears is accurate to 1 deg; more than 6 deg beyond the range would overstretch the joint",
    ),
    Range(
        field="approach_speed_deg_s",
        low=1.0,
        high=45.0,
        unit="deg/s",
        reason="a slower move takes minutes; the paper's motions reach 40 deg/s, and a much faster move is not gentle",
    ),
    Range(
        field="following_error_deg",
        low=2.0,
        high=30.0,
        unit="deg",
        reason="the gears have 1 to 2 deg of play; at a larger distance the drive pushes with its full torque against what blocks the arm",
    ),
    Range(
        field="following_error_ms",
        low=50,
        high=500,
        unit="ms",
        reason="a moving arm can be pushed for a shorter time without a fault; after a longer time the drive has pushed for too long",
    ),
    Range(
        field="silence_ms",
        low=20,
        high=300,
        unit="ms",
        reason="a silent drive is then noticed within 0.5 s, even on the slowest bus",
    ),
    Range(
        field="reversal_s",
        low=0.2,
        high=10.0,
        unit="s",
        reason="a shorter move does not relieve the arm; a longer move is a motion of its own",
    ),
    Range(
        field="service_silence_ms",
        low=200,
        high=900,
        unit="ms",
        reason="four heartbeats of 50 ms may be lost; a lost service must stop the arm within 1 s",
    ),
    Range(
        field="bus_watchdog_ms",
        low=40,
        high=200,
        unit="ms",
        step=20,
        reason="the drive counts steps of 20 ms; the arm must be at rest 200 ms after the control program has failed",
    ),
    Range(
        field="inputs.drive_id",
        low=0,
        high=252,
        protocol="dynamixel",
        reason="253 is reserved and 254 addresses every drive (Protocol 2.0)",
    ),
    Range(
        field="inputs.drive_id",
        low=1,
        high=247,
        protocol="modbus",
        reason="0 addresses every drive, 248 to 255 are reserved (Modbus over serial line, 2.2)",
    ),
    *(
        Range(
            field=f"inputs.{port}",
            low=1,
            high=3,
            protocol="dynamixel",
            reason="a drive has three external ports (XH540 e-manual, addresses 56 to 58)",
        )
        for port in ("estop_port", "estop_second_port", "pedal_port")
    ),
    *(
        Range(
            field=f"inputs.{port}",
            low=1,
            high=65_536,
            protocol="modbus",
            reason="inputs are numbered from 1, their 16-bit addresses from 0",
        )
        for port in ("estop_port", "estop_second_port", "pedal_port")
    ),
    Range(
        field="inputs.contacts_disagree_ms",
        low=20,
        high=200,
        unit="ms",
        reason="a switch's contacts move within 20 ms; a contact that is lost for longer than 200 ms must be noticed",
    ),
    Range(
        field="inputs.max_age_cycles",
        low=1,
        high=150,
        unit="cycles",
        reason="300 ms at the highest rate; a rule below limits the time",
    ),
    Range(
        field="axes.id",
        low=0,
        high=252,
        protocol="dynamixel",
        reason="253 is reserved and 254 addresses every drive (Protocol 2.0)",
    ),
    Range(
        field="axes.id",
        low=1,
        high=247,
        protocol="modbus",
        reason="0 addresses every drive, 248 to 255 are reserved (Modbus over serial line, 2.2)",
    ),
    Range(
        field="axes.model",
        low=min(MODELS),
        high=max(MODELS),
        choices=tuple(MODELS),
        protocol="dynamixel",
        reason=f"current and torque are converted with the model's torque constant; known are {known_models()}",
    ),
    Range(field="axes.model", low=1, high=65_535, protocol="modbus", reason="Modbus drives do not use it"),
    Range(
        field="axes.zero_count",
        low=0,
        high=4_095,
        unit="counts",
        protocol="dynamixel",
        reason="the encoder has 4,096 counts a turn, and after power-up a drive reports a position within one turn",
    ),
    Range(
        field="axes.zero_count",
        low=-1_000_000_000,
        high=1_000_000_000,
        unit="counts",
        protocol="modbus",
        reason="every position of the range then fits into 32 bits",
    ),
    Range(field="axes.direction", low=-1, high=1, choices=(-1, 1), reason="the sign of the drive's angle"),
    *(
        Range(
            field=f"axes[{motor}].{end}",
            low=low - _MECHANISM_MARGIN_DEG,
            high=high + _MECHANISM_MARGIN_DEG,
            unit="deg",
            reason=_one_turn(motor),
        )
        for motor, (low, high) in enumerate(MOTOR_RANGES_DEG, start=1)
        for end in ("min_deg", "max_deg")
    ),
    Range(
        field="axes.max_speed_deg_s",
        low=1.0,
        high=150.0,
        unit="deg/s",
        reason="the fastest motion of the paper's kind reaches 60 deg/s, and 90 deg/s at 150 % speed (decision 0022); the fault at 1.5 times the limit "
        "must stay far below the motors' highest speed of 450 deg/s (75 rpm), or it never occurs",
    ),
    Range(
        field="axes.max_acceleration_deg_s2",
        low=500.0,
        high=6_000.0,
        unit="deg/s2",
        reason="one count of the drive's speed is 137 deg/s2 at 100 Hz, so noise would exceed a lower limit; with a higher limit the speed exceeds 150 deg/s within the 30 ms before "
        "the acceleration is evaluated (decision 0022)",
    ),
    Range(
        field="axes.max_torque_nm",
        low=0.5,
        high=4.0,
        unit="Nm",
        reason="4 Nm is the motors' rated torque; below 0.5 Nm the lowest resistance level is smaller than what a drive can measure",
    ),
    Range(
        field="axes.lag_s",
        low=0.0,
        high=LARGEST_LAG_S,
        unit="s",
        reason="a drive with a longer lag is defective; repair it instead of compensating the lag",
    ),
    Range(
        field="axes.lag2_s2",
        low=0.0,
        high=LARGEST_LAG2_S2,
        unit="s2",
        reason="a drive with more inertia is defective; repair it instead of compensating the lag",
    ),
    Range(
        field="axes.friction_deg",
        low=0.0,
        high=LARGEST_FRICTION_DEG,
        unit="deg",
        reason="a drive with more friction is defective; repair it instead of compensating the friction",
    ),
    Range(
        field="axes.integral_s",
        low=0.0,
        high=LARGEST_INTEGRAL_S,
        unit="s",
        reason="an integral slower than a minute has no effect within a motion; write 0",
    ),
    Range(
        field="axes.droop_deg_nm",
        low=0.0,
        high=LARGEST_DROOP_DEG_NM,
        unit="deg/Nm",
        reason="a drive that gives way by more per Nm is defective; repair it instead of compensating the droop",
    ),
    Range(
        field="axes.damping_nm_s_deg",
        low=0.0,
        high=LARGEST_DAMPING_NM_S_DEG,
        unit="Nm s/deg",
        reason="the highest value means 6 Nm at 60 deg/s, which is more than a drive's rated torque",
    ),
    Range(
        field="axes.inertia_nm_s2_deg",
        low=0.0,
        high=LARGEST_INERTIA_NM_S2_DEG,
        unit="Nm s2/deg",
        reason="an arm of 8 kg at half a metre has less",
    ),
    Range(
        field="axes.coulomb_nm",
        low=0.0,
        high=LARGEST_COULOMB_NM,
        unit="Nm",
        reason="a drive that needs its rated torque to overcome friction is defective",
    ),
    Range(
        field="axes.torque_share",
        low=0.7,
        high=1.4,
        reason="drives of one model differ by a few percent; a drive that differs by more is defective",
    ),
    Range(
        field="arm.link_nm",
        low=-LARGEST_LINK_NM,
        high=LARGEST_LINK_NM,
        unit="Nm",
        reason="motor 3's link weighs less than an arm; no higher value has been measured",
    ),
    Range(
        field="arm.balancer_n",
        low=-LARGEST_BALANCER_N,
        high=LARGEST_BALANCER_N,
        unit="N",
        reason="the paper's balancer pulls with 10 to 20 N (Table 1); no higher value has been measured",
    ),
    *(Range(field=f"axes.position_{gain}_gain", low=0, high=16_383, reason=_GAIN) for gain in ("p", "i", "d")),
    Range(
        field="modbus.silence_characters",
        low=3.5,
        high=800.0,
        unit="characters",
        reason="3.5 end a frame by the standard; 800 are its 1.75 ms at 4 Mbit/s",
    ),
    Range(field="modbus.torque_enable", low=0, high=65_535, reason=_REGISTER),
    *(
        Range(field=f"modbus.{name}", low=0, high=65_535, or_none=True, reason=_REGISTER)
        for name in ("clear", "watchdog_ms", "torque_limit", "supply_voltage", "temperature", "temperature_limit")
    ),
    Range(
        field="modbus.position_limits",
        low=0,
        high=65_532,
        or_none=True,
        reason="Modbus addresses have 16 bits, and the two limits take four registers",
    ),
    Range(
        field="modbus.voltage_limits",
        low=0,
        high=65_534,
        or_none=True,
        reason="Modbus addresses have 16 bits, and the two limits take two registers",
    ),
    Range(field="modbus.response_delay_us", low=0, high=65_535, or_none=True, reason=_REGISTER),
    Range(field="modbus.goal_position", low=0, high=65_534, reason=_PAIR),
    *(Range(field=f"modbus.{name}", low=0, high=65_535, reason=_REGISTER) for name in ("status", "error")),
    Range(field="modbus.position", low=0, high=65_534, reason=_PAIR),
    *(Range(field=f"modbus.{name}", low=0, high=65_535, reason=_REGISTER) for name in ("speed", "torque")),
    *(
        Range(field=f"modbus.status_{name}_bit", low=0, high=15, reason="the status register has 16 bits")
        for name in ("torque", "watchdog")
    ),
    Range(
        field="modbus.position_per_deg",
        low=10.0,
        high=1_000_000.0,
        unit="counts a deg",
        reason="steps above 0.1 deg are too coarse for control; with finer steps the position does not fit into 32 bits",
    ),
    Range(
        field="modbus.speed_per_deg_s",
        low=1.0,
        high=1_000.0,
        unit="counts a deg/s",
        reason="steps above 1 deg/s are too coarse to show acceleration; a rule below limits the value further",
    ),
    Range(
        field="modbus.torque_per_nm",
        low=50.0,
        high=10_000.0,
        unit="counts a Nm",
        reason="the lowest resistance level of the weakest motor is 0.02 Nm; a rule below limits the value further",
    ),
    Range(
        field="modbus.voltage_per_v",
        low=1.0,
        high=1_000.0,
        unit="counts a V",
        reason="steps above 1 V are too coarse to show a weak supply; with steps below 1 mV the voltage does not fit into 16 bits",
    ),
    Range(
        field="modbus.temperature_per_c",
        low=0.5,
        high=100.0,
        unit="counts a degC",
        reason="steps above 2 degC are too coarse for the warning; no sensor has finer steps than 0.01 degC",
    ),
)
"""Ranges of every number of a configuration. A test compares them with the fields of :mod:`kata.device.config`."""


@dataclass(frozen=True, slots=True)
class FieldRule:
    """A rule between fields."""

    text: str
    reason: str
    broken: Callable[["StationConfig"], Iterator[str]]
    """Yields one message for each violation of the rule. Called only when every number is within its range."""


def _five_axes(config: "StationConfig") -> Iterator[str]:
    if len(config.axes) != N_AXES:
        yield f"axes: {N_AXES} are needed, but {len(config.axes)} are given"


def _ids_differ(config: "StationConfig") -> Iterator[str]:
    ids = [axis.id for axis in config.axes]
    if len(set(ids)) != len(ids):
        yield f"axes: ids must differ, got {ids}"


def _inputs_at_an_axis(config: "StationConfig") -> Iterator[str]:
    if config.inputs.drive_id not in [axis.id for axis in config.axes]:
        yield f"inputs.drive_id: {config.inputs.drive_id} must be the id of one of the axes"


def _load_is_an_arms(config: "StationConfig") -> Iterator[str]:
    arm = config.arm
    for name, values, largest in (
        ("inertia", arm.inertia, LARGEST_INERTIA),
        ("girdle_nm_rad", arm.girdle_nm_rad, (LARGEST_GIRDLE_NM_RAD,) * 2),
        ("balancer_m", arm.balancer_m, LARGEST_BALANCER_M),
    ):
        for number, (value, limit) in enumerate(zip(values, largest, strict=True), start=1):
            if not abs(value) <= limit:
                yield f"arm.{name}: number {number}, {value:g}, is more than {limit:g}"


def _ends_in_order(config: "StationConfig") -> Iterator[str]:
    for motor, axis in enumerate(config.axes, start=1):
        if axis.min_deg >= axis.max_deg:
            yield f"axes[{motor}].min_deg: {axis.min_deg:g} must be below max_deg ({axis.max_deg:g})"


def _rates_divide(config: "StationConfig") -> Iterator[str]:
    if config.cycle_hz % config.rate_hz:
        yield f"rate_hz: {config.rate_hz} must divide cycle_hz ({config.cycle_hz})"


def _bus_carries_it(config: "StationConfig") -> Iterator[str]:
    ceiling = max_cycle_hz(config)
    if config.cycle_hz > ceiling:
        yield (
            f"cycle_hz: this bus carries at most {int(ceiling)} cycles a second ({config.protocol} at {config.baud} bit/s); "
            f"the file requests {config.cycle_hz}"
        )


def _timeouts_last(config: "StationConfig") -> Iterator[str]:
    shortest_ms = _LOST_CYCLES * 1000 / config.cycle_hz
    for field, value_ms in (
        ("silence_ms", config.silence_ms),
        ("following_error_ms", config.following_error_ms),
        ("inputs.contacts_disagree_ms", config.inputs.contacts_disagree_ms),
    ):
        if value_ms < shortest_ms:
            yield f"{field}: {value_ms} is less than {shortest_ms:g} ms, {_LOST_CYCLES} cycles at {config.cycle_hz} Hz"


def _watchdog_lasts(config: "StationConfig") -> Iterator[str]:
    shortest_ms = _LOST_CYCLES * 1000 / config.cycle_hz + _LATE_REPLY_MS
    if config.bus_watchdog_ms < shortest_ms:
        yield (
            f"bus_watchdog_ms: {config.bus_watchdog_ms} is less than {shortest_ms:g} ms, {_LOST_CYCLES} cycles at "
            f"{config.cycle_hz} Hz and a late reply"
        )


def _inputs_are_young(config: "StationConfig") -> Iterator[str]:
    age_ms = config.inputs.max_age_cycles * 1000 / config.cycle_hz
    if age_ms > _LONGEST_INPUT_AGE_MS:
        yield (
            f"inputs.max_age_cycles: {config.inputs.max_age_cycles} are {age_ms:g} ms at {config.cycle_hz} Hz; "
            f"the maximum is {_LONGEST_INPUT_AGE_MS:g} ms"
        )


def _ports_differ(config: "StationConfig") -> Iterator[str]:
    inputs = config.inputs
    ports = {"inputs.estop_port": inputs.estop_port, "inputs.pedal_port": inputs.pedal_port}
    if inputs.estop_second_port is not None:
        ports["inputs.estop_second_port"] = inputs.estop_second_port
    for (first, port), (second, other) in combinations(ports.items(), 2):
        if port == other:
            yield f"{second}: {other} is also {first}"
    span = max(ports.values()) - min(ports.values()) + 1
    if config.protocol == "modbus" and span > _INPUTS_BYTE:
        yield f"inputs: the ports {sorted(ports.values())} must lie within {_INPUTS_BYTE} consecutive inputs"


def _approach_is_slower(config: "StationConfig") -> Iterator[str]:
    for motor, axis in enumerate(config.axes, start=1):
        if config.approach_speed_deg_s > axis.max_speed_deg_s:
            yield (
                f"approach_speed_deg_s: {config.approach_speed_deg_s:g} is above axes[{motor}].max_speed_deg_s "
                f"({axis.max_speed_deg_s:g})"
            )


def _can_turn_back(config: "StationConfig") -> Iterator[str]:
    for motor, axis in enumerate(config.axes, start=1):
        needed_deg_s2 = axis.max_speed_deg_s / REVERSAL_RAMP_S / RAMP_SHARE
        if axis.max_acceleration_deg_s2 < needed_deg_s2:
            yield (
                f"axes[{motor}].max_acceleration_deg_s2: {axis.max_acceleration_deg_s2:g} is less than the {needed_deg_s2:g} deg/s2 "
                f"that turning back from {axis.max_speed_deg_s:g} deg/s needs"
            )


def _modbus_registers_apart(config: "StationConfig") -> Iterator[str]:
    registers = config.modbus
    places = [
        ("torque_enable", registers.torque_enable, 1),
        ("clear", registers.clear, 1),
        ("watchdog_ms", registers.watchdog_ms, 1),
        ("torque_limit", registers.torque_limit, 1),
        ("position_limits", registers.position_limits, 4),
        ("response_delay_us", registers.response_delay_us, 1),
        ("goal_position", registers.goal_position, 2),
        ("status", registers.status, 1),
        ("error", registers.error, 1),
        ("position", registers.position, 2),
        ("speed", registers.speed, 1),
        ("torque", registers.torque, 1),
        ("supply_voltage", registers.supply_voltage, 1),
        ("temperature", registers.temperature, 1),
        ("voltage_limits", registers.voltage_limits, 2),
        ("temperature_limit", registers.temperature_limit, 1),
    ]
    there = [place for place in places if place[1] != NO_REGISTER]
    for (name, start, length), (other, other_start, other_length) in combinations(there, 2):
        if start < other_start + other_length and other_start < start + length:
            yield f"modbus.{other}: register {other_start} overlaps modbus.{name} ({start})"
    if registers.block_registers > _MODBUS_BLOCK:
        yield (
            f"modbus: status to torque span {registers.block_registers} registers; one request reads at most {_MODBUS_BLOCK}"
        )
    if registers.status_torque_bit == registers.status_watchdog_bit:
        yield f"modbus.status_watchdog_bit: {registers.status_watchdog_bit} is also modbus.status_torque_bit"


def _modbus_measures_faults(config: "StationConfig") -> Iterator[str]:
    if config.protocol != "modbus":
        return
    fastest = _LARGEST_WORD / config.modbus.speed_per_deg_s
    strongest = _LARGEST_WORD / config.modbus.torque_per_nm
    for motor, axis in enumerate(config.axes, start=1):
        if OVERSPEED_FACTOR * axis.max_speed_deg_s >= fastest:
            yield (
                f"modbus.speed_per_deg_s: a register holds at most {fastest:g} deg/s, but the overspeed fault of motor {motor} occurs at "
                f"{OVERSPEED_FACTOR * axis.max_speed_deg_s:g} deg/s"
            )
        if OVERTORQUE_FACTOR * axis.max_torque_nm >= strongest:
            yield (
                f"modbus.torque_per_nm: a register holds at most {strongest:g} Nm, but the overtorque fault of motor {motor} occurs at "
                f"{OVERTORQUE_FACTOR * axis.max_torque_nm:g} Nm"
            )


def _models_are_strong_enough(config: "StationConfig") -> Iterator[str]:
    if config.protocol != "dynamixel":
        return
    for motor, axis in enumerate(config.axes, start=1):
        model = MODELS[axis.model]
        if axis.max_torque_nm > model.stall_nm:
            yield f"axes[{motor}].max_torque_nm: {axis.max_torque_nm:g} is more than the stall torque of a {model.name} ({model.stall_nm:g})"


RULES: Final[tuple[FieldRule, ...]] = (
    FieldRule("There are five axes.", "The apparatus has five motors.", _five_axes),
    FieldRule(
        "The ids of the axes differ.", "Two drives that answer at once damage each other's answers.", _ids_differ
    ),
    FieldRule(
        "`inputs.drive_id` is the id of an axis.",
        "Emergency stop and pedal are wired to one of the five drives.",
        _inputs_at_an_axis,
    ),
    FieldRule(
        "`inputs.estop_port`, `inputs.estop_second_port` and `inputs.pedal_port` differ; with Modbus they lie within eight consecutive inputs.",
        "With the pedal on the port of the emergency stop, pressing the stop would record; the time of a cycle is calculated with one byte of inputs.",
        _ports_differ,
    ),
    FieldRule("`axes.min_deg` is below `axes.max_deg`.", "Otherwise the axis has no allowed angle.", _ends_in_order),
    FieldRule(
        "The numbers of `arm.inertia` are at most 4 kg m2 (six), 8 kg m (three) and 20 kg; those of `arm.girdle_nm_rad` 60 Nm/rad; those of "
        "`arm.balancer_m` 0.5, 0.6 and 2 m.",
        "An arm of 8 kg at half a metre has half of that inertia, a relaxed girdle a tenth of that stiffness; the apparatus is 2 m high.",
        _load_is_an_arms,
    ),
    FieldRule("`rate_hz` divides `cycle_hz`.", "Setpoints are sent once in a whole number of cycles.", _rates_divide),
    FieldRule(
        "The bus carries `cycle_hz`.", "Otherwise the bytes of a cycle take longer than the cycle.", _bus_carries_it
    ),
    FieldRule(
        "`silence_ms`, `following_error_ms` and `inputs.contacts_disagree_ms` last at least two cycles.",
        "One lost answer is noise and must not stop the arm.",
        _timeouts_last,
    ),
    FieldRule(
        "`bus_watchdog_ms` lasts at least two cycles and a late reply (4 ms).",
        "A drive counts from one packet to the next; one lost cycle must not freeze a drive in the middle of a motion.",
        _watchdog_lasts,
    ),
    FieldRule(
        "`inputs.max_age_cycles` cycles last at most 300 ms.",
        "An emergency stop whose state is older is unknown, which counts as pressed (decision 0006).",
        _inputs_are_young,
    ),
    FieldRule(
        "`approach_speed_deg_s` is at most each `axes.max_speed_deg_s`.",
        "The move to the start must not be faster than what an axis may do.",
        _approach_is_slower,
    ),
    FieldRule(
        "`axes.max_acceleration_deg_s2` is at least 35.8 /s times `axes.max_speed_deg_s`.",
        "When the arm meets resistance it must stop from its highest speed within 0.08 s, with 35 % of the limit.",
        _can_turn_back,
    ),
    FieldRule(
        "The registers of the Modbus map do not overlap, `status` to `torque` span at most 125 registers, and the status bits differ.",
        "A request reads at most 125 registers; a write to one register must not change another.",
        _modbus_registers_apart,
    ),
    FieldRule(
        "Modbus: 1.5 times `axes.max_speed_deg_s` and 1.1 times `axes.max_torque_nm` fit a signed 16-bit register.",
        "Otherwise the register overflows before overspeed or overtorque can be noticed.",
        _modbus_measures_faults,
    ),
    FieldRule(
        "Dynamixel: `axes.max_torque_nm` is at most the stall torque of `axes.model`.",
        "A drive cannot give more (ROBOTIS e-Manual, page of each model).",
        _models_are_strong_enough,
    ),
)

_LONGEST_NAME: Final = 100
"""Maximum length of a name in characters, as in the database."""


def problems(config: "StationConfig") -> list[str]:
    """Return the errors of a configuration as texts with field, value, range and reason; empty if it is accepted."""
    found = [*_driver(config)] or [*_texts(config), *_outside(config)]
    # Rules may divide by any number. They are therefore checked only if all numbers are in range.
    return found or [message for rule in rules_of(config.protocol) for message in rule.broken(config)]


def ranges_of(protocol: str) -> tuple[Range, ...]:
    """Return the ranges of a station with this driver.

    :raises DriverError: when the driver cannot be used.
    """
    return (*(row for row in RANGES if row.protocol in (None, protocol)), *find_driver(protocol).ranges)


def rules_of(protocol: str) -> tuple[FieldRule, ...]:
    """Return the rules between the fields of a station with this driver.

    :raises DriverError: when the driver cannot be used.
    """
    return (*RULES, *find_driver(protocol).rules)


def _driver(config: "StationConfig") -> Iterator[str]:
    try:
        find_driver(config.protocol)
    except DriverError as error:
        yield f"protocol: {error}"
        return
    try:
        driver_settings(config)
    except DriverError as error:
        yield f"driver: {error}"


def _texts(config: "StationConfig") -> Iterator[str]:
    if not (config.name.strip() and len(config.name) <= _LONGEST_NAME and config.name.isprintable()):
        yield f"name: {config.name!r} must have 1 to {_LONGEST_NAME} printable characters"
    if not (config.port.strip() and config.port.isprintable()):
        yield f"port: {config.port!r} must be the path of a serial port"
    pedal = config.inputs.usb_pedal
    if pedal is not None and not (pedal.startswith("/") and pedal.isprintable()):
        yield f"inputs.usb_pedal: {pedal!r} must be an absolute path, such as /dev/input/by-id/...-event-kbd"


def _outside(config: "StationConfig") -> Iterator[str]:
    for accepted in ranges_of(config.protocol):
        for field, value in _values(config, accepted.field):
            if value is not None and not accepted.accepts(value):
                yield f"{field}: {value:.10g} is not within {accepted.shown} ({accepted.reason})"


def _values(config: "StationConfig", field: str) -> Iterator[tuple[str, float | None]]:
    """Yield name and value of each field to which a row of the table applies."""
    holder, _, name = field.rpartition(".")
    if holder == "driver":
        yield field, getattr(driver_settings(config), name)
    elif holder.startswith("axes"):
        for motor, axis in enumerate(config.axes, start=1):
            if holder in ("axes", f"axes[{motor}]"):
                yield f"axes[{motor}].{name}", getattr(axis, name)
    else:
        yield field, getattr(getattr(config, holder) if holder else config, name)
