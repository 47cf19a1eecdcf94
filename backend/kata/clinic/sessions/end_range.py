"""Counts the end-range time of a playback (:mod:`kata.motion.end_range`): live, and from its journal."""

from collections.abc import Iterable
from dataclasses import replace

from kata.clinic.sessions.schemas import EndRangePrescription
from kata.clinic.sessions.tables import RunRow
from kata.device.config import StationConfig
from kata.device.journal import Journal
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.end_feel import MOTORS
from kata.motion.end_range import USUAL, EndRangeCounter, EndRangeThreshold
from kata.station.live_end_range import LiveEndRange, PrescribedEndRange
from kata.types import side_of


def counter(
    taught: Motion,
    side: Side,
    config: StationConfig,
    prescribed: EndRangePrescription | None,
    motors: Iterable[int] = MOTORS,
) -> EndRangeCounter:
    """Return a counter for a playback of this recording at the station. It counts nothing if the station's load is not identified."""
    load = replace(config.servo_model.load, side=side)
    return EndRangeCounter(taught.angles_deg, load, _thresholds(prescribed), motors)


def live(
    taught: Motion, side: Side, config: StationConfig, prescribed: EndRangePrescription | None
) -> LiveEndRange | None:
    """Return the live count of a playback; None without prescription.

    It counts the prescribed motor only, because it runs in the event loop.
    """
    if prescribed is None:
        return None
    motor = motor_of(prescribed)
    wanted = PrescribedEndRange(
        motion=prescribed.motion,
        name=BASIC_MOTIONS[prescribed.motion - 1].name,
        motor=motor,
        seconds=60.0 * prescribed.minutes,
        band_deg=prescribed.band_deg,
        torque_nm=prescribed.torque_nm,
    )
    return LiveEndRange(wanted, counter(taught, side, config, prescribed, [motor]))


def count(
    row: RunRow, journal: Journal, taught: Motion, config: StationConfig, prescribed: EndRangePrescription | None
) -> None:
    """Store the time of each motion of the shoulder joint. All samples of the run count, also those of pauses and of the way back.

    The prescription's band and torque count for its motion, the usual ones for the others. Nothing is stored if the station's load is not
    identified, and for a motion without an end.
    """
    counting = counter(taught, side_of(row.recording.side), config, prescribed)
    counting.add((journal.t_ns - journal.t_ns[0]) / 1e9, journal.measured_deg, journal.torque_nm)
    times, thresholds = counting.times_s(), _thresholds(prescribed)
    for motion in row.motions:
        motors = BASIC_MOTIONS[motion.motion - 1].motors
        if len(motors) == 1 and motors[0] in times:
            threshold = thresholds.get(motors[0], USUAL)
            motion.end_range_s = times[motors[0]]
            motion.end_range_band_deg, motion.end_range_torque_nm = threshold.band_deg, threshold.torque_nm


def motor_of(prescribed: EndRangePrescription) -> int:
    """Return the motor that performs the prescribed motion. Each motion of the shoulder joint has one."""
    (motor,) = BASIC_MOTIONS[prescribed.motion - 1].motors
    return motor


def threshold_of(prescribed: EndRangePrescription) -> EndRangeThreshold:
    """Return the band and the torque that count."""
    return EndRangeThreshold(prescribed.band_deg, prescribed.torque_nm)


def _thresholds(prescribed: EndRangePrescription | None) -> dict[int, EndRangeThreshold]:
    return {motor_of(prescribed): threshold_of(prescribed)} if prescribed else {}
