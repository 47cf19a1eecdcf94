"""Samples of a known motion for the rig."""

from typing import NamedTuple

from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.taught import Taught


class Samples(NamedTuple):
    """Return a recording for a run."""

    times_s: Floats
    angles_deg: Floats


def known(motion: Taught) -> Samples:
    """Save a recording as if it had been taught, without waiting for the hand."""
    return Samples(motion.times_s, motor_angles_deg(motion.poses_deg))
