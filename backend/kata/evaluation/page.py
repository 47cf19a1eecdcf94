"""The report as one HTML file that needs nothing else: the paper's figures 11 to 18, its Table 2, and ours beside its errors."""

from collections.abc import Sequence
from html import escape
from itertools import groupby
from typing import Final

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from kata.evaluation import tables
from kata.evaluation.outcome import Outcome
from kata.evaluation.paper import ERRORS
from kata.motion.linkage import Floats

# As in the service's own figures: told apart by everybody, and in grey by their brightness.
_TAUGHT: Final = "#1f3a93"
_PLAYED: Final = "#e07b00"
_ERROR: Final = "#5e9c76"
_ROW_PX: Final = 260
_STYLE: Final = """
body { font-family: system-ui, sans-serif; margin: 2rem auto; max-width: 80rem; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: 1rem 0 2rem } td, th { padding: .25rem .75rem; text-align: left }
th { border-bottom: 2px solid #444 } td { border-bottom: 1px solid #ddd }
"""


def as_html(outcomes: Sequence[Outcome], *, simulated: bool) -> str:
    """The whole report."""
    where = "Simulated" if simulated else "Measured on the apparatus"
    shown = [tables.by_method(outcomes), tables.beside_the_paper(outcomes), tables.rom_reached(outcomes)]
    parts = [_table(one, where) for one in shown if one.rows]
    parts.append(f"<h2>Teaching, playback and error ({where.lower()})</h2>")
    with_script = True
    for title, figure in _figures(tables.last_plays(outcomes), where.lower()):
        parts.append(f"<h3>{escape(title)}</h3>")
        parts.append(str(figure.to_html(full_html=False, include_plotlyjs=with_script)))
        with_script = False
    parts.append(_table(tables.by_motor(outcomes), where))
    parts += [
        f"<p>{escape(f'{one.case.name}, {one.case.side}, {one.method}, play {one.repetition}: {one.problem}')}</p>"
        for one in outcomes
        if one.problem
    ]
    title = "Teaching against playback, after Section 4 of Sun et al. 2025"
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style></head>'
        f"<body><h1>{title}</h1><p><strong>{where}.</strong> {_about(simulated)}</p>{''.join(parts)}</body></html>\n"
    )


def _about(simulated: bool) -> str:
    if simulated:
        return (
            "Every figure here comes from simulated drives, mechanics and a simulated hand; control loop, supervision and driver are "
            "the real ones. The paper's own figures were measured on its apparatus with a healthy subject."
        )
    return "Every figure here was measured on the configured apparatus."


def _table(told: tables.Table, where: str) -> str:
    heads = "".join(f"<th>{escape(name)}</th>" for name in told.columns)
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in told.rows)
    return f"<h2>{escape(told.title)} ({where.lower()})</h2><table><tr>{heads}</tr>{rows}</table>"


def _figures(last: Sequence[Outcome], where: str) -> list[tuple[str, go.Figure]]:
    """The paper's: one a motion with both sides, and one a side of the arbitrary motion. Of the first seed."""
    seed = last[0].seed if last else None
    found = []
    for _, group in groupby((one for one in last if one.seed == seed), key=_figure_of):
        same = list(group)
        number = _number(same[0])
        title = f"Figure {number}: {same[0].case.name}" if number else same[0].case.name
        sides = sorted({one.case.side for one in same})
        found.append((f"{title}, {' and '.join(sides)}, {where}", _figure(same, sides)))
    return found


def _figure_of(one: Outcome) -> tuple[str, int | None]:
    return one.case.name, _number(one)


def _number(one: Outcome) -> int | None:
    return next(
        (error.figure for error in ERRORS if error.motion == one.case.number and error.side in (None, one.case.side)),
        None,
    )


def _figure(outcomes: Sequence[Outcome], sides: Sequence[str]) -> go.Figure:
    """Rows: motors; columns: sides; a button for each method."""
    motors = outcomes[0].case.motors
    titles = [f"Motor {motor}, {side}" for motor in motors for side in sides]
    figure = make_subplots(
        rows=len(motors),
        cols=len(sides),
        subplot_titles=titles,
        specs=[[{"secondary_y": True}] * len(sides)] * len(motors),
        vertical_spacing=0.28 / len(motors),
    )
    methods = list(dict.fromkeys(one.method for one in outcomes))
    owners: list[str] = []
    for one in outcomes:
        compared = one.comparison
        assert compared is not None
        for row, motor in enumerate(motors, start=1):
            place = {"row": row, "col": sides.index(one.case.side) + 1}
            first = row == 1 and place["col"] == 1
            times = compared.times_s
            lines = (
                ("Teaching", compared.taught_deg, _TAUGHT, "solid", False),
                ("Playback", compared.played_deg, _PLAYED, "dash", False),
                ("Error (right axis)", compared.error_deg, _ERROR, "solid", True),
            )
            for name, angles, colour, dash, right in lines:
                line = go.Scatter(
                    x=_light(times),
                    y=_light(angles[:, motor - 1]),
                    name=name,
                    legendgroup=name,
                    showlegend=first,
                    visible=one.method == methods[0],
                    line={"color": colour, "dash": dash, "width": 1.2 if right else 1.8},
                )
                figure.add_trace(line, **place, secondary_y=right)
                owners.append(one.method)
            figure.update_xaxes(title_text="Time, s" if row == len(motors) else None, **place)
            figure.update_yaxes(title_text="Angle, deg", **place, secondary_y=False)
            reach = _reach_deg(outcomes, motor)
            figure.update_yaxes(
                title_text="Error, deg",
                range=[-reach, reach],
                tickmode="auto",
                nticks=6,
                showgrid=False,
                secondary_y=True,
                **place,
            )
    figure.update_layout(
        template="plotly_white",
        height=120 + _ROW_PX * len(motors),
        legend={"orientation": "h", "y": 1 + 0.35 / len(motors), "x": 0.4},
        margin={"t": 110},
        updatemenus=[
            {
                "type": "buttons",
                "direction": "right",
                "x": 0,
                "xanchor": "left",
                "y": 1 + 0.35 / len(motors),
                "buttons": [
                    {
                        "label": f"{method}, play {max(one.repetition for one in outcomes if one.method == method)}",
                        "method": "update",
                        "args": [{"visible": [owner == method for owner in owners]}],
                    }
                    for method in methods
                ],
            }
        ],
    )
    return figure


def _reach_deg(outcomes: Sequence[Outcome], motor: int) -> float:
    """One error axis for every method and side, zero in its middle: they are to be compared."""
    errors = [one.comparison.error_deg[:, motor - 1] for one in outcomes if one.comparison]
    return 1.1 * max(float(np.abs(error).max()) for error in errors)


def _light(values: Floats) -> np.typing.NDArray[np.float32]:
    """Half the bytes; a screen shows no more."""
    return values.astype(np.float32)
