"""Writes the report as one self-contained HTML file: the paper's figures 11 to 18, its Table 2, and our errors beside the paper's."""

from collections.abc import Iterator, Sequence
from html import escape
from itertools import groupby
from typing import Final

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from kata.evaluation import tables
from kata.evaluation.outcome import CaseResult
from kata.evaluation.paper import ERRORS
from kata.motion.linkage import Floats
from kata.plotting.colours import INDIGO, ORANGE, PALE_GREEN

_ROW_PX: Final = 260
_STYLE: Final = """
body { font-family: system-ui, sans-serif; margin: 2rem auto; max-width: 80rem; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: 1rem 0 2rem } td, th { padding: .25rem .75rem; text-align: left }
th { border-bottom: 2px solid #444 } td { border-bottom: 1px solid #ddd }
"""


_NOT_MODELLED: Final = (
    "</p><p><strong>Not modelled</strong> on either plant: the ball joints' cone of 30 deg, cables, the temperature of gears, the bending of "
    "links, the patient's trunk and breathing, active movement, and the differences between a commissioned arm and the patient's. The "
    "simple plant has no coupling between axes, no soft tissue and no slip at the cuff. Which numbers are published and which are assumed "
    "is in the documentation, page The independent judge."
)


def as_html(outcomes: Sequence[CaseResult], *, simulated: bool, beside: Sequence[CaseResult] = ()) -> str:
    """Return the whole report. ``beside``: playbacks of the same cases on the other plant, shown next to ``outcomes``."""
    source = "Simulated" if simulated else "Measured on the apparatus"
    text_tables = [tables.by_method(outcomes), tables.compared_to_paper(outcomes), tables.rom_reached(outcomes)]
    if tables.plant_of(outcomes) == "mujoco":
        text_tables.insert(0, tables.beside_goals(outcomes))
    if beside:
        text_tables.append(tables.plants_beside(outcomes, beside))
    parts = [_table(table, source) for table in text_tables if table.rows]
    parts.append(f"<p>{tables.plays_in_words(outcomes)}</p>")
    parts.append(f"<h2>Teaching, playback and error ({source.lower()})</h2>")
    with_script = True
    for title, figure in _figures(tables.last_plays(outcomes), tables.last_plays(beside), source.lower()):
        parts.append(f"<h3>{escape(title)}</h3>")
        parts.append(str(figure.to_html(full_html=False, include_plotlyjs=with_script)))
        with_script = False
    parts.append(_table(tables.by_motor(outcomes), source))
    parts += [
        f"<p>{escape(f'{outcome.case.name}, {outcome.case.side}, {outcome.method}, play {outcome.repetition}: {outcome.problem}')}</p>"
        for outcome in outcomes
        if outcome.problem
    ]
    title = "Teaching and playback compared, after Section 4 of Sun et al. 2025"
    about = _about(simulated) + (_NOT_MODELLED if simulated else "")
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style></head>'
        f"<body><h1>{title}</h1><p><strong>{source}.</strong> {about}</p>{''.join(parts)}</body></html>\n"
    )


def _about(simulated: bool) -> str:
    if simulated:
        return (
            "All figures come from simulated drives, mechanics and a simulated hand. Control loop, supervision and driver are the "
            "real ones. The paper's own figures were measured on its apparatus with a healthy subject."
        )
    return "All figures were measured on the configured apparatus."


def _table(table: tables.TextTable, source: str) -> str:
    heads = "".join(f"<th>{escape(name)}</th>" for name in table.columns)
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    return f"<h2>{escape(table.title)} ({source.lower()})</h2><table><tr>{heads}</tr>{rows}</table>"


def _figures(last: Sequence[CaseResult], beside: Sequence[CaseResult], source: str) -> list[tuple[str, go.Figure]]:
    """Return the paper's figures of the first seed. A figure shows both sides of a motion on both plants. The arbitrary motion has one
    figure for each side.
    """
    seed = last[0].seed if last else None
    figures = []
    for key, group in groupby((outcome for outcome in last if outcome.seed == seed), key=_figure_of):
        same = [*group, *(outcome for outcome in beside if outcome.seed == seed and _figure_of(outcome) == key)]
        number = _number(same[0])
        title = f"Figure {number}: {same[0].case.name}" if number else same[0].case.name
        sides = sorted({outcome.case.side for outcome in same})
        figures.append((f"{title}, {' and '.join(sides)}, {source}", _figure(same)))
    return figures


