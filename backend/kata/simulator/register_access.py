"""Calculates the registers that a read or write of a servo accesses, and its error (ROBOTIS e-Manual, Protocol 2.0)."""

import struct
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from operator import itemgetter
from typing import Final, NamedTuple

from kata.simulator import control_table as ct
from kata.simulator import protocol

_MULTI_TURN_COUNTS: Final = 1_048_575
_LIMIT_OF: Final = {ct.GOAL_PWM: ct.PWM_LIMIT, ct.GOAL_CURRENT: ct.CURRENT_LIMIT, ct.GOAL_VELOCITY: ct.VELOCITY_LIMIT}


class Places(NamedTuple):
    """The registers behind a span of addresses. Indirect Data is resolved."""

    addresses: tuple[int, ...]
    """Address of each byte."""
    begin: int
    end: int
    """Lowest address, and the address after the highest."""
    take: Callable[[bytearray], bytes]
    """Function that returns the bytes from a table."""


def is_indirect(begin: int, end: int) -> bool:
    """Return True if Indirect Data is among these addresses."""
    return (begin < 252 and end > 224) or end > 634


def places(table: bytearray, begin: int, end: int) -> Places:
    """Return the registers behind a span of addresses."""
    return _places(begin, end, bytes(table[168:224]), bytes(table[578:634]))


@lru_cache(maxsize=256)
def _places(begin: int, end: int, low: bytes, high: bytes) -> Places:
    targets = dict(zip(ct.INDIRECT, struct.unpack("<56H", low + high), strict=True))
    addresses = tuple(targets.get(address, address) for address in range(begin, end))
    return Places(addresses, min(addresses), max(addresses) + 1, _taker(addresses))


def _taker(addresses: Sequence[int]) -> Callable[[bytearray], bytes]:
    if len(addresses) == 1:
        (only,) = addresses
        return lambda table: bytes(table[only : only + 1])
    getter = itemgetter(*addresses)
    return lambda table: bytes(getter(table))


def written_parts(table: bytearray, address: int, data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the addresses and bytes that a write changes. Indirect Data is resolved."""
    end = address + len(data)
    if not is_indirect(address, end):
        yield address, data
        return
    targets = places(table, address, end).addresses
    begin = 0
    for n in range(1, len(targets) + 1):
        if n == len(targets) or targets[n] != targets[n - 1] + 1:
            yield targets[begin], data[begin:n]
            begin = n


@lru_cache(maxsize=256)
def is_readable(begin: int, end: int, *, has_ports: bool) -> bool:
    """Return True if a servo answers a read with data. Undefined bytes between defined ones read 0."""
    defined = ct.ITEM_OF.keys() if has_ports else ct.ITEM_OF.keys() - ct.PORT_BYTES
    return end <= ct.END and not defined.isdisjoint(range(begin, end))


@lru_cache(maxsize=256)
def touches_ports(begin: int, end: int) -> bool:
    """Return True if these addresses contain registers of the external ports."""
    return not ct.PORT_BYTES.isdisjoint(range(begin, end))


def write_error(table: bytearray, address: int, data: bytes, *, tripped: bool) -> int:
    """Return the error of a write to these addresses; 0 for none. ``tripped``: True if the bus watchdog has tripped."""
    whole = _writable_items(address, address + len(data))
    if isinstance(whole, int):
        return whole
    if tripped:
        touched = range(address, address + len(data))
        cleared = ct.BUS_WATCHDOG in touched and data[ct.BUS_WATCHDOG - address] == 0
        if not cleared and not (ct.GOAL_BYTES | {ct.BUS_WATCHDOG}).isdisjoint(touched):
            return protocol.DATA_RANGE_ERROR
    model = int.from_bytes(table[ct.MODEL : ct.MODEL + 2], "little")
    # No write contains both a goal and the limit of this goal, because undefined addresses separate them.
    values = [(item, item.value(data[item.address - address :][: item.size])) for item in whole]
    for item, value in values:
        low, high = ct.range_of(item, model)
        if not low <= value <= high or (item.address == ct.OPERATING_MODE and value not in ct.MODES):
            return protocol.DATA_RANGE_ERROR
    return protocol.DATA_LIMIT_ERROR if any(_beyond_limit(item, value, table) for item, value in values) else 0


@lru_cache(maxsize=256)
def _writable_items(begin: int, end: int) -> tuple[ct.RegisterItem, ...] | int:
    """Return the values that lie at these addresses, or the error of a write to them."""
    touched = range(begin, end)
    items = [ct.ITEM_OF.get(place) for place in touched]
    if not all(item is not None and item.writable for item in items):
        return protocol.ACCESS_ERROR
    whole = tuple(ct.ITEMS[place] for place in touched if place in ct.ITEMS)
    return whole if sum(item.size for item in whole) == len(touched) else protocol.DATA_LENGTH_ERROR


def _beyond_limit(item: ct.RegisterItem, value: int, table: bytearray) -> bool:
    """Return True if the servo's own limits forbid a goal."""
    if item.address in _LIMIT_OF:
        (greatest,) = struct.unpack_from("<H", table, _LIMIT_OF[item.address])
        return abs(value) > int(greatest)
    if item.address == ct.GOAL_POSITION:
        low, high = -_MULTI_TURN_COUNTS, _MULTI_TURN_COUNTS
        if table[ct.OPERATING_MODE] == ct.POSITION:
            high, low = struct.unpack_from("<II", table, ct.MAX_POSITION)
        return not low <= value <= high
    return False
