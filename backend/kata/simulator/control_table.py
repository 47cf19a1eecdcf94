"""Defines the control table of an X-series servo with current control (ROBOTIS e-Manual, X series, Protocol 2.0).

The table has addresses, sizes, access, ranges and factory values. All values are little-endian. Models differ in a few values.
"""

import struct
from dataclasses import dataclass
from typing import Final, NamedTuple

MODEL, FIRMWARE, ID, BAUD, RETURN_DELAY, DRIVE_MODE, OPERATING_MODE, SECONDARY_ID = 0, 6, 7, 8, 9, 10, 11, 12
HOMING_OFFSET, MOVING_THRESHOLD, TEMPERATURE_LIMIT, MAX_VOLTAGE, MIN_VOLTAGE = 20, 24, 31, 32, 34
PWM_LIMIT, CURRENT_LIMIT, VELOCITY_LIMIT, MAX_POSITION, MIN_POSITION = 36, 38, 44, 48, 52
PORT_MODE, STARTUP, SHUTDOWN = 55, 60, 63
"""``PORT_MODE`` plus n is the mode of external port n."""
EEPROM_END: Final = 64
TORQUE_ENABLE, STATUS_LEVEL, REGISTERED, HARDWARE_ERROR = 64, 68, 69, 70
VELOCITY_GAINS, D_GAIN, P_GAIN, FEEDFORWARD, BUS_WATCHDOG = 76, 80, 84, 88, 98
GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, PROFILE, GOAL_POSITION = 100, 102, 104, 108, 116
REALTIME_TICK, MOVING, PRESENT_PWM, PRESENT_CURRENT, PRESENT_POSITION, TRAJECTORY = 120, 122, 124, 126, 132, 136
PRESENT_VOLTAGE, PRESENT_TEMPERATURE, BACKUP_READY, PORT_DATA = 144, 146, 147, 150
"""``PORT_DATA`` plus 2 n is the value at external port n."""
END: Final = 662
GOAL_BYTES: Final = frozenset((*range(GOAL_PWM, PROFILE), *range(GOAL_POSITION, REALTIME_TICK)))
"""Addresses of all goals."""

INDIRECT: Final = {
    data + n: addresses + 2 * n for addresses, data in ((168, 224), (578, 634)) for n in range(28)
}  # fmt: skip
"""Maps the address of each byte of Indirect Data to the address of its Indirect Address, which names the source register."""

BACKED_UP_RAM: Final = (range(76, 80), range(80, 86), range(88, 92), range(108, 116), range(168, 224), range(578, 634))
"""RAM that Control Table Backup stores in addition to EEPROM: gains, profile and Indirect Addresses."""

BAUDS: Final = {0: 9_600, 1: 57_600, 2: 115_200, 3: 1_000_000, 4: 2_000_000, 5: 3_000_000, 6: 4_000_000, 7: 4_500_000}
BAUD_CODES: Final = {rate: code for code, rate in BAUDS.items()}
CURRENT, VELOCITY, POSITION, MULTI_TURN, CURRENT_BASED_POSITION, PWM = 0, 1, 3, 4, 5, 16
POSITION_MODES: Final = frozenset((POSITION, MULTI_TURN, CURRENT_BASED_POSITION))
MODES: Final = frozenset((CURRENT, VELOCITY, PWM)) | POSITION_MODES
REVERSE, TIME_BASED, TORQUE_ON_BY_GOAL = 0x01, 0x04, 0x08
"""Bits of Drive Mode."""
TORQUE_AT_STARTUP, RAM_RESTORE = 1, 2
"""Bits of Startup Configuration."""
VOLTAGE_ERROR, OVERHEATING_ERROR = 0x01, 0x04
"""Bits of Hardware Error Status and of Shutdown."""


@dataclass(frozen=True)
class ServoKind:
    """Values that differ between models. ``nm_a``: stall torque divided by stall current at the recommended voltage."""

    nm_a: float
    volt: float
    voltage_limits: tuple[int, int]
    """Lowest and highest supply voltage, in units of 0.1 V."""
    current_limit: int
    velocity_limit: int
    has_ports: bool = True
    """True if the servo has external ports."""


