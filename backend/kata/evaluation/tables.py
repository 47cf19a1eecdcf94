"""Builds tables of the figures as text, for the terminal and the report."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from kata.evaluation.goals import GOALS
from kata.evaluation.outcome import CaseResult
from kata.evaluation.paper import ERRORS
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.tracking import AngleRange, MotorTracking


@dataclass(frozen=True)
class TextTable:
    """A title, column heads and rows. The first columns are words, the others numbers."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def last_plays(outcomes: Sequence[CaseResult]) -> list[CaseResult]:
    """Return the last completed playback of each case, method and seed."""
    last_outcomes: dict[tuple[object, ...], CaseResult] = {}
    for outcome in outcomes:
        if outcome.comparison:
            last_outcomes[outcome.case.name, outcome.case.side, outcome.method, outcome.seed] = outcome
    return list(last_outcomes.values())


def by_motor(outcomes: Sequence[CaseResult]) -> TextTable:
    """Return a table with a row for each case, method and motor. A value is the worst of the last playbacks of all seeds."""
    rows = []
    for outcome, motor, trackings in _grouped(outcomes):
        lags = [tracking.lag_ms for tracking in trackings if tracking.lag_ms is not None]
        rows.append(
            (
                outcome.case.name,
                outcome.case.side,
                outcome.method,
                str(outcome.repetition),
                str(motor),
                _signed(trackings, lambda tracking: tracking.peak_deg),
                f"{max(tracking.rmse_deg for tracking in trackings):.2f}",
                _signed(trackings, lambda tracking: tracking.start_deg),
                f"{max(lags, key=abs):+.0f}" if lags else "",
            )
        )
    columns = ("Motion", "Side", "Method", "Play", "Motor", "Peak, deg", "RMSE, deg", "Start, deg", "Lag, ms")
    return TextTable(f"Playback minus teaching{_of_seeds(outcomes)}", columns, rows)


def by_method(outcomes: Sequence[CaseResult]) -> TextTable:
    """Return a table with a row for each method and playback. Each value is the worst value of all cases."""
    rows = []
    played = [outcome for outcome in outcomes if outcome.comparison]
    methods = list(dict.fromkeys((outcome.method, outcome.repetition) for outcome in played))
    for method, repetition in methods:
        trackings = [
            motor
            for outcome in played
            if (outcome.method, outcome.repetition) == (method, repetition)
            for motor in outcome.motors
        ]
        first = [motor for motor in trackings if motor.motor <= 4]
        fifth = [motor for motor in trackings if motor.motor == 5]
        rows.append(
            (
                method,
                str(repetition),
                *(_largest(motor.peak_deg for motor in some) for some in (first, fifth)),
                *(_largest(motor.rmse_deg for motor in some) for some in (first, fifth)),
                _largest(motor.start_deg for motor in trackings),
            )
        )
    columns = (
        "Method", "Play", "Peak 1-4, deg", "Peak 5, deg", "RMSE 1-4, deg", "RMSE 5, deg", "Start, deg",
    )  # fmt: skip
    return TextTable(f"The worst of every case{_of_seeds(outcomes)}", columns, rows)


def plant_of(outcomes: Sequence[CaseResult]) -> str:
    """Return the plant of the outcomes; empty for the real apparatus and without outcomes."""
    return (outcomes[0].plant or "") if outcomes else ""


def plants_beside(outcomes: Sequence[CaseResult], second_outcomes: Sequence[CaseResult]) -> TextTable:
    """Return the rows of :func:`by_method` for both plants side by side, with the same cases and the same seed."""
    seed = second_outcomes[0].seed
    first = by_method([outcome for outcome in outcomes if outcome.seed == seed])
    second = {row[:2]: row[2:] for row in by_method(second_outcomes).rows}
    rows = [
        (*row[:2], *(f"{one} / {other}" for one, other in zip(row[2:], second[row[:2]], strict=True)))
        for row in first.rows
        if row[:2] in second
    ]
    return TextTable(
        f"Plant {plant_of(outcomes)} / plant {plant_of(second_outcomes)}, the worst of every case", first.columns, rows
    )


@dataclass(frozen=True)
class GoalFigure:
    """A figure of the worst case beside its goal, in degrees, for motors 1-4 and for motor 5; None if no playback had such motors."""

    name: str
    goal_deg: tuple[float, float]
    worst_deg: tuple[float | None, float | None]

    @property
    def met(self) -> bool:
        """True if the worst case is within the goal."""
        return all(worst is None or worst <= limit for worst, limit in zip(self.worst_deg, self.goal_deg, strict=True))


def worst_beside_goals(outcomes: Sequence[CaseResult]) -> list[GoalFigure]:
    """Return the figures of the independent plant beside the project's goals. Only completed playbacks have figures."""
    figures = []
    for goal in GOALS:
        tracked: dict[bool, list[float]] = {False: [], True: []}
        for outcome in outcomes:
            if (outcome.method, outcome.repetition) in goal.plays:
                for motor in outcome.motors_at(goal.place):
                    tracked[motor.motor == 5].append(abs(getattr(motor, goal.figure)))
        if tracked[False] or tracked[True]:
            worst = max(tracked[False], default=None), max(tracked[True], default=None)
            figures.append(GoalFigure(goal.name, goal.limits_deg, worst))
    return figures


