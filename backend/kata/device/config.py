"""A station's configuration: one TOML file, read once, checked before anything moves.

The defaults describe the apparatus of Sun et al. (2025) with drives that speak Dynamixel Protocol 2.0. What each field may be is in
:mod:`kata.device.config_rules`; docs/reference/configuration.md shows it.
"""

import re
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np

from kata.device import texts
from kata.device.config_rules import MOTOR_RANGES_DEG, problems
from kata.device.config_rules import NO_REGISTER as NO_REGISTER
from kata.motion.axes import APPARATUS_SIGNS, CANONICAL_SIDE, N_AXES, Side
from kata.motion.method import Lag, Method
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError

REFERENCE_SHARE: Final = 0.5
"""Of the highest acceleration a reference may take this much; the rest is for going ahead of it."""
SHORTEST_REFERENCE_S: Final = 0.2
"""Starting and stopping take so long at full pace. In a shorter recording speed and acceleration are not defined by what they are checked by."""

_WRONG_TYPE: Final = re.compile(r"(?P<why>.*) - at `\$\.(?P<field>.*)`", re.DOTALL)
"""How msgspec reports a value of the wrong type."""


class ConfigError(ValueError):
    """The station's configuration cannot be used; the message says which field and why."""


class Axis(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One motor: its address on the bus, how its encoder is mounted, and what it may do."""

    id: int
    model: int = 1120
    """Model number that a Dynamixel drive reports in registers 0 and 1 (1120: XH540-W270). Another one is refused: torque constant and
    gains belong to the model."""
    zero_count: int | None = None
    """What the drive says at motor angle 0, in its own counts; unless given 2048 for Dynamixel (4096 a turn), 0 for Modbus."""
    direction: int = 1
    """+1 or -1: the sign from encoder to motor angle, of the apparatus that is not turned."""
    min_deg: float
    max_deg: float
    """The mechanism's range of motor angle. Commands and measurements beyond it (and a tolerance) stop the apparatus."""
    max_speed_deg_s: float = 100.0
    """The fastest recorded motion has 60 deg/s, and 90 when it is played at 150 %; 10 % more are for noise. A measured speed of 1.5 times
    as much is a fault. A doctor can allow a patient less. See docs/explanation/decisions/0022-motion-limits-come-from-recorded-motions.md."""
    max_acceleration_deg_s2: float = 4_000.0
    """2.6 times the 1,505 deg/s2 that the drives reach for longer than 30 ms in the paper's way of playing at 150 %. A reference may take
    half of it, 2,000; the sharpest recorded motion takes 600, and 1,163 at 150 %. See the same page."""
    max_torque_nm: float = 4.0
    """Rated torque; sent to the drive as its goal current, so that the drive gives way above it."""
    lag_s: float = 0.0
    """How long the drive follows behind its setpoint: a1 of 1 / (1 + a1 s + a2 s^2). 0 until it has been identified."""
    lag2_s2: float = 0.0
    """a2 of the same, in s^2: what its inertia adds to that."""
    friction_deg: float = 0.0
    """How far its setpoint must be ahead for it to move at all."""
    position_p_gain: int = 1600
    position_i_gain: int = 800
    position_d_gain: int = 720
    """In the drive's own units; Modbus drives keep theirs."""


class Inputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the emergency stop and the pedal are wired: digital inputs of one drive, numbered from 1.

    Dynamixel: external ports. Both are read with the drive's pull-up: a closed contact pulls the port to ground (0), an open one or a broken
    wire reads 1. The emergency stop is normally closed, so 1 means pressed; the pedal is normally open, so 0 means
    down. A broken wire therefore stops the apparatus, and never records. Modbus: discrete inputs, 1 where the contact is
    closed.
    """

    drive_id: int = 1
    estop_port: int = 1
    """The normally closed contact."""
    estop_second_port: int | None = None
    """A normally open contact of the same switch. The two must always differ (antivalent contacts): a lost port mode, a short circuit or
    a welded contact is then noticed. Recommended; None: the switch has one contact."""
    contacts_disagree_ms: int = 100
    """Both contacts may say the same for this long, while the switch moves."""
    pedal_port: int = 2
    max_age_cycles: int = 2
    """What an input said counts for this long; after that the emergency stop counts as pressed, the pedal as up."""
    usb_pedal: str | None = None
    """A pedal that is a keyboard to the computer, as the RI-PF1BK: /dev/input/by-id/...-event-kbd. ``pedal_port`` is then not looked at."""

    @property
    def ports(self) -> frozenset[int]:
        """Every port that has a contact."""
        second = () if self.estop_second_port is None else (self.estop_second_port,)
        return frozenset((self.estop_port, self.pedal_port, *second))


_CLOSE_REGISTERS: Final = 16
"""Registers within so many are cheaper to read at once than one by one."""


class ModbusMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Registers of Modbus RTU drives: addresses of holding registers, counted from 0; 32-bit values high word first.

    -1 (NO_REGISTER) where the drive has none of clear, watchdog, limits or delay. ``status`` to ``torque`` are read as one block.
    """

    function_23: bool = True
    """The drives know function 23 (read and write in one exchange)."""
    silence_characters: float = 3.5
    """Silence that ends a frame. The standard wants 1.75 ms above 19,200 bit/s; most drives are content with 3.5 characters."""
    torque_enable: int = 0x0000
    clear: int = 0x0001
    """Writing 1 clears a tripped watchdog."""
    watchdog_ms: int = 0x0002
    torque_limit: int = 0x0003
    position_limits: int = 0x0004
    """Lowest and highest position, two registers each."""
    response_delay_us: int = 0x0008
    goal_position: int = 0x0010
    """Two registers."""
    status: int = 0x0020
    status_torque_bit: int = 0
    status_watchdog_bit: int = 1
    error: int = 0x0021
    position: int = 0x0022
    """Two registers."""
    speed: int = 0x0024
    torque: int = 0x0025
    position_per_deg: float = 100.0
    speed_per_deg_s: float = 10.0
    torque_per_nm: float = 100.0

    @property
    def verified_spans(self) -> tuple[range, ...]:
        """Registers that are read back in a rotation: one span where they lie close together, else one for each."""
        singles = (self.watchdog_ms, self.torque_limit, self.response_delay_us)
        spans = [range(first, first + 1) for first in singles if first != NO_REGISTER]
        if self.position_limits != NO_REGISTER:
            spans.append(range(self.position_limits, self.position_limits + 4))
        if not spans:
            return ()
        whole = range(min(span.start for span in spans), max(span.stop for span in spans))
        return (whole,) if len(whole) <= _CLOSE_REGISTERS else tuple(spans)

    @property
    def block_start(self) -> int:
        """First register of the block that is read every cycle."""
        return min(self.status, self.error, self.position, self.speed, self.torque)

    @property
    def block_registers(self) -> int:
        """How many registers that block has."""
        return max(self.status, self.error, self.position + 1, self.speed, self.torque) - self.block_start + 1


_MOTOR_5: Final[dict[str, Any]] = {
    "max_torque_nm": 2.0,
    "position_p_gain": 120,
    "position_i_gain": 120,
    "position_d_gain": 150,
}
"""It is weaker, and its pinion has too much play for a stiff control."""


def _default_axes() -> tuple[Axis, ...]:
    return tuple(
        Axis(id=n, min_deg=low, max_deg=high, **(_MOTOR_5 if n == N_AXES else {}))
        for n, (low, high) in enumerate(MOTOR_RANGES_DEG, start=1)
    )


class StationConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. Rates: the loop reads and supervises at ``cycle_hz``; recording and setpoints go at ``rate_hz``."""

    name: str = "Station 1"
    side: Side = CANONICAL_SIDE
    """The shoulder that the apparatus stands for: it is turned by 180 deg about X for the other one (Section 2.2). Whoever turns it
    says so, and the service keeps it; nothing of the other side is taught or played until then."""
    port: str = "/dev/ttyUSB0"
    """Prefer /dev/serial/by-id/...: ttyUSB0 becomes ttyUSB1 when an adapter is replugged."""
    protocol: Literal["dynamixel", "modbus"] = "dynamixel"
    baud: int = 1_000_000
    return_delay_us: int = 0
    """How long a drive waits before it answers; written to it (Dynamixel: register 9, steps of 2 us)."""
    rate_hz: int = 100
    """Samples recorded and setpoints sent per second: 10 as in the paper, 100 by default."""
    cycle_hz: int = 100
    """Bus cycles per second; a multiple of ``rate_hz``. It bounds how late the emergency stop is seen."""
    axes: tuple[Axis, ...] = msgspec.field(default_factory=_default_axes)
    inputs: Inputs = Inputs()
    modbus: ModbusMap = ModbusMap()
    limit_tolerance_deg: float = 4.0
    """How far beyond an axis' range a measured angle may be before it is a fault."""
    approach_speed_deg_s: float = 15.0
    following_error_deg: float = 20.0
    """How far an axis may be from what it was sent, which runs ahead of it by its lag: 6 deg at 60 deg/s and 0.1 s. The rest is
    for what holds the arm."""
    following_error_ms: int = 250
    silence_ms: int = 100
    """A drive that has not answered for this long is a fault. An input is one after two cycles."""
    reversal_s: float = 2.0
    """How far back along the path the arm is taken when it meets resistance, in the recording's own time."""
    service_silence_ms: int = 500
    bus_watchdog_ms: int = 160
    """Written to the drives (register 98, steps of 20 ms): they stop by themselves when the bus falls silent.

    The arm must stand 200 ms after this process has died. A drive may notice a step late, and then needs some 25 ms to
    come to rest.
    """

    @property
    def mechanism_deg(self) -> tuple[tuple[float, float], ...]:
        """What may be commanded of each axis: its range, and half of the tolerance that measured angles have."""
        tolerance = self.limit_tolerance_deg / 2
        return tuple((axis.min_deg - tolerance, axis.max_deg + tolerance) for axis in self.axes)

    @property
    def with_side_directions(self) -> "StationConfig":
        """With the directions that the drives have now: motors 3 to 5 see what turns with the apparatus the other way round."""
        signs = (1, 1, *APPARATUS_SIGNS[self.side][2:])
        axes = (
            msgspec.structs.replace(axis, direction=axis.direction * sign)
            for axis, sign in zip(self.axes, signs, strict=True)
        )
        return msgspec.structs.replace(self, axes=tuple(axes))

    @property
    def lag(self) -> Lag:
        """How the drives fall behind their setpoints, as identified."""
        return Lag(*np.array([(axis.lag_s, axis.lag2_s2, axis.friction_deg) for axis in self.axes]).T)

    def with_speed_limit(self, max_speed_deg_s: float | None) -> "StationConfig":
        """Return this configuration with no axis, and no approach, faster than ``max_speed_deg_s``; None: as it is."""
        if max_speed_deg_s is None:
            return self
        axes = tuple(
            msgspec.structs.replace(axis, max_speed_deg_s=min(axis.max_speed_deg_s, max_speed_deg_s))
            for axis in self.axes
        )
        approach_deg_s = min(self.approach_speed_deg_s, max_speed_deg_s)
        return msgspec.structs.replace(self, axes=axes, approach_speed_deg_s=approach_deg_s)

    def check_reference(self, method: Method, reference: Trajectory) -> None:
        """Refuse what this station may not play: a recording before it is loaded, and before one is made of another.

        :raises TrajectoryError: naming motor, time, value and limit.
        """
        if reference.duration_s < SHORTEST_REFERENCE_S:
            raise TrajectoryError(
                texts.REFERENCE_TOO_SHORT(
                    duration_ms=reference.duration_s * 1000, shortest_ms=SHORTEST_REFERENCE_S * 1000
                )
            )
        # The paper's way leads nothing ahead.
        share = 1.0 if method == "paper" else REFERENCE_SHARE
        limits = [
            AxisLimits(axis.min_deg, axis.max_deg, axis.max_speed_deg_s, share * axis.max_acceleration_deg_s2)
            for axis in self.axes
        ]
        # Half of what a measured angle may be beyond: what was taught at the end of the range must be playable.
        reference.check(limits, self.limit_tolerance_deg / 2)

    @property
    def setpoint_delay_s(self) -> float:
        """How much later than it is worked out a setpoint reaches its drive, because the next cycle's request carries it."""
        return 1.0 / self.cycle_hz if self.protocol == "modbus" and self.modbus.function_23 else 0.0

    def __post_init__(self) -> None:
        found = problems(self)
        if found:
            raise ConfigError("; ".join(found))


_SIMULATED_LAGS: Final = (
    *[{"lag_s": 0.054, "lag2_s2": 0.0015, "friction_deg": 0.08}] * 4,
    {"lag_s": 0.127, "lag2_s2": 0.0043, "friction_deg": 0.28},
)
"""What :mod:`kata.evaluation.identify` finds of the simulated drives, by their nominal parameters; a test holds it to that."""


def simulated(port: str) -> StationConfig:
    """The station that is served when the apparatus is simulated and no other configuration is given: it has been identified.

    A pseudo-terminal hands its bytes over by an ordinary kernel worker, which a busy computer lets wait for some cycles:
    inputs and drives may be older than on a real line before they count as unknown and silent.
    """
    axes = tuple(
        msgspec.structs.replace(axis, **lag) for axis, lag in zip(_default_axes(), _SIMULATED_LAGS, strict=True)
    )
    return StationConfig(port=port, inputs=Inputs(max_age_cycles=30, estop_second_port=3), silence_ms=300, axes=axes)


def at_rate(config: StationConfig, rate_hz: int) -> StationConfig:
    """The same station at another rate; with as many bus cycles a second as before, or the next number that fits the rate.

    :raises ConfigError: when the bus cannot carry that.
    """
    cycle_hz = -(-config.cycle_hz // rate_hz) * rate_hz if rate_hz > 0 else config.cycle_hz
    return msgspec.structs.replace(config, rate_hz=rate_hz, cycle_hz=cycle_hz)


def read(path: Path) -> StationConfig:
    """Read and check a station's TOML file.

    :raises ConfigError: when the file cannot be read, is not TOML, or a value is out of range.
    """
    try:
        return msgspec.toml.decode(path.read_bytes(), type=StationConfig)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from error
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise ConfigError(f"{path}: {_field_first(str(error))}") from error


def _field_first(message: str) -> str:
    """Put the field before the message, with axes counted from 1: ``Expected `int` - at `$.axes[0].id``` is about ``axes[1].id``."""
    wrong = _WRONG_TYPE.fullmatch(message)
    if wrong is None:
        return message
    field = re.sub(r"\[(\d+)\]", lambda index: f"[{int(index[1]) + 1}]", wrong["field"])
    return f"{field}: {wrong['why']}"


def write(config: StationConfig, path: Path) -> None:
    """Write a station's TOML file."""
    path.write_text(as_toml(config))


def as_toml(config: StationConfig) -> str:
    """As it stands in a station's file, every value spelt out but those that are none."""
    return msgspec.toml.encode(_without_none(msgspec.to_builtins(config))).decode()


def _without_none(value: Any) -> Any:
    """TOML has no null."""
    if isinstance(value, dict):
        return {key: _without_none(part) for key, part in value.items() if part is not None}
    return [_without_none(part) for part in value] if isinstance(value, list | tuple) else value
