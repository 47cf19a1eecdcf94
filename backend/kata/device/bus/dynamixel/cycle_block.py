"""The block of Indirect Data that one Fast Sync Read reads from every drive in every cycle.

The configuration maps it: each Indirect Address names the register of one byte. The marker of a configured drive is among
the bytes. A drive that has restarted has neither marker nor map, and all its bytes read 0.

An answer does not identify its request. Each cycle therefore asks for a different length. The last bytes are not needed in
every cycle, so a cycle may omit them.
"""

import struct
from typing import Final

from msgspec import Struct

INDIRECT_ADDRESS: Final = 168
INDIRECT_DATA: Final = 224

_CURRENT_TO_POSITION: Final = range(126, 136)
_TORQUE, _MARKER, _ERROR, _WATCHDOG = 64, 65, 70, 98
_PORTS: Final = (152, 154, 156)
"""The low bytes of ports 1 to 3."""
_GAINS: Final = (*range(80, 86), 102, 103)
"""Gains and goal current."""
_VOLTAGE_AND_TEMPERATURE: Final = (144, 145, 146)

ADDRESSES: Final = (
    *_CURRENT_TO_POSITION,
    *(_TORQUE, _MARKER, _ERROR, _WATCHDOG),
    *_PORTS,
    *_GAINS,
    *_VOLTAGE_AND_TEMPERATURE,
)
"""Register of each byte. An X-series servo has 28 consecutive Indirect Addresses; all are used."""
PRESENT_BYTES: Final = len(_CURRENT_TO_POSITION)

_VOLTAGE: Final = _VOLTAGE_AND_TEMPERATURE[0]
_SUPPLY_FORMAT: Final = struct.Struct("<HB")

AT: Final = {address: n for n, address in enumerate(ADDRESSES)}
"""Index of each register in an answer."""
_ESSENTIAL: Final = AT[_PORTS[-1]] + 1
GAINS_LENGTH: Final = AT[_GAINS[-1]] + 1
"""Answers of this length or longer contain gains and goal current."""


def lengths(other_answers: frozenset[int]) -> tuple[int, ...]:
    """Return the possible lengths of a request, shortest first. ``other_answers``: lengths of a drive's answers to other
    requests, which are excluded.
    """
    return tuple(n for n in range(_ESSENTIAL, len(ADDRESSES) + 1) if n not in other_answers)


class CycleBlock(Struct, frozen=True):
    """One drive's answer, decoded."""

    torque_on: bool
    marked: bool
    """True if the drive has the marker of a configured drive. Without the marker the other fields are invalid."""
    hardware_error: int
    watchdog: int
    ports: dict[int, bool]
    """True for each port (1 to 3) whose contact is closed."""


def decode(data: bytes) -> CycleBlock:
    """Decode the bytes after current, velocity and position. ``data``: a drive's whole answer."""
    return CycleBlock(
        torque_on=data[AT[_TORQUE]] != 0,
        marked=data[AT[_MARKER]] == 1,
        hardware_error=data[AT[_ERROR]],
        watchdog=data[AT[_WATCHDOG]],
        ports={port: data[AT[address]] == 0 for port, address in enumerate(_PORTS, start=1)},
    )


def voltage_and_temperature(data: bytes) -> tuple[float, float] | None:
    """Return supply voltage in V and temperature in degrees Celsius; None if the answer was too short for them."""
    if len(data) < len(ADDRESSES):
        return None
    volt_tenths, temperature_c = _SUPPLY_FORMAT.unpack_from(data, AT[_VOLTAGE])
    return volt_tenths / 10, float(temperature_c)
