"""The live WebSocket. It sends a snapshot first, then changes ten times a second, or five times while the apparatus is at rest, even if
nothing changed. It accepts two messages: Stop, and the confirmation that the page has shown a state.
"""

import asyncio
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID

from fastapi import APIRouter, FastAPI, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from kata.actor import CURRENT_ACTOR, Actor
from kata.api.lease_dependencies import browser
from kata.api.live_serializer import LiveStateSerializer
from kata.api.redaction import Redaction
from kata.api.services import Services, services_of
from kata.api.sockets import accepted, received, serve_until_gone
from kata.api.stopping import StopQueue, stop_by_user
from kata.clinic.importer import Saved
from kata.database.base import utc_now
from kata.device.ipc_messages import EstopState, Mode, Refusal
from kata.station.lease_manager import ListeningPage
from kata.station.schemas import EventLive, Live, RefusalLive, StationInfo
from kata.station.subscriptions import Subscription

router = APIRouter()

_PERIOD_S: Final = 0.1
_PERIOD_AT_REST_S: Final = 0.2
"""Longest time between two messages at rest. It stays far below a second, after which a page that has confirmed no new state is absent."""
_SHOWN_DEG: Final = 0.1
"""The page shows angles in tenths of a degree."""
PING_S: Final = 0.5
PONG_S: Final = 1.0
"""Longest time without an answer to a ping, which is sent every half second. Then the connection is closed."""


class _LiveMessage(BaseModel):
    sequence: int = Field(ge=1, description="Without gaps on one connection; after a gap the client must reconnect.")
    sent_at: datetime = Field(description="UTC, by the service's clock.")
    estop: EstopState
    mode: Mode


class SnapshotMessage(_LiveMessage):
    """The first message on every connection. It contains the complete state."""

    kind: Literal["snapshot"] = "snapshot"
    station: StationInfo
    live: Live


class ChangeMessage(_LiveMessage):
    """The top-level fields of Live that have changed since the last message, perhaps none. Sent ten times a second. While the apparatus is
    idle and no angle changes: five times a second, and at once when anything but a measured value changes.
    """

    kind: Literal["change"] = "change"
    live: dict[str, Any] = Field(description="A part of Live.")


class EventMessage(_LiveMessage):
    """An event of the apparatus. Every event is sent."""

    kind: Literal["event"] = "event"
    event: EventLive


class SavedMessage(_LiveMessage):
    """A recording or a run has been saved in the database."""

    kind: Literal["saved"] = "saved"
    what: Literal["recording", "run"]
    id: UUID
    patient_id: UUID
    session_id: UUID | None


class StopAnswerMessage(_LiveMessage):
    """The answer to a Stop that this connection sent."""

    kind: Literal["stop_answer"] = "stop_answer"
    number: int = Field(description="Number of the answered Stop.")
    refusal: RefusalLive | None = Field(description="Null: the device has confirmed the Stop.")


class ShownMessage(BaseModel):
    """The page's script has shown a state. The lease depends on these messages, because the browser itself answers a ping, even if the
    script hangs.
    """

    model_config = ConfigDict(extra="forbid")

    kind: Literal["shown"] = "shown"
    sequence: int = Field(ge=1, le=2**53, description="Number of the newest message that the page has shown.")


class StopMessage(BaseModel):
    """A Stop. It needs no handshake, unlike a request over a new connection."""

    model_config = ConfigDict(extra="forbid")

    kind: Literal["stop"] = "stop"
    number: int = Field(ge=1, le=2**53, description="Chosen by the page; the answer repeats it.")


@dataclass(frozen=True)
class _StopAnswer:
    number: int
    refusal: Refusal | None


def document(app: FastAPI) -> None:
    """Add the messages to the OpenAPI document as webhooks, because OpenAPI does not describe WebSockets."""

    @app.webhooks.post("live", tags=["station"])
    def live(message: SnapshotMessage | ChangeMessage | EventMessage | SavedMessage | StopAnswerMessage) -> None:
        """Sent by the service on the WebSocket /api/live."""

    @app.webhooks.post("live_stop", tags=["station"])
    def live_stop(message: StopMessage) -> None:
        """Sent by a page on the WebSocket /api/live, with the effect of POST /api/station/stop. Unknown messages are ignored."""

    @app.webhooks.post("live_shown", tags=["station"])
    def live_shown(message: ShownMessage) -> None:
        """Sent by a page on the WebSocket /api/live at least twice a second, after it has shown a state. Without it the browser counts as
        absent.
        """


