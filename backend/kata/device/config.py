"""Reads a station's configuration: one TOML file, which is read once and checked before any motor moves.

The defaults describe the apparatus of Sun et al. (2025) with drives that speak Dynamixel Protocol 2.0. The accepted
values are in :mod:`kata.device.config_rules`; docs/reference/configuration.md lists them.
"""

import re
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from kata.device import texts
from kata.device.bus.registry import find_driver
from kata.device.bus.timing import RtsDirection
from kata.device.config_rules import MOTOR_RANGES_DEG, problems
from kata.device.config_rules import NO_REGISTER as NO_REGISTER
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.motion.arm_load import ArmLoad
from kata.motion.axes import APPARATUS_SIGNS, CANONICAL_SIDE, N_AXES, Side
from kata.motion.method import LoadModel, Method, ServoModel
from kata.motion.reach import check_poses_of, reachable_set
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError
from kata.system.files import replace_file

REFERENCE_SHARE: Final = 0.5
"""Share of the acceleration limit that a reference may use. The rest is reserved for the feed-forward."""
SHORTEST_REFERENCE_S: Final = 0.2
"""Minimum duration of a reference. Starting and stopping take this long at full speed. In a shorter recording the checked
speed and acceleration are not defined.
"""
_FULL_TORQUE_SHARE: Final = 0.98
"""Share of a drive's torque limit that the highest resistance level uses, because a drive reports slightly less than its limit."""
_LEAST_SHARE: Final = _FULL_TORQUE_SHARE / RESISTANCE_LEVELS
"""Share of a drive's torque limit that the lowest resistance level uses. Each level adds the same share."""

_WRONG_TYPE: Final = re.compile(r"(?P<why>.*) - at `\$\.(?P<field>.*)`", re.DOTALL)
"""Matches msgspec's message about a value of the wrong type."""


class ConfigError(ValueError):
    """The station's configuration cannot be used; the message says which field and why."""


class Axis(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One motor: its address on the bus, the mounting of its encoder, its limits and its identified model."""

    id: int
    model: int = 1120
    """Model number that a Dynamixel drive reports in registers 0 and 1 (1120: XM540-W270). Another model is refused, because
    torque constant and gains depend on the model (:mod:`kata.device.bus.dynamixel.models`).
    """
    zero_count: int | None = None
    """Position that the drive reports at motor angle 0, in its own counts. Default: 2048 for Dynamixel (4096 a turn), 0
    for Modbus.
    """
    direction: int = 1
    """+1 or -1: the sign from encoder to motor angle, on the canonical side."""
    min_deg: float
    max_deg: float
    """``min_deg`` and ``max_deg`` are the mechanism's range of motor angle. A command or measurement outside the range (plus a
    tolerance) stops the apparatus.
    """
    max_speed_deg_s: float = 100.0
    """Speed limit. The fastest recorded motion has 60 deg/s, and 90 deg/s at 150 % speed; 10 % are added for noise. A measured
    speed above 1.5 times this limit is a fault. A doctor can set a lower limit for a patient. See decision 0022.
    """
    max_acceleration_deg_s2: float = 4_000.0
    """Acceleration limit: 2.6 times the 1,505 deg/s2 that the drives reach for more than 30 ms with the paper's method at 150 % speed.
    A reference may use half of the limit (2,000 deg/s2). The sharpest recorded motion uses 600, and 1,163 at 150 % speed. See
    decision 0022.
    """
    max_torque_nm: float = 4.0
    """Rated torque. The drive receives it as its goal current and yields to a higher load."""
    lag_s: float = 0.0
    """Lag of the drive behind its setpoint: a1 of 1 / (1 + a1 s + a2 s^2). 0 means not identified."""
    lag2_s2: float = 0.0
    """a2 of the same model, in s^2. It describes the effect of inertia."""
    friction_deg: float = 0.0
    """Distance that the setpoint must lead before the drive moves, because of friction."""
    integral_s: float = 0.0
    """Time constant with which the drive's integral gain removes the lag; 0 if it does not."""
    droop_deg_nm: float = 0.0
    """Lag for each Nm of the arm before the integral gain has removed it."""
    damping_nm_s_deg: float = 0.0
    """Damping: torque for each deg/s of speed."""
    inertia_nm_s2_deg: float = 0.0
    """Inertia: torque for each deg/s2 of acceleration."""
    coulomb_nm: float = 0.0
    """Torque of dry friction, which does not depend on the speed."""
    torque_share: float = 1.0
    """Torque that the drive reports for 1 Nm of load, relative to the station's other drives."""
    position_p_gain: int = 1600
    position_i_gain: int = 800
    position_d_gain: int = 720
    """The three position gains are in the drive's own units. Modbus drives use the gains stored in the drive."""


class Inputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The wiring of the emergency stop and the pedal: digital inputs of one drive, numbered from 1.

    Dynamixel: external ports, read with the drive's pull-up. A closed contact pulls the port to ground (0); an open
    contact or a broken wire reads 1. The emergency stop is normally closed, so 1 means pressed. The pedal is normally
    open, so 0 means down. A broken wire therefore stops the apparatus and cannot start a recording. Modbus: discrete inputs, 1
    if the contact is closed.
    """

    drive_id: int = 1
    estop_port: int = 1
    """Port with the normally closed contact of the emergency stop."""
    estop_second_port: int | None = None
    """A normally open contact of the same switch. The two contacts must always differ (antivalent contacts). This detects a lost
    port mode, a short circuit or a welded contact. A second contact is recommended. None: the switch has one contact.
    """
    contacts_disagree_ms: int = 100
    """Time for which both contacts may report the same state while the switch moves."""
    pedal_port: int = 2
    max_age_cycles: int = 2
    """An input is valid for this many cycles. After that the emergency stop counts as pressed and the pedal as up."""
    usb_pedal: str | None = None
    """Path of a USB pedal that the computer sees as a keyboard, such as the RI-PF1BK: /dev/input/by-id/...-event-kbd.
    The pedal at ``pedal_port`` is then not read, but no other input may have its port.
    """

    @property
    def ports(self) -> frozenset[int]:
        """Numbers of all ports with a contact."""
        second = () if self.estop_second_port is None else (self.estop_second_port,)
        return frozenset((self.estop_port, self.pedal_port, *second))


_CLOSE_REGISTERS: Final = 16
"""Registers within a span of this length are read in one request, which takes less time than one request each."""


class ModbusMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Registers of Modbus RTU drives: addresses of holding registers, counted from 0; 32-bit values high word first.

    -1 (NO_REGISTER) means that the drive has no such register (clear, watchdog, limits, delay, voltage, temperature).
    ``status`` to ``torque``, voltage and temperature are read together as one block.
    """

    function_23: bool = True
    """True if the drives support function 23 (read and write in one request)."""
    silence_characters: float = 3.5
    """Silence that ends a frame. The standard requires 1.75 ms above 19,200 bit/s; most drives accept 3.5 characters.
    """
    torque_enable: int = 0x0000
    clear: int = 0x0001
    """Writing 1 clears a tripped watchdog."""
    watchdog_ms: int = 0x0002
    torque_limit: int = 0x0003
    position_limits: int = 0x0004
    """First register of the lowest and highest position, two registers each."""
    response_delay_us: int = 0x0008
    goal_position: int = 0x0010
    """First of two registers."""
    status: int = 0x0020
    status_torque_bit: int = 0
    status_watchdog_bit: int = 1
    error: int = 0x0021
    position: int = 0x0022
    """First of two registers."""
    speed: int = 0x0024
    torque: int = 0x0025
    supply_voltage: int = NO_REGISTER
    temperature: int = NO_REGISTER
    """Temperature of the drive."""
    voltage_limits: int = NO_REGISTER
    """First register of the lowest and highest supply voltage at which the drive works, one register each."""
    temperature_limit: int = NO_REGISTER
    """Temperature above which the drive switches its torque off."""
    voltage_per_v: float = 10.0
    temperature_per_c: float = 1.0
    position_per_deg: float = 100.0
    speed_per_deg_s: float = 10.0
    torque_per_nm: float = 100.0

    @property
    def verified_spans(self) -> tuple[range, ...]:
        """Spans of registers that are read back in rotation: one span for all registers if they are close together, else one for each."""
        singles = (self.watchdog_ms, self.torque_limit, self.response_delay_us)
        spans = [range(first, first + 1) for first in singles if first != NO_REGISTER]
        if self.position_limits != NO_REGISTER:
            spans.append(range(self.position_limits, self.position_limits + 4))
        if self.voltage_limits != NO_REGISTER:
            spans.append(range(self.voltage_limits, self.voltage_limits + 2))
        if self.temperature_limit != NO_REGISTER:
            spans.append(range(self.temperature_limit, self.temperature_limit + 1))
        if not spans:
            return ()
        whole = range(min(span.start for span in spans), max(span.stop for span in spans))
        return (whole,) if len(whole) <= _CLOSE_REGISTERS else tuple(spans)

    @property
    def block_start(self) -> int:
        """First register of the block that is read every cycle."""
        return min(self._block)

    @property
    def block_registers(self) -> int:
        """Number of registers in the block that is read every cycle."""
        return max(*self._block, self.position + 1) - self.block_start + 1

    @property
    def _block(self) -> list[int]:
        health = [register for register in (self.supply_voltage, self.temperature) if register != NO_REGISTER]
        return [self.status, self.error, self.position, self.speed, self.torque, *health]


