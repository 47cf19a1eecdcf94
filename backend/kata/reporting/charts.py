"""Curves as SVG points, drawn by a template. Paper is static, so no plotting library is needed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from tsdownsample import MinMaxDownsampler

from kata.commissioning.record import RecordedCurve
from kata.motion.axes import AXES
from kata.motion.end_feel import TorqueAngleCurve
from kata.motion.linkage import Floats
from kata.plotting.figures import RunFigureSamples, run_lines

_PLACES: Final = 90
"""Number of sections into which a curve of a small chart is divided. Each section keeps its lowest and highest angle, so that no peak is
lost.
"""
_NARROWEST_DEG: Final = 10.0
"""The smallest range of an angle axis. On a smaller range, single encoder counts would look like movement."""


@dataclass(frozen=True)
class Frame:
    """The size of a chart and the margins around its curves, in the chart's own units."""

    width: float
    height: float
    left: float
    right: float
    top: float
    bottom: float

    def x(self, share: float) -> float:
        """Return the x position of ``share``: 0 at the left, 1 at the right."""
        return round(self.left + share * (self.width - self.left - self.right), 2)

    def y(self, share: float) -> float:
        """Return the y position of ``share``: 0 at the bottom, 1 at the top."""
        return round(self.height - self.bottom - share * (self.height - self.top - self.bottom), 2)


SMALL: Final = Frame(128, 76, 24, 3, 4, 12)
"""Five of these charts fit beside each other on a page."""
WIDE: Final = Frame(250, 120, 28, 8, 8, 18)
"""Two of these charts fit beside each other on a page."""


@dataclass(frozen=True)
class Tick:
    """A position on an axis and its label."""

    at: float
    label: str


@dataclass(frozen=True)
class Curve:
    """A curve: its name, its points as SVG, and the marked points."""

    name: str
    points: str
    dots: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Chart:
    """A chart that is ready to be drawn."""

    name: str
    frame: Frame
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    lines: tuple[Curve, ...]


@dataclass(frozen=True)
class DatedSeries:
    """Values over days. A series without days is a horizontal line."""

    name: str
    days: tuple[float, ...]
    values: tuple[float, ...]


def tracking(parts: RunFigureSamples) -> tuple[Chart, ...]:
    """Return teaching and playback of each motor over the recording's time, as small charts.

    :raises UnreadableError: when the samples are damaged.
    """
    lines = run_lines(parts)
    end_s = float(lines["taught_s"].max())
    return tuple(
        _small(
            str(motor),
            end_s,
            *((name, lines[f"{name}_s"][:, axis], lines[f"{name}_deg"][:, axis]) for name in ("taught", "played")),
        )
        for axis, motor in enumerate(AXES)
    )


def step_responses(curves: Sequence[RecordedCurve]) -> dict[str, tuple[Chart, ...]]:
    """Return a chart per motor for each load ("weight", "empty") that was measured.

    A chart has the height of the step, the response with the kept gains and, if the motor had other gains before, the former response.
    """
    loads = dict.fromkeys(curve.load for curve in curves)
    return {
        load: tuple(
            _step_response([curve for curve in curves if (curve.load, curve.motor) == (load, motor)])
            for motor in sorted({curve.motor for curve in curves if curve.load == load})
        )
        for load in loads
    }


def _step_response(curves: Sequence[RecordedCurve]) -> Chart:
    """Return the chart of one motor. The last curve is that of the kept gains, and the first one that of the former gains."""
    former, present = curves[0], curves[-1]
    has_changed = (former.p_gain, former.i_gain, former.d_gain) != (present.p_gain, present.i_gain, present.d_gain)
    shown_curves = {"former": former, "kept": present} if has_changed else {"kept": present}
    end_s = max(curve.times_s[-1] for curve in shown_curves.values())
    low = min(0.0, *(min(curve.angles_deg) for curve in shown_curves.values()))
    reach = 1.1 * max(present.step_deg, *(max(curve.angles_deg) for curve in shown_curves.values())) - low
    lines = [Curve("reference", _points([(SMALL.x(x), SMALL.y((present.step_deg - low) / reach)) for x in (0, 1)]))]
    for name, curve in shown_curves.items():
        points = [
            (SMALL.x(time / end_s), SMALL.y((angle - low) / reach))
            for time, angle in zip(curve.times_s, curve.angles_deg, strict=True)
        ]
        lines.append(Curve(name, _points(points)))
    ticks = tuple(Tick(SMALL.y((tick - low) / reach), f"{tick:g}") for tick in (0.0, present.step_deg))
    ends = (Tick(SMALL.x(0), "0"), Tick(SMALL.x(1), f"{end_s:.1f} s"))
    return Chart(str(present.motor), SMALL, ends, ticks, tuple(lines))


