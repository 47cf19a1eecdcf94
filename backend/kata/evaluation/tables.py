"""The figures as rows of words, for terminal and report alike."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from kata.evaluation.outcome import Outcome
from kata.evaluation.paper import ERRORS
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.tracking import MotorTracking, Range


@dataclass(frozen=True)
class Table:
    """A title, column heads, and rows; the first columns are words, the others numbers."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def last_plays(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Of each case, method and seed the last playback that came to its end."""
    found: dict[tuple[object, ...], Outcome] = {}
    for one in outcomes:
        if one.comparison:
            found[one.case.name, one.case.side, one.method, one.seed] = one
    return list(found.values())


def by_motor(outcomes: Sequence[Outcome]) -> Table:
    """One row a case, method and motor: the worst over the seeds of the last playback."""
    rows = []
    for one, motor, found in _grouped(outcomes):
        lags = [tracking.lag_ms for tracking in found if tracking.lag_ms is not None]
        rows.append(
            (
                one.case.name,
                one.case.side,
                one.method,
                str(one.repetition),
                str(motor),
                _signed(found, lambda tracking: tracking.peak_deg),
                f"{max(tracking.rmse_deg for tracking in found):.2f}",
                _signed(found, lambda tracking: tracking.start_deg),
                f"{max(lags, key=abs):+.0f}" if lags else "",
            )
        )
    columns = ("Motion", "Side", "Method", "Play", "Motor", "Peak, deg", "RMSE, deg", "Start, deg", "Lag, ms")
    return Table(f"Playback minus teaching{_of_seeds(outcomes)}", columns, rows)


def by_method(outcomes: Sequence[Outcome]) -> Table:
    """One row a method and playback: the worst of everything."""
    rows = []
    played = [one for one in outcomes if one.comparison]
    methods = list(dict.fromkeys((one.method, one.repetition) for one in played))
    for method, repetition in methods:
        found = [
            motor for one in played if (one.method, one.repetition) == (method, repetition) for motor in one.motors
        ]
        first = [motor for motor in found if motor.motor <= 4]
        fifth = [motor for motor in found if motor.motor == 5]
        rows.append(
            (
                method,
                str(repetition),
                *(_largest(motor.peak_deg for motor in some) for some in (first, fifth)),
                *(_largest(motor.rmse_deg for motor in some) for some in (first, fifth)),
                _largest(motor.start_deg for motor in found),
            )
        )
    columns = (
        "Method", "Play", "Peak 1-4, deg", "Peak 5, deg", "RMSE 1-4, deg", "RMSE 5, deg", "Start, deg",
    )  # fmt: skip
    return Table(f"The worst of every case{_of_seeds(outcomes)}", columns, rows)


def beside_the_paper(outcomes: Sequence[Outcome]) -> Table:
    """Ours beside Section 4: the largest error of the motors that the paper speaks of; empty without the paper's motions."""
    last = last_plays(outcomes)
    methods = list(dict.fromkeys(one.method for one in last))
    rows = []
    for error in ERRORS:
        ours = [one for one in last if one.case.number == error.motion and error.side in (None, one.case.side)]
        if not ours:
            continue
        name = ours[0].case.name + (f", {error.side}" if error.side else "")
        cells = []
        for method in methods:
            motors = [motor for one in ours if one.method == method for motor in one.motors]
            shown = [motor for motor in motors if motor.motor in error.motors]
            cells.append(f"±{_largest(motor.peak_deg for motor in shown)}" if shown else "")
        rows.append((f"{error.figure}", name, ", ".join(map(str, error.motors)), error.words, *cells))
    plays = {one.method: one.repetition for one in last}
    heads = tuple(f"ours, {method}, play {plays[method]}" for method in methods)
    return Table(
        f"Errors in degrees beside the paper's (Section 4){_of_seeds(outcomes)}",
        ("Figure", "Motion", "Motors", "Paper", *heads),
        rows,
    )


def rom_reached(outcomes: Sequence[Outcome]) -> Table:
    """Table 2 with what was taught and what playback reached: of each method the least, over sides and seeds."""
    last = last_plays(outcomes)
    methods = list(dict.fromkeys(one.method for one in last))
    rows = []
    for basic in BASIC_MOTIONS:
        ours = [one for one in last if one.case.number == basic.number]
        figures = {id(one): motion for one in ours for motion in one.motions if motion.motion == basic}
        if not figures:
            continue
        taught = _least(figure.taught for figure in figures.values())
        reached = [_least(figures[id(one)].played for one in ours if one.method == method) for method in methods]
        rows.append((f"{basic.number}", basic.name, _rom(basic.range_deg), _rom(basic.reference_deg), taught, *reached))
    heads = tuple(f"reached, {method}" for method in methods)
    return Table(
        f"Table 2: range of motion in degrees{_of_seeds(outcomes)}",
        ("No.", "Motion", "Apparatus", "Reference", "taught", *heads),
        rows,
    )


def _least(ranges: Iterable[Range]) -> str:
    found = list(ranges)
    return _rom((max(one.min_deg for one in found), min(one.max_deg for one in found)))


def _rom(range_deg: tuple[float, float]) -> str:
    return f"{range_deg[1]:+.0f} .. {range_deg[0]:+.0f}"


def _grouped(outcomes: Sequence[Outcome]) -> Iterable[tuple[Outcome, int, list[MotorTracking]]]:
    """Case by case and method by method: an outcome of it, a motor, and that motor's figures of every seed."""

    def key(one: Outcome) -> tuple[str, str, str]:
        return one.case.name, one.case.side, one.method

    order = {key(one): n for n, one in reversed(list(enumerate(outcomes)))}
    for _, group in groupby(sorted(last_plays(outcomes), key=lambda one: order[key(one)]), key):
        same = list(group)
        for motor in same[0].case.motors:
            yield same[0], motor, [tracking for one in same for tracking in one.motors if tracking.motor == motor]


def _signed(found: Iterable[MotorTracking], figure: Callable[[MotorTracking], float]) -> str:
    return f"{max((figure(one) for one in found), key=abs):+.2f}"


def _largest(figures: Iterable[float]) -> str:
    sizes = [abs(figure) for figure in figures]
    return f"{max(sizes):.2f}" if sizes else ""


def _of_seeds(outcomes: Sequence[Outcome]) -> str:
    seeds = len({one.seed for one in outcomes})
    return f", the worst of {seeds} variations of the mechanics" if seeds > 1 else ""
