"""Counts the end-range time of a playback (:mod:`kata.motion.end_range`): live, and from its journal."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from kata.clinic import texts
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.device.config import StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.messages import Text
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.end_feel import MOTORS
from kata.motion.end_range import EndRangeCounter, EndRangeThreshold, end_of_motion
from kata.motion.path import PathPoint
from kata.station.live_end_range import LiveEndRange, PrescribedEndRange

_POSTURES: Final = 50
"""Number of postures near the end whose load is calculated. A band has at most 20 deg, so they are about half a degree apart."""


def counter(
    taught: Motion,
    side: Side,
    config: StationConfig,
    prescribed: EndRangePrescription | None,
    motors: Iterable[int] = MOTORS,
) -> EndRangeCounter:
    """Return a counter for a playback of this recording at the station. It counts nothing if the station's load is not identified."""
    load = replace(config.servo_model.load, side=side)
    return EndRangeCounter(taught.angles_deg, load, thresholds_of(prescribed), motors)


def live(
    taught: Motion, side: Side, config: StationConfig, prescribed: EndRangePrescription | None, resistance_level: int
) -> LiveEndRange | None:
    """Return the live count of a playback; None without prescription.

    It counts the prescribed motor only, because it runs in the event loop.
    """
    if prescribed is None:
        return None
    motor = motor_of(prescribed)
    prescription = PrescribedEndRange(
        motion=prescribed.motion,
        name=BASIC_MOTIONS[prescribed.motion - 1].name,
        motor=motor,
        seconds=60.0 * prescribed.minutes,
        band_deg=prescribed.band_deg,
        torque_nm=prescribed.torque_nm,
        problem=level_problem(taught, side, config, prescribed, resistance_level),
    )
    return LiveEndRange(prescription, counter(taught, side, config, prescribed, [motor]))


def level_problem(
    taught: Motion, side: Side, config: StationConfig, prescribed: EndRangePrescription, resistance_level: int
) -> Text | None:
    """Return the reason why the prescribed torque cannot be reached at this resistance level, or None.

    The resistance level limits the drive's torque. The drive also carries the station's load and friction, as far as they are identified.
    """
    motor = motor_of(prescribed)
    end = end_of_motion(taught.angles_deg, motor, threshold_of(prescribed))
    if end is None:
        return None
    near = taught.angles_deg[end.outward * (end.end_deg - taught.angles_deg[:, motor - 1]) <= prescribed.band_deg]
    postures = near[:: -(-len(near) // _POSTURES)]
    load = replace(config.servo_model.load, side=side)
    carried_nm = end.outward * load.arm_nm(PathPoint(postures, np.zeros_like(postures), np.zeros_like(postures)))
    least_nm = (
        carried_nm[:, motor - 1].min() + load.coulomb_nm[motor - 1] + load.share[motor - 1] * prescribed.torque_nm
    )
    parameters = {"motion": BASIC_MOTIONS[prescribed.motion - 1].name, "torque_nm": prescribed.torque_nm}
    levels = range(1, RESISTANCE_LEVELS + 1)
    sufficient_levels = [level for level in levels if config.resistance_thresholds_nm(level)[motor - 1] > least_nm]
    if not sufficient_levels:
        return texts.END_RANGE_TORQUE_TOO_HIGH(**parameters)
    if resistance_level < sufficient_levels[0]:
        return texts.END_RANGE_LEVEL_TOO_LOW(**parameters, level=resistance_level, least=sufficient_levels[0])
    return None


def motor_of(prescribed: EndRangePrescription) -> int:
    """Return the motor that performs the prescribed motion. Each motion of the shoulder joint has one."""
    (motor,) = BASIC_MOTIONS[prescribed.motion - 1].motors
    return motor


def threshold_of(prescribed: EndRangePrescription) -> EndRangeThreshold:
    """Return the band and the torque that count."""
    return EndRangeThreshold(prescribed.band_deg, prescribed.torque_nm)


def thresholds_of(prescribed: EndRangePrescription | None) -> dict[int, EndRangeThreshold]:
    """Return the band and the torque that count for the prescribed motion, by motor."""
    return {motor_of(prescribed): threshold_of(prescribed)} if prescribed else {}
