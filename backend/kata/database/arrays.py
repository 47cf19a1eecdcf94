"""Compress arrays of samples into one blob with a header.

A blob consists of a line of JSON (format, and each column's name, unit, resolution and shape), one compressed part per column, and a
checksum. A value is stored as a whole number of steps. A step is the resolution, or the encoder count of the drive if all values are
multiples of one. Neighbouring samples differ little, so differences of first to third order are stored. Their bytes are grouped by
significance.

Blobs of the first format, which stored only first differences, can still be read.
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
_FORMER_FORMAT: Final = "kata-samples/1"
_FORMER_MISSING: Final = np.iinfo(np.int64).min
_HIGHEST_ORDER: Final = 3
"""Highest order of differences. Third differences of a smooth setpoint are smallest; a torque is mostly noise."""
_AXIS_HEADER: Final = struct.Struct("<ddBBB")
"""Per column and axis: step, offset, order, bytes per value, and 1 if values are missing."""
_CRC: Final = struct.Struct("<I")
# The differences are noise that neighbouring bytes do not predict, so lc and pb are 0.
_FILTERS: Final = [{"id": lzma.FILTER_LZMA2, "preset": 6, "lc": 0, "pb": 0, "dict_size": 1 << 18}]
_DAMAGE_ERRORS: Final = (ValueError, KeyError, TypeError, IndexError, struct.error, zlib.error, lzma.LZMAError)

Floats = NDArray[np.float64]
_Steps = NDArray[np.int64]


class UnreadableError(ValueError):
    """The samples of a record cannot be read."""


@dataclass(frozen=True)
class SampleColumn:
    """Storage of one array. ``resolution``: the smallest difference that is preserved, in ``unit``."""

    name: str
    unit: str
    resolution: float
    in_encoder_counts: bool = False
    """True if the values are whole encoder counts of a drive. They are stored as counts if a count is larger than the resolution."""
    difference_to: str | None = None
    """Name of an earlier column with the same resolution. Only the difference from that column is stored."""


def encode(arrays: Mapping[str, NDArray[Any]], columns: tuple[SampleColumn, ...]) -> bytes:
    """Compress arrays of equal length, shapes ``(n,)`` or ``(n, k)``. NaN marks a missing value."""
    values = {column.name: np.asarray(arrays[column.name], dtype=np.float64) for column in columns}
    parts = [
        _compress_column(values[column.name], column, values[column.difference_to] if column.difference_to else None)
        for column in columns
    ]
    header = {
        "format": _FORMAT,
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "resolution": column.resolution,
                "along": column.difference_to,
                "shape": list(values[column.name].shape),
                "bytes": len(part),
            }
            for column, part in zip(columns, parts, strict=True)
        ],
    }
    return with_checksum(json.dumps(header).encode() + b"\n" + b"".join(parts))


def decode(blob: bytes) -> dict[str, Floats]:
    """Return the arrays by name.

    :raises UnreadableError: when the blob is damaged or has a format that this version does not know.
    """
    line, _, body = blob.partition(b"\n")
    try:
        header = json.loads(line)
        if header["format"] == _FORMER_FORMAT:
            return _decode_former_format(header, body)
        if header["format"] != _FORMAT:
            raise UnreadableError(f"samples of format {header['format']} cannot be read by this version")
        body = without_checksum(blob)[len(line) + 1 :]
        arrays: dict[str, Floats] = {}
        start = 0
        for column in header["columns"]:
            part = body[start : start + column["bytes"]]
            start += column["bytes"]
            along = arrays[column["along"]] if column["along"] else None
            arrays[column["name"]] = _decompress_column(part, column["shape"], column["resolution"], along)
    except _DAMAGE_ERRORS as error:
        raise UnreadableError(f"the samples cannot be read: {error}") from error
    return arrays


def with_checksum(data: bytes) -> bytes:
    """Return the data with a checksum appended."""
    return data + _CRC.pack(zlib.crc32(data))


def checksum_of(data: bytes) -> str:
    """Return the appended checksum in hexadecimal."""
    return data[-_CRC.size :].hex()


def without_checksum(data: bytes) -> bytes:
    """Check the appended checksum and return the data without it.

    :raises UnreadableError: when the checksum is wrong.
    """
    content = data[: -_CRC.size]
    if data[-_CRC.size :] != _CRC.pack(zlib.crc32(content)):
        raise UnreadableError("the samples are damaged")
    return content


def _compress_column(values: Floats, column: SampleColumn, along: Floats | None) -> bytes:
    table = values if values.ndim > 1 else values[:, None]
    axes = [_encode_axis(table[:, axis], column, along) for axis in range(table.shape[1])]
    return lzma.compress(b"".join(axes), lzma.FORMAT_RAW, filters=_FILTERS)


def _encode_axis(values: Floats, column: SampleColumn, along: Floats | None) -> bytes:
    missing = np.isnan(values)
    present = values[~missing]
    step, offset = _detect_grid(present, column.resolution) if column.in_encoder_counts else (column.resolution, 0.0)
    steps = np.rint((present - offset) / step).astype(np.int64)
    if along is not None:
        steps = steps - _to_steps(along, step)[~missing]
    order, starts, differences = _smallest_differences(steps)
    # Zigzag encoding stores the sign in the lowest bit, so that small negative numbers stay small.
    folded = ((differences << 1) ^ (differences >> 63)).astype("<u8")
    width = -(-int(folded.max(initial=0)).bit_length() // 8)
    planes = folded.view(np.uint8).reshape(-1, 8)[:, :width].T
    return b"".join(
        (
            _AXIS_HEADER.pack(step, offset, order, width, int(missing.any())),
            np.packbits(missing).tobytes() if missing.any() else b"",
            starts.astype("<i8").tobytes(),
            planes.tobytes(),
        )
    )


def _detect_grid(values: Floats, resolution: float) -> tuple[float, float]:
    """Return step and offset of the drive's encoder counts if all values lie on such a grid, else the resolution and 0."""
    distances = np.diff(np.unique(values))
    if len(distances) and (finest := float(distances.min())) > resolution:
        span = float(np.ptp(values))
        # The whole span of 32-bit values gives the size of a count more exactly than a single distance.
        step = span / round(span / finest)
        offset = float(values[0] - np.rint(values[0] / step) * step)
        if np.abs(np.rint((values - offset) / step) * step + offset - values).max() <= resolution / 2:
            return step, offset
    return resolution, 0.0


