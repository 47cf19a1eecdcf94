"""A note, drafted from what was measured: short, as a therapist writes. Pure; somebody reads, edits and signs it."""

from collections.abc import Sequence
from typing import Final

from kata.clinic.sessions.schemas import Run, RunStop, Session
from kata.reporting.content import motor_of
from kata.reporting.note_draft_words import NoteSpeaker
from kata.reporting.words import Language

_HARDLY_LESS: Final = 99.5
_TOLD_METHODS: Final = ("learned", "paper")


def draft(session: Session, language: Language = "en") -> str:
    """The sentences that apply, in the order of a visit."""
    speaker = NoteSpeaker(language)
    runs = [run for run in session.runs if run.outcome not in ("loaded", "unloaded")]
    happened = (
        [
            *(_played(speaker, session, run) for run in runs),
            *_not_played(speaker, session, runs),
            *_reached(speaker, runs),
            *_tracking(speaker, runs),
            *_less(speaker, runs),
            *_reversals(speaker, runs),
            *_stops(speaker, runs),
        ]
        if runs
        else [speaker.say("nothing_played")]
    )
    return speaker.join("between", [_what(speaker, session), *happened, *_pain(speaker, session)])


def _what(speaker: NoteSpeaker, session: Session) -> str:
    shoulder = speaker.say(f"shoulder.{session.side or ''}")
    if session.programme is None:
        return speaker.say("without_programme", shoulder=shoulder)
    return speaker.say(
        "with_programme", shoulder=shoulder, name=session.programme.name, number=session.programme.number
    )


def _played(speaker: NoteSpeaker, session: Session, run: Run) -> str:
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
    settings = _settings(speaker, run)
    name = run.recording_name
    what = speaker.say("with_settings", name=name, settings=speaker.join("and", settings)) if settings else name
    return speaker.say("played_once" if planned == 1 else "played", what=what, done=done, planned=planned)


def _not_played(speaker: NoteSpeaker, session: Session, runs: Sequence[Run]) -> list[str]:
    played = {run.programme_position for run in runs}
    missing = [
        item.recording_name
        for item in (session.programme.items if session.programme else ())
        if item.position not in played
    ]
    return [speaker.say("not_played", names=speaker.join("and", missing))] if missing else []


def _reached(speaker: NoteSpeaker, runs: Sequence[Run]) -> list[str]:
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
        speaker.say("reached_motion", name=speaker.motion(number, name), low=_deg(low), high=_deg(high))
        for number, (name, low, high) in sorted(reached.items())
    ]
    return [speaker.say("reached", motions=speaker.join("motions_between", words))]


def _tracking(speaker: NoteSpeaker, runs: Sequence[Run]) -> list[str]:
    motors = [motor for run in runs if run.comparison for motor in run.comparison.motors]
    if not motors:
        return []
    worst = max(motors, key=lambda motor: abs(motor.peak_deg))
    return [speaker.say("tracking", peak=abs(worst.peak_deg), motor=worst.motor, rmse=worst.rmse_deg)]


def _less(speaker: NoteSpeaker, runs: Sequence[Run]) -> list[str]:
    return [
        speaker.say("less", name=run.recording_name, percent=run.least_range_percent)
        for run in runs
        if run.least_range_percent is not None and run.least_range_percent < _HARDLY_LESS
    ]


def _reversals(speaker: NoteSpeaker, runs: Sequence[Run]) -> list[str]:
    how_often = {1: "reversed_once", 2: "reversed_twice"}
    return [
        speaker.say(
            how_often.get(run.reversals, "reversed"),
            name=run.recording_name,
            count=run.reversals,
            level=run.load_level,
        )
        for run in runs
        if run.reversals
    ]


def _stops(speaker: NoteSpeaker, runs: Sequence[Run]) -> list[str]:
    return [
        *(
            speaker.say(
                "stopped",
                name=run.recording_name,
                cause=speaker.stop(run.stop.code, run.stop.message, _motor(run.stop)),
            )
            for run in runs
            if run.stop
        ),
        *(
            speaker.say(outcome, name=run.recording_name)
            for outcome in ("returned", "interrupted")
            for run in runs
            if run.outcome == outcome
        ),
    ]


def _pain(speaker: NoteSpeaker, session: Session) -> list[str]:
    given = [
        speaker.say(f"pain.{when}", pain=pain)
        for when, pain in (
            ("before", session.pain_before),
            ("during", session.pain_during),
            ("after", session.pain_after),
        )
        if pain is not None
    ]
    return [speaker.say("pain", given=speaker.join("and", given))] if given else []


def _settings(speaker: NoteSpeaker, run: Run) -> list[str]:
    words = []
    if run.range_percent != 100:
        words.append(speaker.say("settings.range", percent=run.range_percent))
    if run.speed_percent != 100:
        words.append(speaker.say("settings.speed", percent=run.speed_percent))
    if run.repetitions > 1 and run.pause_s:
        words.append(speaker.say("settings.pause", seconds=run.pause_s))
    if run.method in _TOLD_METHODS:
        words.append(speaker.say(f"settings.{run.method}"))
    return words


def _deg(value: float) -> str:
    return f"{round(value):d}"


def _motor(stop: RunStop) -> int | None:
    return motor_of(stop.message_key.model_dump()) if stop.message_key else None
