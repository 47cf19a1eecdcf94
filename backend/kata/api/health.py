"""Routes for monitoring: liveness, readiness and metrics. The health answers need no login and contain no personal data."""

from collections.abc import AsyncIterator
from importlib.metadata import version
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client.exposition import choose_encoder

from kata.api import texts
from kata.api.metrics import Metrics
from kata.api.probe import Probe
from kata.api.services import services_of
from kata.database.availability import DATABASE_UNAVAILABLE
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.errors import ProblemError
from kata.station import texts as station_texts
from kata.types import Schema

router = APIRouter(tags=["health"])

_NO_REFUSAL: Final = "second_factor_needed"
"""The first step of every login with a second factor ends with this code."""


class Alive(Schema):
    """The service answers."""

    status: Literal["alive"] = "alive"


class Ready(Schema):
    """A session can begin at this station."""

    status: Literal["ready"] = "ready"
    version: str
    database: Literal["sqlite", "postgresql"]


async def _probe(request: Request) -> Probe:
    return services_of(request).probe


async def _metrics(request: Request) -> Metrics:
    return services_of(request).metrics


TheMetrics = Annotated[Metrics, Depends(_metrics)]


async def count_refused_logins(metrics: TheMetrics) -> AsyncIterator[None]:
    """Count every refusal of a login route."""
    try:
        yield
    except ProblemError as error:
        if error.code != _NO_REFUSAL:
            metrics.sign_ins_refused.labels(error.code).inc()
        raise


@router.get("/health/live", summary="Check that the service is alive")
async def get_health_live() -> Alive:
    """Answer while the service runs. A supervisor may restart a service that does not answer.

    The answer does not depend on database or apparatus: a restart would end a running session.
    """
    return Alive()


@router.get("/health/ready", responses=PROBLEMS.of(503), summary="Check that a session can begin")
async def get_health_ready(
    database: TheDatabase, station: TheStation, probe: Annotated[Probe, Depends(_probe)]
) -> Ready:
    """Answer 200 while database and device process answer, else 503. A running session continues in both cases."""
    if not await probe.answers():
        raise ProblemError(503, DATABASE_UNAVAILABLE, texts.DATABASE_UNANSWERED(), texts.WHAT_GOES_ON_CONTINUES())
    if station.live().device != "running":
        raise ProblemError(503, "device_offline", station_texts.DEVICE_OFFLINE(), texts.RESTARTS_AUTOMATICALLY())
    return Ready(version=version("kata"), database="sqlite" if database.file else "postgresql")


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
