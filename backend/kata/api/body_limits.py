"""Limits on the body of a request: small before the user is authorized; large only for routes that take a file."""

from typing import Final

from fastapi import Request
from fastapi.routing import APIRoute
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope

from kata.api import authorization, texts
from kata.auth.permissions import ROUTE_RULES

ANONYMOUS_BODY: Final = 1 << 16
"""Maximum number of bytes read before the user is authorized, and in a request to a public route. This is more than any login needs."""
LARGEST_BODY: Final = 1 << 20
"""Maximum number of bytes of a request in JSON: a hundred times the longest note."""
LARGEST_FILE: Final = 1 << 26
"""Maximum number of bytes of a file, such as an hour's motion as CSV or a FHIR bundle."""
MOST_PARTS: Final = 20_000
"""Maximum number of commas and opening brackets in a JSON request. Their number is an upper bound of the number of values. Parsing and
checking values blocks the event loop.
"""
_OPENING: Final = (b",", b"[", b"{")


def limited_body(scope: Scope, receive: Receive) -> Receive:
    """Count the bytes of a body while they arrive.

    The returned function raises HTTPException (413) when the body is too long for its route, and ProblemError (401, 403 or 423) when a
    long body comes from a user who may not use the route. FastAPI reads a body before it authorizes.
    """
    received = parts = 0
    authorized = False

    async def counted() -> Message:
        nonlocal received, parts, authorized
        message = await receive()
        chunk = message.get("body", b"")
        received += len(chunk)
        parts += sum(map(chunk.count, _OPENING))
        if parts > MOST_PARTS and not _is_file(scope):
            raise HTTPException(413, texts.TOO_MANY_PARTS(limit=MOST_PARTS))
        if received > ANONYMOUS_BODY:
            # The router has found the route by now, because nothing before the router reads the body.
            if received > (limit := _limit(scope)):
                raise HTTPException(413, texts.TOO_MUCH_SENT(limit=limit))
            if not authorized:
                await authorization.authorize_before_validation(Request(scope))
                authorized = True
        return message

    return counted


def _limit(scope: Scope) -> int:
    """Return the largest allowed body of this request in bytes."""
    route = scope.get("route")
    if not isinstance(route, APIRoute) or ROUTE_RULES[route.name].needs == "public":
        return ANONYMOUS_BODY
    return LARGEST_FILE if _is_file(scope) else LARGEST_BODY


def _is_file(scope: Scope) -> bool:
    """Return whether the body is a file of the type that its route takes. FastAPI would parse a CSV file that is sent as JSON."""
    route = scope.get("route")
    file = ROUTE_RULES[route.name].upload_media_type if isinstance(route, APIRoute) else ""
    sent = Headers(scope=scope).get("content-type", "").partition(";")[0].strip().lower()
    return bool(file) and (sent == file or "json" not in sent)
