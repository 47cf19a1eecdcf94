"""What Prometheus reads: how punctual the control loop is, what stopped it, what waits. No names, no patients, no ids.

What is counted here begins anew with the service; what the device counts, with its process. Prometheus knows what to make of that.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector

from kata.errors import ProblemError
from kata.station.schemas import LoopLive
from kata.station.station import Station

router = APIRouter(tags=["health"])

_NO_REFUSAL: Final = "second_factor_needed"
"""Every sign-in with a second factor begins so."""


class Metrics:
    """One service's. What is here counts as it happens; what others know already is asked for when it is read."""

    def __init__(self, station: Station) -> None:
        self.registry = CollectorRegistry()
        self.listeners = Gauge(
            "kata_websocket_clients", "Browsers that listen to the live state.", registry=self.registry
        )
        self.stops = Counter("kata_stops", "Stops, by what caused them.", ["cause"], registry=self.registry)
        self.sign_ins_refused = Counter(
            "kata_sign_ins_refused", "Sign-ins that were refused, and why.", ["why"], registry=self.registry
        )
        self.write_waited_s = Histogram(
            "kata_database_write_wait_seconds",
            "How long what is written has waited for its turn with the database.",
            buckets=(0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0),
            registry=self.registry,
        )
        service = Gauge(
            "kata_service", "1: this version, for this station.", ["version", "station"], registry=self.registry
        )
        service.labels(version("kata"), station.info.name).set(1)
        self.registry.register(_OfDevice(station))
        ProcessCollector(registry=self.registry)

    def ask_for(self, name: str, what: str, now: Callable[[], float]) -> None:
        """A number that somebody else knows, asked for whenever it is read. ``name`` without unit is a count."""
        Gauge(name, what, registry=self.registry).set_function(now)

    @asynccontextmanager
    async def counting_stops(self, station: Station) -> AsyncIterator[None]:
        """While the context lasts, every cause of every stop is counted once."""
        latched: set[tuple[str, int | None]] = set()

        def look() -> None:
            nonlocal latched
            stop = station.live().stop
            causes = {(cause.code, cause.axis) for cause in stop.causes} if stop else set()
            for code, _ in causes - latched:
                self.stops.labels(code).inc()
            latched = causes

        async def listen() -> None:
            while True:
                await told.changed.wait()
                told.changed.clear()
                told.waiting.clear()
                look()

        with station.subscribed() as told:
            listening = asyncio.create_task(listen(), name="stops counted")
            try:
                yield
            finally:
                listening.cancel()
                await asyncio.gather(listening, return_exceptions=True)


class _OfDevice(Collector):
    """What the control loop says of itself in its snapshots."""

    def __init__(self, station: Station) -> None:
        self._station = station

    def describe(self) -> Iterable[Metric]:
        """Nothing: the names are the class's own."""
        return []

    def collect(self) -> Iterable[Metric]:
        """The newest."""
        live = self._station.live()
        yield GaugeMetricFamily(
            "kata_device_running", "1: the device process runs and talks.", value=live.device == "running"
        )
        yield GaugeMetricFamily(
            "kata_device_age_seconds", "Since it last said anything.", value=(live.age_ms or 0) / 1e3
        )
        if live.loop:
            yield from self._of_loop(live.loop)

    @staticmethod
    def _of_loop(loop: LoopLive) -> Iterable[Metric]:
        lateness = GaugeMetricFamily(
            "kata_loop_lateness_seconds",
            "How late cycles have begun since the device process started; quantile 1 is the latest.",
            labels=["quantile"],
        )
        for quantile, late_ms in (
            ("0.5", loop.lateness_p50_ms),
            ("0.99", loop.lateness_p99_ms),
            ("0.999", loop.lateness_p999_ms),
            ("1", loop.lateness_max_ms),
        ):
            lateness.add_metric([quantile], late_ms / 1e3)
        yield lateness
        drives = CounterMetricFamily(
            "kata_drive_errors", "Cycles in which a drive was asked and no sound answer came.", labels=["motor"]
        )
        for motor, errors in enumerate(loop.drive_errors, start=1):
            drives.add_metric([str(motor)], errors)
        yield drives
        yield CounterMetricFamily("kata_loop_cycles", "Cycles of the control loop.", value=loop.cycles)
        yield CounterMetricFamily(
            "kata_loop_overruns", "Cycles missed: the one before ended late.", value=loop.overruns
        )
        yield CounterMetricFamily("kata_bus_errors", "Replies missing or damaged, inputs too.", value=loop.bus_errors)
        yield CounterMetricFamily(
            "kata_telemetry_dropped", "Snapshots that never reached the service.", value=loop.telemetry_dropped
        )
        yield GaugeMetricFamily(
            "kata_loop_real_time", "1: SCHED_FIFO was granted to the control loop.", value=loop.real_time
        )


async def _metrics(request: Request) -> Metrics:
    metrics: Metrics = request.app.state.metrics
    return metrics


TheMetrics = Annotated[Metrics, Depends(_metrics)]


async def refusals_counted(metrics: TheMetrics) -> AsyncIterator[None]:
    """For routes by which one signs in: each refusal of theirs counts."""
    try:
        yield
    except ProblemError as error:
        if error.code != _NO_REFUSAL:
            metrics.sign_ins_refused.labels(error.code).inc()
        raise


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
async def get_metrics(request: Request, metrics: TheMetrics) -> Response:
    """For Prometheus: for technicians and administrators, and for a program that shows the token of ``KATA_METRICS_TOKEN``."""
    encode, media_type = choose_encoder(request.headers.get("accept", ""))
    return Response(encode(metrics.registry), media_type=media_type)
