"""Implements the lease: one browser operates the apparatus, others watch. The caller passes the time.

Stop needs no lease. For reasons, and for actions without the holder's browser, see
docs/explanation/decisions/0015-one-browser-holds-the-lease.md.
"""

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final, Literal, NamedTuple
from uuid import UUID

from kata.device.ipc_messages import Mode, Refusal, TorqueState
from kata.station import texts
from kata.station.schemas import LeaseLive

PRESENT_AFTER_SHOWN_S: Final = 1.0
"""A page's script confirms the live states that it shows, about three times a second. The page counts as present for this time after the
service sent the newest confirmed state. A page that hangs confirms nothing, so it is absent after at most this time."""
PAUSE_AFTER_ABSENCE_S: Final = 2.0
"""Longest absence of the holder's browser during playback. A page reloads, and a weak network recovers, within this time."""
STOP_AND_END_LEASE_AFTER_S: Final = 30.0
"""Longest absence of the holder's browser. After it the station stops a motion or a held arm, but completes a return. The lease ends when
torque is known to be off."""
NOT_OPERATING: Final = "not_operating"
"""Code of the refusal of a command from a browser without the lease."""

AbsenceAction = Literal["pause", "stop"]
_NOTHING_TO_STOP: Final[tuple[Mode, ...]] = ("idle", "offline", "returning")
"""Modes in which the holder's absence causes no Stop. A return ends by itself with torque off."""


class ClockReading(NamedTuple):
    """One time, read on the monotonic clock and on the wall clock."""

    s: float
    """Seconds of a monotonic clock."""
    at: datetime
    """UTC."""

    def later(self, s: float) -> "ClockReading":
        """Return the reading ``s`` seconds later."""
        return ClockReading(self.s + s, self.at + timedelta(seconds=s))


@dataclass(frozen=True, slots=True)
class Browser:
    """A browser with a login session."""

    id: UUID
    """Id of the login session. All pages of one browser share it."""
    name: str
    """Name of the user, as other users see it."""


@dataclass(slots=True, eq=False)
class OpenPage:
    """A page that listens to the live state."""

    shown: ClockReading
    """Time at which the newest state that the page has shown was sent; at first the time of its opening."""

    @property
    def present_until(self) -> ClockReading:
        """Return the time until which the page counts as present."""
        return self.shown.later(PRESENT_AFTER_SHOWN_S)


@dataclass(slots=True)
class _Holding:
    browser: Browser
    since: datetime
    taken_from: str | None
    present_until: ClockReading
    """The browser counts as present until this time even if no page of it is open."""
    listened: bool = False
    """True if a page of the browser has listened. A browser that only sends requests is present for a while after each request."""
    paused: bool = False


