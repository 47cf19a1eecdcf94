"""Reading motions from files, and the built-in motions."""

import os
from pathlib import Path

import numpy as np
import pytest

from kata.motion.axes import BASIC_MOTIONS, POSE_COLUMNS, POSE_RANGE_DEG
from kata.motion.builtin import SPEED_DEG_S, built_in_motions
from kata.motion.taught import TaughtError, parse_csv, read_csv

HEADER = "time_s," + ",".join(POSE_COLUMNS)


def test_columns_may_have_any_order() -> None:
    text = (
        "note,external_rotation,time_s,shoulder_flexion,shoulder_abduction,scapula_upward_rotation,scapula_abduction\n"
        "a,5,10.0,4,3,2,1\n"
        "b,5.5,10.6,4.5,3.5,2.5,1.5\n"
    )
    taught = parse_csv(text, "mixed")

    assert taught.times_s == pytest.approx([0.0, 0.6])
    assert taught.poses_deg[0] == pytest.approx([1, 2, 3, 4, 5])


def test_spreadsheet_byte_order_mark_and_line_ends_are_accepted() -> None:
    text = "\ufeff" + HEADER + "\r\n0,0,0,0,0,0\r\n1,0,0,0,0,0\r\n\r\n"
    assert parse_csv(text, "from a spreadsheet").duration_s == 1.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the first line must name the columns"),
        ("time_s,shoulder_abduction\n0,1\n", "missing: scapula_abduction, scapula_upward_rotation, shoulder_flexion"),
        (f"{HEADER}\n0,0,0,0,0,0\n1,0,0,x,0,0\n", "line 3, column shoulder_abduction: 'x' is not a number"),
        (f"{HEADER}\n0,0,0,0,0,0\n1,0,0\n", "line 3, column shoulder_abduction: '' is not a number"),
        (f"{HEADER}\n0,0,0,0,0,0\n1,0,nan,0,0,0\n", "line 3, column scapula_upward_rotation: 'nan' is not a number"),
        (f"{HEADER}\n1,0,0,0,0,0\n1,0,0,0,0,0\n", "line 3, column time_s: the time must increase, but 1 s follows 1 s"),
        (f"{HEADER}\n0,0,0,0,0,0\n1,0,0,0,195,0\n", "line 3, column shoulder_flexion: 195° is outside"),
        (f"{HEADER}\n0,0,0,0,0,0\n", "the motion is too short"),
        (f"{HEADER}\n0,0,0,0,0,0\n0.1,0,0,0,0,0\n", "the motion is too short"),
    ],
)
def test_bad_files_are_reported_with_the_error_and_place(text: str, sentence: str) -> None:
    with pytest.raises(TaughtError) as caught:
        parse_csv(text, "bad")
    assert sentence in str(caught.value)


def test_binary_or_missing_files_are_reported(tmp_path: Path) -> None:
    with pytest.raises(TaughtError, match="No such file"):
        read_csv(tmp_path / "nothing.csv")
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(TaughtError, match="is not a text file"):
        read_csv(tmp_path / "picture.csv")


@pytest.mark.skipif("KATA_TAUGHT" not in os.environ, reason="no recorded motions at hand (KATA_TAUGHT)")
def test_the_recorded_motions_are_read() -> None:
    files = sorted(Path(os.environ["KATA_TAUGHT"]).glob("*.csv"))
    assert files
    for file in files:
        taught = read_csv(file)
        assert taught.name == file.stem
        assert taught.times_s[0] == 0.0
        assert taught.duration_s > 5


def test_the_seven_built_in_motions_are_smooth_and_within_range() -> None:
    motions = built_in_motions()
    assert len(motions) == 7
    ranges = np.array(POSE_RANGE_DEG)
    for motion in motions:
        assert np.all(motion.poses_deg >= ranges[:, 0])
        assert np.all(motion.poses_deg <= ranges[:, 1])
        speed = np.abs(np.diff(motion.poses_deg, axis=0)).max() / 0.01
        assert speed <= SPEED_DEG_S * 1.01
        assert motion.poses_deg[0] == pytest.approx(motion.poses_deg[-1])


def test_each_basic_motion_moves_its_own_angle_most() -> None:
    for basic, motion in zip(BASIC_MOTIONS, built_in_motions(), strict=False):
        moved = np.ptp(motion.poses_deg, axis=0)
        low, high = basic.range_deg
        assert moved[basic.axis - 1] > 0.7 * (high - low)
        assert int(np.argmax(moved)) == basic.axis - 1
