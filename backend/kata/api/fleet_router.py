"""Routes for all stations of the clinic: the list, the live states, and the configuration versions."""

import asyncio
import logging
from collections import defaultdict
from datetime import datetime
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, FastAPI, Query, Request, WebSocket, WebSocketDisconnect
from pydantic import Field

from kata.actor import CURRENT_ACTOR, Actor
from kata.api.fleet import Fleet
from kata.api.redaction import Redaction
from kata.api.services import services_of
from kata.api.sockets import accepted, received, serve_until_gone
from kata.clinic.stations import service
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.pagination import Page
from kata.station.fleet import StationStatus
from kata.types import Schema

log = logging.getLogger(__name__)
router = APIRouter(tags=["stations"])

_AT_MOST_EVERY_S: Final = 0.2
_AT_LEAST_EVERY_S: Final = 1.0


class Station(Schema):
    """A station that is registered or has sent its state."""

    shown: StationStatus
    registered_at: datetime | None
    started_at: datetime | None = Field(description="Last start of the station's service.")
    version: int = Field(description="Version of configuration and calibration; 0: unknown.")


class StationVersion(Schema):
    """Configuration and calibration that a station's device has used since a given time."""

    number: int = Field(ge=1)
    since: datetime
    software: str = Field(description="Version of Kata that recorded it.", examples=["1.0.0"])
    config: str = Field(description="TOML: configuration and calibration.")
    changed_by: str = Field(description="User who imported it on the page; empty if the station's file was edited.")


class StationsMessage(Schema):
    """States of all stations. Sent when a client connects, when a state has changed, and at least every second."""

    sequence: int = Field(ge=1, description="Number of the message; without gaps on one connection.")
    sent_at: datetime
    stations: list[StationStatus]


def document(app: FastAPI) -> None:
    """Add the WebSocket's message to the OpenAPI document."""

    @app.webhooks.post("live_stations", tags=["stations"])
    def live_stations(message: StationsMessage) -> None:
        """Sent by the service on the WebSocket /api/stations/live. Clients send nothing."""


class _Redactions:
    """Redacts the states of all stations for one user."""

    def __init__(self, actor: Actor, database: Database) -> None:
        self._by_station: defaultdict[str, Redaction] = defaultdict(lambda: Redaction(actor, database))

    async def apply(self, stations: list[StationStatus]) -> list[StationStatus]:
        return [await self._redact(status) for status in stations]

    async def _redact(self, status: StationStatus) -> StationStatus:
        patient = status.state.patient if status.state else None
        if status.state is None or patient is None or await self._may_see(status.name, patient.id):
            return status
        state = status.state.model_copy(update={"patient": None, "recording_name": None})
        return status.model_copy(update={"state": state, "patient_hidden": True})

    async def _may_see(self, station: str, patient_id: Any) -> bool:
        try:
            return await self._by_station[station].may_see(patient_id)
        except Exception as error:
            # Without an answer from the database the patient's name is hidden.
            log.info("a patient's name is hidden because the permission could not be read: %s", error)
            return False


async def _fleet(request: Request) -> Fleet:
    return services_of(request).fleet


TheFleet = Annotated[Fleet, Depends(_fleet)]


@router.get("/api/stations", summary="List all stations with their states")
async def list_stations(database: TheDatabase, fleet: TheFleet, actor: TheActor) -> Page[Station]:
    """Return every station with its current state, this service's own station first. A patient is named only to users who may open that
    record. The list has no pages.
    """

    def registered() -> dict[str, tuple[datetime, datetime, int]]:
        with database.read() as session:
            return {row.name: (row.registered_at, row.started_at, n) for row, n in service.registered(session)}

    registrations = await asyncio.to_thread(registered)
    fleet.register(list(registrations))
    statuses = await _Redactions(actor, database).apply(fleet.statuses())
    items = []
    for status in statuses:
        registered_at, started_at, version = registrations.get(status.name, (None, None, 0))
        items.append(Station(shown=status, registered_at=registered_at, started_at=started_at, version=version))
    return Page[Station].complete(items)


@router.get("/api/station-versions", responses=PROBLEMS.of(404, 422), summary="List a station's configuration versions")
def list_station_versions(
    database: TheDatabase, station: Annotated[str, Query(max_length=100, description="Name of the station.")]
) -> Page[StationVersion]:
    """Return the configurations and calibrations that a station has used, newest first. Changes are rare, so the list has no pages."""
    with database.read() as session:
        rows = service.versions(session, station)
        return Page[StationVersion].complete([StationVersion.model_validate(row, from_attributes=True) for row in rows])


@router.websocket("/api/stations/live")
async def live_stations(socket: WebSocket) -> None:
    """Send the states to one listener until it disconnects or its login session ends."""
    services = services_of(socket)
    actor = CURRENT_ACTOR.get()
    # The rule of this route requires a login.
    assert actor is not None
    if not await accepted(socket, actor):
        return
    redactions = _Redactions(actor, services.database)
    await serve_until_gone(socket, actor, _until_disconnected(socket, actor), _send(socket, services.fleet, redactions))


async def _until_disconnected(socket: WebSocket, actor: Actor) -> None:
    async for _ in received(socket, actor):
        pass  # clients have nothing to send


async def _send(socket: WebSocket, fleet: Fleet, redactions: _Redactions) -> None:
    """Send the newest states each time the listener has taken the previous message. A slow listener gets fewer messages."""
    sequence = 0
    try:
        await fleet.refresh()
        while True:
            sequence += 1
            sent_changes = fleet.changes
            stations = await redactions.apply(fleet.statuses())
            message = StationsMessage(sequence=sequence, sent_at=utc_now(), stations=stations)
            await socket.send_text(message.model_dump_json())
            await asyncio.sleep(_AT_MOST_EVERY_S)
            if fleet.changes == sent_changes:
                await fleet.wait_for_change(_AT_LEAST_EVERY_S - _AT_MOST_EVERY_S)
    except WebSocketDisconnect:
        return
