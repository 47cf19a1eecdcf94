"""Proposes position gains from a measured step response. Pure mathematics.

A drive with position gain P, integral gain I and damping gain D turns an inertia J. Without I and outer loads, J x'' + D x' + P (x - goal) = 0.
Divided by J this is x'' + 2 z w x' + w^2 (x - goal) = 0 with w = sqrt(P / J) and the damping ratio z = D / (2 sqrt(J P)). From rest, and
for z < 1, a step of height 1 gives x = 1 - exp(-z w t) (cos(v t) + z w / v sin(v t)) with v = w sqrt(1 - z^2). Its derivative
w^2 / v exp(-z w t) sin(v t) is first zero at v t = pi, where x = 1 + exp(-pi z / sqrt(1 - z^2)). The overshoot therefore depends only on z.
With d = -ln(overshoot), z = d / sqrt(pi^2 + d^2). If the response does not overshoot and z is well above 1, the slow pole is at about P / D,
so that the rise from 10 to 90 % takes ln(9) D / P = 2.2 D / P. The rules use only ratios of gains, because the units differ between drives:

1. Too much overshoot: raise D by the wanted damping ratio over the measured one. What the limit of D leaves, P takes, as the ratio changes
   with 1 / sqrt(P). I falls with P, so that the time constant P / I of the integral stays.
2. Otherwise, too slow: raise P and I by the measured rise time over the wanted one.
3. Otherwise, or in addition to 2, an error remains: raise I by the measured error over the wanted one.

A gain that is good stays. No trial more than doubles or halves a gain, because the model leaves out play, friction and the torque limit.
"""

import math
from typing import Final, Literal

from msgspec import Struct

from kata.commissioning.step_response import LARGEST_STEADY_ERROR_DEG, StepResponse
from kata.device.config_rules import RANGES

TARGET_OVERSHOOT: Final = 0.1
"""A larger overshoot, as a share of the step, needs other gains. It is two counts of the encoder in a step of 2 deg."""
TARGET_DAMPING: Final = 0.7
"""Wanted damping ratio: exp(-pi 0.7 / sqrt(1 - 0.7^2)) = 4.6 % overshoot."""
TARGET_RISE_S: Final = 0.5
"""A longer rise needs other gains. It belongs to a lag of 0.23 s; the configuration accepts 0.3 s."""
TARGET_STEADY_ERROR_DEG: Final = LARGEST_STEADY_ERROR_DEG / 2
LARGEST_CHANGE: Final = 2
"""Largest factor by which a trial raises or lowers a gain."""
_FROM_NOTHING: Final = 100
"""Value to which a trial may raise a gain of less than half of it."""
GAIN_RANGE: Final = next(accepted for accepted in RANGES if accepted.field == "axes.position_p_gain")
"""Values that the drive's registers of P, I and D hold."""

Advice = Literal["", "damp", "faster", "integrate"]


class Gains(Struct, frozen=True):
    """The position gains of a motor, in the drive's own units."""

    p: int
    i: int
    d: int


def gain_limits(present: Gains) -> tuple[Gains, Gains]:
    """Return the lowest and the highest gains that the next trial may use."""
    lowest = Gains(*(_within(math.ceil(gain / LARGEST_CHANGE)) for gain in _as_tuple(present)))
    highest = Gains(*(_within(max(gain * LARGEST_CHANGE, _FROM_NOTHING)) for gain in _as_tuple(present)))
    return lowest, highest


def are_within_limits(gains: Gains, present: Gains) -> bool:
    """Return True if the next trial may use these gains."""
    lowest, highest = gain_limits(present)
    return all(low <= gain <= high for low, gain, high in zip(*map(_as_tuple, (lowest, gains, highest)), strict=True))


def propose(present: Gains, measured: StepResponse) -> tuple[Gains, Advice]:
    """Return the proposed gains and the reason of the proposal.

    If the response needs no change, the gains are the present ones and the reason is empty.

    :param measured: response with the present gains.
    """
    p, i, d = map(float, _as_tuple(present))
    advice: Advice = ""
    if measured.overshoot > TARGET_OVERSHOOT:
        advice = "damp"
        factor = TARGET_DAMPING / damping_ratio(measured.overshoot)
        # From nothing, D is raised, too. How much damping this gives is unknown, so P takes all.
        raised = min(d * factor or _FROM_NOTHING, _as_tuple(gain_limits(present)[1])[2])
        share = (raised / d / factor) ** 2 if d else 1 / factor**2
        p, i, d = p * share, i * share, raised
    elif measured.rise_s > TARGET_RISE_S:
        advice = "faster"
        p, i = (gain * measured.rise_s / TARGET_RISE_S for gain in (p, i))
    if advice != "damp" and measured.steady_error_deg > TARGET_STEADY_ERROR_DEG:
        advice = advice or "integrate"
        i = max(i, present.i * measured.steady_error_deg / TARGET_STEADY_ERROR_DEG, _FROM_NOTHING)
    limits = zip(*map(_as_tuple, gain_limits(present)), strict=True)
    return Gains(
        *(round(min(max(gain, low), high)) for gain, (low, high) in zip((p, i, d), limits, strict=True))
    ), advice


def damping_ratio(overshoot: float) -> float:
    """Return the damping ratio of a system of second order with this overshoot (a share of the step, more than 0)."""
    decrement = -math.log(min(overshoot, 0.99))
    return decrement / math.hypot(math.pi, decrement)


def _as_tuple(gains: Gains) -> tuple[int, int, int]:
    return gains.p, gains.i, gains.d


def _within(gain: int) -> int:
    return int(min(max(gain, GAIN_RANGE.low), GAIN_RANGE.high))
