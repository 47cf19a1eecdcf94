"""The registers that a configured drive must have, computed from the manuals and not from the driver.

Dynamixel: control table of the X series. Modbus: the station's register map.
"""

import struct
from typing import Final

from kata.device.config import NO_REGISTER, StationConfig

_CURRENT_UNIT_A: Final = 0.00269
_TORQUE_CONSTANT_NM_A: Final = 10.6 / 4.4
"""XM540-W270, the model of the default station: stall torque over stall current at 12 V."""
_COUNTS_PER_TURN: Final = 4096
_HALF_TURN: Final = 2048
_INPUT_WITH_PULL_UP: Final = 2
_WHOLE_PWM: Final = 885
_CURRENT_BASED_POSITION: Final = 5

_NO_SECONDARY_ID: Final = 255

Registers = dict[int, bytes]
"""First address to bytes (Dynamixel, little-endian) or to register contents (Modbus, big-endian)."""


def expected_registers(config: StationConfig, motor: int) -> Registers:
    """Return what motor 1-5 must have in its registers while it has torque, the bus watchdog excepted.

    ``config``: the station's configuration from :attr:`StationConfig.with_side_directions`.
    """
    return _modbus(config, motor) if config.protocol == "modbus" else _dynamixel(config, motor)


def _dynamixel(config: StationConfig, motor: int) -> Registers:
    axis, inputs = config.axes[motor - 1], config.inputs
    current = round(axis.max_torque_nm / _TORQUE_CONSTANT_NM_A / _CURRENT_UNIT_A)
    registers: Registers = {
        0: struct.pack("<H", axis.model),
        9: bytes([config.return_delay_us // 2]),
        10: b"\0",
        11: bytes([_CURRENT_BASED_POSITION]),
        12: bytes([_NO_SECONDARY_ID]),
        20: bytes(4),
        36: struct.pack("<H", _WHOLE_PWM),
        38: struct.pack("<H", current),
        60: b"\0",
        80: struct.pack("<HHH", axis.position_d_gain, axis.position_i_gain, axis.position_p_gain),
        100: struct.pack("<H", _WHOLE_PWM),
        102: struct.pack("<h", current),
        108: bytes(8),
    }
    if axis.id == inputs.drive_id:
        ports = [inputs.estop_port, inputs.pedal_port]
        ports += [inputs.estop_second_port] if inputs.estop_second_port else []
        registers |= {55 + port: bytes([_INPUT_WITH_PULL_UP]) for port in ports}
    zero = _HALF_TURN if axis.zero_count is None else axis.zero_count
    ends = sorted(zero + axis.direction * angle * _COUNTS_PER_TURN / 360 for angle in (axis.min_deg, axis.max_deg))
    if ends[0] >= 0 and ends[1] <= _COUNTS_PER_TURN - 1:
        registers[48] = struct.pack("<II", round(ends[1]), round(ends[0]))
    return registers


def _modbus(config: StationConfig, motor: int) -> Registers:
    axis, layout = config.axes[motor - 1], config.modbus
    registers: Registers = {}
    if layout.torque_limit != NO_REGISTER:
        registers[layout.torque_limit] = struct.pack(">H", round(axis.max_torque_nm * layout.torque_per_nm))
    if layout.response_delay_us != NO_REGISTER:
        registers[layout.response_delay_us] = struct.pack(">H", config.return_delay_us)
    if layout.position_limits != NO_REGISTER:
        reach = (axis.min_deg - config.limit_tolerance_deg, axis.max_deg + config.limit_tolerance_deg)
        ends = sorted(round(axis.direction * angle * layout.position_per_deg) for angle in reach)
        registers[layout.position_limits] = struct.pack(">ii", *(end + (axis.zero_count or 0) for end in ends))
    return registers
