"""Which browser a request comes from, and whether it operates the apparatus; what each browser is told of that."""

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Depends, Request

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, by_program
from kata.api.problems import DATABASE_AWAY, refused
from kata.audit.audit_log import AuditLog
from kata.audit.entries import entry
from kata.dependencies import TheStation
from kata.device.messages import COMMAND_NAMES, Refusal
from kata.station.lease import Browser, Due
from kata.station.schemas import Kept, RefusalLive
from kata.station.station import Station


def browser() -> Browser:
    """Where this request comes from: its sign-in. Only for routes that need one."""
    actor = CURRENT_ACTOR.get()
    # Whoever has not signed in comes no further than the door (``api/authorization.py``).
    assert actor is not None
    return Browser(actor.sign_in_id, actor.name)


async def _watching(station: TheStation) -> Browser:
    here = browser()
    station.operating.asked(here)
    return here


async def _operator(station: TheStation) -> Browser:
    here = browser()
    refusal = station.operating.take(here)
    if refusal:
        raise refused(refusal)
    return here


Watching = Annotated[Browser, Depends(_watching)]
"""Whoever asks; it counts as a sign of life."""
Operator = Annotated[Browser, Depends(_operator)]
"""Whoever operates the apparatus, by this request if nobody did; 409 while another does."""


class LiveStateView:
    """The live state as JSON, worked out once for all who listen; what differs from one browser to another is laid over it."""

    def __init__(self, station: Station, kept: Callable[[], Kept], may_load: Callable[[], bool]) -> None:
        """``kept`` tells how it is with the database, ``may_load`` whether something can be loaded without it."""
        self._station = station
        self._kept = kept
        self._may_load = may_load
        self._version: object = None
        self._state: dict[str, Any] = {}

    def state(self, seen_by: Browser) -> dict[str, Any]:
        """What :class:`~kata.station.schemas.Live` says, to that browser."""
        station = self._station
        if station.version != self._version:
            self._version, self._state = station.version, station.live().model_dump(mode="json")
        own: dict[str, Any] = {
            "at": station.clock.now().isoformat().replace("+00:00", "Z"),
            "age_ms": station.age_ms,
            "lease": station.operating.told(seen_by).model_dump(mode="json"),
        }
        elsewhere = station.operating.refusal(seen_by)
        kept = self._kept()
        own["kept"] = kept.model_dump(mode="json")
        if elsewhere:
            own["refusals"] = _all_but_stop(elsewhere)
        elif kept.away_since:
            # What has begun goes on, a session with all that was fetched ahead of it; whatever else would begin has to be found in
            # the database first, and written down there.
            waits = ("teach",) if self._may_load() else ("teach", "load")
            own["refusals"] = dict.fromkeys(waits, _told(DATABASE_AWAY)) | self._state["refusals"]
        return self._state | own


def _all_but_stop(refusal: Refusal) -> dict[str, Any]:
    told = _told(refusal)
    return {name: told for name in COMMAND_NAMES if name != "stop"}


def _told(refusal: Refusal) -> dict[str, Any]:
    return RefusalLive.model_validate(refusal, from_attributes=True).model_dump(mode="json")


def _live_view(request: Request) -> LiveStateView:
    live_view: LiveStateView = request.app.state.live_view
    return live_view


TheLiveView = Annotated[LiveStateView, Depends(_live_view)]


def noting(audit_log: AuditLog, station: str) -> Callable[[Browser, Due], None]:
    """What the station does for want of a browser goes into the audit trail."""

    def note(browser: Browser, due: Due) -> None:
        action = "pause_without_browser" if due == "pause" else "stop_without_browser"
        with by_program(action, station):
            audit_log.tell_at_once(
                entry(action, "done", subject=f"sign_in {browser.id}", detail={"operator": browser.name})
            )

    return note


def taken_over(audit_log: AuditLog, before: Browser) -> None:
    """Written down, with whose it was; in place of the request's own row."""
    audit_log.tell_at_once(entry("take_over", "done", subject=f"sign_in {before.id}", detail={"from": before.name}))
    if context := REQUEST_CONTEXT.get():
        context.told.add("done")
