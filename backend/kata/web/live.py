"""The WebSocket: a snapshot first, then changes, ten times a second whether anything changed or not."""

import asyncio
import logging
import time
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID

from fastapi import APIRouter, FastAPI, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, Field

from kata.access.actor import ACTING
from kata.clinic.importer import Saved
from kata.database.base import utc_now
from kata.device.messages import EstopState, Mode
from kata.station.lease import Browser
from kata.station.schemas import EventLive, Live, StationInfo
from kata.station.station import Station, Subscription
from kata.web.operating import Board, browser
from kata.web.signing import Endings
from kata.web.view import View

log = logging.getLogger(__name__)
router = APIRouter()

_PERIOD_S: Final = 0.1
PING_S: Final = 0.5
PONG_S: Final = 1.0
"""A listener that is asked every half second, and has not answered for so long, has gone: the lease's grace begins then."""


class _LiveMessage(BaseModel):
    sequence: int = Field(ge=1, description="Without gaps on one connection; a gap means: connect again.")
    sent_at: datetime = Field(description="UTC, by the service's clock.")
    estop: EstopState
    mode: Mode


class SnapshotMessage(_LiveMessage):
    """The first message on every connection: everything."""

    kind: Literal["snapshot"] = "snapshot"
    station: StationInfo
    live: Live


class ChangeMessage(_LiveMessage):
    """Ten times a second: the top-level fields of Live that have changed since the last message, perhaps none."""

    kind: Literal["change"] = "change"
    live: dict[str, Any] = Field(description="A part of Live.")


class EventMessage(_LiveMessage):
    """Something that happened; none is left out."""

    kind: Literal["event"] = "event"
    event: EventLive


class SavedMessage(_LiveMessage):
    """A teaching's take or a run has reached the database."""

    kind: Literal["saved"] = "saved"
    what: Literal["recording", "run"]
    id: UUID
    patient_id: UUID
    session_id: UUID | None


def document(app: FastAPI) -> None:
    """Put the messages into the OpenAPI document: WebSockets have no place of their own there."""

    @app.webhooks.post("live", tags=["station"])
    def live(message: SnapshotMessage | ChangeMessage | EventMessage | SavedMessage) -> None:
        """What the service sends on the WebSocket /api/live. It expects nothing back."""


@router.websocket("/api/live")
async def live(socket: WebSocket) -> None:
    """Tell one listener, until it leaves."""
    station: Station = socket.app.state.station
    board: Board = socket.app.state.board
    here = browser()
    actor = ACTING.get()
    # The rule of this route lets nobody through who has not signed in.
    assert actor is not None
    view = View(actor, socket.app.state.database)
    await socket.accept()
    # Listening finds out that the other end has gone, even while nothing can be sent.
    listening = asyncio.create_task(_listen(socket))
    endings: Endings = socket.app.state.access.endings
    ending = asyncio.create_task(endings.of(actor.sign_in_id))
    try:
        listeners = socket.app.state.metrics.listeners
        with station.operating.listening(here), station.subscribed() as subscription, listeners.track_inprogress():
            telling = asyncio.create_task(_tell(socket, station.info, board, here, subscription, view))
            first, pending = await asyncio.wait({listening, telling, ending}, return_when=asyncio.FIRST_COMPLETED)
            for task in pending:
                task.cancel()
            if pending:
                # Not gather: it would swallow what we ourselves are cancelled by.
                await asyncio.wait(pending)
            if not telling.cancelled() and (error := telling.exception()):
                log.error("a listener could not be told any more", exc_info=error)
            if ending in first and listening not in first:
                await socket.close(1008, "signed out")
    finally:
        listening.cancel()
        ending.cancel()


async def _listen(socket: WebSocket) -> None:
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


async def _tell(
    socket: WebSocket, info: StationInfo, board: Board, here: Browser, subscription: Subscription, view: View
) -> None:
    """Changes are merged while a slow listener keeps us waiting; events never are."""
    told: dict[str, Any] = {}
    sequence = 0
    try:
        while not subscription.overflown:
            subscription.changed.clear()
            state = await view.of(board.state(here))
            sequence += 1
            common: dict[str, Any] = {
                "sequence": sequence,
                "sent_at": utc_now(),
                "estop": state["estop"],
                "mode": state["mode"],
            }
            if sequence == 1:
                message: _LiveMessage = SnapshotMessage(**common, station=info, live=Live.model_validate(state))
            else:
                changed = {name: value for name, value in state.items() if told.get(name) != value}
                message = ChangeMessage(**common, live=changed)
            told = state
            await socket.send_text(message.model_dump_json())
            while subscription.waiting:
                item = subscription.waiting.popleft()
                if isinstance(item, Saved) and not await view.may_hear_of(item.patient_id):
                    continue
                sequence += 1
                await socket.send_text(_notice(item, common | {"sequence": sequence}))
            await _until_next(subscription)
        await socket.close(1013, "too far behind: connect again")
    except WebSocketDisconnect:
        return


async def _until_next(subscription: Subscription) -> None:
    """A tenth of a second; less when something happened that is not just another sample."""
    until = time.monotonic() + _PERIOD_S
    while (left := until - time.monotonic()) > 0 and not subscription.waiting:
        try:
            await asyncio.wait_for(subscription.changed.wait(), left)
        except TimeoutError:
            return
        subscription.changed.clear()


def _notice(item: object, common: dict[str, Any]) -> str:
    if isinstance(item, EventLive):
        return EventMessage(**common, event=item).model_dump_json()
    assert isinstance(item, Saved)
    saved = SavedMessage(**common, what=item.what, id=item.id, patient_id=item.patient_id, session_id=item.session_id)
    return saved.model_dump_json()
