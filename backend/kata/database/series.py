"""A series of samples in blocks of one minute, so that a window of a long recording can be read without the rest.

The head describes columns, axes, rate and clock, and contains the time range and checksum of each block. Each block is a complete blob of
:mod:`kata.database.arrays`, so damage to one block leaves the others readable. An old series has no blocks; it has one blob in place of the
head.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from kata.database.arrays import (
    Floats,
    SampleColumn,
    UnreadableError,
    checksum_of,
    decode,
    encode,
    with_checksum,
    without_checksum,
)

BLOCK_SAMPLES: Final = 6000
"""Number of samples in a block: one minute at 100 Hz."""
_FORMAT: Final = "kata-series/1"
_CLOCK_DESCRIPTION: Final = "seconds since the first sample, by the monotonic clock of the device"


@dataclass(frozen=True)
class Series:
    """A stored series, or a part of it: the head, and blocks by number."""

    head: bytes
    blocks: Mapping[int, bytes] = field(default_factory=dict)


def pack(arrays: Mapping[str, NDArray[Any]], columns: tuple[SampleColumn, ...]) -> Series:
    """Compress arrays of equal length, shapes ``(n,)`` or ``(n, k)``. The first column is their clock, ``time_s``."""
    count = len(arrays[columns[0].name])
    blocks: list[bytes] = []
    table = []
    for start in range(0, count, BLOCK_SAMPLES):
        part = {column.name: np.asarray(arrays[column.name])[start : start + BLOCK_SAMPLES] for column in columns}
        blocks.append(encode(part, columns))
        table.append(
            {
                "samples": len(part[columns[0].name]),
                "seal": checksum_of(blocks[-1]),
                "covers": {column.name: _value_range(part[column.name]) for column in columns if column.unit == "s"},
            }
        )
    head = {
        "format": _FORMAT,
        "samples": count,
        "clock": _CLOCK_DESCRIPTION,
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
    return Series(with_checksum(json.dumps(head).encode()), dict(enumerate(blocks)))


def unpack(series: Series) -> dict[str, Floats]:
    """Return all arrays by name.

    :raises UnreadableError: when a part is missing, damaged or of a format that this version does not know.
    """
    if _is_one_blob(series.head):
        return decode(series.head)
    return _join_blocks(series, range(len(_parse_head(series.head)["blocks"])))


def numbers_within(head: bytes, clock: str, start_s: float, end_s: float) -> list[int]:
    """Return the numbers of the blocks that overlap a window. Return none for a series without blocks.

    :param clock: name of the column of seconds to which the window refers.
    :raises UnreadableError: when the head cannot be read.
    """
    if _is_one_blob(head):
        return []
    return _blocks_within(_parse_head(head), clock, start_s, end_s)


def unpack_within(series: Series, clock: str, start_s: float, end_s: float) -> dict[str, Floats]:
    """Return the samples within a window, including both ends. Only blocks that overlap the window are needed.

    :raises UnreadableError: when one of these blocks is missing or damaged.
    """
    if _is_one_blob(series.head):
        arrays = decode(series.head)
    else:
        arrays = _join_blocks(series, _blocks_within(_parse_head(series.head), clock, start_s, end_s))
    within = (arrays[clock] >= start_s) & (arrays[clock] <= end_s)
    return {name: values[within] for name, values in arrays.items()}


def _join_blocks(series: Series, numbers: range | list[int]) -> dict[str, Floats]:
    head = _parse_head(series.head)
    parts = [_decode_block(series, head, number) for number in numbers]
    if not parts:
        return {
            column["name"]: np.empty((0, len(column["axes"])) if column["axes"] else 0) for column in head["columns"]
        }
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _decode_block(series: Series, head: dict[str, Any], number: int) -> dict[str, Floats]:
    blob = series.blocks.get(number, b"")
    if checksum_of(blob) != head["blocks"][number]["seal"]:
        raise UnreadableError(f"block {number} of the samples is damaged")
    return decode(blob)


def _is_one_blob(head: bytes) -> bool:
    return f'"{_FORMAT}"'.encode() not in head[:40]


def _parse_head(data: bytes) -> dict[str, Any]:
    try:
        head: dict[str, Any] = json.loads(without_checksum(data))
    except ValueError as error:
        raise UnreadableError(f"the samples cannot be read: {error}") from error
    return head


def _blocks_within(head: dict[str, Any], clock: str, start_s: float, end_s: float) -> list[int]:
    covered = [block["covers"][clock] for block in head["blocks"]]
    return [number for number, of in enumerate(covered) if of and of[0] <= end_s and of[1] >= start_s]


def _value_range(values: Floats) -> list[float] | None:
    """Return the lowest and highest value, slightly widened because stored values are rounded. Return None if all values are missing."""
    present_values = values[~np.isnan(values)]
    return [float(present_values.min()) - 1e-5, float(present_values.max()) + 1e-5] if len(present_values) else None


def _rate_hz(times_s: Floats) -> float | None:
    """Return the median sample rate, or None for a single sample. A recording that consists of several parts can have several rates."""
    return round(float(1 / np.median(np.diff(times_s))), 1) if len(times_s) > 1 else None
