"""Calculates the registers that a read or write of a servo accesses, and its error (ROBOTIS e-Manual, Protocol 2.0)."""

import struct
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from operator import itemgetter
from typing import Final

from kata.simulator import control_table as ct
from kata.simulator import protocol

_MULTI_TURN_COUNTS: Final = 1_048_575
_LIMIT_OF: Final = {ct.GOAL_PWM: ct.PWM_LIMIT, ct.GOAL_CURRENT: ct.CURRENT_LIMIT, ct.GOAL_VELOCITY: ct.VELOCITY_LIMIT}


def is_indirect(begin: int, end: int) -> bool:
    """Return True if Indirect Data is among these addresses."""
    return (begin < 252 and end > 224) or end > 634


def places(table: bytearray, begin: int, end: int) -> tuple[int, ...]:
    """Return the address of each byte of a span. Indirect Data is resolved."""
    return _places(begin, end, bytes(table[168:224]), bytes(table[578:634]))


@lru_cache(maxsize=256)
def _places(begin: int, end: int, low: bytes, high: bytes) -> tuple[int, ...]:
    targets = dict(zip(ct.INDIRECT, struct.unpack("<56H", low + high), strict=True))
    return tuple(targets.get(address, address) for address in range(begin, end))


def bytes_at(table: bytearray, wanted: Sequence[int]) -> bytes:
    """Return the bytes at these addresses."""
    return bytes(_getter(wanted)(table)) if len(wanted) > 1 else bytes([table[wanted[0]]])


@lru_cache(maxsize=256)
def _getter(wanted: Sequence[int]) -> Callable[[bytearray], tuple[int, ...]]:
    return itemgetter(*wanted)


def written_parts(table: bytearray, address: int, data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the addresses and bytes that a write changes. Indirect Data is resolved."""
    end = address + len(data)
    if not is_indirect(address, end):
        yield address, data
        return
    targets = places(table, address, end)
    begin = 0
    for n in range(1, len(targets) + 1):
        if n == len(targets) or targets[n] != targets[n - 1] + 1:
            yield targets[begin], data[begin:n]
            begin = n


def is_readable(begin: int, end: int) -> bool:
    """Return True if a servo answers a read with data. Undefined bytes between defined ones read 0."""
    return end <= ct.END and any(address in ct.ITEM_OF for address in range(begin, end))


def write_error(table: bytearray, address: int, data: bytes, *, tripped: bool) -> int:
    """Return the error of a write to these addresses; 0 for none. ``tripped``: True if the bus watchdog has tripped."""
    touched = range(address, address + len(data))
    items = [ct.ITEM_OF.get(place) for place in touched]
    if not all(item is not None and item.writable for item in items):
        return protocol.ACCESS_ERROR
    whole = [ct.ITEMS[place] for place in touched if place in ct.ITEMS]
    if sum(item.size for item in whole) != len(touched):
        return protocol.DATA_LENGTH_ERROR
    if tripped:
        cleared = ct.BUS_WATCHDOG in touched and data[ct.BUS_WATCHDOG - address] == 0
        if not cleared and not (ct.GOAL_BYTES | {ct.BUS_WATCHDOG}).isdisjoint(touched):
            return protocol.DATA_RANGE_ERROR
    after = table[:]
    after[touched.start : touched.stop] = data
    model = int.from_bytes(table[ct.MODEL : ct.MODEL + 2], "little")
    for item in whole:
        value = item.value(after[item.address : item.address + item.size])
        low, high = ct.range_of(item, model)
        if not low <= value <= high or (item.address == ct.OPERATING_MODE and value not in ct.MODES):
            return protocol.DATA_RANGE_ERROR
    return protocol.DATA_LIMIT_ERROR if any(_beyond_limit(item, after) for item in whole) else 0


def _beyond_limit(item: ct.RegisterItem, table: bytearray) -> bool:
    """Return True if the servo's own limits forbid a goal."""
    value = item.value(table[item.address : item.address + item.size])
    if item.address in _LIMIT_OF:
        (greatest,) = struct.unpack_from("<H", table, _LIMIT_OF[item.address])
        return abs(value) > int(greatest)
    if item.address == ct.GOAL_POSITION:
        low, high = -_MULTI_TURN_COUNTS, _MULTI_TURN_COUNTS
        if table[ct.OPERATING_MODE] == ct.POSITION:
            high, low = struct.unpack_from("<II", table, ct.MAX_POSITION)
        return not low <= value <= high
    return False
