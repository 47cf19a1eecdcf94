"""What can be wrong with a request, in the clinic's own words; api/ turns it into a problem document (RFC 9457)."""

from collections.abc import Mapping, Sequence
from datetime import datetime

from kata import texts
from kata.messages import NO_TEXT, Template, Text


class ProblemError(Exception):
    """A request that cannot be fulfilled: HTTP status, stable code of the kind, sentence, next step; and each place that is wrong.

    Several messages may share a ``code``: programs act on it. The page translates by the codes of the two texts.

    ``headers``: of the answer, as ``Retry-After`` in seconds.
    """

    def __init__(
        self,
        status: int,
        code: str,
        message: Text,
        next_step: Text = NO_TEXT,
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

    def at(self, place: str, message: Text) -> "ProblemError":
        """Return the same problem with another message and the place where it is."""
        return ProblemError(self.status, self.code, message, self.next_step, [(place, self.message)])


def not_found(what: Template) -> ProblemError:
    """404 for a record that is not there."""
    return ProblemError(404, "not_found", what(), texts.CHECK_LIST_AGAIN())


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
        texts.EDITED_MEANWHILE(),
        texts.RELOAD_AND_CHANGE_AGAIN(),
    )
