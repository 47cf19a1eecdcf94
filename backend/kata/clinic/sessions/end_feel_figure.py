"""The figure of torque-angle curves as Plotly JSON. No red, yellow or cyan is used. Each line has its own dash."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any, Final
from uuid import UUID

from kata.clinic import texts
from kata.plotting.colours import GRID, INDIGO, ORANGE, SLATE
from kata.plotting.placed_texts import with_texts

_DASHES: Final = ("dash", "dot", "dashdot", "longdash")
_LAYOUT: Final = {
    "margin": {"l": 60, "r": 20, "t": 70, "b": 50},
    "font": {"family": "system-ui, sans-serif", "size": 13},
    "hovermode": "closest",
    "plot_bgcolor": "white",
    "paper_bgcolor": "white",
    "height": 420,
    "legend": {"orientation": "h", "y": 1.05, "yanchor": "bottom", "x": 0},
}


@dataclass(frozen=True)
class DrawnCurve:
    """The numbers of one test's curve."""

    run_id: UUID
    day: date
    """Day of the test in the clinic's time zone."""
    angles_deg: list[float]
    out_nm: list[float]
    back_nm: list[float]
    mean_nm: list[float]


def draw(own_curves: Sequence[DrawnCurve], other_side: Sequence[DrawnCurve]) -> dict[str, Any]:
    """Return the figure. The first of ``own_curves`` is drawn with both ways, the others are earlier ones."""
    newest, *earlier = own_curves
    traces = [
        _line(texts.FIGURE_THIS_TEST(), newest, newest.mean_nm, INDIGO, "solid", 3.0),
        _line(texts.FIGURE_WAY_OUT(), newest, newest.out_nm, INDIGO, "dot", 1.2),
        _line(texts.FIGURE_WAY_BACK(), newest, newest.back_nm, INDIGO, "dashdot", 1.2),
    ]
    for curve, dash in zip(earlier, _DASHES, strict=False):
        traces.append(
            _line(texts.FIGURE_EARLIER_TEST(day=curve.day.isoformat()), curve, curve.mean_nm, SLATE, dash, 1.8)
        )
    traces += [
        _line(texts.FIGURE_OTHER_SIDE(), curve, curve.mean_nm, ORANGE, "longdashdot", 2.2) for curve in other_side
    ]
    axes = {
        "xaxis": GRID | {"title": {"text": texts.FIGURE_APPARATUS_ANGLE()}},
        "yaxis": GRID | {"title": {"text": texts.FIGURE_SHOULDER_TORQUE()}},
    }
    return with_texts({"data": traces, "layout": _LAYOUT | axes})


def _line(name: str, curve: DrawnCurve, torque_nm: list[float], colour: str, dash: str, width: float) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": curve.angles_deg,
        "y": torque_nm,
        "line": {"color": colour, "width": width, "dash": dash},
        "hovertemplate": texts.FIGURE_TORQUE_HOVER(),
    }
