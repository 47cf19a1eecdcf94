"""What every number means: its unit, from its name or from a declaration here.

A number's name ends with its unit, or the name is declared. A new field with neither fails ``tests/clinic/test_units.py``.
"""

import json
from dataclasses import asdict, dataclass
from typing import Any, Final

from tests.support.paths import ROOT

SUFFIXES: Final = {
    "_deg": ("deg", "°", "degrees", "度"),
    "_deg_s": ("deg/s", "°/s", "度/秒", "°"),
    "_nm": ("Nm",),
    "_nm_deg": ("Nm/deg", "Nm/°"),
    "_ms": ("ms", "ミリ秒"),
    "_s": ("s", "seconds", "秒"),
    "_hz": ("Hz",),
    "_v": ("V",),
    "_c": ("°C",),
    "_j": ("J",),
    "_percent": ("%",),
    "_years": ("years", "歳"),
    "_points": ("points", "点"),
    "_minutes": ("min", "minutes", "分"),
    "_bytes": ("bytes", "kB", "MB", "GB"),
}
"""Ending of a name, and the words for its unit in English and Japanese texts."""

ORDINAL: Final = "a place in an order"
COUNT: Final = "a number of things"
SCORE_10: Final = "a score of 0 to 10"
SCORE_100: Final = "a score of 0 to 100"
LEVEL: Final = "a resistance level of 1 to 25"

DECLARED: Final[dict[str, str]] = {
    **dict.fromkeys(
        ("motor", "axis", "motion", "outward", "position", "programme_position", "number", "version", "take", "category", "status"), ORDINAL
    ),
    **dict.fromkeys(
        (
            "sessions", "sessions_prescribed", "sessions_per_week", "repetitions", "repetitions_planned", "repetitions_done", "runs", "stops",
            "run_count", "stop_count", "samples", "reversals", "takes", "cycles", "overruns", "bus_errors", "drive_errors",
            "telemetry_dropped", "waiting", "audit_rows", "digits", "programmes", "overdue", "prescribed", "held", "playbacks", "stopped", "stopped_sessions",
            "alarms", "due_count", "left_out", "left_out_further", "patients", "shoulders", "least_patients", "least_programmes",
            "presses", "passes", "repetitions_left", "unsigned_count", "count",
        ),
        COUNT,
    ),
    **dict.fromkeys(("pain_before", "pain_during", "pain_after", "pain_rest", "pain_active", "pain_passive", "pain_average", "spadi"), SCORE_10),
    **dict.fromkeys(
        ("pain", "disability", "total", "spadi_score", "spadi_mcid_lower", "spadi_mcid_upper", "spadi_mdc"), SCORE_100
    ),
    **dict.fromkeys(("resistance_level", "max_resistance_level", "load_level", "max_load_level"), LEVEL),
    **dict.fromkeys(("taught_smoothness", "played_smoothness"), "spectral arc length, which has no unit"),
    **dict.fromkeys(("ratio", "ratio_deviation"), "degrees for each degree, which has no unit"),
    **dict.fromkeys(("p_gain", "i_gain", "d_gain", "p", "i", "d"), "in the drive's own units"),
    "overshoot": "a share of the step",
    "minutes": "minutes",
    "valid_days": "days",
    "hours": "hours",
    "weeks_to_important": "weeks",
    "points": "points",
    "items": COUNT,
    "most_unanswered": COUNT,
    "answers": "answers on the scale of each item",
    "answer": "an answer on the scale of its item",
    "bytes": "bytes",
    **dict.fromkeys(("before", "after"), "a value of a commissioning record; its name contains the unit"),
}  # fmt: skip
"""Names of numbers without a unit in their name."""


def unit_of(name: str) -> str | None:
    """Return the unit or meaning of a number, None if it is not declared."""
    endings = [ending for ending in SUFFIXES if name.endswith(ending)]
    return DECLARED.get(name) or (max(endings, key=len) if endings else None)


def is_of_a_body(name: str) -> bool:
    """True if the number is an angle, a torque or a score of a person, which needs a side and a time."""
    return unit_of(name) in {"_deg", "_nm", "_points", SCORE_10, SCORE_100}


@dataclass(frozen=True)
class UnitWords:
    """What may stand beside a number on a page of one language. All are regular expressions."""

    units_after: str
    """Units and other words that follow a number."""
    counted: list[str]
    """Words of counted things, which follow their number."""
    placed: list[str]
    """Words before the number of a place, of a level or of a thing that is called by a number."""
    count_heads: list[str]
    """Heads of table columns with counts and places."""
    scales: str
    unit_head: str
    """Head of the column that has the units of a table's rows."""
    axes: str
    """Titles of axes and panels that have another word than a unit."""
    unit_last: str
    """End of a row's name that has the unit of its values, or that says that they have none."""


_WORDS: Final = json.loads((ROOT / "tests/support/unit_words.json").read_text(encoding="utf-8"))
UNIT_WORDS: Final = {language: UnitWords(**words) for language, words in _WORDS.items()}

_BARE_NUMBERS: Final = (
    (ROOT / "tests/support/bare_numbers.js").read_text(encoding="utf-8").partition("export default ")[2]
)
"""Returns the numbers that a page shows without a unit. Tests of the page use it too (``frontend/src/app/shownNumbers.test.tsx``)."""


def bare_numbers(page: Any, language: str = "en") -> list[str]:
    """Return the numbers that page, figures and dialogs show without a unit, a scale or a word for what is counted."""
    found = page.evaluate(_BARE_NUMBERS, asdict(UNIT_WORDS[language]))
    return [str(text) for text in found]
