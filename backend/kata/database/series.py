"""A series of samples, cut into blocks of about a minute: a window of an hour is read without the rest of it.

The head says what is in all of them (columns, axes, rate, clock) and for each block which part of the clock it covers, with
its checksum. A block is a whole blob of :mod:`kata.database.arrays`: damage to one leaves the others as they are. Series
of before there were blocks are one such blob in the place of the head.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from kata.database.arrays import Column, Floats, UnreadableError, decode, encode, seal, sealed, unsealed

BLOCK_SAMPLES: Final = 6000
"""A minute at 100 Hz."""
_FORMAT: Final = "kata-series/1"
_CLOCK: Final = "seconds since the first sample, by the monotonic clock of the device"


@dataclass(frozen=True)
class Series:
    """A series as it is stored, or some of it: the head and, by number, blocks of it."""

    head: bytes
    blocks: Mapping[int, bytes] = field(default_factory=dict)


def pack(arrays: Mapping[str, NDArray[Any]], columns: tuple[Column, ...]) -> Series:
    """Compress arrays of equal length, ``(n,)`` or ``(n, k)``; the first column is their clock ``time_s``."""
    count = len(arrays[columns[0].name])
    blocks: list[bytes] = []
    table = []
    for start in range(0, count, BLOCK_SAMPLES):
        part = {column.name: np.asarray(arrays[column.name])[start : start + BLOCK_SAMPLES] for column in columns}
        blocks.append(encode(part, columns))
        table.append(
            {
                "samples": len(part[columns[0].name]),
                "seal": seal(blocks[-1]),
                "covers": {column.name: _covers(part[column.name]) for column in columns if column.unit == "s"},
            }
        )
    head = {
        "format": _FORMAT,
        "samples": count,
        "clock": _CLOCK,
        "rate_hz": _rate_hz(np.asarray(arrays[columns[0].name])),
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "resolution": column.resolution,
                "axes": list(range(1, np.shape(arrays[column.name])[1] + 1))
                if np.ndim(arrays[column.name]) > 1
                else None,
            }
            for column in columns
        ],
        "blocks": table,
    }
    return Series(sealed(json.dumps(head).encode()), dict(enumerate(blocks)))


def unpack(series: Series) -> dict[str, Floats]:
    """All of its arrays by name.

    :raises UnreadableError: when any of it is missing, damaged or of a format this version does not know.
    """
    if _is_one_blob(series.head):
        return decode(series.head)
    return _joined(series, range(len(_head(series.head)["blocks"])))


def numbers_within(head: bytes, clock: str, start_s: float, end_s: float) -> list[int]:
    """Which blocks cover some of a window, by one of the columns of seconds; none of a series that has no blocks.

    :raises UnreadableError: when the head cannot be read.
    """
    if _is_one_blob(head):
        return []
    return _within(_head(head), clock, start_s, end_s)


def unpack_within(series: Series, clock: str, start_s: float, end_s: float) -> dict[str, Floats]:
    """The samples within a window, both ends included; only the blocks that cover some of it need be there.

    :raises UnreadableError: when one of these is missing, or damaged.
    """
    if _is_one_blob(series.head):
        arrays = decode(series.head)
    else:
        arrays = _joined(series, _within(_head(series.head), clock, start_s, end_s))
    there = (arrays[clock] >= start_s) & (arrays[clock] <= end_s)
    return {name: values[there] for name, values in arrays.items()}


def _joined(series: Series, numbers: range | list[int]) -> dict[str, Floats]:
    head = _head(series.head)
    parts = [_block(series, head, number) for number in numbers]
    if not parts:
        return {one["name"]: np.empty((0, len(one["axes"])) if one["axes"] else 0) for one in head["columns"]}
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _block(series: Series, head: dict[str, Any], number: int) -> dict[str, Floats]:
    blob = series.blocks.get(number, b"")
    if seal(blob) != head["blocks"][number]["seal"]:
        raise UnreadableError(f"block {number} of the samples is damaged")
    return decode(blob)


def _is_one_blob(head: bytes) -> bool:
    return f'"{_FORMAT}"'.encode() not in head[:40]


def _head(data: bytes) -> dict[str, Any]:
    try:
        head: dict[str, Any] = json.loads(unsealed(data))
    except ValueError as error:
        raise UnreadableError(f"the samples cannot be read: {error}") from error
    return head


def _within(head: dict[str, Any], clock: str, start_s: float, end_s: float) -> list[int]:
    covered = [block["covers"][clock] for block in head["blocks"]]
    return [number for number, of in enumerate(covered) if of and of[0] <= end_s and of[1] >= start_s]


def _covers(values: Floats) -> list[float] | None:
    """Rounded outwards, as what is stored is rounded too; None where all are missing."""
    known = values[~np.isnan(values)]
    return [float(known.min()) - 1e-5, float(known.max()) + 1e-5] if len(known) else None


def _rate_hz(times_s: Floats) -> float | None:
    """As most of them follow each other: what was put together of several parts has its samples at several distances."""
    return round(float(1 / np.median(np.diff(times_s))), 1) if len(times_s) > 1 else None
