"""Which browser a request comes from, and whether it operates the apparatus; what each browser is told of that."""

import asyncio
import logging
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Depends, Request

from kata.access import audit
from kata.access.actor import ACTING, by_program
from kata.clinic.dependencies import TheStation
from kata.database.engine import Database
from kata.device.messages import COMMAND_NAMES, Refusal
from kata.station.lease import Browser, Due
from kata.station.schemas import RefusalLive
from kata.station.station import Station
from kata.web.problems import refused

log = logging.getLogger(__name__)


def browser() -> Browser:
    """Where this request comes from: its sign-in. Only for routes that need one."""
    actor = ACTING.get()
    # Whoever has not signed in comes no further than the door (``web/access.py``).
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


class Board:
    """The live state as JSON, worked out once for all who listen; what differs from one browser to another is laid over it."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._version: object = None
        self._state: dict[str, Any] = {}

    def state(self, seen_by: Browser) -> dict[str, Any]:
        """What :class:`~kata.station.schemas.Live` says, to that browser."""
        station = self._station
        if station.version != self._version:
            self._version, self._state = station.version, station.live().model_dump(mode="json")
        own: dict[str, Any] = {
            "age_ms": station.age_ms,
            "lease": station.operating.told(seen_by).model_dump(mode="json"),
        }
        elsewhere = station.operating.refusal(seen_by)
        if elsewhere:
            own["refusals"] = _all_but_stop(elsewhere)
        return self._state | own


def _all_but_stop(refusal: Refusal) -> dict[str, Any]:
    told = RefusalLive.model_validate(refusal, from_attributes=True).model_dump(mode="json")
    return {name: told for name in COMMAND_NAMES if name != "stop"}


def _board(request: Request) -> Board:
    board: Board = request.app.state.board
    return board


TheBoard = Annotated[Board, Depends(_board)]


def noting(database: Database, station: str, tasks: set[asyncio.Task[None]]) -> Callable[[Browser, Due], None]:
    """What the station does for want of a browser goes into the audit trail; ``tasks`` has what is not written yet."""

    def write(browser: Browser, due: Due) -> None:
        action = "pause_without_browser" if due == "pause" else "stop_without_browser"
        with by_program(action, station), database.write() as session:
            audit.note(session, action, subject=f"sign_in {browser.id}", detail={"operator": browser.name})

    async def noted(browser: Browser, due: Due) -> None:
        try:
            await asyncio.to_thread(write, browser, due)
        except Exception:
            # The apparatus has done what it had to: that it is not written down changes nothing about that.
            log.exception("%s's browser was lost: what was done about it is not written down", browser.name)

    def note(browser: Browser, due: Due) -> None:
        task = asyncio.create_task(noted(browser, due), name="audit")
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    return note


def taken_over(database: Database, before: Browser) -> None:
    """Written down, with whose it was."""
    with database.write() as session:
        audit.note(session, "take_over", subject=f"sign_in {before.id}", detail={"from": before.name})
