"""The time zone in which a route counts days and weeks."""

from datetime import timedelta, timezone, tzinfo
from typing import Annotated, Protocol

from fastapi import Depends, Query, Request

from kata.clinic.profile import service
from kata.dependencies import TheDatabase
from kata.settings import Settings


class ZoneServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def settings(self) -> Settings:
        """Return the settings."""


def _zone(
    request: Request,
    database: TheDatabase,
    utc_offset_minutes: Annotated[
        int,
        Query(
            ge=-720,
            le=840,
            description="Offset from UTC, minutes. Days and weeks begin at the clinic's midnight; this offset counts only if "
            "the clinic has no time zone.",
        ),
    ] = 0,
) -> tzinfo:
    services: ZoneServices = request.app.state.services
    with database.read() as session:
        zone = service.time_zone(session, services.settings)
    return zone or timezone(timedelta(minutes=utc_offset_minutes))


TheZone = Annotated[tzinfo, Depends(_zone)]
"""The clinic's time zone. Without one, a zone with the offset that the request names."""
