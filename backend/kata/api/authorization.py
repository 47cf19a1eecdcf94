"""Authorize every request before its route: identify the user, check the role's permission, and check access to the record.

One dependency serves HTTP and WebSockets. The ids in path, query and body lead to a patient (``clinic/restricted/objects.py``), so one
check covers pages, PDFs, exports and commands.
"""

import asyncio
import json
import logging
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from fastapi import FastAPI, Request, WebSocketException
from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute, APIWebSocketRoute, iter_route_contexts
from sqlalchemy.exc import SQLAlchemyError
from starlette.requests import HTTPConnection

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, Actor, RequestContext
from kata.api import texts
from kata.api.services import Services, services_of
from kata.auth import access_tokens, login_session, secrets
from kata.auth.login import address_of, authenticate, cookie_of
from kata.auth.permissions import (
    COMMAND_PERMISSIONS,
    ROLE_PERMISSIONS,
    ROUTE_RULES,
    TOKEN_PERMISSIONS,
    UNAUDITED_READ_PERMISSIONS,
    RouteRule,
    audit_action,
)
from kata.auth.throttle import ADDRESS_POLICY
from kata.clinic.restricted import service as restricted
from kata.clinic.restricted.objects import PATIENT_QUERY_BY_ID_NAME, patients_of
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError

log = logging.getLogger(__name__)

ACTIVE: Final = "x-kata-active"
"""Header by which a page reports user activity in a request that only reads."""
_AUTHORIZED: Final = "authorized"
"""Name of the field in a connection's state that is True once the connection has been authorized."""
_READ_METHODS: Final = ("GET", "HEAD")
_CACHED_ACTOR_AFTER_S: Final = 0.5
"""Seconds. If the database has not answered within this time, a cached user is used, so that Pause does not take longer."""
_SPOOL_ARRIVAL_LIMIT_S: Final = 20.0
"""Seconds that a request waits after an outage for spooled records of the objects that it names."""
_MIN_TOKEN_CHARACTERS: Final = 20
"""Shortest accepted token: 20 characters have at least 100 random bits."""


async def authorize(connection: HTTPConnection) -> None:
    """Authorize a request or WebSocket, and set CURRENT_ACTOR and REQUEST_CONTEXT.

    :raises ProblemError: 401, 403 or 423. For a WebSocket, WebSocketException is raised instead.
    """
    try:
        await _authorize(connection, await _body(connection))
    except ProblemError as error:
        if connection.scope["type"] == "websocket":
            raise WebSocketException(1008, error.code) from error
        raise
    except DatabaseUnavailableError as error:
        if connection.scope["type"] == "websocket":
            raise WebSocketException(1013, "database_away") from error
        raise


async def authorize_before_validation(request: Request) -> None:
    """Authorize before validation errors are reported. This runs earlier than :func:`authorize`, because FastAPI parses the body first.

    :raises ProblemError: 401, 403 or 423.
    """
    if not getattr(request.state, _AUTHORIZED, False) and "route" in request.scope:
        await _authorize(request, None)


def check_rules(app: FastAPI) -> None:
    """Check that every route has a rule, and that FastAPI authorizes every route that is not public.

    :raises LookupError: when a rule or the authorization is missing.
    """
    for route in iter_route_contexts(app.routes):
        rule = ROUTE_RULES.get(route.name or "")
        if rule is None:
            raise LookupError(f"the route {route.name} has no rule: give it one in auth/permissions.py")
        if rule.needs != "public" and not isinstance(route.original_route, APIRoute | APIWebSocketRoute):
            raise LookupError(f"the route {route.name} is not FastAPI's, so it would not be authorized")


def document(described: dict[str, Any]) -> None:
    """Add the refusals by authorization to the operations of an OpenAPI document."""
    for operations in described["paths"].values():
        for operation in operations.values():
            rule = ROUTE_RULES[operation["operationId"]]
            if rule.needs != "public":
                statuses = (401, 403, 429, 503) if rule.allowed_while_locked else (401, 403, 423, 429, 503)
                for status, answer in PROBLEMS.of(*statuses).items():
                    operation["responses"].setdefault(str(status), answer)


