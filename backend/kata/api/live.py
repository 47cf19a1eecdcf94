"""The WebSocket: a snapshot first, then changes, ten times a second whether anything changed or not. It takes one thing: Stop."""

import asyncio
import time
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID

from fastapi import APIRouter, FastAPI, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kata.actor import CURRENT_ACTOR
from kata.api.operating import LiveStateView, browser
from kata.api.redaction import View
from kata.api.sockets import until_gone
from kata.clinic.importer import Saved
from kata.database.base import utc_now
from kata.device.messages import EstopState, Mode, Refusal, Stop
from kata.station.lease import Browser
from kata.station.schemas import EventLive, Live, RefusalLive, StationInfo
from kata.station.station import Station, Subscription

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


class StopAnswerMessage(_LiveMessage):
    """What came of a Stop that was asked for on this connection."""

    kind: Literal["stop_answer"] = "stop_answer"
    number: int = Field(description="Of the Stop that it answers.")
    refusal: RefusalLive | None = Field(description="Null: the device has confirmed it.")


class StopMessage(BaseModel):
    """The one thing that a page sends here: it waits for no handshake, as a request over a new connection may have to."""

    model_config = ConfigDict(extra="forbid")

    kind: Literal["stop"] = "stop"
    number: int = Field(ge=1, le=2**53, description="The page's own; comes back with the answer.")


@dataclass(frozen=True)
class _StopAnswer:
    number: int
    refusal: Refusal | None


def document(app: FastAPI) -> None:
    """Put the messages into the OpenAPI document: WebSockets have no place of their own there."""

    @app.webhooks.post("live", tags=["station"])
    def live(message: SnapshotMessage | ChangeMessage | EventMessage | SavedMessage | StopAnswerMessage) -> None:
        """What the service sends on the WebSocket /api/live."""

    @app.webhooks.post("live_stop", tags=["station"])
    def live_stop(message: StopMessage) -> None:
        """What a page may send on the WebSocket /api/live: the same as POST /api/station/stop. Anything else is left unread."""


@router.websocket("/api/live")
async def live(socket: WebSocket) -> None:
    """Tell one listener, until it leaves."""
    station: Station = socket.app.state.station
    live_view: LiveStateView = socket.app.state.live_view
    here = browser()
    actor = CURRENT_ACTOR.get()
    # The rule of this route lets nobody through who has not signed in.
    assert actor is not None
    view = View(actor, socket.app.state.database, socket.app.state.offline_cache)
    await socket.accept()
    with station.operating.listening(here), station.subscribed() as subscription:
        await until_gone(
            socket,
            actor,
            _listen(socket, station, subscription),
            _tell(socket, station.info, live_view, here, subscription, view),
        )


async def _listen(socket: WebSocket, station: Station, subscription: Subscription) -> None:
    """Until it has gone. A Stop goes to the device at once, while listening goes on; nobody's leaving takes it back."""
    stopping: set[asyncio.Task[None]] = set()
    while (message := await socket.receive())["type"] != "websocket.disconnect":
        try:
            asked = StopMessage.model_validate_json(message.get("text") or b"")
        except ValidationError:
            continue
        task = asyncio.create_task(_stop(station, subscription, asked.number), name="stop")
        stopping.add(task)
        task.add_done_callback(stopping.discard)


async def _stop(station: Station, subscription: Subscription, number: int) -> None:
    """Every account that may listen may also stop (``auth/permissions.py``)."""
    subscription.put(_StopAnswer(number, await station.command(Stop())))


async def _tell(
    socket: WebSocket,
    info: StationInfo,
    live_view: LiveStateView,
    here: Browser,
    subscription: Subscription,
    view: View,
) -> None:
    """Changes are merged while a slow listener keeps us waiting; events never are."""
    told: dict[str, Any] = {}
    sequence = 0
    try:
        while not subscription.overflown:
            subscription.changed.clear()
            state = await view.of(live_view.state(here))
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
            async with asyncio.timeout(left):
                await subscription.changed.wait()
        except TimeoutError:
            return
        subscription.changed.clear()


def _notice(item: object, common: dict[str, Any]) -> str:
    if isinstance(item, EventLive):
        return EventMessage(**common, event=item).model_dump_json()
    if isinstance(item, _StopAnswer):
        refusal = item.refusal and RefusalLive.model_validate(item.refusal, from_attributes=True)
        return StopAnswerMessage(**common, number=item.number, refusal=refusal).model_dump_json()
    assert isinstance(item, Saved)
    saved = SavedMessage(**common, what=item.what, id=item.id, patient_id=item.patient_id, session_id=item.session_id)
    return saved.model_dump_json()
