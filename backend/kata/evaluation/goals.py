"""Defines the project's goals on the independent plant, at the encoder and at the arm.

Between encoder and arm are play and soft parts. Where they move by more than the sum of both goals, no setpoint meets both.
"""

from dataclasses import dataclass
from typing import Final, Literal


@dataclass(frozen=True)
class Goal:
    """A figure of certain playbacks, with its limits for motors 1-4 and for motor 5."""

    name: str
    plays: tuple[tuple[str, int], ...]
    """The playbacks, as pairs of method and repetition."""
    figure: Literal["peak_deg", "rmse_deg", "start_deg"]
    limits_deg: tuple[float, float]
    place: Literal["encoder", "arm", "between"] = "encoder"
    """``arm``: after play and soft parts. ``between``: the error at the arm minus the error at the encoder."""


_FIRST: Final = (("smooth", 1), ("learned", 1))
_FIFTH: Final = (("learned", 5),)

GOALS: Final = (
    Goal("first play, peak at the encoder", _FIRST, "peak_deg", (0.6, 1.0)),
    Goal("first play, RMSE at the encoder", _FIRST, "rmse_deg", (0.2, 0.3)),
    Goal("first play, peak at the arm", _FIRST, "peak_deg", (1.0, 1.5), "arm"),
    Goal("first play, arm minus encoder", _FIRST, "peak_deg", (1.6, 2.5), "between"),
    Goal("fifth learned play, peak at the encoder", _FIFTH, "peak_deg", (0.3, 0.5)),
    Goal("fifth learned play, RMSE at the encoder", _FIFTH, "rmse_deg", (0.1, 0.15)),
    Goal("fifth learned play, peak at the arm", _FIFTH, "peak_deg", (1.0, 1.5), "arm"),
    Goal("fifth learned play, arm minus encoder", _FIFTH, "peak_deg", (1.3, 2.0), "between"),
    Goal("start error", (*_FIRST, *_FIFTH), "start_deg", (0.3, 0.3)),
)
