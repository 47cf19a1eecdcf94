"""Progress charts as Plotly JSON.

Building a chart of a hundred traces with Plotly's classes takes longer than the rest of the request. Passing its numbers to the figure
worker takes longer than writing the JSON here, which takes a few milliseconds. A test checks that Plotly's classes accept the JSON. No red,
yellow or
cyan is used. Each line has its own dash and marker, because colour alone does not distinguish lines for everyone.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, Final

from kata.clinic import texts
from kata.clinic.assessments.spadi import DETECTABLE_CHANGE, IMPORTANT_CHANGE
from kata.clinic.programmes.adherence import AdherenceWeek
from kata.clinic.progress import line_names
from kata.clinic.progress.line_names import LineName
from kata.clinic.progress.series import (
    KINDS,
    PAIN_CONTEXTS,
    PAIN_IN_SESSIONS,
    EndFeelPoint,
    EndRangeGain,
    LineSeries,
    Point,
    QuestionnairePanel,
    RomLine,
    RomPanel,
    SpadiPoint,
    TotalPoint,
    Tracked,
)
from kata.clinic.questionnaires.changes import certain_above, improved_by
from kata.clinic.questionnaires.definitions import Definition
from kata.plotting.colours import BROWN, GREEN, GRID, INDIGO, ORANGE, SLATE, VIOLET

_Trace = dict[str, Any]
Figure = dict[str, Any]

_COLOURS: Final = (INDIGO, ORANGE, GREEN, VIOLET, BROWN, SLATE)
_DASHES: Final = ("solid", "dash", "dot", "dashdot", "longdash")
_MARKERS: Final = ("circle", "square", "diamond", "triangle-up", "cross", "x", "star")

_LAYOUT: Final = {
    "margin": {"l": 60, "r": 20, "t": 70, "b": 50},
    "font": {"family": "system-ui, sans-serif", "size": 13},
    "hovermode": "closest",
    "plot_bgcolor": "white",
    "paper_bgcolor": "white",
}
_HEIGHT: Final = 420
_PANEL_HEIGHT: Final = 260
_NARROW_LEGEND_PX: Final = 150
"""Height that the legend of a single panel takes from it on a telephone."""
_SPADI_RANGE: Final = [-4.0, 104.0]
_MARGINS: Final = 120
_LEGEND_PX: Final = 40
"""Height of the legend within the margin above the panels."""
_COLUMN_GAP: Final = 0.25
"""Share of the width between two columns, for the names of lines and the numbers of the next axis."""
_LEVEL_PX: Final = 2.0
_REFERENCE_PX: Final = 3.0
_LEADING_PX: Final = 4.0
_OTHER_PX: Final = 1.5
_MOST_COLUMNS: Final = 2
_MOST_DAYS: Final = 4
"""Days below a chart that fit on a telephone."""
_WEEK_MS: Final = 7 * 24 * 3600 * 1000
_PAIN_RANGE: Final = [-0.6, 10.6]
_PAIN_PANELS: Final[tuple[tuple[str, dict[str, str]], ...]] = (
    (
        texts.FIGURE_PAIN_AT_ASSESSMENTS(),
        dict(
            zip(
                PAIN_CONTEXTS,
                (
                    texts.FIGURE_PAIN_AT_REST(),
                    texts.FIGURE_ACTIVE(),
                    texts.FIGURE_PASSIVE(),
                    texts.FIGURE_PAIN_AVERAGE_SHORT(),
                ),
                strict=True,
            )
        ),
    ),
    (
        texts.FIGURE_PAIN_AROUND_SESSIONS(),
        dict(
            zip(
                PAIN_IN_SESSIONS,
                (texts.FIGURE_PAIN_BEFORE_SHORT(), texts.FIGURE_PAIN_DURING_SHORT(), texts.FIGURE_PAIN_AFTER_SHORT()),
                strict=True,
            )
        ),
    ),
)
"""Titles of the panels, and the short names of their lines."""
_PAIN_PLACES: Final[dict[str, int]] = {
    name: place
    for order in ((PAIN_CONTEXTS[3], *PAIN_CONTEXTS[:3]), PAIN_IN_SESSIONS)
    for place, name in enumerate(order)
}
"""Places of the lines in their panels. The first one leads: the average, which the outcomes count, and the pain before a session."""
_NAMED_BY_METHOD: Final = {
    "smooth": texts.FIGURE_RECORDING_SMOOTH,
    "learned": texts.FIGURE_RECORDING_LEARNED,
    "paper": texts.FIGURE_RECORDING_PAPER,
}


def rom(panels: Sequence[RomPanel], columns: int = _MOST_COLUMNS) -> Figure:
    """Return one panel per motion with active and passive angles over the weeks. Baseline, other side and reference are horizontal
    lines with their names beside them. ``columns``: 1 for a narrow screen, on which the titles of two columns would overlap.
    """
    rows = max(1, -(-len(panels) // columns))
    height = _MARGINS + rows * _PANEL_HEIGHT
    last = _last_week(point for panel in panels for line in panel.lines for point in line.points)
    layout = _layout_with_names(height)
    traces: list[_Trace] = []
    for place, panel in enumerate(panels):
        axes = _Panel(place, rows, height, columns)
        highest = max([panel.measure.reference_deg, *(value for line in panel.lines for value in _values(line))])
        lowest = min([0.0, *(value for line in panel.lines for value in _values(line))])
        spare = 0.08 * (highest - lowest) + 2
        ends = [lowest - spare, highest + spare]
        layout |= axes.layout(last, ends)
        layout["annotations"].append(axes.title(texts.FIGURE_MEASURE_DEG(measure=panel.measure.english)))
        layout["annotations"] += axes.names(_level_names(panel), ends)
        for line in panel.lines:
            traces += [axes.on_axes(trace, first=place == 0) for trace in _rom_line(line, last)]
        level = _level(texts.FIGURE_REFERENCE(), panel.measure.reference_deg, last, SLATE, "solid", is_angle=True)
        level["line"]["width"] = _REFERENCE_PX
        traces.append(axes.on_axes(level, first=place == 0))
    _show_each_name_once(traces)
    return _figure(traces, layout)


def _level_names(panel: RomPanel) -> list[LineName]:
    """Return the names of the horizontal lines of a motion. Colour and dash of active and passive are those of the legend."""
    others = tuple(line.other_side_deg for line in panel.lines if line.other_side_deg is not None)
    names = [
        LineName(texts.FIGURE_REFERENCE(), (panel.measure.reference_deg,)),
        LineName(texts.FIGURE_BASELINE(), tuple(line.points[0].value for line in panel.lines)),
    ]
    return [*names, LineName(texts.FIGURE_OTHER_SIDE(), others)] if others else names


def pain(lines: Sequence[LineSeries]) -> Figure:
    """Return pain scores (0 to 10) over the weeks: one panel for assessments, one for sessions. In each, the line that is read first is
    strong, and each line has its name at its end.
    """
    panels = [
        (title, {name: short for name, short in names.items() if any(line.name == name for line in lines)})
        for title, names in _PAIN_PANELS
    ]
    panels = [(title, names) for title, names in panels if names]
    height = _MARGINS + max(1, len(panels)) * _PANEL_HEIGHT
    layout = _layout_with_names(height)
    last = _last_week(point for line in lines for point in line.points)
    traces = []
    for row, (title, names) in enumerate(panels):
        axes = _Panel(row, len(panels), height, columns=1)
        layout |= axes.layout(last, _PAIN_RANGE)
        layout["annotations"].append(axes.title(title))
        ends = []
        for line in (line for line in lines if line.name in names):
            # No legend: each line has its name, and lines of two panels look alike.
            trace = axes.on_axes(_pain_line(line), first=False)
            traces.append(trace)
            ends.append(LineName(names[line.name], (line.points[-1].value,), trace["line"]["color"]))
        layout["annotations"] += axes.names(ends, _PAIN_RANGE)
    return _figure(traces, _without_legend(layout))


def _pain_line(line: LineSeries) -> _Trace:
    place = _PAIN_PLACES[line.name]
    trace = _nth_line(line, place, texts.FIGURE_PAIN_HOVER())
    trace["line"]["width"] = _OTHER_PX if place else _LEADING_PX
    return trace


def spadi(points: Sequence[SpadiPoint]) -> Figure:
    """Return total and both subscales over the weeks, with the change of the total that is important."""
    halves = (("SPADI", "total"), (texts.FIGURE_PAIN(), "pain"), (texts.FIGURE_DISABILITY(), "disability"))
    lines = [
        LineSeries(
            name,
            tuple(
                Point(point.at, point.week, getattr(point, part))
                for point in points
                if getattr(point, part) is not None
            ),
        )
        for name, part in halves
    ]
    traces = [_nth_line(line, place, texts.FIGURE_POINTS_HOVER()) for place, line in enumerate(lines) if line.points]
    last = _last_week(points)
    layout = _layout_with_names(_HEIGHT) | _axes(texts.FIGURE_SPADI_SCALE(), _SPADI_RANGE, last)
    if lines[0].points:
        baseline = lines[0].points[0].value
        smallest, _ = IMPORTANT_CHANGE
        names = _change_names(
            baseline, {-smallest: baseline - smallest, -DETECTABLE_CHANGE: baseline - DETECTABLE_CHANGE}
        )
        layout["annotations"] = line_names.beside(names, _SPADI_RANGE, _HEIGHT - _MARGINS - _NARROW_LEGEND_PX)
        traces.append(_level(texts.FIGURE_BASELINE(), baseline, last, INDIGO, "dot"))
        traces.append(_level(texts.FIGURE_BETTER_PERHAPS(points=smallest), baseline - smallest, last, GREEN, "dash"))
        traces.append(
            _level(
                texts.FIGURE_BETTER_IMPORTANT(points=DETECTABLE_CHANGE),
                baseline - DETECTABLE_CHANGE,
                last,
                GREEN,
                "longdashdot",
            )
        )
        layout["shapes"] = [
            {
                "type": "rect",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": baseline - DETECTABLE_CHANGE,
                "y1": baseline - smallest,
                "fillcolor": GREEN,
                "opacity": 0.12,
                "line": {"width": 0},
                "layer": "below",
            }
        ]
    return _figure(traces, layout)


def _change_names(baseline: float, levels: dict[float, float]) -> list[LineName]:
    """Return the names of the baseline and of levels, by the points between them."""
    changes = [(f"{points:+g}".replace("-", "−"), level) for points, level in levels.items()]
    names = [LineName(texts.FIGURE_POINTS_CHANGED(points=points), (level,), GREEN) for points, level in changes]
    return [LineName(texts.FIGURE_BASELINE(), (baseline,), INDIGO), *names]


def questionnaires(panels: Sequence[QuestionnairePanel]) -> Figure:
    """Return one panel per questionnaire with its totals, the baseline, and from where on an improvement is important and no chance."""
    rows = max(1, len(panels))
    height = _MARGINS + rows * _PANEL_HEIGHT
    layout = _layout_with_names(height)
    last = _last_week(point for panel in panels for point in panel.points)
    traces: list[_Trace] = []
    for place, panel in enumerate(panels):
        axes = _Panel(place, rows, height, columns=1)
        definition = panel.definition
        spare = 0.04 * (definition.highest_total - definition.lowest_total)
        ends = [definition.lowest_total - spare, definition.highest_total + spare]
        layout |= axes.layout(last, ends, y_title=_scale_of(definition))
        layout["annotations"].append(axes.title(definition.title))
        layout["annotations"] += axes.names(_total_names(panel), ends)
        traces += [axes.on_axes(trace, first=place == 0) for trace in _total_lines(panel, last)]
    _show_each_name_once(traces)
    return _figure(traces, layout)


def _scale_of(definition: Definition) -> str:
    text = texts.FIGURE_LOWER_IS_BETTER if definition.better == "lower" else texts.FIGURE_HIGHER_IS_BETTER
    return text(lowest=definition.lowest_total, highest=definition.highest_total)


def _total_names(panel: QuestionnairePanel) -> list[LineName]:
    totals = [point.total for point in panel.points if point.total is not None]
    if not totals:
        return []
    definition, baseline = panel.definition, totals[0]
    sign = -1 if definition.better == "lower" else 1
    steps = (definition.important.points, certain_above(definition))
    return _change_names(baseline, {sign * points: improved_by(definition, baseline, points) for points in steps})


def _total_lines(panel: QuestionnairePanel, last: float) -> list[_Trace]:
    """Return the totals and the levels of one questionnaire; nothing without a total."""
    points = tuple(Point(point.at, point.week, point.total) for point in panel.points if point.total is not None)
    if not points:
        return []
    definition, baseline = panel.definition, points[0].value
    perhaps = improved_by(definition, baseline, definition.important.points)
    certain = improved_by(definition, baseline, certain_above(definition))
    return [
        _line(LineSeries(texts.FIGURE_TOTAL(), points), INDIGO, "solid", "circle", texts.FIGURE_POINTS_HOVER()),
        _level(texts.FIGURE_BASELINE(), baseline, last, INDIGO, "dot"),
        _level(texts.FIGURE_PERHAPS_FROM_HERE(), perhaps, last, GREEN, "dash"),
        _level(texts.FIGURE_IMPORTANT_BEYOND(), certain, last, GREEN, "longdashdot"),
    ]


def tracking(tracked: Sequence[Tracked]) -> Figure:
    """Return the error of each recording by method and session. The upper panel has the mean RMSE, the lower one the largest error."""
    by_recording: dict[str, list[Tracked]] = defaultdict(list)
    for playbacks in tracked:
        by_recording[_name_of(playbacks)].append(playbacks)
    height = _MARGINS + 2 * _PANEL_HEIGHT
    layout = _layout(height)
    last = _last_week(tracked)
    traces: list[_Trace] = []
    for row, (title, part) in enumerate(
        ((texts.FIGURE_MEAN_RMSE(), "rmse_deg"), (texts.FIGURE_LARGEST_ERROR(), "peak_deg"))
    ):
        axes = _Panel(row, 2, height, columns=1)
        highest = max((getattr(playbacks, part) for playbacks in tracked), default=1.0)
        layout |= axes.layout(last, [0, 1.1 * highest + 0.2])
        layout["annotations"].append(axes.title(title))
        for place, (name, sessions) in enumerate(by_recording.items()):
            line = LineSeries(
                name, tuple(Point(playbacks.at, playbacks.week, getattr(playbacks, part)) for playbacks in sessions)
            )
            traces.append(axes.on_axes(_nth_line(line, place, texts.FIGURE_NAMED_ANGLE_HOVER()), first=row == 0))
    return _figure(traces, layout)


def _name_of(playbacks: Tracked) -> str:
    if playbacks.method is None:
        return playbacks.recording
    return _NAMED_BY_METHOD[playbacks.method](recording=playbacks.recording)


def correction(lines: Sequence[LineSeries]) -> Figure:
    """Return the size of the learned correction at the end of each session, with one line per recording."""
    highest = max((point.value for line in lines for point in line.points), default=0.5)
    last = _last_week(point for line in lines for point in line.points)
    return _figure(
        [_nth_line(line, place, texts.FIGURE_NAMED_ANGLE_HOVER()) for place, line in enumerate(lines)],
        _layout(_HEIGHT) | _axes(texts.FIGURE_CORRECTION(), [0, 1.15 * highest + 0.05], last),
    )


def end_feel(points: Sequence[EndFeelPoint]) -> Figure:
    """Return the range at 60 % of the chosen torque with its 95 % interval. Ranges at different torques, or of different shoulders, cannot
    be compared, so there is one line for each motion, side and torque.
    """
    last = _last_week(points)
    traces = []
    lines: dict[tuple[str, str, float], list[EndFeelPoint]] = defaultdict(list)
    for point in points:
        lines[point.motion, point.side, point.torque_nm].append(point)
    for place, ((motion, side, torque_nm), points_of_line) in enumerate(lines.items()):
        name = texts.FIGURE_END_FEEL_LINE(motion=motion, side=side, torque_nm=torque_nm)
        line = LineSeries(name, tuple(Point(point.at, point.week, point.range_deg) for point in points_of_line))
        error = {"type": "data", "array": [point.half_deg for point in points_of_line]}
        traces.append(_nth_line(line, place, texts.FIGURE_NAMED_ANGLE_HOVER()) | {"error_y": error})
    values = [point.range_deg for point in points] or [0.0]
    axes = _axes(texts.FIGURE_END_FEEL_RANGE(), [min(values) - 10.0, max(values) + 10.0], last)
    return _figure(traces, _layout(_HEIGHT) | axes)


def end_range(end_range_gain: EndRangeGain) -> Figure:
    """Return the end-range time of each week and motion as bars, and below it the gain of passive range on the same weeks."""
    height = _MARGINS + 2 * _PANEL_HEIGHT
    layout = _layout(height) | {"barmode": "group"}
    gained = [point for line in end_range_gain.gains for point in line.points]
    # The bar of the last week ends where the week ends.
    last = max([_last_week(gained), *(int(point.week) + 1.0 for point in end_range_gain.points)])
    dose, gain = (_Panel(row, 2, height, columns=1) for row in (0, 1))
    layout["annotations"] = [dose.title(texts.FIGURE_END_RANGE_IN_WEEK()), gain.title(texts.FIGURE_GAIN_OF_RANGE())]
    traces = []
    for place, motion in enumerate(dict.fromkeys(point.motion for point in end_range_gain.points)):
        # The last session of a week has the sum of the week.
        sums = {int(point.week): point for point in end_range_gain.points if point.motion == motion}
        bars = {
            "type": "bar",
            "name": motion,
            "x": [week + 0.5 for week in sums],
            "y": [point.in_week_min for point in sums.values()],
            "marker": {"color": _COLOURS[place % len(_COLOURS)]},
            "hovertemplate": texts.FIGURE_MINUTES_HOVER(),
        }
        traces.append(dose.on_axes(bars, first=True))
    for place, line in enumerate(end_range_gain.gains):
        traces.append(gain.on_axes(_nth_line(line, place, texts.FIGURE_NAMED_ANGLE_HOVER()), first=True))
    highest = max((point.in_week_min for point in end_range_gain.points), default=1.0)
    values = [0.0, *(point.value for point in gained)]
    layout |= dose.layout(last, [0, 1.1 * highest + 0.1])
    layout |= gain.layout(last, [min(values) - 5.0, max(values) + 5.0])
    return _figure(traces, layout)


def adherence(weeks: Sequence[AdherenceWeek]) -> Figure:
    """Return the sessions per week as bars and the prescribed sessions as a line."""
    mondays = [week.begins_on for week in weeks]
    hover = texts.FIGURE_WEEK_HOVER()
    sessions = {
        "type": "bar",
        "name": texts.FIGURE_SESSIONS(),
        "x": mondays,
        "y": [week.sessions for week in weeks],
        "marker": {"color": INDIGO},
        "hovertemplate": hover,
    }
    wished = {
        "type": "scatter",
        "mode": "lines+markers",
        "name": texts.FIGURE_AS_PRESCRIBED(),
        "x": mondays,
        "y": [week.sessions_prescribed for week in weeks],
        "line": {"color": ORANGE, "dash": "dot", "shape": "hvh", "width": _REFERENCE_PX},
        "marker": {"color": ORANGE, "symbol": "diamond"},
        "hovertemplate": hover,
    }
    traces = [sessions, *([wished] if any(week.sessions_prescribed for week in weeks) else [])]
    highest = max((max(week.sessions, week.sessions_prescribed or 0) for week in weeks), default=1)
    # Without these, Plotly names Sundays.
    ticks = {"tick0": mondays[0], "dtick": _WEEK_MS * -(-len(weeks) // _MOST_DAYS)} if mondays else {}
    day = {"type": "date", "tickformat": texts.FIGURE_DAY_FORMAT(), "title": {"text": texts.FIGURE_WEEK_FROM()}}
    axes: dict[str, dict[str, Any]] = {
        "xaxis": GRID | day | ticks,
        "yaxis": GRID | {"title": {"text": texts.FIGURE_SESSIONS()}, "range": [0, highest + 0.5]},
    }
    if highest <= 10:
        axes["yaxis"]["dtick"] = 1
    return _figure(traces, _layout(380) | axes)


class _Panel:
    """One of several small plots, with its axes and their position."""

    def __init__(self, place: int, rows: int, height: int, columns: int = _MOST_COLUMNS) -> None:
        row, column = divmod(place, columns)
        self._number = "" if place == 0 else str(place + 1)
        self._lowest = row == rows - 1
        gap = 60 / (height - _MARGINS)
        width = (1 - _COLUMN_GAP * (columns - 1)) / columns
        share = (1 - gap * (rows - 1)) / rows
        self._x = [column * (width + _COLUMN_GAP), column * (width + _COLUMN_GAP) + width]
        self._height_px = share * (height - _MARGINS)
        self._y = [1 - row * (share + gap) - share, 1 - row * (share + gap)]

    def layout(self, last: float, y_range: list[float], y_title: str = "") -> dict[str, Any]:
        """Return both axes."""
        y_axis = GRID | ({"title": {"text": y_title}} if y_title else {})
        return {
            f"xaxis{self._number}": _week_axis(last, with_title=self._lowest)
            | {"domain": self._x, "anchor": f"y{self._number}"},
            f"yaxis{self._number}": y_axis | {"domain": self._y, "anchor": f"x{self._number}", "range": y_range},
        }

    def title(self, text: str) -> dict[str, Any]:
        """Return the panel's title."""
        return {
            "text": text,
            # No bold markup, because Plotly would turn it into a style attribute, which the page's security policy refuses.
            "font": {"weight": "bold"},
            "xref": "paper",
            "yref": "paper",
            "x": self._x[0],
            "y": self._y[1],
            "xanchor": "left",
            "yanchor": "bottom",
            "showarrow": False,
        }

    def names(self, names: Sequence[LineName], y_range: Sequence[float]) -> list[dict[str, Any]]:
        """Return the names at the right ends of the panel's lines."""
        return line_names.beside(names, y_range, self._height_px, (f"x{self._number}", f"y{self._number}"))

    def on_axes(self, trace: _Trace, *, first: bool) -> _Trace:
        """Return a trace on the panel's axes. The panels share one legend."""
        shared = {"xaxis": f"x{self._number}", "yaxis": f"y{self._number}", "legendgroup": str(trace["name"])}
        return trace | shared | {"showlegend": first}


