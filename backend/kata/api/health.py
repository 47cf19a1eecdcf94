"""Routes for monitoring: liveness, readiness and metrics. The health answers need no login and contain no personal data."""

from collections.abc import AsyncIterator
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool
from prometheus_client.exposition import choose_encoder

from kata import __version__
from kata.api import texts
from kata.api.database_probe import DatabaseProbe
from kata.api.metrics import Metrics
from kata.api.services import services_of
from kata.clinic.sessions import service as sessions
from kata.database.availability import DATABASE_UNAVAILABLE
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.errors import ProblemError
from kata.station import texts as station_texts
from kata.types import Schema

router = APIRouter(tags=["health"])

_NOT_COUNTED: Final = "second_factor_needed"
"""Error code that ends the first step of every login with a second factor. It is no refusal."""


class Liveness(Schema):
    """Says that the service answers."""

    status: Literal["alive"] = "alive"


class Readiness(Schema):
    """Says that a session can begin at this station."""

    status: Literal["ready"] = "ready"
    version: str
    database: Literal["sqlite", "postgresql"]


class SafeToStop(Schema):
    """Says that the service may be stopped because no treatment would be interrupted."""

    status: Literal["idle"] = "idle"


async def _probe(request: Request) -> DatabaseProbe:
    return services_of(request).probe


async def _metrics(request: Request) -> Metrics:
    return services_of(request).metrics


TheMetrics = Annotated[Metrics, Depends(_metrics)]


async def count_refused_logins(metrics: TheMetrics) -> AsyncIterator[None]:
    """Count every refusal of a login route."""
    try:
        yield
    except ProblemError as error:
        if error.code != _NOT_COUNTED:
            metrics.sign_ins_refused.labels(error.code).inc()
        raise


@router.get("/health/live", summary="Check that the service is alive")
async def get_health_live() -> Liveness:
    """Answer while the service runs. A supervisor may restart a service that does not answer.

    The answer does not depend on database or apparatus, because a restart would end a running session.
    """
    return Liveness()


@router.get("/health/ready", responses=PROBLEMS.of(503), summary="Check that a session can begin")
async def get_health_ready(
    database: TheDatabase, station: TheStation, probe: Annotated[DatabaseProbe, Depends(_probe)]
) -> Readiness:
    """Answer 200 while database and device process answer, else 503. A running session continues in either case."""
    if not await probe.answers():
        raise ProblemError(503, DATABASE_UNAVAILABLE, texts.DATABASE_UNANSWERED(), texts.WHAT_GOES_ON_CONTINUES())
    if station.live().device != "running":
        raise ProblemError(503, "device_offline", station_texts.DEVICE_OFFLINE(), texts.RESTARTS_AUTOMATICALLY())
    return Readiness(version=__version__, database=database.kind)


@router.get("/health/idle", responses=PROBLEMS.of(503), summary="Check that the service may be stopped")
async def get_health_idle(request: Request, database: TheDatabase, station: TheStation) -> SafeToStop:
    """Answer 200 while torque is off, no commissioning runs and no session is open at this station, else 503.

    ``kata update`` asks this route before it stops the service. If the database does not answer, open sessions are unknown, so the answer
    is 503.
    """
    services = services_of(request)
    if station.occupied or services.commissioning_run.running:
        raise ProblemError(503, "station_occupied", texts.STATION_MOVES(), texts.END_SESSION_FIRST())
    if not await services.probe.answers():
        raise ProblemError(503, DATABASE_UNAVAILABLE, texts.DATABASE_UNANSWERED(), texts.WHAT_GOES_ON_CONTINUES())
    if await run_in_threadpool(_has_open_session, database, station.config.name):
        raise ProblemError(503, "session_open", texts.SESSION_OPEN(), texts.END_SESSION_FIRST())
    return SafeToStop()


def _has_open_session(database: Database, station: str) -> bool:
    with database.read() as session:
        return sessions.has_open(session, station)


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}}},
    summary="Read the metrics in Prometheus format",
)
async def get_metrics(request: Request, metrics: TheMetrics) -> Response:
    """Return all metrics.

    Technicians and administrators may read them, and programs that send the token of ``KATA_METRICS_TOKEN_FILE``.
    """
    encode, media_type = choose_encoder(request.headers.get("accept", ""))
    return Response(encode(metrics.registry), media_type=media_type)