_MOTOR_5: Final[dict[str, Any]] = {
    "max_torque_nm": 2.0,
    "position_p_gain": 120,
    "position_i_gain": 120,
    "position_d_gain": 150,
}
"""Motor 5 is weaker than the others, and its pinion has too much play for stiff control."""


def _default_axes() -> tuple[Axis, ...]:
    return tuple(
        Axis(id=n, min_deg=low, max_deg=high, **(_MOTOR_5 if n == N_AXES else {}))
        for n, (low, high) in enumerate(MOTOR_RANGES_DEG, start=1)
    )


class StationConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. The loop reads and supervises at ``cycle_hz``. Samples are recorded and setpoints sent at ``rate_hz``."""

    name: str = "Station 1"
    side: Side = CANONICAL_SIDE
    """The shoulder for which the apparatus is set up. For the other shoulder it is turned by 180 deg about X (Section
    2.2). The person who turns it confirms this, and the service stores the side. Until then motions of the other side are
    neither taught nor played.
    """
    port: str = "/dev/ttyUSB0"
    """Prefer a path of /dev/serial/by-id, because ttyUSB0 may become ttyUSB1 when an adapter is plugged in again."""
    rts_direction: RtsDirection = "off"
    """For an adapter that switches between sending and receiving by its RTS line: the level of RTS while Kata sends. The kernel then switches
    RTS (RS-485 mode). ``off``: the adapter switches by itself, and Kata does not change the kernel's mode.
    """
    protocol: str = "dynamixel"
    """Name of the driver: ``dynamixel``, ``modbus``, or an entry point of another package
    (:mod:`kata.device.bus.registry`).
    """
    baud: int = 1_000_000
    return_delay_us: int = 0
    """Delay before a drive answers. The driver writes it to the drive (Dynamixel: register 9, steps of 2 us)."""
    rate_hz: int = 100
    """Samples recorded and setpoints sent per second: 10 as in the paper, 100 by default."""
    cycle_hz: int = 100
    """Bus cycles per second; a multiple of ``rate_hz``. The rate determines how soon the emergency stop is detected."""
    axes: tuple[Axis, ...] = msgspec.field(default_factory=_default_axes)
    arm: ArmLoad = ArmLoad()
    """Load that the motors carry besides themselves."""
    inputs: Inputs = Inputs()
    modbus: ModbusMap = ModbusMap()
    driver: dict[str, Any] = {}
    """Settings of an installed driver of another package."""
    limit_tolerance_deg: float = 4.0
    """Distance beyond an axis' range from which a measured angle is a fault."""
    approach_speed_deg_s: float = 15.0
    """Highest speed of every motor on the way to the start of a recording and on the way back. If the patient's speed limit is lower, that
    limit applies.
    """
    following_error_deg: float = 20.0
    """Largest allowed distance between an axis and its setpoint. A larger distance that lasts longer than ``following_error_ms`` is a fault.
    The setpoint leads the axis by the lag: 6 deg at 60 deg/s and a lag of 0.1 s. The rest is the margin for an arm that is held.
    """
    following_error_ms: int = 250
    silence_ms: int = 100
    """Time without an answer after which a drive is a fault. For inputs see ``inputs.max_age_cycles``."""
    reversal_s: float = 2.0
    """When the arm meets resistance, it goes back along the path by the part that the recording plays in this time."""
    service_silence_ms: int = 500
    bus_watchdog_ms: int = 160
    """Watchdog time of the drives (register 98, steps of 20 ms). They stop when the bus is silent for this long.

    The arm must be at rest 200 ms after this process has died. A drive may notice the silence one step late, and then needs
    some 25 ms to come to rest.
    """

    @property
    def mechanism_deg(self) -> tuple[tuple[float, float], ...]:
        """Limits of each axis' setpoints: its range, extended by half of the tolerance of measured angles."""
        tolerance = self.limit_tolerance_deg / 2
        return tuple((axis.min_deg - tolerance, axis.max_deg + tolerance) for axis in self.axes)

    @property
    def with_side_directions(self) -> "StationConfig":
        """The configuration with the drive directions of the present side. Turning the apparatus changes the sign of motors 3 to 5."""
        signs = (1, 1, *APPARATUS_SIGNS[self.side][2:])
        axes = (
            msgspec.structs.replace(axis, direction=axis.direction * sign)
            for axis, sign in zip(self.axes, signs, strict=True)
        )
        return msgspec.structs.replace(self, axes=tuple(axes))

    @property
    def servo_model(self) -> ServoModel:
        """The identified model of the drives: their lag behind their setpoints and their load."""
        first_s, second_s2, friction_deg, integral_s, droop_deg_nm, damping, inertia, coulomb, share = np.array(
            [
                (
                    axis.lag_s,
                    axis.lag2_s2,
                    axis.friction_deg,
                    axis.integral_s,
                    axis.droop_deg_nm,
                    axis.damping_nm_s_deg,
                    axis.inertia_nm_s2_deg,
                    axis.coulomb_nm,
                    axis.torque_share,
                )
                for axis in self.axes
            ]
        ).T
        load = LoadModel(damping, inertia, coulomb, share, self.arm, self.side)
        return ServoModel(first_s, second_s2, friction_deg, integral_s, droop_deg_nm, load)

    @property
    def inputs_axis(self) -> int:
        """Index (0-4) of the axis whose drive reads the inputs."""
        return [axis.id for axis in self.axes].index(self.inputs.drive_id)

    def resistance_thresholds_nm(self, resistance_level: int) -> list[float]:
        """Return for each axis the torque in N m that counts as resistance at a patient's level."""
        return [axis.max_torque_nm * resistance_level * _LEAST_SHARE for axis in self.axes]

    def with_speed_limit(self, max_speed_deg_s: float | None) -> "StationConfig":
        """Return a copy whose axes and approach are at most as fast as ``max_speed_deg_s``; if that is None, return ``self``."""
        if max_speed_deg_s is None:
            return self
        axes = tuple(
            msgspec.structs.replace(axis, max_speed_deg_s=min(axis.max_speed_deg_s, max_speed_deg_s))
            for axis in self.axes
        )
        approach_deg_s = min(self.approach_speed_deg_s, max_speed_deg_s)
        return msgspec.structs.replace(self, axes=axes, approach_speed_deg_s=approach_deg_s)

    def check_reference(self, method: Method, reference: Trajectory, side: Side) -> None:
        """Refuse a reference that this station must not play. Used for a recording before it is loaded, and before a recording is
        derived from another recording.

        :param side: the shoulder that is moved. It determines which pose motors 1 and 2 produce.
        :raises TrajectoryError: naming motor, time, value and limit.
        """
        if reference.duration_s < SHORTEST_REFERENCE_S:
            raise TrajectoryError(
                texts.REFERENCE_TOO_SHORT(
                    duration_ms=reference.duration_s * 1000, shortest_ms=SHORTEST_REFERENCE_S * 1000
                )
            )
        # The paper's method has no feed-forward.
        share = 1.0 if method == "paper" else REFERENCE_SHARE
        limits = [
            AxisLimits(axis.min_deg, axis.max_deg, axis.max_speed_deg_s, share * axis.max_acceleration_deg_s2)
            for axis in self.axes
        ]
        # Allow half of the tolerance of a measured angle, so that a motion taught at the end of the range is playable.
        reference.check(limits, self.pose_tolerance_deg)
        check_poses_of(reference, lambda motors_deg: reachable_set(motors_deg, side), self.pose_tolerance_deg)

    @property
    def pose_tolerance_deg(self) -> float:
        """Distance by which references and setpoints may leave the reachable set. It equals the tolerance of an axis' range."""
        return self.limit_tolerance_deg / 2

    @property
    def setpoint_delay_s(self) -> float:
        """Delay between computing a setpoint and its arrival at the drive."""
        return find_driver(self.protocol).setpoint_delay_s(self)

    def __post_init__(self) -> None:
        found = problems(self)
        if found:
            raise ConfigError("; ".join(found))


