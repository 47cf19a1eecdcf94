"""REST routes of the clinic's own data."""

from typing import Protocol

from fastapi import APIRouter, Request

from kata.clinic.profile import service
from kata.clinic.profile.schemas import ClinicProfile, ClinicProfileUpdate
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.settings import Settings

router = APIRouter(tags=["clinic"])


class ProfileServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def settings(self) -> Settings:
        """Return the settings."""


def _settings(request: Request) -> Settings:
    services: ProfileServices = request.app.state.services
    return services.settings


@router.get("/api/clinic-profile", summary="Get the clinic's letterhead and time zone")
def get_clinic_profile(request: Request, database: TheDatabase) -> ClinicProfile:
    """Return the head of printed reports and the clinic's time zone."""
    with database.read() as session:
        return service.read(session, _settings(request))


@router.put("/api/clinic-profile", responses=PROBLEMS.of(422), summary="Change the clinic's letterhead and time zone")
def update_clinic_profile(
    request: Request, database: TheDatabase, actor: TheActor, body: ClinicProfileUpdate
) -> ClinicProfile:
    """Replace the head of printed reports and the clinic's time zone. Reports use the new values at once. The logo is a setting of the
    service.
    """
    with database.write() as session:
        service.change(session, actor, body)
        session.flush()
        return service.read(session, _settings(request))
