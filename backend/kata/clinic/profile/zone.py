"""The time zone in which a route counts days and weeks."""

from datetime import tzinfo
from typing import Annotated, Protocol

from fastapi import Depends, Request

from kata.clinic.profile import service
from kata.dependencies import TheDatabase
from kata.settings import Settings


class ZoneServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def settings(self) -> Settings:
        """Return the settings."""


def _zone(request: Request, database: TheDatabase) -> tzinfo:
    services: ZoneServices = request.app.state.services
    with database.read() as session:
        return service.time_zone(session, services.settings)


TheZone = Annotated[tzinfo, Depends(_zone)]
"""The clinic's time zone: UTC if none is set."""
