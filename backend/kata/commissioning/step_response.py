"""Returns the figures of a measured step response. Pure mathematics."""

from typing import Final

import numpy as np
from msgspec import Struct

from kata.motion.linkage import Floats

_SETTLED_S: Final = 0.3
LARGEST_OVERSHOOT: Final = 0.6
"""Largest overshoot as a share of the step. We chose it, because the paper states no figure. A motor with more overshoot
vibrates, which a patient feels.
"""
LARGEST_STEADY_ERROR_DEG: Final = 0.5


class StepResponse(Struct, frozen=True):
    """The response to a step: rise time from 10 to 90 %, overshoot as a share of the step, error at the end."""

    rise_s: float
    overshoot: float
    steady_error_deg: float


def step_response(times_s: Floats, angles_deg: Floats, step_deg: float) -> StepResponse:
    """Return the figures of a response.

    :param times_s: ``(n,)``, times since the step.
    :param angles_deg: ``(n,)``, angles relative to the angle before the step.
    :param step_deg: height of the step, not 0.
    """
    share = angles_deg / step_deg
    over_10, over_90 = np.flatnonzero(share >= 0.1), np.flatnonzero(share >= 0.9)
    rise_s = float(times_s[over_90[0]] - times_s[over_10[0]]) if len(over_10) and len(over_90) else float(times_s[-1])
    settled = angles_deg[times_s > times_s[-1] - _SETTLED_S]
    return StepResponse(rise_s, max(0.0, float(share.max()) - 1.0), abs(float(np.mean(settled)) - step_deg))
