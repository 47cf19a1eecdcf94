"""Limits on the body of a request: little before the user is authorized, and a large file only on a route that takes one."""

from typing import Any, Final

from fastapi import Request
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope

from kata.api import authorization, texts
from kata.auth.permissions import RULES

ANONYMOUS_BODY: Final = 1 << 16
"""Bytes that are read before the user is authorized, and of a request to a public route: more than any login needs."""
LARGEST_BODY: Final = 1 << 20
"""Bytes of a request in JSON: a hundred times the longest note."""
LARGEST_FILE: Final = 1 << 26
"""Bytes of a file: an hour's motion as CSV, a FHIR bundle."""
_FILES: Final = ("text/csv", "application/fhir+json")


def limited_body(scope: Scope, receive: Receive) -> Receive:
    """Count the bytes of a body while they arrive.

    The returned function raises HTTPException (413) when the body is too long for its route, and ProblemError (401, 403 or 423) when a
    long body comes from a user who may not use the route. FastAPI reads a body before it authorizes.
    """
    received = 0
    authorized = False

    async def counted() -> Message:
        nonlocal received, authorized
        message = await receive()
        received += len(message.get("body", b""))
        if received > ANONYMOUS_BODY:
            # The router has found the route by now: nothing before it reads the body.
            if received > (limit := _limit(scope.get("route"))):
                raise HTTPException(413, texts.TOO_MUCH_SENT(limit=limit))
            if not authorized:
                await authorization.allowed_first(Request(scope))
                authorized = True
        return message

    return counted


def _limit(route: Any) -> int:
    """Return the largest body of a route in bytes."""
    if not isinstance(route, APIRoute) or RULES[route.name].needs == "public":
        return ANONYMOUS_BODY
    media_type = getattr(route.body_field.field_info, "media_type", "") if route.body_field else ""
    return LARGEST_FILE if media_type in _FILES else LARGEST_BODY
