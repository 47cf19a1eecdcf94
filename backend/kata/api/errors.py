"""Answer every error with a problem document (RFC 9457): a sentence and a next step, without a traceback."""

import asyncio
import logging
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from kata import i18n
from kata.actor import REQUEST_CONTEXT
from kata.api import authorization, texts
from kata.database import availability
from kata.dependencies import Problem, ProblemField
from kata.device.ipc_messages import Refusal
from kata.errors import ProblemError
from kata.messages import NO_TEXT, Text, with_key
from kata.station.schemas import TextKey

log = logging.getLogger(__name__)

_RETRY_AFTER_S: Final = 5
REFUSED_AFTER_S: Final = 1.0
"""Delay of an answer with status 429. A program that guesses passwords waits for the answer; without the delay, its next guess would
slow down the Stops of all users.
"""
_MAX_FIELDS: Final = 50
"""Maximum number of invalid fields that an answer names. Describing thousands would block the event loop for seconds."""
_STATUS_TEXTS: Final = {404: texts.PATH_NOT_FOUND(), 405: texts.METHOD_NOT_ALLOWED()}
"""Messages for Starlette's own errors, by status."""


def refused(refusal: Refusal) -> ProblemError:
    """Return the problem of a command that the device refused: 409, or 503 if no device process answers."""
    status = 503 if refusal.code in ("device_offline", "no_answer") else 409
    return ProblemError(
        status,
        refusal.code,
        with_key(refusal.message, refusal.message_key),
        with_key(refusal.next_step, refusal.next_step_key),
    )


def install(app: FastAPI) -> None:
    """Install the error handlers."""

    @app.exception_handler(ProblemError)
    async def problem(request: Request, error: ProblemError) -> JSONResponse:
        if error.status == HTTPStatus.TOO_MANY_REQUESTS:
            await asyncio.sleep(REFUSED_AFTER_S)
        places = [
            ProblemField(
                pointer=pointer,
                field=pointer.removeprefix("#/").replace("_", " ") if pointer.startswith("#/") else pointer,
                detail=message,
                field_key=TextKey.of(pointer),
                detail_key=TextKey.of(message),
            )
            for pointer, message in error.places
        ]
        return document(error.status, error.code, error.message, error.next_step, places, error.headers)

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> JSONResponse:
        if isinstance(error.__cause__, ProblemError):
            # FastAPI turns a problem that occurs while it reads the body into a 400.
            return await problem(request, error.__cause__)
        if error.status_code == HTTPStatus.BAD_REQUEST:
            if refusal := await _authorization_error(request):
                return await problem(request, refusal)
            # FastAPI answers 400 to a body that it cannot decode as text. The API documents invalid bodies as 422.
            return document(422, "invalid", texts.NOT_JSON())
        # Python 3.13 renamed this status.
        code = "content_too_large" if error.status_code == 413 else HTTPStatus(error.status_code).name.lower()
        if isinstance(error.detail, Text):
            detail = error.detail
        else:
            detail = _STATUS_TEXTS.get(error.status_code) or with_key(f"{error.detail}.", None)
        return document(error.status_code, code, detail, headers=error.headers)

    @app.exception_handler(RequestValidationError)
    async def invalid(request: Request, error: RequestValidationError) -> JSONResponse:
        if refusal := await _authorization_error(request):
            return await problem(request, refusal)
        invalid_fields = [_invalid_field(detail, error.body) for detail in error.errors()[:_MAX_FIELDS]]
        problems = [texts.FIELD_PROBLEM(field=field, problem=problem) for _, field, problem in invalid_fields]
        fields = [_field(*invalid_field) for invalid_field in invalid_fields]
        return document(422, "invalid", texts.INVALID_INPUT(fields=problems), errors=fields)

    @app.exception_handler(availability.DatabaseUnavailableError)
    async def unavailable(request: Request, error: availability.DatabaseUnavailableError) -> JSONResponse:
        return document(
            503,
            availability.DATABASE_UNAVAILABLE,
            texts.DATABASE_UNAVAILABLE(),
            texts.TRY_AGAIN_STOP_WORKS(),
            headers={"retry-after": str(_RETRY_AFTER_S)},
        )

    @app.exception_handler(Exception)
    def unexpected(request: Request, error: Exception) -> JSONResponse:
        log.error("%s %s failed", request.method, request.url.path, exc_info=error)
        return document(500, "unexpected", texts.INTERNAL_ERROR(), texts.REPORT_WITH_LOG())


async def _authorization_error(request: Request) -> ProblemError | None:
    try:
        await authorization.authorize_before_validation(request)
    except ProblemError as error:
        return error
    return None


def document(
    status: int,
    code: str,
    detail: Text,
    next_step: Text = NO_TEXT,
    errors: list[ProblemField] | None = None,
    headers: Any = None,
) -> JSONResponse:
    """Return a problem document, and store its code for the audit trail."""
    if context := REQUEST_CONTEXT.get():
        context.why = code
    problem = Problem(
        type="about:blank",
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        code=code,
        next_step=next_step,
        detail_key=TextKey.of(detail),
        next_step_key=TextKey.of(next_step),
        errors=errors or [],
    )
    return JSONResponse(problem.model_dump(), status, headers, media_type="application/problem+json")


def _invalid_field(error: Any, body: Any) -> tuple[str, Text, Text]:
    """Return the pointer to a field, the field's name and the problem."""
    source, *path = error["loc"]
    if source == "body":
        # For invalid JSON, the location is the position of a character instead of a field.
        path = [] if error["type"] == "json_invalid" else _path(path, body)
    problem = i18n.sentence(error["type"], str(error["msg"]), error.get("ctx", {}))
    pointer = "/".join(str(part) for part in path)
    return f"#/{pointer}" if source == "body" else f"{source}/{pointer}", i18n.name(path), problem


def _field(pointer: str, field: Text, detail: Text) -> ProblemField:
    return ProblemField(
        pointer=pointer, field=field, field_key=TextKey.of(field), detail=detail, detail_key=TextKey.of(detail)
    )


def _path(location: list[Any], body: Any) -> list[str | int]:
    path = []
    for place, part in enumerate(location, start=1):
        exists = part in body if isinstance(body, dict) else isinstance(body, list) and part in range(len(body))
        # Pydantic's location also contains the variant of a union, which is not in the body. The last part may be a missing field.
        if exists or place == len(location):
            path.append(part)
        if exists:
            body = body[part]
    return path
