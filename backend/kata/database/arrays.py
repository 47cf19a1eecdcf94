"""Samples as compressed arrays: one blob a recording or run, with a header that says what is in it.

A blob is a line of JSON (format, checksum, and for each column its name, unit, resolution, shape) followed by one compressed block a
column. A value is stored as a whole number of resolution steps; neighbouring samples differ little, so differences are
stored, their bytes grouped by significance, deflated.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_FORMAT: Final = "kata-samples/1"
_LEVEL: Final = 6
_MISSING: Final = np.iinfo(np.int64).min
"""Stands for NaN: no place on the path."""


class UnreadableError(ValueError):
    """The blob cannot be read; the record around it can."""


@dataclass(frozen=True)
class Column:
    """How one array is kept: ``resolution`` is the smallest difference that survives, in ``unit``."""

    name: str
    unit: str
    resolution: float


def encode(arrays: Mapping[str, NDArray[Any]], columns: tuple[Column, ...]) -> bytes:
    """Compress arrays of equal length, shapes ``(n,)`` or ``(n, k)``."""
    blocks = [_pack(np.asarray(arrays[column.name], dtype=np.float64), column.resolution) for column in columns]
    body = b"".join(blocks)
    header = {
        "format": _FORMAT,
        "crc32": zlib.crc32(body),
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "resolution": column.resolution,
                "shape": list(np.shape(arrays[column.name])),
                "bytes": len(block),
            }
            for column, block in zip(columns, blocks, strict=True)
        ],
    }
    return json.dumps(header).encode() + b"\n" + body


def decode(blob: bytes) -> dict[str, NDArray[np.float64]]:
    """The arrays by name.

    :raises UnreadableError: when the blob is damaged or of a format this version does not know.
    """
    line, _, body = blob.partition(b"\n")
    try:
        header = json.loads(line)
        if header["format"] != _FORMAT:
            raise UnreadableError(f"samples of format {header['format']} cannot be read by this version")
        if header["crc32"] != zlib.crc32(body):
            raise UnreadableError("the samples are damaged")
        arrays = {}
        start = 0
        for column in header["columns"]:
            block = body[start : start + column["bytes"]]
            start += column["bytes"]
            arrays[column["name"]] = _unpack(block, column["shape"], column["resolution"])
    except (ValueError, KeyError, TypeError, zlib.error) as error:
        raise UnreadableError(f"the samples cannot be read: {error}") from error
    return arrays


def _pack(values: NDArray[np.float64], resolution: float) -> bytes:
    missing = np.isnan(values)
    steps = np.where(missing, 0, np.rint(values / resolution)).astype(np.int64)
    steps[missing] = _MISSING
    with np.errstate(over="ignore"):
        differences = np.diff(steps, axis=0, prepend=np.zeros_like(steps[:1]))
    grouped = differences.astype("<i8").view(np.uint8).reshape(-1, 8).T
    return zlib.compress(grouped.tobytes(), _LEVEL)


def _unpack(block: bytes, shape: list[int], resolution: float) -> NDArray[np.float64]:
    grouped = np.frombuffer(zlib.decompress(block), dtype=np.uint8).reshape(8, -1)
    differences = np.ascontiguousarray(grouped.T).view("<i8").reshape(shape)
    steps = np.cumsum(differences, axis=0, dtype=np.int64)
    return np.where(steps == _MISSING, np.nan, steps * resolution)
