"""Names at the right ends of the lines of a chart, so that a reader need not look for a line in the legend."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

MARGIN_PX: Final = 96
"""Width of the longest name and the gap before it."""
_NAME_PX: Final = 18
"""Height of a name."""
_GAP: Final = 8
"""Pixels between a line and its name."""


@dataclass(frozen=True)
class LineName:
    """The name of one line, or of lines close to each other that have the same name."""

    text: str
    values: tuple[float, ...]
    """Where the lines end."""
    colour: str | None = None
    """Colour of the line; None for the colour of the figure's texts."""


def beside(
    names: Sequence[LineName], y_range: Sequence[float], height_px: float, axes: tuple[str, str] = ("x", "y")
) -> list[dict[str, Any]]:
    """Return the names as annotations of a panel: each beside the end of its line, moved apart where lines are close."""
    low, high = y_range
    height = _NAME_PX * (high - low) / height_px
    ordered = sorted(names, key=lambda name: sum(name.values) / len(name.values))
    places = apart(
        [sum(name.values) / len(name.values) for name in ordered], height, (low + height / 2, high - height / 2)
    )
    return [
        {
            "text": name.text,
            "x": 1.0,
            "xref": f"{axes[0]} domain",
            "xshift": _GAP,
            "xanchor": "left",
            "y": place,
            "yref": axes[1],
            "yanchor": "middle",
            "showarrow": False,
        }
        | ({"font": {"color": name.colour, "weight": "bold"}} if name.colour else {})
        for name, place in zip(ordered, places, strict=True)
    ]


def apart(values: Sequence[float], gap: float, within: tuple[float, float]) -> list[float]:
    """Return ascending values at least ``gap`` apart, each as near to the given one as the others allow, and within the limits."""
    groups: list[tuple[float, int]] = []
    """Mean and number of values that are moved together."""
    for place, value in enumerate(values):
        mean, count = value - place * gap, 1
        while groups and groups[-1][0] > mean:
            before, number = groups.pop()
            mean, count = (before * number + mean * count) / (number + count), number + count
        groups.append((mean, count))
    low, high = within[0], within[1] - (len(values) - 1) * gap
    means = [max(low, min(high, mean)) for mean, count in groups for _ in range(count)]
    return [mean + place * gap for place, mean in enumerate(means)]
