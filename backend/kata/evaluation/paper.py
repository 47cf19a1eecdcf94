"""Lists the errors that the paper reports in Section 4."""

from dataclasses import dataclass
from typing import Final

from kata.motion.axes import Side


@dataclass(frozen=True)
class PaperError:
    """The paper's error (playback minus teaching) of one motion (7 is the arbitrary motion) for some of its motors."""

    motion: int
    side: Side | None
    """None if the error applies to both sides together."""
    motors: tuple[int, ...]
    figure: int
    words: str


ERRORS: Final = (
    PaperError(1, None, (1, 2), 11, "within ±4, start excepted"),
    PaperError(2, None, (1, 2), 12, "within ±4, start excepted"),
    PaperError(3, None, (4,), 13, "within ±5"),
    PaperError(4, None, (3,), 14, "within ±4"),
    PaperError(5, None, (4,), 15, "within ±6"),
    PaperError(6, None, (5,), 16, "mostly within ±5, peaks near -8 and +8"),
    PaperError(7, "left", (1, 2, 3, 4), 17, "within ±5, start excepted"),
    PaperError(7, "left", (5,), 17, "peaks beyond -10"),
    PaperError(7, "right", (1, 2, 3, 4), 18, "within ±6, start and one peak excepted"),
    PaperError(7, "right", (5,), 18, "peaks to about 10"),
)
