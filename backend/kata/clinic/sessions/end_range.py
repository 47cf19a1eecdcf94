"""Counts the end-range time of a playback from its journal (:mod:`kata.motion.end_range`), and stores it with each motion."""

from dataclasses import replace

from kata.clinic.sessions.tables import RunRow
from kata.device.config import StationConfig
from kata.device.journal import Journal
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.edit import Motion
from kata.motion.end_range import BAND_DEG, TORQUE_NM, end_range_times_s
from kata.types import side_of


def count(row: RunRow, journal: Journal, taught: Motion, config: StationConfig) -> None:
    """Store the time of each motion of the shoulder joint. All samples of the run count, also those of pauses and of the way back.

    Nothing is stored if the station's load is not identified, and for a motion without an end.
    """
    times = end_range_times_s(
        (journal.t_ns - journal.t_ns[0]) / 1e9,
        journal.measured_deg,
        journal.torque_nm,
        taught.angles_deg,
        replace(config.servo_model.load, side=side_of(row.recording.side)),
    )
    for motion in row.motions:
        motors = BASIC_MOTIONS[motion.motion - 1].motors
        if len(motors) == 1 and motors[0] in times:
            motion.end_range_s = times[motors[0]]
            motion.end_range_band_deg, motion.end_range_torque_nm = BAND_DEG, TORQUE_NM
