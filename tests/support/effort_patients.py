"""Patients whose effort along a path is known: they help, resist, tremble, let go, or alternate."""

import math
from collections.abc import Callable
from typing import Final

Effort = Callable[[float], float]
"""Torque along the path, forwards, in Nm at a time in s."""

HELP_NM: Final = 2.5
LETS_GO_S: Final = 4.0

PATIENTS: Final[dict[str, Effort]] = {
    "relaxed": lambda _: 0.0,
    "helps": lambda _: HELP_NM,
    "resists": lambda _: -2.0,
    "trembles_4_hz": lambda at_s: 3.0 * math.sin(2 * math.pi * 4.0 * at_s),
    "trembles_10_hz": lambda at_s: 3.0 * math.sin(2 * math.pi * 10.0 * at_s),
    "lets_go": lambda at_s: HELP_NM if at_s < LETS_GO_S else 0.0,
    "alternates": lambda at_s: HELP_NM if at_s % 4.0 < 2.0 else -HELP_NM,
}