PORT_BYTES: Final = frozenset((*range(PORT_MODE + 1, PORT_MODE + 4), *range(PORT_DATA + 2, PORT_DATA + 8)))
"""Addresses that a servo without external ports does not have."""

MODELS: Final = {
    1020: ServoKind(4.1 / 2.3, 12.0, (95, 160), 1193, 200, has_ports=False),  # XM430-W350
    1030: ServoKind(3.0 / 2.3, 12.0, (95, 160), 1193, 330, has_ports=False),  # XM430-W210
    1100: ServoKind(9.9 / 4.9, 12.0, (95, 160), 2047, 167),  # XH540-W270
    1120: ServoKind(10.6 / 4.4, 12.0, (95, 160), 2047, 128),  # XM540-W270
    1140: ServoKind(9.2 / 2.4, 24.0, (110, 300), 2047, 128),  # XH540-V270
}
"""Simulated models by model number. The driver knows more (``kata.device.bus.dynamixel.models``)."""
OTHER_MODEL: Final = MODELS[1120]
"""Used for every other model number: models that only the driver knows, and numbers that no servo has."""
FIRMWARE_VERSION: Final = 48


class RegisterItem(NamedTuple):
    """One value of the table. It is read-only if ``high`` is below ``low``."""

    address: int
    size: int
    low: int = 0
    high: int = -1
    initial: int = 0

    @property
    def writable(self) -> bool:
        """True if the value can be written."""
        return self.low <= self.high

    def value(self, data: bytes | bytearray) -> int:
        """Return the number that the value's bytes represent."""
        return int.from_bytes(data, "little", signed=self.low < 0)


_GAIN: Final = 16_383
_ITEMS: Final = (
    RegisterItem(MODEL, 2),
    RegisterItem(2, 4),
    RegisterItem(FIRMWARE, 1, initial=FIRMWARE_VERSION),
    RegisterItem(ID, 1, 0, 252, 1),
    RegisterItem(BAUD, 1, 0, 7, 1),
    RegisterItem(RETURN_DELAY, 1, 0, 254, 250),
    RegisterItem(DRIVE_MODE, 1, 0, 15),
    RegisterItem(OPERATING_MODE, 1, 0, 16, POSITION),
    RegisterItem(SECONDARY_ID, 1, 0, 255, 255),
    RegisterItem(13, 1, 2, 2, 2),  # Protocol 1.0 is not simulated.
    RegisterItem(HOMING_OFFSET, 4, -1_044_479, 1_044_479),
    RegisterItem(MOVING_THRESHOLD, 4, 0, 1_023, 10),
    RegisterItem(TEMPERATURE_LIMIT, 1, 0, 100, 80),
    RegisterItem(MAX_VOLTAGE, 2, 0, 0),
    RegisterItem(MIN_VOLTAGE, 2, 0, 0),
    RegisterItem(PWM_LIMIT, 2, 0, 885, 885),
    RegisterItem(CURRENT_LIMIT, 2, 0, 0),
    RegisterItem(VELOCITY_LIMIT, 4, 0, 1_023),
    RegisterItem(MAX_POSITION, 4, 0, 4_095, 4_095),
    RegisterItem(MIN_POSITION, 4, 0, 4_095),
    *(RegisterItem(PORT_MODE + port, 1, 0, 3, 3) for port in (1, 2, 3)),
    RegisterItem(STARTUP, 1, 0, 3),
    RegisterItem(SHUTDOWN, 1, 0, 63, 52),
    RegisterItem(TORQUE_ENABLE, 1, 0, 1),
    RegisterItem(65, 1, 0, 1),
    RegisterItem(STATUS_LEVEL, 1, 0, 2, 2),
    RegisterItem(REGISTERED, 1),
    RegisterItem(HARDWARE_ERROR, 1),
    RegisterItem(VELOCITY_GAINS, 2, 0, _GAIN, 1_920),
    RegisterItem(VELOCITY_GAINS + 2, 2, 0, _GAIN, 100),
    RegisterItem(D_GAIN, 2, 0, _GAIN),
    RegisterItem(D_GAIN + 2, 2, 0, _GAIN),
    RegisterItem(P_GAIN, 2, 0, _GAIN, 800),
    RegisterItem(FEEDFORWARD, 2, 0, _GAIN),
    RegisterItem(FEEDFORWARD + 2, 2, 0, _GAIN),
    RegisterItem(BUS_WATCHDOG, 1, 0, 127),
    *(
        RegisterItem(goal, size, -(1 << 8 * size - 1), (1 << 8 * size - 1) - 1)
        for goal, size in ((100, 2), (102, 2), (104, 4))
    ),
    RegisterItem(PROFILE, 4, 0, 32_767),
    RegisterItem(PROFILE + 4, 4, 0, 32_767),
    RegisterItem(GOAL_POSITION, 4, -(1 << 31), (1 << 31) - 1),
    *(
        RegisterItem(address, size)
        for address, size in ((120, 2), (122, 1), (123, 1), (124, 2), (126, 2), (128, 4), (132, 4))
    ),
    *(RegisterItem(address, size) for address, size in ((136, 4), (140, 4), (144, 2), (146, 1), (147, 1))),
    *(RegisterItem(PORT_DATA + 2 * port, 2, 0, 65_535) for port in (1, 2, 3)),
    *(RegisterItem(at, 2, 64, 661, data) for data, at in INDIRECT.items()),
    *(RegisterItem(data, 1, 0, 255) for data in INDIRECT),
)
ITEMS: Final = {item.address: item for item in _ITEMS}
"""Values by their address."""
ITEM_OF: Final = {address: item for item in _ITEMS for address in range(item.address, item.address + item.size)}
"""Values by the address of each of their bytes."""


