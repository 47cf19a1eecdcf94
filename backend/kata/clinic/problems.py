"""What can be wrong with a request, in the clinic's own words; web/ turns it into a problem document (RFC 9457)."""


class ProblemError(Exception):
    """A request that cannot be fulfilled: HTTP status, stable code, sentence, next step."""

    def __init__(self, status: int, code: str, message: str, next_step: str = "") -> None:
        super().__init__(message)
        self.status = status
        self.code = code
        self.message = message
        self.next_step = next_step


def not_found(what: str) -> ProblemError:
    """404 for a record that is not there."""
    return ProblemError(404, "not_found", f"There is no such {what}.", "Go back to the list; it may have changed.")