def _rom_line(line: RomLine, last: float) -> list[_Trace]:
    colour, dash, marker = {"active": (INDIGO, "solid", "circle"), "passive": (ORANGE, "dash", "square")}[line.kind]
    name = texts.FIGURE_ACTIVE() if line.kind == "active" else texts.FIGURE_PASSIVE()
    kind = KINDS[line.kind]
    traces = [
        _line(LineSeries(name, line.points), colour, dash, marker, texts.FIGURE_MEASURED_ANGLE_HOVER()),
        _level(texts.FIGURE_BASELINE_OF(kind=kind), line.points[0].value, last, colour, "dot", is_angle=True),
    ]
    if line.other_side_deg is not None:
        name = texts.FIGURE_OTHER_SIDE_OF(kind=kind)
        traces.append(_level(name, line.other_side_deg, last, colour, "longdashdot", is_angle=True))
    return traces


def _values(line: RomLine) -> list[float]:
    other = [] if line.other_side_deg is None else [line.other_side_deg]
    return [point.value for point in line.points] + other


def _nth_line(line: LineSeries, place: int, hover: str) -> _Trace:
    """Return line number ``place`` of a chart. The first thirty lines differ from each other, even in grey."""
    colour = _COLOURS[place % len(_COLOURS)]
    return _line(line, colour, _DASHES[place % len(_DASHES)], _MARKERS[place % len(_MARKERS)], hover)