async def _authorize(connection: HTTPConnection, body: Any) -> None:
    setattr(connection.state, _AUTHORIZED, True)
    route = connection.scope["route"].name
    rule = ROUTE_RULES[route]
    context = RequestContext(
        audit_action(route),
        address=address_of(connection),
        audits_views=rule.needs not in UNAUDITED_READ_PERMISSIONS,
        is_command=rule.needs in COMMAND_PERMISSIONS,
    )
    CURRENT_ACTOR.set(None)
    REQUEST_CONTEXT.set(context)
    if rule.needs == "public":
        return
    if rule.accepts_metrics_token and await run_in_threadpool(_has_metrics_token, connection):
        return
    services = services_of(connection)
    context.station = services.station_name
    records = list(_named_records(connection, body))
    context.subject = " ".join(
        f"{name.removesuffix('_id')} {record_id}" for name, record_id in records if name != "patient_id"
    )
    cookie, auth_cache = cookie_of(connection) or "", services.auth_cache
    token = _access_token(connection)
    actor = auth_cache.cached_actor_for_stop(cookie) if rule.needs == "stop" and not token else None
    if token:
        actor = await run_in_threadpool(_read_token_owner, services, token, context.address)
    elif actor is None:
        actor = await _read_actor(connection, rule, cookie)
    CURRENT_ACTOR.set(actor)
    if actor.by_token:
        check_only_reads(connection.scope.get("method"), rule)
    check_user(actor, rule, context.station, records)
    if records:
        await run_in_threadpool(_wait_for_arrival, services, records)
        try:
            await run_in_threadpool(_check_records, services, actor, rule, context, records)
        except DatabaseUnavailableError:
            patient_id = services.offline_cache.owner_of(records) if rule.allowed_without_database else None
            if patient_id is None:
                raise
            context.patient_id = patient_id
    is_activity = (
        actor.by_token or connection.scope.get("method", "GET") not in _READ_METHODS or ACTIVE in connection.headers
    )
    if is_activity and rule.needs != "stop" and auth_cache.should_store_activity(token or cookie):
        task = asyncio.create_task(
            run_in_threadpool(_record_activity, services.database, actor, services.auth.now()), name="record activity"
        )
        auth_cache.activity_writes.add(task)
        task.add_done_callback(auth_cache.activity_writes.discard)


def _log_late_error(query: asyncio.Future[Actor | None]) -> None:
    # The start of the outage is already in the log.
    if not query.cancelled() and (error := query.exception()) and not isinstance(error, DatabaseUnavailableError):
        log.info("the user could not be read from the database: %s", error)


async def _read_actor(connection: HTTPConnection, rule: RouteRule, cookie: str) -> Actor:
    """Return the user of the cookie from the database, or from the cache if the database does not answer and the rule allows that.

    :raises ProblemError: 401.
    :raises DatabaseUnavailableError: when the database does not answer and the cache cannot be used.
    """
    services = services_of(connection)
    auth_cache = services.auth_cache
    cached = (
        auth_cache.cached_actor(cookie, services.auth.limits.longest.total_seconds())
        if rule.allowed_without_database
        else None
    )
    query = asyncio.ensure_future(run_in_threadpool(authenticate, connection, services.database))
    # Commands of a running session do not wait until the outage is detected.
    await asyncio.wait({query}, timeout=_CACHED_ACTOR_AFTER_S if cached else None)
    try:
        actor = query.result()
    except (DatabaseUnavailableError, asyncio.InvalidStateError):
        if cached is None:
            raise
        query.add_done_callback(_log_late_error)
        # The actor is not cached again, because only the database can confirm the login session.
        return cached
    if actor is None:
        auth_cache.forget(cookie)
        raise ProblemError(401, "not_signed_in", texts.NOT_SIGNED_IN(), texts.SIGN_IN_FIRST())
    auth_cache.put(cookie, actor)
    return actor


def _bearer_token(connection: HTTPConnection) -> str:
    """Return the bearer token of the request, or an empty text."""
    scheme, _, sent = connection.headers.get("authorization", "").partition(" ")
    return sent.strip() if scheme.lower() == "bearer" else ""


def _access_token(connection: HTTPConnection) -> str:
    """Return the access token of the request, or an empty text. A browser sends no token; its cookie is then used."""
    token = _bearer_token(connection)
    return token if token.startswith(access_tokens.PREFIX) else ""


def _read_token_owner(services: Services, token: str, address: str) -> Actor:
    """Return the owner of an access token. An address that sends many invented tokens must wait before it may try again.

    :raises ProblemError: 401; 429 after too many attempts.
    """
    throttle, key = services.auth.throttle, f"token {address}"
    throttle.check(key)
    with services.database.read() as session:
        actor = access_tokens.find_actor(session, token, services.auth.now())
    if actor is None:
        throttle.begin((key, ADDRESS_POLICY))
        raise ProblemError(401, "token_unknown", texts.TOKEN_UNKNOWN(), texts.COPY_WHOLE_TOKEN())
    return actor


def check_only_reads(method: str | None, rule: RouteRule) -> None:
    """Check that a request with an access token can only read. A WebSocket has no HTTP method, so it is refused.

    :raises ProblemError: 403.
    """
    if method not in _READ_METHODS or rule.needs not in TOKEN_PERMISSIONS:
        raise ProblemError(403, "token_only_reads", texts.TOKEN_ONLY_READS(), texts.SIGN_IN_AT_THE_PAGE())


