"""What a session's end could be called, by what happened in it. Pure."""

from collections.abc import Sequence
from typing import Protocol

from kata.clinic.sessions.schemas import EndReason, SessionItem


class Played(Protocol):
    """What a run's end says about the session's."""

    @property
    def outcome(self) -> str:
        """As :data:`kata.clinic.sessions.schemas.Outcome`."""

    @property
    def programme_position(self) -> int | None:
        """Which item it was."""


def suggested_reason(planned: Sequence[SessionItem], runs: Sequence[Played]) -> EndReason:
    """What the session's end could be called, by what happened."""
    played = [run for run in runs if run.outcome not in ("unloaded", "loaded")]
    whole = {run.programme_position for run in played if run.outcome == "completed"}
    if planned and all(item.position in whole for item in planned):
        return "completed"
    if played and played[-1].outcome in ("stopped", "interrupted"):
        return "stopped"
    if not planned and played and played[-1].outcome == "completed":
        return "completed"
    return "shortened"
