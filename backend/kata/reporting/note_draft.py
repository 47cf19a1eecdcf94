"""Draft a short note from the measurements, by pure functions. A therapist reads, edits and signs the note."""

from collections.abc import Sequence
from typing import Final

from kata.clinic.sessions.schemas import MotionTracking, Run, RunStop, Session, SessionItem
from kata.reporting.content import motor_of
from kata.reporting.note_draft_phrases import NotePhrases
from kata.reporting.phrases import Language

_FULL_RANGE_PERCENT: Final = 99.5
_NAMED_METHODS: Final = ("learned", "paper")


def draft(session: Session, language: Language = "en") -> str:
    """Return the sentences that apply, in the order of a session."""
    phrases = NotePhrases(language)
    runs = [run for run in session.runs if run.outcome not in ("loaded", "unloaded") and run.end_feel is None]
    of_treated = [run for run in runs if not _is_other_shoulder(session, run)]
    happened = (
        [
            *(_played(phrases, session, run) for run in runs),
            *_not_played(phrases, session, runs),
            *_reached(phrases, of_treated),
            *_patient_reached(phrases, of_treated),
            *_tracking(phrases, runs),
            *_reduced_range(phrases, runs),
            *_reversals(phrases, runs),
            *_stops(phrases, runs),
        ]
        if runs
        else [phrases.text("nothing_played")]
    )
    return phrases.join(
        "between", [_programme(phrases, session), *_simulated(phrases, session), *happened, *_pain(phrases, session)]
    )


def _programme(phrases: NotePhrases, session: Session) -> str:
    shoulder = phrases.text(f"shoulder.{session.side or ''}")
    if session.programme is None:
        return phrases.text("without_programme", shoulder=shoulder)
    return phrases.text(
        "with_programme", shoulder=shoulder, name=session.programme.name, number=session.programme.number
    )


def _simulated(phrases: NotePhrases, session: Session) -> list[str]:
    return [phrases.text("simulated")] if session.simulated else []


def _is_other_shoulder(session: Session, run: Run) -> bool:
    """True if the recording is of the shoulder that the session does not treat. Its angles do not describe the treated shoulder."""
    return None not in (session.side, run.side) and session.side != run.side


def _played(phrases: NotePhrases, session: Session, run: Run) -> str:
    planned = next(
        (item.repetitions for item in (session.programme.items if session.programme else ()) if _is_of(run, item)),
        run.repetitions,
    )
    done = run.repetitions_done if run.repetitions_done is not None else 0
    if run.outcome == "completed" and run.repetitions_done is None:
        done = run.repetitions
    settings = _settings(phrases, run)
    name = run.recording_name
    if _is_other_shoulder(session, run):
        name = phrases.text(f"other_shoulder.{run.side}", name=name)
    description = phrases.text("with_settings", name=name, settings=phrases.join("and", settings)) if settings else name
    return phrases.text("played_once" if planned == 1 else "played", what=description, done=done, planned=planned)


def _is_of(run: Run, item: SessionItem) -> bool:
    """True if the run played this item. A run of another recording at the item's position did not."""
    return (run.programme_position, run.recording_id) == (item.position, item.recording_id)


def _not_played(phrases: NotePhrases, session: Session, runs: Sequence[Run]) -> list[str]:
    missing = [
        item.recording_name
        for item in (session.programme.items if session.programme else ())
        if not any(_is_of(run, item) for run in runs)
    ]
    return [phrases.text("not_played", names=phrases.join("and", missing))] if missing else []


def _reached(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    """Return, for each motion, the widest range of all runs, including parts with reduced range."""
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
        phrases.text("reached_motion", name=phrases.motion(number, name), low=_deg(low), high=_deg(high))
        for number, (name, low, high) in sorted(reached.items())
    ]
    return [phrases.text("reached", motions=phrases.join("motions_between", words))]


def _patient_reached(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    """Return the estimated patient's angles of each motion: each end from the run in which the apparatus reached furthest to that end."""
    found: dict[int, list[MotionTracking]] = {}
    for motion in (motion for run in runs if run.comparison for motion in run.comparison.motions):
        if motion.patient_max_deg is not None:
            found.setdefault(motion.motion, []).append(motion)
    ends = {
        number: (
            min(motions, key=lambda motion: motion.played_min_deg or 0.0),
            max(motions, key=lambda motion: motion.played_max_deg or 0.0),
        )
        for number, motions in found.items()
    }
    words = [
        phrases.text(
            "patient_reached_motion",
            name=phrases.motion(number, low.name),
            low=_deg(low.patient_min_deg or 0.0),
            low_u=_deg(low.patient_min_uncertainty_deg or 0.0),
            high=_deg(high.patient_max_deg or 0.0),
            high_u=_deg(high.patient_max_uncertainty_deg or 0.0),
        )
        for number, (low, high) in sorted(ends.items())
    ]
    return [phrases.text("patient_reached", motions=phrases.join("motions_between", words))] if words else []


def _tracking(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    # The figures of a partial run do not describe the session.
    motors = [motor for run in runs if run.comparison and not run.partial for motor in run.comparison.motors]
    if not motors:
        return []
    worst = max(motors, key=lambda motor: abs(motor.peak_deg))
    return [phrases.text("tracking", peak=abs(worst.peak_deg), motor=worst.motor, rmse=worst.rmse_deg)]


def _reduced_range(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    return [
        phrases.text("less", name=run.recording_name, percent=run.least_range_percent)
        for run in runs
        if run.least_range_percent is not None and run.least_range_percent < _FULL_RANGE_PERCENT
    ]


def _reversals(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    key_of_count = {1: "reversed_once", 2: "reversed_twice"}
    return [
        phrases.text(
            key_of_count.get(run.reversals, "reversed"),
            name=run.recording_name,
            count=run.reversals,
            level=run.resistance_level,
        )
        for run in runs
        if run.reversals
    ]


def _stops(phrases: NotePhrases, runs: Sequence[Run]) -> list[str]:
    return [
        *(
            phrases.text(
                "stopped",
                name=run.recording_name,
                cause=phrases.stop(run.stop.code, run.stop.message, _motor(run.stop)),
            )
            for run in runs
            if run.stop
        ),
        *(
            phrases.text(outcome, name=run.recording_name)
            for outcome in ("returned", "interrupted")
            for run in runs
            if run.outcome == outcome
        ),
    ]


def _pain(phrases: NotePhrases, session: Session) -> list[str]:
    scores = [
        phrases.text(f"pain.{when}", pain=pain)
        for when, pain in (
            ("before", session.pain_before),
            ("during", session.pain_during),
            ("after", session.pain_after),
        )
        if pain is not None
    ]
    return [phrases.text("pain", given=phrases.join("and", scores))] if scores else []


def _settings(phrases: NotePhrases, run: Run) -> list[str]:
    words = []
    if run.range_percent != 100:
        words.append(phrases.text("settings.range", percent=run.range_percent))
    if run.speed_percent != 100:
        words.append(phrases.text("settings.speed", percent=run.speed_percent))
    if run.repetitions > 1 and run.pause_s:
        words.append(phrases.text("settings.pause", seconds=run.pause_s))
    if run.method in _NAMED_METHODS:
        words.append(phrases.text(f"settings.{run.method}"))
    if run.self_paced:
        words.append(phrases.text("settings.self_paced"))
    return words


def _deg(value: float) -> str:
    return f"{round(value):d}"


def _motor(stop: RunStop) -> int | None:
    return motor_of(stop.message_key.model_dump()) if stop.message_key else None