def _has_metrics_token(connection: HTTPConnection) -> bool:
    """Return whether the request carries the token of the file. The file is read each time, so a new token needs no restart."""
    file = services_of(connection).settings.metrics_token_file
    token_sent = _bearer_token(connection)
    if file is None or not token_sent:
        return False
    try:
        token = file.read_text().strip()
    except (OSError, UnicodeDecodeError) as error:
        log.error("the token file of /metrics cannot be read: %s", error)
        return False
    # A short token, such as that of an empty file, is invalid.
    return len(token) >= _MIN_TOKEN_CHARACTERS and secrets.matches(token_sent, secrets.hash_secret(token))


def _record_activity(database: Database, actor: Actor, now: datetime) -> None:
    try:
        with database.write() as session:
            if actor.by_token:
                access_tokens.record_use(session, actor.login_session_id, now)
            else:
                login_session.record_activity(session, actor, now)
    except DatabaseUnavailableError:
        # The start of the outage is already in the log.
        return
    except SQLAlchemyError as error:
        log.warning("user activity could not be stored: %s", error)


def check_user(actor: Actor, rule: RouteRule, station: str, records: Sequence[tuple[str, UUID]] = ()) -> None:
    """Check that the user has the rule's permission at this station and may open every restricted record in ``records``.

    :raises ProblemError: 403 or 423.
    """
    if actor.locked and not rule.allowed_while_locked:
        raise ProblemError(423, "locked", texts.SCREEN_LOCKED(), texts.GIVE_PASSWORD_STOP_WORKS())
    if actor.enrolling and not rule.allowed_while_enrolling:
        raise ProblemError(403, "second_factor_needed", texts.SECOND_FACTOR_MISSING(), texts.SET_UP_SECOND_FACTOR())

    granted = ROLE_PERMISSIONS[actor.role]
    # Without permission to read records, no route may name one.
    if rule.needs not in granted or (records and "read_records" not in granted):
        raise ProblemError(403, "not_allowed", texts.ROLE_NOT_ALLOWED(), texts.ASK_PERMITTED_PERSON())
    if rule.own_station_only and actor.stations and station not in actor.stations:
        raise ProblemError(
            403,
            "other_station",
            texts.OTHER_STATION(),
            texts.USE_OWN_STATION(),
        )


def _wait_for_arrival(services: Services, records: list[tuple[str, UUID]]) -> None:
    """Wait for spooled records of the named objects, so that the route finds them in the database.

    :raises DatabaseUnavailableError: when the database answers but the records have not arrived within the limit.
    """
    database = services.database
    if database.unavailable_since is not None or not services.offline_cache.is_pending(records):
        return
    if not services.event_spool.until_taken(_SPOOL_ARRIVAL_LIMIT_S) and database.unavailable_since is None:
        raise DatabaseUnavailableError(utc_now())


def _check_records(
    services: Services, actor: Actor, rule: RouteRule, context: RequestContext, records: list[tuple[str, UUID]]
) -> None:
    with services.database.read() as session:
        patients = patients_of(session, records)
        context.patient_id = patients[0] if patients else None
        if not rule.allowed_for_restricted and not restricted.may_see(session, actor, patients):
            raise ProblemError(
                403,
                "restricted",
                texts.RECORD_RESTRICTED(),
                texts.OPEN_IN_EMERGENCY(),
            )
    if context.patient_id and not rule.allowed_for_restricted and not actor.by_token:
        services.offline_cache.note_opened(context.patient_id)


def _named_records(connection: HTTPConnection, body: Any) -> Iterator[tuple[str, UUID]]:
    """Yield every record that the request names, each once."""
    fields = [*connection.path_params.items(), *connection.query_params.multi_items(), *_fields(body)]
    yielded = set()
    for name, value in fields:
        if name not in PATIENT_QUERY_BY_ID_NAME:
            continue
        try:
            record = name, UUID(str(value))
        except ValueError:
            # The route reports the invalid id.
            continue
        if record not in yielded:
            yielded.add(record)
            yield record


def _fields(body: Any) -> Iterator[tuple[str, Any]]:
    """Yield every field of a body, at any depth."""
    unvisited = [body]
    while unvisited:
        value = unvisited.pop()
        if isinstance(value, dict):
            yield from value.items()
            unvisited += value.values()
        elif isinstance(value, list):
            unvisited += value


async def _body(connection: HTTPConnection) -> Any:
    """Return the JSON body, also for content types that FastAPI would not parse. Starlette keeps the bytes for the route.

    Return None for an uploaded file: it names no record, and parsing it would block the event loop.
    """
    if not isinstance(connection, Request) or ROUTE_RULES[connection.scope["route"].name].upload_media_type:
        return None
    if "json" not in connection.headers.get("content-type", "").lower():
        return None
    try:
        return json.loads(await connection.body() or b"null")
    except (ValueError, RecursionError):
        return None
