"""The registers of an X-series servo that a station's configuration determines (control table of the X series, ROBOTIS e-Manual)."""

import struct
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from kata.device.bus.dynamixel.cycle_block import ADDRESSES, INDIRECT_ADDRESS, lengths
from kata.device.bus.dynamixel.models import AMPERE_PER_UNIT, MODELS
from kata.device.config import Axis, StationConfig

TORQUE_ENABLE: Final = 64
BUS_WATCHDOG: Final = 98
GOAL_POSITION: Final = 116
PRESENT: Final = 126
"""Address of current (2 bytes), velocity (4) and position (4)."""
PORT_DATA: Final = 150
"""Base address: port n is at this address plus 2 n."""

_MODEL: Final = 0
FIRMWARE: Final = 6
_RETURN_DELAY: Final = 9
_DRIVE_MODE: Final = 10
_OPERATING_MODE: Final = 11
_SECONDARY_ID: Final = 12
_HOMING_OFFSET: Final = 20
_HEALTH_LIMITS: Final = 31
"""Address of temperature limit (1 byte), maximum voltage (2) and minimum voltage (2). The driver only reads them."""
_PWM_LIMIT: Final = 36
_CURRENT_LIMIT: Final = 38
_POSITION_LIMITS: Final = 48
"""Address of maximum and minimum position, four bytes each, in counts of one turn."""
_PORT_MODE: Final = 55
"""Base address: the mode of port n (1 to 3) is at this address plus n."""
_STARTUP: Final = 60
_LED: Final = 65
_GAINS: Final = 80
"""Address of the gains D, I and P, two bytes each."""
_GOAL_PWM: Final = 100
_GOAL_CURRENT: Final = 102
_PROFILE: Final = 108
"""Address of profile acceleration and profile velocity, four bytes each."""
_WHOLE_PWM: Final = 885
"""The factory value of PWM limit and goal PWM: the whole supply voltage. A lower value weakens the drive below its current limit."""
_NO_PROFILE: Final = 0
"""The drive turns to each goal at once. Another value delays it."""

STATUS_BLOCK: Final = range(TORQUE_ENABLE, _GOAL_CURRENT + 2)
"""Torque, hardware error, gains, watchdog and goal current: read from one drive in turn while the mapped block is not used."""
_FIRST_MAP: Final = 15
_MAP_END: Final = INDIRECT_ADDRESS + 2 * len(ADDRESSES)
ROTATION_BLOCKS: Final = (
    range(24),
    range(_HEALTH_LIMITS - 2, _STARTUP + 1),
    range(INDIRECT_ADDRESS, INDIRECT_ADDRESS + 2 * _FIRST_MAP),
    range(INDIRECT_ADDRESS + 2 * _FIRST_MAP, _MAP_END),
    range(_GAINS + 2, _PROFILE + 8),
)
"""The blocks that are read in a slow rotation. A read of the rotation may replace a status read, so no block is longer than the status
block. All blocks have different lengths.
"""
BLOCKS_WITH_STATUS: Final = 2
BLOCKS: Final[tuple[Sequence[int], ...]] = (
    range(TORQUE_ENABLE, _GAINS),
    (*range(_GAINS, _GAINS + 6), _GOAL_CURRENT, _GOAL_CURRENT + 1),
    *ROTATION_BLOCKS,
)
"""The addresses of the verified blocks. The first two come with a drive's status, the others in the slow rotation."""
LENGTHS: Final = lengths(frozenset(len(block) for block in ROTATION_BLOCKS))
"""Lengths of the block to request, a different one in each cycle (:mod:`~kata.device.bus.dynamixel.cycle_block`)."""
STATUS, GAINS, PORTS_BLOCK = 0, 1, 3
MAP_BLOCKS: Final = (4, 5)

_CURRENT_BASED_POSITION: Final = 5
_DIGITAL_INPUT_PULL_UP: Final = 2
_NORMAL: Final = 0
"""Drive mode: not reversed, velocity-based profile, torque switched by its own register only."""

_NO_SECONDARY_ID: Final = 255
"""The drive answers only to its own id."""
_NOTHING_AT_STARTUP: Final = 0
"""No torque and no restored RAM: after power-up the drive has its defaults, which verification detects."""

MAP_NAMES: Final = ("indirect addresses 1 to 15", "indirect addresses 16 to 28")

DEG_PER_COUNT: Final = 360 / 4096
COUNTS_PER_TURN: Final = 4096
_HALF_TURN: Final = 2048
_LAST_COUNT: Final = 4095


class Register(NamedTuple):
    """One configured register: display name, address, and required value."""

    name: str
    address: int
    data: bytes


CONFIGURED: Final = Register("configured marker (LED)", _LED, b"\1")
"""Set as the last step of a configuration. The register is in RAM: power loss, a reboot or an exchange of the drive clears it."""


