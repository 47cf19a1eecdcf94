"""Record the station's telemetry."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from kata.clinic.events.observer import AlarmsEnded, NewDeviceEvent, Observer
from kata.station.schemas import EventLive
from kata.station.station import Station
from kata.station.subscriptions import Subscription

log = logging.getLogger(__name__)


@asynccontextmanager
async def recording_events(
    station: Station, store: Callable[[NewDeviceEvent | AlarmsEnded], None]
) -> AsyncIterator[None]:
    """Pass the station's events to ``store`` while the context lasts. At its end, pass the last events. ``store`` returns at once."""
    observer = Observer(station.info.name)

    def take(subscription: Subscription) -> None:
        if subscription.overflown:
            log.error("the service was too busy to record all events of the device; some are missing")
            subscription.overflown = False
        for item in observer.observe_state(station.live(), station.occupation):
            store(item)
        while subscription.waiting:
            event = subscription.waiting.popleft()
            if isinstance(event, EventLive):
                for row in observer.observe_event(event):
                    store(row)

    async def listen(subscription: Subscription) -> None:
        while True:
            await subscription.changed.wait()
            subscription.changed.clear()
            try:
                take(subscription)
            except Exception:
                # If recording events fails, the apparatus must remain usable.
                log.exception("device events could not be recorded")

    with station.subscribed() as subscription:
        listening = asyncio.create_task(listen(subscription), name="device events")
        try:
            yield
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
            take(subscription)
