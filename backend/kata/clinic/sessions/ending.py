"""Rules of a session's end: when it may end, which changes are refused afterwards, and the suggested reason. Pure functions."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Protocol

from kata.clinic import texts
from kata.clinic.sessions.schemas import EndReason, SessionItem
from kata.errors import ProblemError


class Played(Protocol):
    """A run, as far as the end of its session depends on it."""

    @property
    def outcome(self) -> str:
        """See :data:`kata.clinic.sessions.schemas.Outcome`."""

    @property
    def programme_position(self) -> int | None:
        """Position of its item in the programme."""


def check_goes_on(ended_at: datetime | None) -> None:
    """Check that a session has not ended.

    :raises ProblemError: 409.
    """
    if ended_at:
        raise ProblemError(409, "session_ended", texts.SESSION_ENDED(), texts.BEGIN_NEW_SESSION())


def check_played(played: Iterable[Played]) -> None:
    """Check that every run of a session has ended.

    :raises ProblemError: 409.
    """
    if _has_unfinished(played):
        raise run_not_ended()


def check_results(played: Iterable[Played]) -> None:
    """Check that the result of every playback of an ended session is in the record.

    A run's end comes from its journal, which may be imported after the session has been ended elsewhere.

    :raises ProblemError: 409.
    """
    if _has_unfinished(played):
        raise ProblemError(
            409,
            "run_not_arrived",
            texts.RUN_NOT_ARRIVED(),
            texts.SIGN_AGAIN_SOON(),
        )


def _has_unfinished(played: Iterable[Played]) -> bool:
    """True if a run was loaded and its end is not in the record."""
    return any(run.outcome == "loaded" for run in played)


def run_not_ended() -> ProblemError:
    """Return the error for a session with a run that has not ended."""
    return ProblemError(409, "run_not_ended", texts.RUN_NOT_ENDED(), texts.END_OR_STOP_FIRST())


def suggested_reason(planned: Sequence[SessionItem], runs: Sequence[Played]) -> EndReason:
    """Return the suggested end reason, derived from the runs."""
    played = [run for run in runs if run.outcome not in ("unloaded", "loaded")]
    whole = {run.programme_position for run in played if run.outcome == "completed"}
    if planned and all(item.position in whole for item in planned):
        return "completed"
    if played and played[-1].outcome in ("stopped", "interrupted"):
        return "stopped"
    if not planned and played and played[-1].outcome == "completed":
        return "completed"
    return "shortened"