class Lease:
    """The lease of one apparatus."""

    def __init__(self) -> None:
        self._holding: _Holding | None = None
        self._pages: defaultdict[UUID, list[OpenPage]] = defaultdict(list)
        """The listening pages of each browser."""

    # -- presence ------------------------------------------------------------------------------------------------

    def page_opened(self, browser: Browser, now: ClockReading) -> OpenPage:
        """Note that a page of the browser begins to listen. Return the page."""
        page = OpenPage(now)
        self._pages[browser.id].append(page)
        if holding := self._of(browser):
            holding.listened = True
        return page

    def page_closed(self, browser: Browser, page: OpenPage, now: ClockReading) -> None:
        """Note that a page of the browser has stopped listening."""
        pages = self._pages[browser.id]
        pages.remove(page)
        if not pages:
            del self._pages[browser.id]
        if holding := self._of(browser):
            holding.present_until = max(holding.present_until, min(now, page.present_until))

    def shows(self, browser: Browser, now: ClockReading) -> bool:
        """Return True if a page of the browser shows the live state. A page whose script hangs does not."""
        return any(page.present_until > now for page in self._pages.get(browser.id, ()))

    def note_request(self, browser: Browser, now: ClockReading) -> None:
        """Note a request of the browser, which shows that it is present now."""
        if holding := self._of(browser):
            holding.present_until = max(
                holding.present_until, now if holding.listened else now.later(PAUSE_AFTER_ABSENCE_S)
            )

    # -- the holder ----------------------------------------------------------------------------------------------

    def refusal(self, browser: Browser) -> Refusal | None:
        """Return the refusal of the browser's commands; None if it holds the lease or the lease is free."""
        if self._holding is None or self._of(browser):
            return None
        name = self._holding.browser.name
        return Refusal.of(
            code=NOT_OPERATING,
            message=texts.OPERATED_ELSEWHERE(operator=name),
            next_step=texts.WATCH_OR_TAKE_OVER(operator=name),
        )

    def take(self, browser: Browser, now: ClockReading, *, take_over: bool = False) -> Refusal | None:
        """Give the lease to the browser. Refused while another browser holds it, unless this one takes over."""
        if holding := self._of(browser):
            holding.paused = False
        else:
            refusal = self.refusal(browser)
            if refusal and not take_over:
                return refusal
            taken_from = self._holding.browser.name if self._holding else None
            self._holding = _Holding(browser, now.at, taken_from, now, listened=browser.id in self._pages)
        self.note_request(browser, now)
        return None

    def release(self, browser: Browser, torque: TorqueState) -> Refusal | None:
        """Free the lease of the browser. Refused while the motors move or hold the arm, or may do so."""
        if self._holding is None:
            return None
        refusal = self.refusal(browser)
        if refusal is None and torque == "unknown":
            refusal = Refusal.of(
                code="torque_unknown",
                message=texts.OPERATOR_NEEDED_UNKNOWN(),
                next_step=texts.CHECK_ARM_OR_HAND_OVER(),
            )
        elif refusal is None and torque == "on":
            refusal = Refusal.of(
                code="torque_on",
                message=texts.OPERATOR_NEEDED(),
                next_step=texts.MOVE_BACK_OR_HAND_OVER(),
            )
        if refusal is None:
            self._holding = None
        return refusal

    @property
    def holder(self) -> Browser | None:
        """Return the browser that holds the lease, None if it is free."""
        return self._holding.browser if self._holding else None

    # -- the holder's absence --------------------------------------------------------------------------------------

    def absence_action(self, now: ClockReading, mode: Mode, torque: TorqueState) -> AbsenceAction | None:
        """Return the action that is due because the holder's browser is absent. Call it repeatedly until the action is done.

        Without a holder no action is due, because a motion begins with a lease and the lease is released only without torque. No Stop
        is sent in idle, offline and returning. If the torque is unknown, the lease is kept until it is known to be off.
        """
        absent_s = self._absent_s(now)
        if absent_s < PAUSE_AFTER_ABSENCE_S:
            return None
        if absent_s >= STOP_AND_END_LEASE_AFTER_S and torque == "off":
            self._holding = None
            return None
        if absent_s >= STOP_AND_END_LEASE_AFTER_S and mode not in _NOTHING_TO_STOP:
            return "stop"
        return "pause" if mode == "playing" else None

    def note_pause(self) -> None:
        """Note that the playback was paused because the holder's browser is absent. The page shows this until the holder sends
        a command.
        """
        if self._holding:
            self._holding.paused = True

    def live(self, browser: Browser | None, now: ClockReading) -> LeaseLive:
        """Return the lease as ``browser`` sees it. With None, no lease counts as the caller's own."""
        holding = self._holding
        if holding is None:
            return LeaseLive(holder=None, mine=False, since=None, taken_from=None, unreachable_since=None, paused=False)
        return LeaseLive(
            holder=holding.browser.name,
            mine=browser is not None and holding.browser.id == browser.id,
            since=holding.since,
            taken_from=holding.taken_from,
            unreachable_since=self._present_until(holding).at if self._absent_s(now) > 0 else None,
            paused=holding.paused,
        )

    def _of(self, browser: Browser) -> _Holding | None:
        return self._holding if self._holding and self._holding.browser.id == browser.id else None

    def _present_until(self, holding: _Holding) -> ClockReading:
        pages = self._pages.get(holding.browser.id, ())
        return max([holding.present_until, *(page.present_until for page in pages)])

    def _absent_s(self, now: ClockReading) -> float:
        return max(0.0, now.s - self._present_until(self._holding).s) if self._holding else 0.0