_SIMULATED_LAGS: Final = (
    *[{"lag_s": 0.054, "lag2_s2": 0.0015, "friction_deg": 0.08}] * 4,
    {"lag_s": 0.127, "lag2_s2": 0.0043, "friction_deg": 0.28},
)
"""Result of :mod:`kata.motion.identify_load` for the simulated drives with their nominal parameters; a test compares
them.
"""

_SIMULATED_LOADS: Final = (
    {"damping_nm_s_deg": 0.0021, "inertia_nm_s2_deg": 0.00053, "coulomb_nm": 0.388},
    {"damping_nm_s_deg": 0.0012, "inertia_nm_s2_deg": 0.00047, "coulomb_nm": 0.399},
    {"damping_nm_s_deg": 0.0042, "inertia_nm_s2_deg": 0.00166, "coulomb_nm": 0.466},
    {"damping_nm_s_deg": 0.0037, "inertia_nm_s2_deg": 0.00136, "coulomb_nm": 0.497},
    {"damping_nm_s_deg": 0.0, "inertia_nm_s2_deg": 0.00001, "coulomb_nm": 0.166},
)
_SIMULATED_ARM: Final = ArmLoad(
    inertia=(0.0052, 0.0055, 0.0362, -0.0064, -0.0092, -0.0035, 0.0028, -0.0034, -0.0834, -0.0477),
    link_nm=0.2346,
    girdle_nm_rad=(-0.0875, -0.1354),
    balancer_n=2.311,
    balancer_m=(0.1556, -0.1305, 0.0662),
)
"""Load from the same identification. The mechanics have separate joints, so single numbers are not those of an arm; only the torque is right."""