def _figure_of(outcome: CaseResult) -> tuple[str, int | None]:
    return outcome.case.name, _number(outcome)


def _number(outcome: CaseResult) -> int | None:
    return next(
        (
            error.figure
            for error in ERRORS
            if error.motion == outcome.case.number and error.side in (None, outcome.case.side)
        ),
        None,
    )


def _column(outcome: CaseResult) -> tuple[str, str]:
    return outcome.case.side, f"plant {outcome.plant}" if outcome.plant else ""


def _figure(outcomes: Sequence[CaseResult]) -> go.Figure:
    """Return a figure with a row for each motor, a column for each side and plant, and a button for each method."""
    motors = outcomes[0].case.motors
    columns = sorted(dict.fromkeys(_column(outcome) for outcome in outcomes))
    figure = make_subplots(
        rows=len(motors),
        cols=len(columns),
        subplot_titles=[", ".join(filter(None, (f"Motor {motor}", *column))) for motor in motors for column in columns],
        specs=[[{"secondary_y": True}] * len(columns)] * len(motors),
        vertical_spacing=0.28 / len(motors),
    )
    methods = list(dict.fromkeys(outcome.method for outcome in outcomes))
    trace_methods: list[str] = []
    for outcome in outcomes:
        for row, motor in enumerate(motors, start=1):
            cell = {"row": row, "col": columns.index(_column(outcome)) + 1}
            for trace, on_the_right in _traces(outcome, motor):
                trace.update(showlegend=cell == {"row": 1, "col": 1}, visible=outcome.method == methods[0])
                figure.add_trace(trace, **cell, secondary_y=on_the_right)
                trace_methods.append(outcome.method)
            _label_axes(figure, cell, last_row=row == len(motors), limit_deg=_error_limit_deg(outcomes, motor))
    plays = {method: max(outcome.repetition for outcome in outcomes if outcome.method == method) for method in methods}
    buttons = [
        {
            "label": f"{method}, play {plays[method]}",
            "method": "update",
            "args": [{"visible": [of_trace == method for of_trace in trace_methods]}],
        }
        for method in methods
    ]
    top = 1 + 0.35 / len(motors)
    figure.update_layout(
        template="plotly_white",
        height=120 + _ROW_PX * len(motors),
        legend={"orientation": "h", "y": top, "x": 0.4},
        margin={"t": 110},
        updatemenus=[
            {"type": "buttons", "direction": "right", "x": 0, "xanchor": "left", "y": top, "buttons": buttons}
        ],
    )
    return figure


def _traces(outcome: CaseResult, motor: int) -> Iterator[tuple[go.Scatter, bool]]:
    """Yield the curves of one motor, each with True if it uses the right axis."""
    compared = outcome.comparison
    assert compared is not None
    for name, angles, colour, dash, on_the_right in (
        ("Teaching", compared.taught_deg, INDIGO, "solid", False),
        ("Playback", compared.played_deg, ORANGE, "dash", False),
        ("Error (right axis)", compared.error_deg, PALE_GREEN, "solid", True),
    ):
        trace = go.Scatter(
            x=_float32(compared.times_s),
            y=_float32(angles[:, motor - 1]),
            name=name,
            legendgroup=name,
            line={"color": colour, "dash": dash, "width": 1.2 if on_the_right else 1.8},
        )
        yield trace, on_the_right


def _label_axes(figure: go.Figure, cell: dict[str, int], *, last_row: bool, limit_deg: float) -> None:
    figure.update_xaxes(title_text="Time, s" if last_row else None, **cell)
    figure.update_yaxes(title_text="Angle, deg", **cell, secondary_y=False)
    figure.update_yaxes(
        title_text="Error, deg",
        range=[-limit_deg, limit_deg],
        tickmode="auto",
        nticks=6,
        showgrid=False,
        secondary_y=True,
        **cell,
    )


def _error_limit_deg(outcomes: Sequence[CaseResult], motor: int) -> float:
    """Return the limit of the error axis. It is the same for every method and side, so that they can be compared."""
    errors = [outcome.comparison.error_deg[:, motor - 1] for outcome in outcomes if outcome.comparison]
    return 1.1 * max(float(np.abs(error).max()) for error in errors)


def _float32(values: Floats) -> np.typing.NDArray[np.float32]:
    """Return 32-bit values, which have half the bytes and are precise enough for a screen."""
    return values.astype(np.float32)
