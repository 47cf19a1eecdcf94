"""A note, drafted from what was measured: short, as a therapist writes. Pure; somebody reads, edits and signs it."""

from collections.abc import Sequence
from typing import Final

from kata.clinic.sessions.schemas import Run, Session

_HARDLY_LESS: Final = 99.5
_METHOD_WORDS: Final = {"learned": "learned", "paper": "as in the paper"}


def draft(session: Session) -> str:
    """The sentences that apply, in the order of a visit."""
    runs = [run for run in session.runs if run.outcome not in ("loaded", "unloaded")]
    if not runs:
        return " ".join([_what(session), "Nothing was played.", *_pain(session)])
    sentences = [
        _what(session),
        *(_played(session, run) for run in runs),
        *_not_played(session, runs),
        *_reached(runs),
        *_tracking(runs),
        *_less(runs),
        *_reversals(runs),
        *_stops(runs),
        *_pain(session),
    ]
    return " ".join(sentences)


def _what(session: Session) -> str:
    side = f"{session.side.capitalize()} shoulder" if session.side else "Shoulder"
    if session.programme is None:
        return f"{side}, without a programme."
    return f"{side}, programme {session.programme.name} (version {session.programme.number})."


def _played(session: Session, run: Run) -> str:
    planned = next(
        (
            item.repetitions
            for item in (session.programme.items if session.programme else ())
            if item.position == run.programme_position
        ),
        run.repetitions,
    )
    done = run.repetitions_done if run.repetitions_done is not None else 0
    if run.outcome == "completed" and run.repetitions_done is None:
        done = run.repetitions
    settings = _settings(run)
    return f"{run.recording_name}{f' ({settings})' if settings else ''}: {done} of {_repetitions(planned)}."


def _not_played(session: Session, runs: Sequence[Run]) -> list[str]:
    played = {run.programme_position for run in runs}
    missing = [
        item.recording_name
        for item in (session.programme.items if session.programme else ())
        if item.position not in played
    ]
    return [f"Not played: {', '.join(missing)}."] if missing else []


def _reached(runs: Sequence[Run]) -> list[str]:
    """By motion, the widest of all runs; what was played with less range is not in the comparison."""
    reached: dict[int, tuple[str, float, float]] = {}
    for run in runs:
        for motion in run.comparison.motions if run.comparison else ():
            low, high = motion.played_min_deg, motion.played_max_deg
            if low is None or high is None:
                continue
            _, lowest, highest = reached.get(motion.motion, (motion.name, low, high))
            reached[motion.motion] = (motion.name, min(low, lowest), max(high, highest))
    if not reached:
        return []
    words = [
        f"{name[0].lower()}{name[1:]} {_deg(low)} to {_deg(high)} deg"
        for _, (name, low, high) in sorted(reached.items())
    ]
    return [f"Reached: {'; '.join(words)}."]


def _tracking(runs: Sequence[Run]) -> list[str]:
    motors = [motor for run in runs if run.comparison for motor in run.comparison.motors]
    if not motors:
        return []
    worst = max(motors, key=lambda motor: abs(motor.peak_deg))
    return [
        f"Tracking error at most {abs(worst.peak_deg):.1f} deg (motor {worst.motor}, RMSE {worst.rmse_deg:.1f} deg)."
    ]


def _less(runs: Sequence[Run]) -> list[str]:
    return [
        f"Less range was asked for in {run.recording_name}: part of it was played with {run.least_range_percent:.0f} % "
        "of its range."
        for run in runs
        if run.least_range_percent is not None and run.least_range_percent < _HARDLY_LESS
    ]


def _reversals(runs: Sequence[Run]) -> list[str]:
    return [
        f"In {run.recording_name} the arm met resistance and was taken back {_times(run.reversals)} "
        f"(level {run.load_level})."
        for run in runs
        if run.reversals
    ]


def _stops(runs: Sequence[Run]) -> list[str]:
    sentences = [f"{run.recording_name} was stopped: {run.stop.message}" for run in runs if run.stop]
    sentences += [f"{run.recording_name} was ended early." for run in runs if run.outcome == "returned"]
    sentences += [
        f"{run.recording_name} was interrupted: the control program ended."
        for run in runs
        if run.outcome == "interrupted"
    ]
    return sentences


def _pain(session: Session) -> list[str]:
    given = [
        f"{pain} {when}"
        for when, pain in (
            ("before", session.pain_before),
            ("during", session.pain_during),
            ("after", session.pain_after),
        )
        if pain is not None
    ]
    return [f"Pain (0 to 10): {', '.join(given)}."] if given else []


def _settings(run: Run) -> str:
    words = []
    if run.range_percent != 100:
        words.append(f"{run.range_percent:g} % of the range")
    if run.speed_percent != 100:
        words.append(f"{run.speed_percent:g} % speed")
    if run.repetitions > 1 and run.pause_s:
        words.append(f"{run.pause_s:g} s of pause")
    if run.method in _METHOD_WORDS:
        words.append(_METHOD_WORDS[run.method])
    return ", ".join(words)


def _repetitions(count: int) -> str:
    return f"{count} repetition{'' if count == 1 else 's'}"


def _times(count: int | None) -> str:
    return "once" if count == 1 else "twice" if count == 2 else f"{count} times"


def _deg(value: float) -> str:
    return f"{round(value):d}"
