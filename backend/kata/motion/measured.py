"""What a run was measured to be, for whoever learns from it: without scipy, so that what only reads journals starts quickly."""

from dataclasses import dataclass

import numpy as np

from kata.motion.linkage import Floats


@dataclass(frozen=True)
class Repetition:
    """One run that was played to its end, as it was measured: ``k`` samples in the order in which they came.

    ``path_s`` ``(k,)`` is the place on the recording's clock; ``playing`` ``(k,)`` is False where the arm was paused, stopped or
    taken back.
    """

    path_s: Floats
    measured_deg: Floats
    torque_nm: Floats
    playing: np.ndarray[tuple[int], np.dtype[np.bool_]]