def configured_registers(config: StationConfig, axis: Axis) -> tuple[Register, ...]:
    """Return every register that must hold a fixed value, in the order in which they are written; the marker is last.

    The bus watchdog is not among them: it is armed together with the torque. The model number is among them, but
    is only compared, not written.
    """
    return tuple(_registers(config, axis))


def _registers(config: StationConfig, axis: Axis) -> Iterator[Register]:
    current = round(axis.max_torque_nm / nm_per_unit(axis))
    yield Register("model number", _MODEL, struct.pack("<H", axis.model))
    yield Register("return delay time", _RETURN_DELAY, bytes([config.return_delay_us // 2]))
    yield Register("drive mode", _DRIVE_MODE, bytes([_NORMAL]))
    yield Register("operating mode", _OPERATING_MODE, bytes([_CURRENT_BASED_POSITION]))
    yield Register("secondary id", _SECONDARY_ID, bytes([_NO_SECONDARY_ID]))
    yield Register("homing offset", _HOMING_OFFSET, bytes(4))
    yield Register("PWM limit", _PWM_LIMIT, struct.pack("<H", _WHOLE_PWM))
    yield Register("current limit", _CURRENT_LIMIT, struct.pack("<H", current))
    if limits := _position_limits(axis):
        yield Register("position limits", _POSITION_LIMITS, limits)
    if axis.id == config.inputs.drive_id:
        for port in sorted(config.inputs.ports):
            yield Register(port_mode(port), _PORT_MODE + port, bytes([_DIGITAL_INPUT_PULL_UP]))
    yield Register("startup configuration", _STARTUP, bytes([_NOTHING_AT_STARTUP]))
    for begin, name in ((0, MAP_NAMES[0]), (_FIRST_MAP, MAP_NAMES[1])):
        part = ADDRESSES[begin : begin + _FIRST_MAP]
        yield Register(name, INDIRECT_ADDRESS + 2 * begin, struct.pack(f"<{len(part)}H", *part))
    gains = struct.pack("<HHH", axis.position_d_gain, axis.position_i_gain, axis.position_p_gain)
    yield Register("position gains", _GAINS, gains)
    yield Register("goal PWM", _GOAL_PWM, struct.pack("<H", _WHOLE_PWM))
    yield Register("goal current", _GOAL_CURRENT, struct.pack("<h", current))
    yield Register("profile acceleration", _PROFILE, struct.pack("<I", _NO_PROFILE))
    yield Register("profile velocity", _PROFILE + 4, struct.pack("<I", _NO_PROFILE))
    yield CONFIGURED


def nm_per_unit(axis: Axis) -> float:
    """Return the torque in N m of one unit of the current registers."""
    return AMPERE_PER_UNIT * MODELS[axis.model].nm_per_a


def port_mode(port: int) -> str:
    """Return the name of the register with the mode of external port 1 to 3."""
    return f"mode of external port {port}"


class HealthLimits(NamedTuple):
    """The limits at which a drive switches its torque off."""

    max_temperature_c: float
    max_voltage_v: float
    min_voltage_v: float


_HEALTH_FORMAT: Final = struct.Struct("<BHH")


def health_limits(ports_block: bytes) -> HealthLimits:
    """Decode the limits from the block that also contains the modes of the ports."""
    at = _HEALTH_LIMITS - ROTATION_BLOCKS[PORTS_BLOCK - BLOCKS_WITH_STATUS].start
    temperature_c, most_tenths, least_tenths = _HEALTH_FORMAT.unpack_from(ports_block, at)
    return HealthLimits(float(temperature_c), most_tenths / 10, least_tenths / 10)


def _position_limits(axis: Axis) -> bytes | None:
    """Return the encoded maximum and minimum position; None for a range beyond one turn, which these registers cannot express.

    The drive enforces them in its single-turn position modes, but not in the multi-turn mode with goal current that is
    used here. They are written so that they apply if the mode is changed.
    """
    ends = [zero_count(axis) + axis.direction * angle / DEG_PER_COUNT for angle in (axis.min_deg, axis.max_deg)]
    if min(ends) < 0 or max(ends) > _LAST_COUNT:
        return None
    return struct.pack("<II", round(max(ends)), round(min(ends)))


def zero_count(axis: Axis) -> int:
    """Return the encoder's count at motor angle 0."""
    return _HALF_TURN if axis.zero_count is None else axis.zero_count


def nearest_turn(axis: Axis, position: int) -> int:
    """Return the whole turns, in counts, that shift a drive's position nearest to the middle of the axis' range.

    After power-up a drive knows its position within one turn only: 185 deg reads as -175 deg. The result is unique for a range
    below 360 deg.
    """
    middle = zero_count(axis) + axis.direction * (axis.min_deg + axis.max_deg) / 2 / DEG_PER_COUNT
    return COUNTS_PER_TURN * round((middle - position) / COUNTS_PER_TURN)
