"""A listener of the station's telemetry that has everything written down."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from kata.clinic.events.observer import AlarmsEnded, NewDeviceEvent, Observer
from kata.station.schemas import EventLive
from kata.station.station import Station, Subscription

log = logging.getLogger(__name__)


@asynccontextmanager
async def recording(station: Station, put: Callable[[NewDeviceEvent | AlarmsEnded], None]) -> AsyncIterator[None]:
    """While the context lasts, what the station tells is put down; at its end, what was told last too. ``put`` returns at once."""
    observer = Observer(station.info.name)

    def take(subscription: Subscription) -> None:
        if subscription.overflown:
            log.error("the service was too busy to hear every event of the device; some are not written down")
            subscription.overflown = False
        for item in observer.observe_state(station.live(), station.occupation):
            put(item)
        while subscription.waiting:
            event = subscription.waiting.popleft()
            if isinstance(event, EventLive):
                for happening in observer.observe_event(event):
                    put(happening)

    async def listen(subscription: Subscription) -> None:
        while True:
            await subscription.changed.wait()
            subscription.changed.clear()
            try:
                take(subscription)
            except Exception:
                # What is written down about the apparatus must never keep anybody from using it.
                log.exception("what the device told is not written down")

    with station.subscribed() as subscription:
        listening = asyncio.create_task(listen(subscription), name="device events")
        try:
            yield
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
            take(subscription)
