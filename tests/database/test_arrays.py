"""Samples as compressed arrays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as numpy_arrays

from kata.database.arrays import SampleColumn, UnreadableError, decode, encode
from tests.support.array_formats import FIRST_FORMAT

COUNT_DEG = 360 / 4096
COLUMNS = (SampleColumn("time_s", "s", 1e-6), SampleColumn("angle_deg", "deg", 1e-4, in_encoder_counts=True))
angles = numpy_arrays(np.float64, st.tuples(st.integers(0, 50), st.just(5)), elements=st.floats(-360, 360))


@given(angles)
def test_decoded_values_are_within_the_resolution(angle_deg: np.ndarray) -> None:
    time_s = np.arange(len(angle_deg)) * 0.01
    back = decode(encode({"time_s": time_s, "angle_deg": angle_deg}, COLUMNS))

    assert back["angle_deg"].shape == angle_deg.shape
    assert np.abs(back["time_s"] - time_s).max(initial=0) <= 0.5001e-6
    assert np.abs(back["angle_deg"] - angle_deg).max(initial=0) <= 0.5001e-4


@given(numpy_arrays(np.int64, st.tuples(st.integers(0, 50), st.just(5)), elements=st.integers(-4096, 4096)))
def test_counts_of_a_drive_come_back_as_they_were(counts: np.ndarray) -> None:
    """Counts are restored exactly for every offset, although the journal stores them in 32 bits."""
    angle_deg = (0.0123 + counts * COUNT_DEG).astype(np.float32).astype(np.float64)
    back = decode(encode({"angle_deg": angle_deg}, (SampleColumn("angle_deg", "deg", 1e-4, in_encoder_counts=True),)))[
        "angle_deg"
    ]
    assert np.abs(back - angle_deg).max(initial=0) <= 0.5001e-4
    assert np.array_equal(np.rint((back - 0.0123) / COUNT_DEG), counts)


@pytest.mark.parametrize("resolution", [1e-6, 1e-3])
def test_a_missing_value_stays_missing(resolution: float) -> None:
    path_s = np.array([np.nan, 0.0, 0.01, np.nan, 5.0])
    columns = (SampleColumn("time_s", "s", resolution), SampleColumn("path_s", "s", resolution, difference_to="time_s"))
    back = decode(encode({"time_s": np.arange(5) * 0.01, "path_s": path_s}, columns))["path_s"]
    assert back == pytest.approx(path_s, nan_ok=True)
    nowhere = decode(encode({"time_s": np.arange(5) * 0.01, "path_s": np.full(5, np.nan)}, columns))["path_s"]
    assert np.isnan(nowhere).all()


def test_a_minute_of_motion_is_small() -> None:
    time_s = np.arange(6000) * 0.01
    counts = np.rint(1000 * np.sin(time_s[:, None] * np.arange(1, 6)))
    blob = encode({"time_s": time_s, "angle_deg": counts * COUNT_DEG}, COLUMNS)
    assert len(blob) < 0.08 * (time_s.nbytes + counts.nbytes)


def test_columns_beside_a_jittering_clock_compress_to_nothing() -> None:
    time_s = np.cumsum(np.random.default_rng(1).normal(0.01, 0.0003, 6000))
    columns = (SampleColumn("time_s", "s", 1e-6), SampleColumn("path_s", "s", 1e-6, difference_to="time_s"))
    alone = encode({"time_s": time_s}, columns[:1])
    assert len(encode({"time_s": time_s, "path_s": time_s - 7.0}, columns)) < len(alone) + 200


@pytest.mark.parametrize("blob", [encode({"time_s": np.arange(50) * 0.01, "angle_deg": np.ones((50, 5))}, COLUMNS)])
def test_damaged_blob_is_detected_wherever_it_is_damaged(blob: bytes) -> None:
    for cut in range(len(blob)):
        with pytest.raises(UnreadableError):
            decode(blob[:cut])
    for place in range(len(blob)):
        with pytest.raises(UnreadableError):
            decode(blob[:place] + bytes([blob[place] ^ 0x10]) + blob[place + 1 :])


def test_arrays_of_the_first_version_are_readable() -> None:
    back = decode(FIRST_FORMAT)
    assert back["time_s"] == pytest.approx(np.arange(5) * 0.01)
    assert back["path_s"] == pytest.approx(np.array([np.nan, 0.0, 0.01, np.nan, 5.0]), nan_ok=True)
    assert back["angle_deg"] == pytest.approx(np.arange(10).reshape(5, 2) * 1.0001 - 3, abs=0.5001e-4)
    body = FIRST_FORMAT.index(b"\n") + 1
    for place in range(body, len(FIRST_FORMAT)):
        with pytest.raises(UnreadableError):
            decode(FIRST_FORMAT[:place] + bytes([FIRST_FORMAT[place] ^ 0x10]) + FIRST_FORMAT[place + 1 :])


def test_a_format_from_the_future_is_named() -> None:
    with pytest.raises(UnreadableError, match="kata-samples/9"):
        decode(b'{"format":"kata-samples/9","columns":[]}\n')