def torque_angle(name: str, curve: TorqueAngleCurve, outward: int, marks_deg: Sequence[float]) -> Chart:
    """Return the torque of an end-feel test over the apparatus angle: out, back, and the mean of both.

    :param outward: sign of the apparatus angle on the way out.
    :param marks_deg: apparatus angles to mark on the mean, such as onset and range.
    """
    angles = outward * curve.places_deg
    torques = {"way_out": curve.out_nm, "way_back": curve.back_nm, "mean": curve.mean_nm}
    lowest_nm = min(0.0, *(float(np.nanmin(torque)) for torque in torques.values()))
    x_ticks = nice_ticks(float(angles.min()), float(angles.max()), 4)
    y_ticks = nice_ticks(lowest_nm, float(np.nanmax(curve.out_nm)), 4)

    def x(angle: float) -> float:
        return WIDE.x((angle - x_ticks[0]) / (x_ticks[-1] - x_ticks[0]))

    def y(torque: float) -> float:
        return WIDE.y((torque - y_ticks[0]) / (y_ticks[-1] - y_ticks[0]))

    is_known = np.isfinite(curve.mean_nm)
    marked_nm = np.interp(np.multiply(outward, marks_deg), curve.places_deg[is_known], curve.mean_nm[is_known])
    dots = tuple((x(mark), y(torque)) for mark, torque in zip(marks_deg, marked_nm.tolist(), strict=True))
    lines = []
    for line, torque in torques.items():
        points = zip(angles.tolist(), torque.tolist(), strict=True)
        positions = [(x(angle), y(value)) for angle, value in points if math.isfinite(value)]
        lines.append(Curve(line, _points(positions), dots if line == "mean" else ()))
    return Chart(
        name,
        WIDE,
        tuple(Tick(x(tick), f"{_label(tick)}°") for tick in x_ticks),
        tuple(Tick(y(tick), _label(tick)) for tick in y_ticks),
        tuple(lines),
    )


def over_days(name: str, series: Sequence[DatedSeries], labels: Sequence[Tick], low: float, high: float) -> Chart:
    """Return a chart of values over days. ``labels``: days since the first day with their names; the last label is the end of the axis."""
    end = max(labels[-1].at, 1.0)
    ticks = nice_ticks(low, high, 4)
    low, high = min(low, ticks[0]), max(high, ticks[-1])
    lines = []
    for curve in series:
        days = curve.days or (0.0, end)
        values = curve.values if curve.days else curve.values * 2
        positions = [(WIDE.x(day / end), WIDE.y((v - low) / (high - low))) for day, v in zip(days, values, strict=True)]
        lines.append(Curve(curve.name, _points(positions), tuple(positions) if curve.days else ()))
    return Chart(
        name,
        WIDE,
        tuple(Tick(WIDE.x(label.at / end), label.label) for label in labels),
        tuple(Tick(WIDE.y((tick - low) / (high - low)), _label(tick)) for tick in ticks),
        tuple(lines),
    )


def nice_ticks(low: float, high: float, about: int) -> tuple[float, ...]:
    """Return about ``about`` + 1 ticks at round numbers, from at most ``low`` to at least ``high``."""
    rough = max(high - low, 1e-9) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= rough * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return tuple(round(count * step, 10) for count in range(first, last + 1))


def _label(tick: float) -> str:
    return f"{tick:g}".replace("-", "−")


def _small(name: str, duration_s: float, *curves: tuple[str, Floats, Floats]) -> Chart:
    low = min(float(angles.min()) for _, _, angles in curves)
    high = max(float(angles.max()) for _, _, angles in curves)
    middle, reach = (low + high) / 2, max(_NARROWEST_DEG, high - low) / 2 * 1.1
    ticks = [tick for tick in nice_ticks(middle - reach, middle + reach, 4) if abs(tick - middle) <= reach]

    def y(angle: float) -> float:
        return SMALL.y((angle - middle + reach) / (2 * reach))

    lines = []
    for line, times, angles in curves:
        positions = [
            (SMALL.x(min(time / duration_s, 1.0)), y(angle)) for time, angle in _section_extremes(times, angles)
        ]
        lines.append(Curve(line, _points(positions)))
    return Chart(
        name,
        SMALL,
        (Tick(SMALL.x(0), "0"), Tick(SMALL.x(1), f"{duration_s:.0f} s")),
        tuple(Tick(y(tick), _label(tick)) for tick in ticks),
        tuple(lines),
    )


def _section_extremes(times: Floats, angles: Floats) -> list[tuple[float, float]]:
    """Return the lowest and highest point of each section, in order."""
    if len(times) > 2 * _PLACES:
        points = MinMaxDownsampler().downsample(np.ascontiguousarray(angles), n_out=2 * _PLACES)  # type: ignore[no-untyped-call]
        times, angles = times[points], angles[points]
    return list(zip(times.tolist(), angles.tolist(), strict=True))


def _points(positions: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in positions)
