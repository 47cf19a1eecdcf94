"""Samples as compressed arrays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as numpy_arrays

from kata.database.arrays import Column, UnreadableError, decode, encode

COLUMNS = (Column("time_s", "s", 1e-6), Column("angle_deg", "deg", 1e-4))
angles = numpy_arrays(np.float64, st.tuples(st.integers(0, 50), st.just(5)), elements=st.floats(-360, 360))


@given(angles)
def test_what_comes_back_is_within_the_resolution(angle_deg: np.ndarray) -> None:
    time_s = np.arange(len(angle_deg)) * 0.01
    back = decode(encode({"time_s": time_s, "angle_deg": angle_deg}, COLUMNS))

    assert back["angle_deg"].shape == angle_deg.shape
    assert np.abs(back["time_s"] - time_s).max(initial=0) <= 0.5001e-6
    assert np.abs(back["angle_deg"] - angle_deg).max(initial=0) <= 0.5001e-4


def test_a_missing_value_stays_missing() -> None:
    path_s = np.array([np.nan, 0.0, 0.01, np.nan, 5.0])
    back = decode(encode({"path_s": path_s}, (Column("path_s", "s", 1e-6),)))["path_s"]
    assert back == pytest.approx(path_s, nan_ok=True)


def test_a_minute_of_motion_is_small() -> None:
    time_s = np.arange(6000) * 0.01
    counts = np.rint(1000 * np.sin(time_s[:, None] * np.arange(1, 6)))
    blob = encode({"time_s": time_s, "angle_deg": counts * 360 / 4096}, COLUMNS)
    assert len(blob) < 0.25 * (time_s.nbytes + counts.nbytes)


def test_a_damaged_blob_is_told_apart_wherever_the_damage_is() -> None:
    blob = encode({"time_s": np.arange(50) * 0.01, "angle_deg": np.ones((50, 5))}, COLUMNS)
    for cut in range(0, len(blob), 7):
        with pytest.raises(UnreadableError):
            decode(blob[:cut])
    body = blob.index(b"\n") + 1
    for place in range(body, len(blob), 5):
        with pytest.raises(UnreadableError):
            decode(blob[:place] + bytes([blob[place] ^ 0x10]) + blob[place + 1 :])


def test_a_format_from_the_future_is_named() -> None:
    with pytest.raises(UnreadableError, match="kata-samples/9"):
        decode(b'{"format":"kata-samples/9","columns":[]}\n')