def _line(line: LineSeries, colour: str, dash: str, marker: str, hover: str) -> _Trace:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": line.name,
        "x": [point.week for point in line.points],
        "y": [point.value for point in line.points],
        "customdata": [point.at for point in line.points],
        "line": {"color": colour, "width": 2, "dash": dash},
        "marker": {"color": colour, "size": 8, "symbol": marker},
        "hovertemplate": hover,
    }


def _level(name: str, value: float, last: float, colour: str, dash: str, *, is_angle: bool = False) -> _Trace:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": [-0.2, last + 0.2],
        "y": [value, value],
        "line": {"color": colour, "width": _LEVEL_PX, "dash": dash},
        "hovertemplate": texts.FIGURE_ANGLE_LEVEL_HOVER() if is_angle else texts.FIGURE_POINTS_LEVEL_HOVER(),
    }


def _last_week(points: Iterable[Point | SpadiPoint | TotalPoint | Tracked | EndFeelPoint]) -> float:
    return max([1.0, *(point.week for point in points)])


def _show_each_name_once(traces: list[_Trace]) -> None:
    """Show each name only once in the legend. The first panel may lack a line, so any panel may show the name."""
    shown_names: set[str] = set()
    for trace in traces:
        trace["showlegend"] = trace["name"] not in shown_names
        shown_names.add(trace["name"])