def beside_goals(outcomes: Sequence[CaseResult]) -> TextTable:
    """Return :func:`worst_beside_goals` as text."""
    rows = []
    for figure in worst_beside_goals(outcomes):
        worst = ("" if value is None else f"{value:.2f}" for value in figure.worst_deg)
        rows.append(
            (figure.name, *(f"{limit:.2f}" for limit in figure.goal_deg), *worst, "yes" if figure.met else "no")
        )
    columns = ("Figure", "Goal 1-4, deg", "Goal 5, deg", "Motors 1-4, deg", "Motor 5, deg", "Met")
    return TextTable(f"Beside the goals{_of_seeds(outcomes)}", columns, rows)


def plays_in_words(outcomes: Sequence[CaseResult]) -> str:
    """Return as text the numbers of playbacks that ended, that were refused, and that did not end. Goals use only the first group."""
    refused = sum(outcome.refused for outcome in outcomes)
    failed = sum(bool(outcome.problem) for outcome in outcomes) - refused
    completed = sum(outcome.comparison is not None for outcome in outcomes)
    return f"{completed} plays ended, {refused} were refused before they started, {failed} started and did not end."


def compared_to_paper(outcomes: Sequence[CaseResult]) -> TextTable:
    """Return our largest errors of the motors that Section 4 names, beside the paper's. As in the paper, errors have their sign and
    the start is separate. Without the paper's motions the table is empty.
    """
    last = last_plays(outcomes)
    methods = list(dict.fromkeys(outcome.method for outcome in last))
    rows = []
    for error in ERRORS:
        ours = [
            outcome
            for outcome in last
            if outcome.case.number == error.motion and error.side in (None, outcome.case.side)
        ]
        if not ours:
            continue
        name = ours[0].case.name + (f", {error.side}" if error.side else "")
        cells = []
        for method in methods:
            motors = [motor for outcome in ours if outcome.method == method for motor in outcome.motors]
            named = [motor for motor in motors if motor.motor in error.motors]
            peak, start = (
                (_signed(named, lambda motor: motor.peak_deg), _signed(named, lambda motor: motor.start_deg))
                if named
                else ("", "")
            )
            cells += [peak, start]
        rows.append((f"{error.figure}", name, ", ".join(map(str, error.motors)), error.words, *cells))
    plays = {outcome.method: outcome.repetition for outcome in last}
    heads = tuple(
        head for method in methods for head in (f"ours, {method}, play {plays[method]}", f"its start, {method}")
    )
    return TextTable(
        f"Errors in degrees beside the paper's (Section 4){_of_seeds(outcomes)}",
        ("Figure", "Motion", "Motors", "Paper", *heads),
        rows,
    )


def rom_reached(outcomes: Sequence[CaseResult]) -> TextTable:
    """Return Table 2 with the taught and the reached range of motion for each method. A range is the smallest of sides and seeds."""
    last = last_plays(outcomes)
    methods = list(dict.fromkeys(outcome.method for outcome in last))
    rows = []
    for basic in BASIC_MOTIONS:
        ours = [outcome for outcome in last if outcome.case.number == basic.number]
        figures = {id(outcome): motion for outcome in ours for motion in outcome.motions if motion.motion == basic}
        if not figures:
            continue
        taught = _least(figure.taught for figure in figures.values())
        reached = [
            _least(figures[id(outcome)].played for outcome in ours if outcome.method == method) for method in methods
        ]
        rows.append((f"{basic.number}", basic.name, _rom(basic.range_deg), _rom(basic.reference_deg), taught, *reached))
    heads = tuple(f"reached, {method}" for method in methods)
    return TextTable(
        f"Table 2: range of motion in degrees{_of_seeds(outcomes)}",
        ("No.", "Motion", "Apparatus", "Reference", "taught", *heads),
        rows,
    )


def _least(ranges: Iterable[AngleRange]) -> str:
    found = list(ranges)
    return _rom((max(range_.min_deg for range_ in found), min(range_.max_deg for range_ in found)))


def _rom(range_deg: tuple[float, float]) -> str:
    return f"{range_deg[1]:+.0f} .. {range_deg[0]:+.0f}"


def _grouped(outcomes: Sequence[CaseResult]) -> Iterable[tuple[CaseResult, int, list[MotorTracking]]]:
    """Yield for each case, method and motor: an outcome, the motor, and the motor's figures of every seed."""

    def key(outcome: CaseResult) -> tuple[str, str, str]:
        return outcome.case.name, outcome.case.side, outcome.method

    order = {key(outcome): n for n, outcome in reversed(list(enumerate(outcomes)))}
    for _, group in groupby(sorted(last_plays(outcomes), key=lambda outcome: order[key(outcome)]), key):
        same = list(group)
        for motor in same[0].case.motors:
            yield (
                same[0],
                motor,
                [tracking for outcome in same for tracking in outcome.motors if tracking.motor == motor],
            )


def _signed(trackings: Iterable[MotorTracking], figure: Callable[[MotorTracking], float]) -> str:
    return f"{max((figure(tracking) for tracking in trackings), key=abs):+.2f}"


def _largest(figures: Iterable[float]) -> str:
    sizes = [abs(figure) for figure in figures]
    return f"{max(sizes):.2f}" if sizes else ""


def _of_seeds(outcomes: Sequence[CaseResult]) -> str:
    seeds = len({outcome.seed for outcome in outcomes})
    return f", the worst of {seeds} variations of the mechanics" if seeds > 1 else ""
