"""Places of a printed text where no line may break. The page has the same rules in ``frontend/src/lib/joinUnits.ts``.

The page's joiner between Japanese characters is missing in Kata's font. A Japanese range stays on one line in a table's cell of numbers.
"""

import re
from typing import Final

_MONTH: Final = "(?:Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)"
_SPACES: Final = re.compile(
    r"(?<=\d) (?=(?:%|s|ms|min|h|Nm|Hz|mm|kg|°C|minutes?)(?![A-Za-z\d]))"
    r"|(?<=,) (?=(?:°|ms|s|min|Nm)$)"
    rf"|(?<=\b\d) (?={_MONTH}\b)|(?<=\b\d\d) (?={_MONTH}\b)|(?<=\d {_MONTH}) (?=\d{{4}}\b)"
    r"|(?<=\d) (?=± )|(?<=\d[°%]) (?=± )|(?<=\d ±) (?=\d)|(?<=\d[°%] ±) (?=\d)"
    r"|(?<=\b[Mm]otor) (?=\d)|(?<=\b[Mm]otion) (?=\d)|(?<=\bStation) (?=\d)|(?<=\b[Vv]ersion) (?=\d)"
)
"""Spaces before a unit and within a date, an uncertainty, and the name of a numbered thing."""
_RANGE: Final = re.compile(r"(?<=\d)([°%]?) (to|of) (?=[+−-]?\d)(?!\d{1,2}[ \u00a0][A-Z]|[\d.]+°?[ \u00a0]±)")
"""The word within −39.0 to −26.6 and 3 of 7. A range of dates, or of numbers with their uncertainties, is too long for one line."""


def join_units(text: str) -> str:
    """Return the text without a line break between a number and its unit, or within a date or a range."""
    return _RANGE.sub("\\1\u00a0\\2\u00a0", _SPACES.sub("\u00a0", text))
