"""The lease: one person at one browser operates the apparatus, others watch. Pure: it is told the time.

Stop needs no lease. Why it is so, and what is done without the holder's browser: docs/explanation/decisions/0015-one-browser-holds-the-lease.md.
"""

from collections import Counter
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final, Literal, NamedTuple
from uuid import UUID

from kata.device.messages import Mode, Refusal, TorqueState
from kata.station import texts
from kata.station.schemas import LeaseLive

GRACE_S: Final = 2.0
"""A page is loaded anew, and a weak network comes back, within this time."""
GIVEN_UP_S: Final = 30.0
"""Nobody comes back to that browser any more: the arm is no longer held, and the apparatus is free."""
NOT_OPERATING: Final = "not_operating"
"""Code of the refusal of whoever does not hold the lease."""

Due = Literal["pause", "stop"]
_NOTHING_TO_STOP: Final[tuple[Mode, ...]] = ("idle", "offline", "returning")
"""Returning ends by itself with torque off, where the arm came from."""


class Moment(NamedTuple):
    """A time by the clock that never jumps, and the one that people read."""

    s: float
    """Seconds of a monotonic clock."""
    at: datetime
    """UTC."""

    def later(self, s: float) -> "Moment":
        """So many seconds after it."""
        return Moment(self.s + s, self.at + timedelta(seconds=s))


@dataclass(frozen=True, slots=True)
class Browser:
    """Where somebody is signed in."""

    id: UUID
    """The sign-in's: the pages of one browser are one."""
    name: str
    """Of the person, as others are shown it."""


@dataclass(slots=True)
class _Held:
    browser: Browser
    since: datetime
    taken_from: str | None
    seen: Moment
    """The last sign of life. While it has a page open that listens, it needs none."""
    listened: bool = False
    """It has had such a page: without one, it is not there. One that only ever asks is, for a while after each request."""
    paused: bool = False


class Lease:
    """Who operates one apparatus."""

    def __init__(self) -> None:
        self._held: _Held | None = None
        self._listening: Counter[UUID] = Counter()

    # -- who is there ---------------------------------------------------------------------------------------------

    def came(self, browser: Browser) -> None:
        """A page of that browser begins to listen."""
        self._listening[browser.id] += 1
        if held := self._of(browser):
            held.listened = True

    def left(self, browser: Browser, now: Moment) -> None:
        """A page of that browser listens no more."""
        self._listening[browser.id] -= 1
        if self._listening[browser.id] <= 0:
            del self._listening[browser.id]
            if held := self._of(browser):
                held.seen = max(held.seen, now)

    def asked(self, browser: Browser, now: Moment) -> None:
        """That browser has asked for something: it is there, at this moment."""
        if held := self._of(browser):
            held.seen = max(held.seen, now if held.listened else now.later(GRACE_S))

    # -- who operates ---------------------------------------------------------------------------------------------

    def refusal(self, browser: Browser) -> Refusal | None:
        """Why that browser may not command; None when it holds the lease, or nobody does."""
        if self._held is None or self._of(browser):
            return None
        name = self._held.browser.name
        return Refusal.of(
            code=NOT_OPERATING,
            message=texts.OPERATED_ELSEWHERE(operator=name),
            next_step=texts.WATCH_OR_TAKE_OVER(operator=name),
        )

    def take(self, browser: Browser, now: Moment, *, take_over: bool = False) -> Refusal | None:
        """From now on that browser operates; from another who holds it, only by taking over."""
        if held := self._of(browser):
            held.paused = False
        else:
            refusal = self.refusal(browser)
            if refusal and not take_over:
                return refusal
            taken_from = self._held.browser.name if self._held else None
            self._held = _Held(browser, now.at, taken_from, now, listened=self._listening[browser.id] > 0)
        self.asked(browser, now)
        return None

    def release(self, browser: Browser, torque: TorqueState) -> Refusal | None:
        """That browser operates no more; refused while the motors move or hold the arm, or may do so."""
        if self._held is None:
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
            self._held = None
        return refusal

    @property
    def holder(self) -> Browser | None:
        """Who operates."""
        return self._held.browser if self._held else None

    # -- without its browser --------------------------------------------------------------------------------------

    def due(self, now: Moment, mode: Mode, torque: TorqueState) -> Due | None:
        """What has to be done for want of the holder's browser; asked again and again until it is done.

        Of a lease that nobody holds nothing is: a motion begins with a lease, and it is given back only without torque. In idle and
        offline a Stop changes nothing: with unknown torque the lease waits there until it is known.
        """
        away_s = self._away_s(now)
        if away_s < GRACE_S:
            return None
        if away_s >= GIVEN_UP_S and torque == "off":
            self._held = None
            return None
        if away_s >= GIVEN_UP_S and mode not in _NOTHING_TO_STOP:
            return "stop"
        return "pause" if mode == "playing" else None

    def note_pause(self) -> None:
        """The playback has been paused for want of the holder's browser; told until the holder commands again."""
        if self._held:
            self._held.paused = True

    def told(self, browser: Browser | None, now: Moment) -> LeaseLive:
        """As one browser sees it; None: as nobody in particular does."""
        held = self._held
        if held is None:
            return LeaseLive(holder=None, mine=False, since=None, taken_from=None, unreachable_since=None, paused=False)
        return LeaseLive(
            holder=held.browser.name,
            mine=browser is not None and held.browser.id == browser.id,
            since=held.since,
            taken_from=held.taken_from,
            unreachable_since=held.seen.at if self._away_s(now) > 0 else None,
            paused=held.paused,
        )

    def _of(self, browser: Browser) -> _Held | None:
        return self._held if self._held and self._held.browser.id == browser.id else None

    def _away_s(self, now: Moment) -> float:
        held = self._held
        if held is None or self._listening[held.browser.id] > 0:
            return 0.0
        return max(0.0, now.s - held.seen.s)