def factory_table(model: int) -> bytearray:
    """Return the table of a new servo."""
    kind = MODELS.get(model, OTHER_MODEL)
    table = bytearray(END)
    for item in _ITEMS:
        table[item.address : item.address + item.size] = item.initial.to_bytes(item.size, "little", signed=item.low < 0)
    if not kind.has_ports:
        table[PORT_MODE + 1 : PORT_MODE + 4] = bytes(3)
    least, greatest = kind.voltage_limits
    for address, form, value in (
        (MODEL, "<H", model),
        (MAX_VOLTAGE, "<H", greatest),
        (MIN_VOLTAGE, "<H", least),
        (CURRENT_LIMIT, "<H", kind.current_limit),
        (VELOCITY_LIMIT, "<I", kind.velocity_limit),
    ):
        struct.pack_into(form, table, address, value)
    return table


def range_of(item: RegisterItem, model: int) -> tuple[int, int]:
    """Return the lowest and the highest value that a model accepts."""
    kind = MODELS.get(model, OTHER_MODEL)
    if item.address in (MAX_VOLTAGE, MIN_VOLTAGE):
        return kind.voltage_limits
    if item.address == CURRENT_LIMIT:
        return 0, kind.current_limit
    return item.low, item.high


def ram_of(table: bytes | bytearray, backup: bytes | None = None) -> bytearray:
    """Return the RAM of a servo that starts with this EEPROM. ``backup``: the servo's table at the last Control Table Backup, or None."""
    ram = factory_table(int.from_bytes(table[MODEL : MODEL + 2], "little"))[EEPROM_END:]
    for goal, limit in ((GOAL_PWM, PWM_LIMIT), (GOAL_CURRENT, CURRENT_LIMIT)):
        ram[goal - EEPROM_END : goal - EEPROM_END + 2] = table[limit : limit + 2]
    if backup is not None:
        ram[BACKUP_READY - EEPROM_END] = 1
        for span in BACKED_UP_RAM if table[STARTUP] & RAM_RESTORE else ():
            ram[span.start - EEPROM_END : span.stop - EEPROM_END] = backup[span.start : span.stop]
    return ram
