"""The lease of a running station: whose it is by now, and what is done when the browser that holds it is gone."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime

from kata.device.messages import Command, Pause, Refusal, Snapshot, Stop, TorqueState
from kata.station.lease import Browser, Due, Lease, Moment
from kata.station.schemas import LeaseLive

log = logging.getLogger(__name__)


def _now() -> Moment:
    return Moment(time.monotonic(), datetime.now(UTC))


class Operating:
    """Lives in the service's event loop, as its station does."""

    def __init__(
        self,
        command: Callable[[Command], Awaitable[Refusal | None]],
        changed: Callable[[], None],
        on_due: Callable[[Browser, Due], None],
        now: Callable[[], Moment] = _now,
    ) -> None:
        """``command`` asks the device; ``changed`` is called when somebody else operates, or has come or gone; ``on_due`` after
        a pause or stop for want of the browser that operates.
        """
        self._command = command
        self._changed = changed
        self._on_due = on_due
        self._now = now
        self._lease = Lease()
        self._doing: asyncio.Task[None] | None = None

    @property
    def by(self) -> Browser | None:
        """Who operates; None: nobody."""
        return self._lease.holder

    def refusal(self, browser: Browser) -> Refusal | None:
        """Why that browser's commands would be refused, whatever the device says; None when they would not."""
        return self._lease.refusal(browser)

    def take(self, browser: Browser, *, take_over: bool = False) -> Refusal | None:
        """That browser is to operate; refused while another does, unless it takes over."""
        before = self.told(browser)
        refusal = self._lease.take(browser, self._now(), take_over=take_over)
        if self.told(browser) != before:
            self._changed()
        return refusal

    def release(self, browser: Browser, torque: TorqueState) -> Refusal | None:
        """That browser operates no more; refused unless torque is known to be off."""
        refusal = self._lease.release(browser, torque)
        self._changed()
        return refusal

    def told(self, browser: Browser | None) -> LeaseLive:
        """As that browser sees it; None: as nobody in particular does."""
        return self._lease.told(browser, self._now())

    def asked(self, browser: Browser) -> None:
        """That browser has asked for something: it is there."""
        self._lease.asked(browser, self._now())

    @contextmanager
    def listening(self, browser: Browser) -> Iterator[None]:
        """A page of that browser is there for as long as the context lasts."""
        self._lease.came(browser)
        self._changed()
        try:
            yield
        finally:
            self._lease.left(browser, self._now())
            self._changed()

    def look(self, snapshot: Snapshot) -> None:
        """Do what is due for want of the browser that operates; to be called with every snapshot."""
        holder = self._lease.holder
        due = self._lease.due(self._now(), snapshot.mode, snapshot.torque)
        if holder is None or due is None or (self._doing and not self._doing.done()):
            return
        # Both take their time: once is enough, until it turns out that it was not.
        if "pause" in snapshot.refusals if due == "pause" else _ends_with_torque_off(snapshot):
            return
        self._doing = asyncio.create_task(self._do(due, holder), name=f"{due} without a browser")

    async def _do(self, due: Due, holder: Browser) -> None:
        refusal = await self._command(Pause() if due == "pause" else Stop(because="browser_lost"))
        log.warning("%s's browser is gone: %s %s", holder.name, due, refusal.code if refusal else "done")
        if refusal is None:
            if due == "pause":
                self._lease.note_pause()
                self._changed()
            self._on_due(holder, due)


def _ends_with_torque_off(snapshot: Snapshot) -> bool:
    return snapshot.stop is not None and any(cause.category < 2 for cause in snapshot.stop.causes)
