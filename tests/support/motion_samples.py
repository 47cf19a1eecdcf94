"""Samples of a known motion for the rig."""

from typing import NamedTuple

from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.taught import Taught


class Samples(NamedTuple):
    """A recording, as a run is given it."""

    times_s: Floats
    angles_deg: Floats


def known(motion: Taught) -> Samples:
    """As if it had been taught: what is about playing need not wait for a hand."""
    return Samples(motion.times_s, motor_angles_deg(motion.poses_deg))
