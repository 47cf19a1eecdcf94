"""Arrays of samples as one compressed blob, with a header that says what is in it.

A blob is a line of JSON (format, and for each column its name, unit, resolution, shape), one compressed part a column, and a checksum
of it all. A value is stored as a whole number of steps: of its resolution, or of the counts that a drive tells it in,
where the values themselves show them. Neighbouring samples differ little, so what is stored is how far each is from where
the ones before it lead, its bytes grouped by significance.

Blobs of the first format, which stored differences only, are still read.
"""

import json
import lzma
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_FORMAT: Final = "kata-samples/2"
_BEFORE: Final = "kata-samples/1"
_MISSING_BEFORE: Final = np.iinfo(np.int64).min
_HIGHEST_ORDER: Final = 3
"""A setpoint is a smooth curve, whose third differences are smallest; a torque is mostly noise."""
_AXIS: Final = struct.Struct("<ddBBB")
"""Step, offset, order, bytes a value, whether some are missing."""
_CRC: Final = struct.Struct("<I")
# What is left is noise: its bytes follow no pattern of their neighbours, and are told best by how frequent each is.
_FILTERS: Final = [{"id": lzma.FILTER_LZMA2, "preset": 6, "lc": 0, "pb": 0, "dict_size": 1 << 18}]
_DAMAGE: Final = (ValueError, KeyError, TypeError, IndexError, struct.error, zlib.error, lzma.LZMAError)

Floats = NDArray[np.float64]
_Steps = NDArray[np.int64]


class UnreadableError(ValueError):
    """The blob cannot be read; the record around it can."""


@dataclass(frozen=True)
class Column:
    """How one array is kept: ``resolution`` is the smallest difference that survives, in ``unit``."""

    name: str
    unit: str
    resolution: float
    counted: bool = False
    """Its values come from a drive, in whole counts: stored as these where they are coarser than the resolution."""
    along: str | None = None
    """Another column, before this one and of the same resolution, that this one goes along with."""


def encode(arrays: Mapping[str, NDArray[Any]], columns: tuple[Column, ...]) -> bytes:
    """Compress arrays of equal length, shapes ``(n,)`` or ``(n, k)``; NaN is a value that is missing."""
    values = {column.name: np.asarray(arrays[column.name], dtype=np.float64) for column in columns}
    parts = [_packed(values[column.name], column, values[column.along] if column.along else None) for column in columns]
    header = {
        "format": _FORMAT,
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "resolution": column.resolution,
                "along": column.along,
                "shape": list(values[column.name].shape),
                "bytes": len(part),
            }
            for column, part in zip(columns, parts, strict=True)
        ],
    }
    return sealed(json.dumps(header).encode() + b"\n" + b"".join(parts))


def decode(blob: bytes) -> dict[str, Floats]:
    """The arrays by name.

    :raises UnreadableError: when the blob is damaged or of a format this version does not know.
    """
    line, _, body = blob.partition(b"\n")
    try:
        header = json.loads(line)
        if header["format"] == _BEFORE:
            return _decode_before(header, body)
        if header["format"] != _FORMAT:
            raise UnreadableError(f"samples of format {header['format']} cannot be read by this version")
        body = unsealed(blob)[len(line) + 1 :]
        arrays: dict[str, Floats] = {}
        start = 0
        for column in header["columns"]:
            part = body[start : start + column["bytes"]]
            start += column["bytes"]
            along = arrays[column["along"]] if column["along"] else None
            arrays[column["name"]] = _unpacked(part, column["shape"], column["resolution"], along)
    except _DAMAGE as error:
        raise UnreadableError(f"the samples cannot be read: {error}") from error
    return arrays


def sealed(data: bytes) -> bytes:
    """With a checksum behind it."""
    return data + _CRC.pack(zlib.crc32(data))


def seal(data: bytes) -> str:
    """The checksum behind it, to know it again by."""
    return data[-_CRC.size :].hex()


def unsealed(data: bytes) -> bytes:
    """What stands before the checksum.

    :raises UnreadableError: when it is not the data's.
    """
    inside = data[: -_CRC.size]
    if data[-_CRC.size :] != _CRC.pack(zlib.crc32(inside)):
        raise UnreadableError("the samples are damaged")
    return inside


def _packed(values: Floats, column: Column, along: Floats | None) -> bytes:
    table = values if values.ndim > 1 else values[:, None]
    axes = [_axis(table[:, axis], column, along) for axis in range(table.shape[1])]
    return lzma.compress(b"".join(axes), lzma.FORMAT_RAW, filters=_FILTERS)


