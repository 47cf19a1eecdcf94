"""What can be wrong with a request, in the clinic's own words; web/ turns it into a problem document (RFC 9457)."""

from collections.abc import Mapping, Sequence


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