def _to_steps(values: Floats, step: float) -> _Steps:
    return np.rint(values / step).astype(np.int64)


def _smallest_differences(steps: _Steps) -> tuple[int, _Steps, _Steps]:
    """Return the order of differences that needs the fewest bits, the first value of each lower order, and the differences."""
    differences = [steps]
    while len(differences) <= min(_HIGHEST_ORDER, len(steps) - 1):
        differences.append(np.diff(differences[-1]))
    bits = [float(np.log2(1.0 + np.abs(values)).sum()) for values in differences]
    order = int(np.argmin(bits))
    starts = np.array([values[0] for values in differences[:order]], dtype=np.int64)
    return order, starts, differences[order]


def _decompress_column(part: bytes, shape: list[int], resolution: float, along: Floats | None) -> Floats:
    data = lzma.decompress(part, lzma.FORMAT_RAW, filters=_FILTERS)
    count = shape[0]
    values = np.empty((count, shape[1] if len(shape) > 1 else 1))
    position = 0
    for axis in range(values.shape[1]):
        step, offset, order, width, some_missing = _AXIS_HEADER.unpack_from(data, position)
        position += _AXIS_HEADER.size
        is_present = np.ones(count, dtype=bool)
        if some_missing:
            bits = np.frombuffer(data, np.uint8, -(-count // 8), position)
            is_present = np.unpackbits(bits, count=count) == 0
            position += len(bits)
        starts = np.frombuffer(data, "<i8", order, position)
        position += starts.nbytes
        stored = int(is_present.sum()) - order
        folded = np.zeros((stored, 8), dtype=np.uint8)
        folded[:, :width] = np.frombuffer(data, np.uint8, stored * width, position).reshape(width, stored).T
        position += stored * width
        steps = _integrate(folded.view("<u8").ravel(), starts)
        if along is not None:
            steps = steps + _to_steps(along, step)[is_present]
        values[:, axis] = np.nan
        values[is_present, axis] = steps * step + offset
    return values.reshape(shape)


def _integrate(folded: NDArray[np.uint64], starts: _Steps) -> _Steps:
    steps = (folded >> 1).astype(np.int64) ^ -(folded & 1).astype(np.int64)
    for start in starts[::-1]:
        steps = np.cumsum(np.concatenate([[start], steps]), dtype=np.int64)
    return steps


def _decode_former_format(header: dict[str, Any], body: bytes) -> dict[str, Floats]:
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
        arrays[column["name"]] = np.where(steps == _FORMER_MISSING, np.nan, steps * column["resolution"])
    return arrays
