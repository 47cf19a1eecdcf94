"""The lease of a running station. Pauses or stops the arm when the holder's browser is absent."""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Final

from kata.device.ipc_messages import Command, Pause, Refusal, Snapshot, Stop, TorqueState
from kata.station.lease import AbsenceAction, Browser, ClockReading, Lease, OpenPage
from kata.station.schemas import LeaseLive

_SENT_STATES: Final = 100
"""The times of so many sent states are kept. A page that is further behind is absent."""

log = logging.getLogger(__name__)


def _now() -> ClockReading:
    return ClockReading(time.monotonic(), datetime.now(UTC))


class ListeningPage:
    """A page, the live states that were sent to it, and the newest of them that it has shown."""

    def __init__(self, browser: Browser, page: OpenPage, now: Callable[[], ClockReading]) -> None:
        """Begin without a state."""
        self.browser = browser
        self._page = page
        self._now = now
        self._sent: deque[tuple[int, ClockReading]] = deque(maxlen=_SENT_STATES)

    def note_sent(self, sequence: int) -> None:
        """Note that a message with this number is being sent to the page."""
        self._sent.append((sequence, self._now()))

    def note_shown(self, sequence: int) -> None:
        """Note that the page has shown every message up to this number."""
        while self._sent and self._sent[0][0] <= sequence:
            _, self._page.shown = self._sent.popleft()


class LeaseManager:
    """The lease of one station and its automatic actions. Use this class only in the service's event loop."""

    def __init__(
        self,
        command: Callable[[Command], Awaitable[Refusal | None]],
        changed: Callable[[], None],
        on_absence_action: Callable[[Browser, AbsenceAction], None],
        now: Callable[[], ClockReading] = _now,
    ) -> None:
        """``command`` sends a command to the device. ``changed`` is called when the holder or its presence changes. ``on_absence_action`` is
        called after a pause or stop because the holder's browser is absent.
        """
        self._command = command
        self._changed = changed
        self._on_absence_action = on_absence_action
        self._now = now
        self._lease = Lease()
        self._action: asyncio.Task[None] | None = None

    @property
    def holder(self) -> Browser | None:
        """Return the browser that holds the lease, None if it is free."""
        return self._lease.holder

    def refusal(self, browser: Browser) -> Refusal | None:
        """Return the refusal of the browser's commands by the lease; None if the lease allows them."""
        return self._lease.refusal(browser)

    def take(self, browser: Browser, *, take_over: bool = False) -> Refusal | None:
        """Give the lease to the browser. Refused while another browser holds it, unless this one takes over."""
        before = self.lease_for(browser)
        refusal = self._lease.take(browser, self._now(), take_over=take_over)
        if self.lease_for(browser) != before:
            self._changed()
        return refusal

    def release(self, browser: Browser, torque: TorqueState) -> Refusal | None:
        """Free the lease of the browser. Refused unless torque is known to be off."""
        refusal = self._lease.release(browser, torque)
        self._changed()
        return refusal

    def lease_for(self, browser: Browser | None) -> LeaseLive:
        """Return the lease as ``browser`` sees it. With None, no lease counts as the caller's own."""
        return self._lease.live(browser, self._now())

    def note_request(self, browser: Browser) -> None:
        """Note a request of the browser, which shows that it is present now."""
        self._lease.note_request(browser, self._now())

    def shows(self, browser: Browser) -> bool:
        """Return True if a page of the browser shows the live state. A page whose script hangs does not."""
        return self._lease.shows(browser, self._now())

    @contextmanager
    def listening(self, browser: Browser) -> Iterator[ListeningPage]:
        """During the block a page of the browser listens. The browser is present while the page confirms the states that it shows."""
        page = self._lease.page_opened(browser, self._now())
        self._changed()
        try:
            # The clock is looked up at each call, because tests replace it.
            yield ListeningPage(browser, page, lambda: self._now())
        finally:
            self._lease.page_closed(browser, page, self._now())
            self._changed()

    def act_if_due(self, snapshot: Snapshot) -> None:
        """Pause or stop if this is due because the holder's browser is absent. Call it with every snapshot."""
        holder = self._lease.holder
        action = self._lease.absence_action(self._now(), snapshot.mode, snapshot.torque)
        if self._lease.holder != holder:
            self._changed()
        if holder is None or action is None or (self._action and not self._action.done()):
            return
        # Pause and Stop take time. Send the command once, and again only if it had no effect.
        if "pause" in snapshot.refusals if action == "pause" else _ends_with_torque_off(snapshot):
            return
        self._action = asyncio.create_task(self._act(action, holder), name=f"{action} without a browser")

    async def _act(self, action: AbsenceAction, holder: Browser) -> None:
        refusal = await self._command(Pause() if action == "pause" else Stop(because="browser_lost"))
        log.warning(
            "the operator's browser (login session %s) is disconnected; automatic %s: %s",
            holder.id,
            action,
            refusal.code if refusal else "done",
        )
        if refusal is None:
            if action == "pause":
                self._lease.note_pause()
                self._changed()
            self._on_absence_action(holder, action)


def _ends_with_torque_off(snapshot: Snapshot) -> bool:
    return snapshot.stop is not None and any(cause.category < 2 for cause in snapshot.stop.causes)
