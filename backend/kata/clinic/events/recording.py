"""A listener of the station's telemetry that has everything written down."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from kata.clinic.events.observer import Observer
from kata.clinic.events.writer import EventWriter
from kata.station.schemas import EventLive
from kata.station.station import Station, Subscription

log = logging.getLogger(__name__)


@asynccontextmanager
async def recording(station: Station, writer: EventWriter) -> AsyncIterator[None]:
    """While the context lasts, what the station tells goes to the writer; at its end, what was told last too."""
    observer = Observer(station.info.name)

    def take(told: Subscription) -> None:
        if told.overflown:
            log.error("the service was too busy to hear every event of the device; some are not written down")
            told.overflown = False
        for item in observer.look(station.live(), station.occupation):
            writer.put(item)
        while told.waiting:
            event = told.waiting.popleft()
            if isinstance(event, EventLive):
                for happening in observer.hear(event):
                    writer.put(happening)

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
