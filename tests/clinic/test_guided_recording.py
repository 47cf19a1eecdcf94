"""A recording that is guided by recordings of the sound side."""

import pytest

from kata.clinic.recordings.derive import OtherRecording, Source, derive
from kata.clinic.recordings.edits import GuideScapula
from kata.clinic.recordings.tables import RECORDING_COLUMNS
from kata.database.series import Series, pack
from kata.device.config import simulated
from kata.motion.axes import Side
from kata.motion.edit import EditError
from kata.motion.linkage import Floats, motor_angles_deg
from tests.support.rhythm_motions import evenly, times_of, wave

DAMAGED = OtherRecording("Damaged", Series(b"damaged"))
GUIDE = GuideScapula(do="guide")


def series(poses: Floats, side: Side) -> Series:
    return pack({"time_s": times_of(poses), "angle_deg": motor_angles_deg(poses, side)}, RECORDING_COLUMNS)


def source(*others: OtherRecording) -> Source:
    return Source(series(evenly(wave(12.0, 80.0, 8.0), 3.0), "left"), "left", (), others)


def test_damaged_recording_of_the_sound_side_is_left_out() -> None:
    sound = OtherRecording("Sound arm", series(evenly(wave(12.0, 88.0, 10.0), 4.0), "right"))
    derived = derive(source(DAMAGED, sound), GUIDE, simulated("virtual"))
    assert any("Sound arm" in text for text in derived.done)


def test_only_damaged_recordings_guide_nothing() -> None:
    with pytest.raises(EditError):
        derive(source(DAMAGED), GUIDE, simulated("virtual"))