def _layout(height: int) -> dict[str, Any]:
    """Return the layout with the legend above the titles of the panels."""
    legend = {"orientation": "h", "y": 1 + 26 / (height - _MARGINS), "yanchor": "bottom", "x": 0}
    return _LAYOUT | {"height": height, "legend": legend, "annotations": []}


def _layout_with_names(height: int) -> dict[str, Any]:
    """Return the layout with room for the names of lines beside them."""
    layout = _layout(height)
    return layout | {"margin": layout["margin"] | {"r": line_names.MARGIN_PX}}


def _without_legend(layout: dict[str, Any]) -> dict[str, Any]:
    """Return the layout without the space of the legend. The panels keep their height."""
    margin = layout["margin"]
    return layout | {"margin": margin | {"t": margin["t"] - _LEGEND_PX}, "height": layout["height"] - _LEGEND_PX}


def _week_axis(last: float, *, with_title: bool = True) -> dict[str, Any]:
    """Return a time axis with labels at about a dozen whole weeks."""
    title = {"text": texts.FIGURE_WEEK() if with_title else ""}
    return GRID | {"title": title, "range": [-0.2, last + 0.2], "tick0": 0, "dtick": max(1, round(last / 12))}


def _axes(y_title: str, y_range: list[float], last: float) -> dict[str, Any]:
    return {"xaxis": _week_axis(last), "yaxis": GRID | {"title": {"text": y_title}, "range": y_range}}


def _figure(traces: list[_Trace], layout: dict[str, Any]) -> Figure:
    return {"data": traces, "layout": layout}
