"""Rules for the end of a session: when it may end, which changes are then refused, and which reason is suggested. Pure functions."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Protocol

from kata.clinic import texts
from kata.clinic.sessions.schemas import EndReason, SessionItem
from kata.errors import ProblemError


class Played(Protocol):
    """The properties of a run on which the end of its session depends."""

    @property
    def outcome(self) -> str:
        """See :data:`kata.clinic.sessions.schemas.RunOutcome`."""

    @property
    def programme_position(self) -> int | None:
        """Position of the run's item in the programme; None if the run was not planned."""


def check_not_ended(ended_at: datetime | None) -> None:
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

    The end of a run comes from its journal, which may be imported after the session was ended at another station.

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
    """Return True if a run was loaded and its end is not in the record."""
    return any(run.outcome == "loaded" for run in played)


def run_not_ended() -> ProblemError:
    """Return the error for a session with a run that has not ended."""
    return ProblemError(409, "run_not_ended", texts.RUN_NOT_ENDED(), texts.END_OR_STOP_FIRST())


def suggested_reason(planned: Sequence[SessionItem], runs: Sequence[Played]) -> EndReason:
    """Return the end reason that the runs suggest."""
    played = [run for run in runs if run.outcome not in ("unloaded", "loaded")]
    completed_positions = {run.programme_position for run in played if run.outcome == "completed"}
    if planned and all(item.position in completed_positions for item in planned):
        return "completed"
    if played and played[-1].outcome in ("stopped", "interrupted"):
        return "stopped"
    if not planned and played and played[-1].outcome == "completed":
        return "completed"
    return "shortened"
