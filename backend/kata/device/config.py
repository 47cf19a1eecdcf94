"""A station's configuration: one TOML file, read once, checked before anything moves.

The defaults describe the apparatus of Sun et al. (2025) with drives that speak Dynamixel Protocol 2.0.
"""

from pathlib import Path
from typing import Final

import msgspec

from kata.motion.axes import N_AXES, POSE_RANGE_DEG


class ConfigError(ValueError):
    """The station's configuration cannot be used; the message says which field and why."""


class Axis(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One motor: its address on the bus, how its encoder is mounted, and what it may do."""

    id: int
    zero_count: int = 2048
    """Encoder count (4096 a turn) at motor angle 0."""
    direction: int = 1
    """+1 or -1: the sign from encoder to motor angle."""
    min_deg: float
    max_deg: float
    """The mechanism's range of motor angle. Commands and measurements beyond it (and a tolerance) stop the apparatus."""
    max_speed_deg_s: float = 150.0
    max_torque_nm: float = 4.0
    """Rated torque; sent to the drive as its goal current, so that the drive gives way above it."""
    position_p_gain: int = 1600
    position_i_gain: int = 400
    position_d_gain: int = 60


class Inputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the emergency stop and the pedal are wired: digital inputs (external ports) of one drive.

    Both are read with the drive's pull-up: a closed contact pulls the port to ground (0), an open one or a broken
    wire reads 1. The emergency stop is normally closed, so 1 means pressed; the pedal is normally open, so 0 means
    down. A broken wire therefore stops the apparatus, and never records.
    """

    drive_id: int = 1
    estop_port: int = 1
    pedal_port: int = 2


# The image of the scapula's +-20 deg square under the linkage, rounded outwards (tests hold it to that).
_MOTOR_RANGES_DEG: Final = ((-19.0, 43.0), (88.0, 129.0), *POSE_RANGE_DEG[2:])


def _default_axes() -> tuple[Axis, ...]:
    return tuple(Axis(id=n + 1, min_deg=low, max_deg=high) for n, (low, high) in enumerate(_MOTOR_RANGES_DEG))


class StationConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One station. Rates: the loop reads and supervises at ``cycle_hz``; recording and setpoints go at ``rate_hz``."""

    name: str = "Station 1"
    port: str = "/dev/ttyUSB0"
    """Prefer /dev/serial/by-id/...: ttyUSB0 becomes ttyUSB1 when an adapter is replugged."""
    baud: int = 1_000_000
    return_delay_us: int = 0
    """Written to the drives (register 9, steps of 2 us)."""
    rate_hz: int = 100
    """Samples recorded and setpoints sent per second: 10 as in the paper, 100 by default."""
    cycle_hz: int = 100
    """Bus cycles per second; a multiple of ``rate_hz``. It bounds how late the emergency stop is seen."""
    axes: tuple[Axis, ...] = msgspec.field(default_factory=_default_axes)
    inputs: Inputs = Inputs()
    limit_tolerance_deg: float = 4.0
    """How far beyond an axis' range a measured angle may be before it is a fault."""
    approach_speed_deg_s: float = 15.0
    following_error_deg: float = 20.0
    following_error_ms: int = 250
    silence_ms: int = 100
    """A drive or input that has not answered for this long is a fault."""
    service_silence_ms: int = 500
    bus_watchdog_ms: int = 160
    """Written to the drives (register 98, steps of 20 ms): they stop by themselves when the bus falls silent.

    The arm must stand 200 ms after this process has died. A drive may notice a step late, and then needs some 25 ms to
    come to rest.
    """

    def __post_init__(self) -> None:
        problems = list(self._problems())
        if problems:
            raise ConfigError("; ".join(problems))

    def _problems(self) -> list[str]:
        found: list[str] = []
        if len(self.axes) != N_AXES:
            found.append(f"axes: {N_AXES} are needed, {len(self.axes)} given")
        ids = [axis.id for axis in self.axes]
        if len(set(ids)) != len(ids):
            found.append(f"axes: ids must differ, got {ids}")
        for n, axis in enumerate(self.axes, start=1):
            if axis.direction not in (-1, 1):
                found.append(f"axes[{n}].direction: must be 1 or -1")
            if not axis.min_deg < axis.max_deg:
                found.append(f"axes[{n}]: min_deg must be below max_deg")
            if not 0 < axis.max_speed_deg_s <= 450:
                found.append(f"axes[{n}].max_speed_deg_s: must be above 0 and at most 450 (75 rpm)")
            if not 0 < axis.max_torque_nm <= 4:
                found.append(f"axes[{n}].max_torque_nm: must be above 0 and at most 4 (rated torque)")
        if self.inputs.drive_id not in ids:
            found.append("inputs.drive_id: must be the id of one of the axes")
        if not 1 <= self.rate_hz <= self.cycle_hz or self.cycle_hz % self.rate_hz:
            found.append("rate_hz: must divide cycle_hz")
        if not 50 <= self.cycle_hz <= 500:
            found.append("cycle_hz: must be 50 to 500, or the emergency stop would be seen too late")
        return found


def read(path: Path) -> StationConfig:
    """Read and check a station's TOML file.

    :raises ConfigError: when the file cannot be read, is not TOML, or a value is out of range.
    """
    try:
        return msgspec.toml.decode(path.read_bytes(), type=StationConfig)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from error
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise ConfigError(f"{path}: {error}") from error


def write(config: StationConfig, path: Path) -> None:
    """Write a station's TOML file, every value spelt out."""
    path.write_bytes(msgspec.toml.encode(config))