@router.websocket("/api/live")
async def live(socket: WebSocket) -> None:
    """Send the live state to one listener until it disconnects."""
    services = services_of(socket)
    station = services.station
    actor = CURRENT_ACTOR.get()
    # The rule of this route requires a login.
    assert actor is not None
    redaction = Redaction(actor, services.database, services.offline_cache)
    if not await accepted(socket, actor):
        return
    with station.lease_manager.listening(browser()) as page, station.subscribed() as subscription:
        await serve_until_gone(
            socket,
            actor,
            _receive(socket, actor, services, subscription, page),
            _send(socket, station.info, services.live_serializer, page, subscription, redaction),
        )


_FROM_PAGE: Final = TypeAdapter[StopMessage | ShownMessage](StopMessage | ShownMessage)


async def _receive(
    socket: WebSocket, actor: Actor, services: Services, subscription: Subscription, page: ListeningPage
) -> None:
    """Receive until the listener disconnects. A Stop goes to the device at once and stays in force after a disconnection."""

    def answer(number: int, refusal: Refusal | None) -> None:
        subscription.put(_StopAnswer(number, refusal))

    stops = StopQueue(lambda: stop_by_user(services), answer)
    async for text in received(socket, actor):
        try:
            message = _FROM_PAGE.validate_json(text)
        except ValidationError:
            continue
        if isinstance(message, StopMessage):
            stops.put(message.number)
        else:
            page.note_shown(message.sequence)


async def _send(
    socket: WebSocket,
    info: StationInfo,
    live_serializer: LiveStateSerializer,
    page: ListeningPage,
    subscription: Subscription,
    redaction: Redaction,
) -> None:
    """Send messages. For a slow listener, changes are merged; events never are."""
    last: dict[str, Any] = {}
    sequence = 0
    try:
        while not subscription.overflown:
            # A change from now on may be missing in this message.
            subscription.changed.clear()
            state = await redaction.apply(live_serializer.state(page.browser))
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
                changed = {name: value for name, value in state.items() if last.get(name) != value}
                message = ChangeMessage(**common, live=changed)
            last, at_rest = state, _is_at_rest(last, state)
            page.note_sent(sequence)
            await socket.send_text(message.model_dump_json())
            while subscription.waiting:
                item = subscription.waiting.popleft()
                if isinstance(item, Saved) and not await redaction.may_be_notified_of(item.patient_id):
                    continue
                sequence += 1
                await socket.send_text(_encode(item, common | {"sequence": sequence}))
            await _until_next(subscription, at_rest=at_rest)
        await socket.close(1013, "too far behind: connect again")
    except WebSocketDisconnect:
        return


def _is_at_rest(last: dict[str, Any], state: dict[str, Any]) -> bool:
    """Return True if the apparatus is idle and shows the same angles as in the last message."""
    if not state["mode"] == last.get("mode") == "idle":
        return False
    angles = (
        (now["measured_deg"], then["measured_deg"]) for now, then in zip(state["axes"], last["axes"], strict=True)
    )
    return all(now == then or (None not in (now, then) and abs(now - then) < _SHOWN_DEG) for now, then in angles)


async def _until_next(subscription: Subscription, *, at_rest: bool) -> None:
    """Wait a tenth of a second, or until an event or a notice is waiting. At rest, wait two tenths, or until the state changes."""
    # Every item before this moment has been sent.
    subscription.item_arrived.clear()
    wake_up, period_s = (subscription.changed, _PERIOD_AT_REST_S) if at_rest else (subscription.item_arrived, _PERIOD_S)
    # A timeout would cancel the wait ten times a second, which takes longer than a timer that ends it.
    timer = asyncio.get_running_loop().call_later(period_s, wake_up.set)
    try:
        await wake_up.wait()
    finally:
        timer.cancel()


def _encode(item: object, common: dict[str, Any]) -> str:
    if isinstance(item, EventLive):
        return EventMessage(**common, event=item).model_dump_json()
    if isinstance(item, _StopAnswer):
        refusal = item.refusal and RefusalLive.model_validate(item.refusal, from_attributes=True)
        return StopAnswerMessage(**common, number=item.number, refusal=refusal).model_dump_json()
    assert isinstance(item, Saved)
    saved = SavedMessage(**common, what=item.what, id=item.id, patient_id=item.patient_id, session_id=item.session_id)
    return saved.model_dump_json()
