"""Defines the samples of a run as input for learning. It does not import scipy, so that programs that only read journals start quickly."""

from dataclasses import dataclass

import numpy as np

from kata.motion.linkage import Floats


@dataclass(frozen=True)
class Repetition:
    """The ``k`` samples of one run that was played to its end, in the order of their arrival.

    ``path_s`` ``(k,)`` is the place on the recording's clock. ``playing`` ``(k,)`` is False while the arm was paused, stopped or
    moved back.
    """

    path_s: Floats
    measured_deg: Floats
    torque_nm: Floats
    playing: np.ndarray[tuple[int], np.dtype[np.bool_]]
