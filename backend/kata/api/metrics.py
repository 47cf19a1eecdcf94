"""Metrics for Prometheus: punctuality of the control loop, causes of stops, queued records. They contain no names and no ids.

Counters of the service start at 0 when the service starts, counters of the device when the device process starts. Prometheus handles such
resets.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from kata import __version__
from kata.station.schemas import LoopLive
from kata.station.station import Station


class Metrics:
    """The metrics of one service. The counters here count events; :meth:`add_gauge` registers values that other objects hold."""

    def __init__(self, station: Station) -> None:
        self.registry = CollectorRegistry()
        self.listeners = Gauge(
            "kata_websocket_clients", "Browsers that receive the live state.", registry=self.registry
        )
        self.stops = Counter("kata_stops", "Stops, by cause.", ["cause"], registry=self.registry)
        self.sign_ins_refused = Counter(
            "kata_sign_ins_refused", "Refused logins, by reason.", ["why"], registry=self.registry
        )
        self.write_waited_s = Histogram(
            "kata_database_write_wait_seconds",
            "Seconds that a write waited for the database's write lock.",
            buckets=(0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0),
            registry=self.registry,
        )
        service = Gauge(
            "kata_service", "1: this version, for this station.", ["version", "station"], registry=self.registry
        )
        service.labels(__version__, station.info.name).set(1)
        self.registry.register(_DeviceCollector(station))
        ProcessCollector(registry=self.registry)

    def add_gauge(self, name: str, description: str, read_value: Callable[[], float]) -> None:
        """Register a gauge whose value ``read_value`` returns at each scrape. A ``name`` that contains no unit is a count."""
        Gauge(name, description, registry=self.registry).set_function(read_value)

    @asynccontextmanager
    async def counting_stops(self, station: Station) -> AsyncIterator[None]:
        """While the context lasts, count each cause of each stop once."""
        latched: set[tuple[str, int | None]] = set()

        def count_new_causes() -> None:
            nonlocal latched
            stop = station.live().stop
            causes = {(cause.code, cause.axis) for cause in stop.causes} if stop else set()
            for code, _ in causes - latched:
                self.stops.labels(code).inc()
            latched = causes

        async def count_changes() -> None:
            while True:
                await subscription.changed.wait()
                subscription.changed.clear()
                subscription.waiting.clear()
                count_new_causes()

        with station.subscribed() as subscription:
            listening = asyncio.create_task(count_changes(), name="stops counted")
            try:
                yield
            finally:
                listening.cancel()
                await asyncio.gather(listening, return_exceptions=True)


class _DeviceCollector(Collector):
    """Returns figures of the control loop from the newest snapshot."""

    def __init__(self, station: Station) -> None:
        self._station = station

    def describe(self) -> Iterable[Metric]:
        """Return nothing, because no other collector uses these names."""
        return []

    def collect(self) -> Iterable[Metric]:
        """Yield the metrics of the newest snapshot."""
        live = self._station.live()
        yield GaugeMetricFamily(
            "kata_device_running", "1: the device process runs and sends snapshots.", value=live.device == "running"
        )
        yield GaugeMetricFamily(
            "kata_device_age_seconds", "Seconds since the newest snapshot.", value=(live.age_ms or 0) / 1e3
        )
        if live.loop:
            yield from self._loop_metrics(live.loop)

    @staticmethod
    def _loop_metrics(loop: LoopLive) -> Iterable[Metric]:
        lateness = GaugeMetricFamily(
            "kata_loop_lateness_seconds",
            "Delay of cycle starts since the device process started; quantile 1 is the maximum.",
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
            "kata_drive_errors", "Cycles in which a drive gave no valid answer.", labels=["motor"]
        )
        for motor, errors in enumerate(loop.drive_errors, start=1):
            drives.add_metric([str(motor)], errors)
        yield drives
        yield CounterMetricFamily("kata_loop_cycles", "Cycles of the control loop.", value=loop.cycles)
        yield CounterMetricFamily(
            "kata_loop_overruns", "Cycles skipped because the previous one ended late.", value=loop.overruns
        )
        yield CounterMetricFamily(
            "kata_bus_errors", "Missing or corrupt replies of drives and inputs.", value=loop.bus_errors
        )
        yield CounterMetricFamily(
            "kata_telemetry_dropped", "Snapshots that never reached the service.", value=loop.telemetry_dropped
        )
        yield GaugeMetricFamily(
            "kata_loop_real_time", "1: the control loop runs with SCHED_FIFO.", value=loop.real_time
        )