def simulated(port: str) -> StationConfig:
    """Return the configuration of the simulated apparatus, with identified drives. A service without a station file uses it.

    The simulator is an ordinary program, which a busy computer may delay for several cycles.
    Inputs and drives may therefore be older than on a real bus before they count as unknown and silent.
    """
    axes = tuple(
        msgspec.structs.replace(axis, **lag) for axis, lag in zip(_default_axes(), _SIMULATED_LAGS, strict=True)
    )
    return StationConfig(port=port, inputs=Inputs(max_age_cycles=30, estop_second_port=3), silence_ms=300, axes=axes)


def simulated_with_load(port: str) -> StationConfig:
    """Return :func:`simulated` with the identified load of the simulated apparatus' nominal patient, for functions that need a load.
    docs/how-to/simulated-with-load.toml has the same values.
    """
    station = simulated(port)
    axes = tuple(
        msgspec.structs.replace(axis, **load) for axis, load in zip(station.axes, _SIMULATED_LOADS, strict=True)
    )
    return msgspec.structs.replace(station, axes=axes, arm=_SIMULATED_ARM)


def at_rate(config: StationConfig, rate_hz: int) -> StationConfig:
    """Return the station at another rate. ``cycle_hz`` stays the same or is raised to the next multiple of the rate.

    :raises ConfigError: when the bus cannot carry that cycle rate.
    """
    cycle_hz = -(-config.cycle_hz // rate_hz) * rate_hz if rate_hz > 0 else config.cycle_hz
    return msgspec.structs.replace(config, rate_hz=rate_hz, cycle_hz=cycle_hz)


def read(path: Path) -> StationConfig:
    """Read and check a station's TOML file.

    :raises ConfigError: when the file cannot be read, is not TOML, or a value is out of range.
    """
    try:
        return decode(path.read_bytes())
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from error
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def decode(toml: bytes) -> StationConfig:
    """Decode and check the configuration in a TOML text.

    :raises ConfigError: when it is not TOML, or a value is out of range.
    """
    try:
        return msgspec.convert(_without_removed(msgspec.toml.decode(toml)), StationConfig, str_keys=True)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise ConfigError(_field_first(str(error))) from error


def _without_removed(value: Any) -> Any:
    """Remove ``weight_nm``, which earlier releases wrote for each axis; they never identified it, so it is all zeros."""
    if isinstance(value, dict):
        return {key: _without_removed(part) for key, part in value.items() if key != "weight_nm" or part != [0.0] * 6}
    return [_without_removed(part) for part in value] if isinstance(value, list) else value


def _field_first(message: str) -> str:
    """Put the field before the message and count axes from 1: ``Expected `int` - at `$.axes[0].id``` becomes
    ``axes[1].id: Expected `int```.
    """
    wrong = _WRONG_TYPE.fullmatch(message)
    if wrong is None:
        return message
    field = re.sub(r"\[(\d+)\]", lambda index: f"[{int(index[1]) + 1}]", wrong["field"])
    return f"{field}: {wrong['why']}"


def write(config: StationConfig, path: Path) -> None:
    """Write a station's TOML file. It is replaced as a whole, because a cut file is valid: every missing value has its default.

    :raises OSError: when the file cannot be written. The former file is then unchanged.
    """
    replace_file(path, as_toml(config).encode())


def as_toml(config: StationConfig) -> str:
    """Return the content of a station's file with every value except None."""
    return msgspec.toml.encode(_without_none(msgspec.to_builtins(config))).decode()


def _without_none(value: Any) -> Any:
    """Remove None values: TOML has no null."""
    if isinstance(value, dict):
        return {key: _without_none(part) for key, part in value.items() if part is not None}
    return [_without_none(part) for part in value] if isinstance(value, list | tuple) else value
