"""Every error as a problem document (RFC 9457): a sentence and a next step, a traceback for nobody."""

import logging
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from kata.clinic.dependencies import Problem, ProblemField
from kata.clinic.problems import ProblemError
from kata.device.messages import Refusal

log = logging.getLogger(__name__)


def refused(refusal: Refusal) -> ProblemError:
    """A command that the apparatus did not accept: 409, or 503 when there is nobody to accept it."""
    status = 503 if refusal.code in ("device_offline", "no_answer") else 409
    return ProblemError(status, refusal.code, refusal.message, refusal.next_step)


def install(app: FastAPI) -> None:
    """Answer every error this way."""

    @app.exception_handler(ProblemError)
    def problem(request: Request, error: ProblemError) -> JSONResponse:
        return document(error.status, error.code, error.message, error.next_step)

    @app.exception_handler(HTTPException)
    def http(request: Request, error: HTTPException) -> JSONResponse:
        code = HTTPStatus(error.status_code).name.lower()
        return document(error.status_code, code, f"{error.detail}.", headers=error.headers)

    @app.exception_handler(RequestValidationError)
    def invalid(request: Request, error: RequestValidationError) -> JSONResponse:
        fields = [ProblemField(pointer=_pointer(one["loc"]), detail=_sentence(one)) for one in error.errors()]
        what = "; ".join(f"{field.pointer.removeprefix('#/')} {field.detail}" for field in fields)
        return document(422, "invalid", f"Please check what was entered: {what}.", errors=fields)

    @app.exception_handler(Exception)
    def unexpected(request: Request, error: Exception) -> JSONResponse:
        log.error("%s %s failed", request.method, request.url.path, exc_info=error)
        return document(
            500, "unexpected", "Something went wrong in the service.", "Try again; if it stays, report it with the log."
        )


def document(
    status: int,
    code: str,
    detail: str,
    next_step: str = "",
    errors: list[ProblemField] | None = None,
    headers: Any = None,
) -> JSONResponse:
    """One problem document."""
    problem = Problem(
        type="about:blank",
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        code=code,
        next_step=next_step,
        errors=errors or [],
    )
    return JSONResponse(problem.model_dump(), status, headers, media_type="application/problem+json")


def _pointer(location: tuple[Any, ...]) -> str:
    where, *rest = location
    path = "/".join(str(part) for part in rest)
    return f"#/{path}" if where == "body" else f"{where}/{path}"


_PLAIN: Final = {"string_too_short": "must not be empty", "missing": "is needed"}


def _sentence(error: Any) -> str:
    if error["type"] in _PLAIN:
        return _PLAIN[error["type"]]
    message = str(error["msg"]).removeprefix("Value error, ")
    return message[0].lower() + message[1:]
