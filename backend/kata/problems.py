"""What can be wrong with a request, in the clinic's own words; web/ turns it into a problem document (RFC 9457)."""

from collections.abc import Sequence


class ProblemError(Exception):
    """A request that cannot be fulfilled: HTTP status, stable code, sentence, next step; and each place that is wrong."""

    def __init__(
        self, status: int, code: str, message: str, next_step: str = "", places: Sequence[tuple[str, str]] = ()
    ) -> None:
        super().__init__(message)
        self.status = status
        self.code = code
        self.message = message
        self.next_step = next_step
        self.places = tuple(places)
