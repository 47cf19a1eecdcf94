"""A listener of the station's telemetry that has everything written down."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from kata.clinic.events.observer import Ended, Happening, Observer
from kata.station.schemas import EventLive
from kata.station.station import Station, Subscription

log = logging.getLogger(__name__)


@asynccontextmanager
async def recording(station: Station, put: Callable[[Happening | Ended], None]) -> AsyncIterator[None]:
    """While the context lasts, what the station tells is put down; at its end, what was told last too. ``put`` returns at once."""
    observer = Observer(station.info.name)

    def take(told: Subscription) -> None:
        if told.overflown:
            log.error("the service was too busy to hear every event of the device; some are not written down")
            told.overflown = False
        for item in observer.look(station.live(), station.occupation):
            put(item)
        while told.waiting:
            event = told.waiting.popleft()
            if isinstance(event, EventLive):
                for happening in observer.hear(event):
                    put(happening)

    async def listen(told: Subscription) -> None:
        while True:
            await told.changed.wait()
            told.changed.clear()
            try:
                take(told)
            except Exception:
                # What is written down about the apparatus must never keep anybody from using it.
                log.exception("what the device told is not written down")

    with station.subscribed() as told:
        listening = asyncio.create_task(listen(told), name="device events")
        try:
            yield
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
            take(told)
