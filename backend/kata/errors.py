"""What can be wrong with a request, in the clinic's own words; api/ turns it into a problem document (RFC 9457)."""

from collections.abc import Mapping, Sequence
from datetime import datetime


class ProblemError(Exception):
    """A request that cannot be fulfilled: HTTP status, stable code, sentence, next step; and each place that is wrong.

    ``headers``: of the answer, as ``Retry-After`` in seconds.
    """

    def __init__(
        self,
        status: int,
        code: str,
        message: str,
        next_step: str = "",
        places: Sequence[tuple[str, str]] = (),
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(message)
        self.status = status
        self.code = code
        self.message = message
        self.next_step = next_step
        self.places = tuple(places)
        self.headers = headers


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
