"""What is wrong with requests for records of any kind."""

from datetime import datetime

from kata.problems import ProblemError

__all__ = ["ProblemError", "check_version", "edited_meanwhile", "not_found"]


def not_found(what: str) -> ProblemError:
    """404 for a record that is not there."""
    return ProblemError(404, "not_found", f"There is no such {what}.", "Go back to the list; it may have changed.")


def check_version(stored: datetime, seen: datetime | None) -> None:
    """Whoever changes a record says which version was seen: its ``updated_at``.

    :raises ProblemError: 409 when somebody else has changed it since.
    """
    if seen and seen != stored:
        raise edited_meanwhile()


def edited_meanwhile() -> ProblemError:
    """409 for who was not the first to change a record."""
    return ProblemError(
        409,
        "edited_meanwhile",
        "Somebody else has changed this record in the meantime.",
        "Reload it, and make your change again.",
    )
