"""The project's goals on the independent plant, at the encoder and at the arm (issue "An independent judge")."""

from dataclasses import dataclass
from typing import Final, Literal


@dataclass(frozen=True)
class Goal:
    """One figure of some plays, and its limits for motors 1-4 and for motor 5."""

    name: str
    plays: tuple[tuple[str, int], ...]
    """Methods and repetitions."""
    figure: Literal["peak_deg", "rmse_deg", "start_deg"]
    limits_deg: tuple[float, float]
    arm: bool = False
    """True: of the arm, behind play and everything soft; False: of the encoder."""


_FIRST: Final = (("smooth", 1), ("learned", 1))
_FIFTH: Final = (("learned", 5),)

GOALS: Final = (
    Goal("first play, peak at the encoder", _FIRST, "peak_deg", (0.6, 1.0)),
    Goal("first play, RMSE at the encoder", _FIRST, "rmse_deg", (0.2, 0.3)),
    Goal("first play, peak at the arm", _FIRST, "peak_deg", (1.0, 1.5), arm=True),
    Goal("fifth learned play, peak at the encoder", _FIFTH, "peak_deg", (0.3, 0.5)),
    Goal("fifth learned play, RMSE at the encoder", _FIFTH, "rmse_deg", (0.1, 0.15)),
    Goal("fifth learned play, peak at the arm", _FIFTH, "peak_deg", (1.0, 1.5), arm=True),
    Goal("start error", (*_FIRST, *_FIFTH), "start_deg", (0.3, 0.3)),
)