def _axis(values: Floats, column: Column, along: Floats | None) -> bytes:
    missing = np.isnan(values)
    known = values[~missing]
    step, offset = _counts(known, column.resolution) if column.counted else (column.resolution, 0.0)
    steps = np.rint((known - offset) / step).astype(np.int64)
    if along is not None:
        steps = steps - _in_steps(along, step)[~missing]
    order, starts, left = _least(steps)
    # Sign into the lowest bit: small numbers of either sign are small.
    folded = ((left << 1) ^ (left >> 63)).astype("<u8")
    width = -(-int(folded.max(initial=0)).bit_length() // 8)
    planes = folded.view(np.uint8).reshape(-1, 8)[:, :width].T
    return b"".join(
        (
            _AXIS.pack(step, offset, order, width, int(missing.any())),
            np.packbits(missing).tobytes() if missing.any() else b"",
            starts.astype("<i8").tobytes(),
            planes.tobytes(),
        )
    )


def _counts(values: Floats, resolution: float) -> tuple[float, float]:
    """Step and offset of the grid that all values lie on, where there is a coarser one than the resolution."""
    apart = np.diff(np.unique(values))
    if len(apart) and (finest := float(apart.min())) > resolution:
        span = float(np.ptp(values))
        # A value of 32 bits tells a single count less exactly than it tells the whole way.
        step = span / round(span / finest)
        offset = float(values[0] - np.rint(values[0] / step) * step)
        if np.abs(np.rint((values - offset) / step) * step + offset - values).max() <= resolution / 2:
            return step, offset
    return resolution, 0.0


def _in_steps(values: Floats, step: float) -> _Steps:
    return np.rint(values / step).astype(np.int64)


def _least(steps: _Steps) -> tuple[int, _Steps, _Steps]:
    """The order of differences that leaves least: order, what each order starts from, what is left."""
    tried = [steps]
    while len(tried) <= min(_HIGHEST_ORDER, len(steps) - 1):
        tried.append(np.diff(tried[-1]))
    bits = [float(np.log2(1.0 + np.abs(left)).sum()) for left in tried]
    order = int(np.argmin(bits))
    starts = np.array([left[0] for left in tried[:order]], dtype=np.int64)
    return order, starts, tried[order]


def _unpacked(part: bytes, shape: list[int], resolution: float, along: Floats | None) -> Floats:
    data = lzma.decompress(part, lzma.FORMAT_RAW, filters=_FILTERS)
    count = shape[0]
    values = np.empty((count, shape[1] if len(shape) > 1 else 1))
    position = 0
    for axis in range(values.shape[1]):
        step, offset, order, width, some_missing = _AXIS.unpack_from(data, position)
        position += _AXIS.size
        known = np.ones(count, dtype=bool)
        if some_missing:
            bits = np.frombuffer(data, np.uint8, -(-count // 8), position)
            known = np.unpackbits(bits, count=count) == 0
            position += len(bits)
        starts = np.frombuffer(data, "<i8", order, position)
        position += starts.nbytes
        left = int(known.sum()) - order
        folded = np.zeros((left, 8), dtype=np.uint8)
        folded[:, :width] = np.frombuffer(data, np.uint8, left * width, position).reshape(width, left).T
        position += left * width
        steps = _summed(folded.view("<u8").ravel(), starts)
        if along is not None:
            steps = steps + _in_steps(along, step)[known]
        values[:, axis] = np.nan
        values[known, axis] = steps * step + offset
    return values.reshape(shape)


def _summed(folded: NDArray[np.uint64], starts: _Steps) -> _Steps:
    steps = (folded >> 1).astype(np.int64) ^ -(folded & 1).astype(np.int64)
    for start in starts[::-1]:
        steps = np.cumsum(np.concatenate([[start], steps]), dtype=np.int64)
    return steps


def _decode_before(header: dict[str, Any], body: bytes) -> dict[str, Floats]:
    if header["crc32"] != zlib.crc32(body):
        raise UnreadableError("the samples are damaged")
    arrays: dict[str, Floats] = {}
    start = 0
    for column in header["columns"]:
        part = zlib.decompress(body[start : start + column["bytes"]])
        start += column["bytes"]
        grouped = np.frombuffer(part, dtype=np.uint8).reshape(8, -1)
        differences = np.ascontiguousarray(grouped.T).view("<i8").reshape(column["shape"])
        steps = np.cumsum(differences, axis=0, dtype=np.int64)
        arrays[column["name"]] = np.where(steps == _MISSING_BEFORE, np.nan, steps * column["resolution"])
    return arrays
