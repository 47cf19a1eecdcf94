"""Confidence intervals of 95 %. Pure functions."""

from math import sqrt
from typing import Final, NamedTuple

from kata.clinic.statistics.schemas import Estimate

_Z: Final = 1.959964
"""The 97.5 % quantile of the normal distribution."""
_TAIL: Final = 0.975


class SampleSums(NamedTuple):
    """Count, sum and sum of squares of some values."""

    number: int
    total: float
    square_total: float

    @property
    def mean(self) -> float:
        """Return the mean. The sample must not be empty."""
        return self.total / self.number

    @property
    def variance(self) -> float:
        """Return the variance of the population, estimated from at least two values."""
        return max(0.0, (self.square_total - self.total**2 / self.number) / (self.number - 1))


def _student_quantile(freedom: float) -> float:
    """Return the 97.5 % quantile of Student's distribution."""
    # Imported here, because scipy would delay the start of every service.
    from scipy.special import stdtrit

    return float(stdtrit(freedom, _TAIL))


def of_mean(sample: SampleSums) -> Estimate | None:
    """Return the mean with Student's interval, or None for fewer than two values."""
    if sample.number < 2:
        return None
    half_width = _student_quantile(sample.number - 1) * sqrt(sample.variance / sample.number)
    return Estimate(value=sample.mean, low=sample.mean - half_width, high=sample.mean + half_width)


def of_share(count: int, of: int) -> Estimate | None:
    """Return a share with its score interval (Wilson 1927, J Am Stat Assoc 22, 209-212), or None if ``of`` is 0."""
    if of == 0:
        return None
    share, z2 = count / of, _Z**2
    centre = (share + z2 / (2 * of)) / (1 + z2 / of)
    half_width = _Z / (1 + z2 / of) * sqrt(share * (1 - share) / of + z2 / (4 * of**2))
    return Estimate(value=share, low=max(0.0, centre - half_width), high=min(1.0, centre + half_width))


def of_difference(later: SampleSums, earlier: SampleSums) -> Estimate | None:
    """Return the change of a mean with Welch's interval (Biometrika 1947, 34, 28-35), or None for fewer than two values in either
    sample.
    """
    if later.number < 2 or earlier.number < 2:
        return None
    change = later.mean - earlier.mean
    parts = [sample.variance / sample.number for sample in (later, earlier)]
    if sum(parts) == 0:
        return Estimate(value=change, low=change, high=change)
    freedom = sum(parts) ** 2 / sum(
        part**2 / (sample.number - 1) for part, sample in zip(parts, (later, earlier), strict=True)
    )
    half_width = _student_quantile(freedom) * sqrt(sum(parts))
    return Estimate(value=change, low=change - half_width, high=change + half_width)
