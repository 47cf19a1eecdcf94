"""Errors of requests, with a message for the user. ``api/errors.py`` turns them into problem documents (RFC 9457)."""

from collections.abc import Mapping, Sequence
from datetime import datetime

from kata import texts
from kata.messages import NO_TEXT, Template, Text


class ProblemError(Exception):
    """A request cannot be fulfilled.

    :param status: HTTP status.
    :param code: stable code of the kind of problem, for programs. Several messages may have the same code.
    :param message: the problem in one sentence.
    :param next_step: what the user can do.
    :param places: JSON pointer of each invalid field, or a Text that names its place, and the message.
    :param headers: headers of the answer, such as ``Retry-After`` in seconds.
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
        """Return the same problem with another message. The original message becomes the message of the field at ``place``."""
        return ProblemError(self.status, self.code, message, self.next_step, [(place, self.message)])


def not_found(message: Template) -> ProblemError:
    """Return a problem with status 404."""
    return ProblemError(404, "not_found", message(), texts.CHECK_LIST_AGAIN())


def check_version(stored: datetime, seen_version: datetime | None) -> None:
    """Check that a record has not changed since the editor read it.

    :param stored: the record's ``updated_at``.
    :param seen_version: the ``updated_at`` that the editor saw; None skips the check.
    :raises ProblemError: 409 when the record has changed.
    """
    if seen_version and seen_version != stored:
        raise edited_meanwhile()


def edited_meanwhile() -> ProblemError:
    """Return the problem that another user has changed a record in the meantime: status 409."""
    return ProblemError(
        409,
        "edited_meanwhile",
        texts.EDITED_MEANWHILE(),
        texts.RELOAD_AND_CHANGE_AGAIN(),
    )
