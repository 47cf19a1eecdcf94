"""The clinic's stations: the list, the live overview, and what each of them runs with."""

import asyncio
import logging
from collections import defaultdict
from datetime import datetime
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, FastAPI, Query, Request, WebSocket, WebSocketDisconnect
from pydantic import Field

from kata.actor import CURRENT_ACTOR, Actor
from kata.api.overview import Overview
from kata.api.redaction import View
from kata.api.sockets import until_gone
from kata.clinic.stations import service
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.station.overview import StationShown
from kata.types import Schema

log = logging.getLogger(__name__)
router = APIRouter(tags=["stations"])

_AT_MOST_EVERY_S: Final = 0.2
_AT_LEAST_EVERY_S: Final = 1.0


class Station(Schema):
    """One that is registered, or was heard."""

    shown: StationShown
    registered_at: datetime | None
    started_at: datetime | None = Field(description="When its service last did.")
    version: int = Field(description="Of configuration and calibration; 0: not known.")


class StationList(Schema):
    """All of them, this service's own first."""

    items: list[Station]


class StationVersion(Schema):
    """What a station's device ran with from a moment on."""

    number: int = Field(ge=1)
    since: datetime
    software: str = Field(description="Version of Kata that wrote it down.", examples=["0.1.0"])
    config: str = Field(description="TOML: configuration and calibration.")


class StationVersionList(Schema):
    """The newest first."""

    items: list[StationVersion]


class StationsMessage(Schema):
    """All stations: at the beginning, when one of them has said something, and at least every second."""

    sequence: int = Field(ge=1, description="Without gaps on one connection.")
    sent_at: datetime
    stations: list[StationShown]


def document(app: FastAPI) -> None:
    """Put the message into the OpenAPI document."""

    @app.webhooks.post("live_stations", tags=["stations"])
    def live_stations(message: StationsMessage) -> None:
        """What the service sends on the WebSocket /api/stations/live. It expects nothing back."""


class _Views:
    """One watcher's, of every station: without patients who are none of their business."""

    def __init__(self, actor: Actor, database: Database) -> None:
        self._of: defaultdict[str, View] = defaultdict(lambda: View(actor, database))

    async def of(self, stations: list[StationShown]) -> list[StationShown]:
        return [await self._shown(one) for one in stations]

    async def _shown(self, one: StationShown) -> StationShown:
        patient = one.state.patient if one.state else None
        if one.state is None or patient is None or await self._may_see(one.name, patient.id):
            return one
        state = one.state.model_copy(update={"patient": None, "recording_name": None})
        return one.model_copy(update={"state": state})

    async def _may_see(self, station: str, patient_id: Any) -> bool:
        try:
            return await self._of[station].may_see(patient_id)
        except Exception as error:
            # Nobody knows whether they may: then they may not.
            log.info("a patient is not named: %s", error)
            return False


async def _overview(request: Request) -> Overview:
    overview: Overview = request.app.state.overview
    return overview


TheOverview = Annotated[Overview, Depends(_overview)]


@router.get("/api/stations")
async def list_stations(database: TheDatabase, overview: TheOverview, actor: TheActor) -> StationList:
    """Every station with what it does now; a patient only to whom that record is open."""

    def registered() -> dict[str, tuple[datetime, datetime, int]]:
        with database.read() as session:
            return {row.name: (row.registered_at, row.started_at, n) for row, n in service.registered(session)}

    known = await asyncio.to_thread(registered)
    overview.register(list(known))
    shown = await _Views(actor, database).of(overview.shown())
    items = []
    for one in shown:
        registered_at, started_at, version = known.get(one.name, (None, None, 0))
        items.append(Station(shown=one, registered_at=registered_at, started_at=started_at, version=version))
    return StationList(items=items)


@router.get("/api/station-versions", responses=PROBLEMS.of(404, 422))
def list_station_versions(
    database: TheDatabase, station: Annotated[str, Query(max_length=100, description="Its name.")]
) -> StationVersionList:
    """What a station has run with, the newest first: configuration and calibration."""
    with database.read() as session:
        rows = service.versions(session, station)
        return StationVersionList(items=[StationVersion.model_validate(row, from_attributes=True) for row in rows])


@router.websocket("/api/stations/live")
async def live_stations(socket: WebSocket) -> None:
    """Tell one listener, until it leaves or is signed out."""
    state = socket.app.state
    actor = CURRENT_ACTOR.get()
    # The rule of this route lets nobody through who has not signed in.
    assert actor is not None
    await socket.accept()
    views = _Views(actor, state.database)
    await until_gone(socket, actor, _hear_nothing(socket), _tell(socket, state.overview, views))


async def _hear_nothing(socket: WebSocket) -> None:
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


async def _tell(socket: WebSocket, overview: Overview, views: _Views) -> None:
    """The newest whenever the listener has taken the last: one that is slow gets fewer, and nothing waits for it."""
    sequence = 0
    try:
        await overview.refresh()
        while True:
            sequence += 1
            seen = overview.changes
            stations = await views.of(overview.shown())
            message = StationsMessage(sequence=sequence, sent_at=utc_now(), stations=stations)
            await socket.send_text(message.model_dump_json())
            await asyncio.sleep(_AT_MOST_EVERY_S)
            if overview.changes == seen:
                await overview.changed(_AT_LEAST_EVERY_S - _AT_MOST_EVERY_S)
    except WebSocketDisconnect:
        return
