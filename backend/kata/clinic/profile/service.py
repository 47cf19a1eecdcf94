"""Read and change the clinic's own data. The caller commits."""

from datetime import tzinfo
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.clinic import texts
from kata.clinic.local_time import zone_of
from kata.clinic.profile.computer_zone import computer_zone
from kata.clinic.profile.schemas import ClinicProfile, ClinicProfileUpdate
from kata.clinic.profile.tables import THE_CLINIC, ClinicProfileRow
from kata.database.base import utc_now
from kata.errors import ProblemError
from kata.settings import Settings, address_lines


def read(session: Session, settings: Settings) -> ClinicProfile:
    """Return the values that an administrator has set on the page, or else those of the service's settings."""
    row = session.get(ClinicProfileRow, THE_CLINIC)
    has_logo = settings.clinic_logo is not None
    if row is None or not row.updated_by:
        return ClinicProfile(
            name=settings.clinic_name.strip(),
            address="\n".join(address_lines(settings.clinic_address)),
            phone=settings.clinic_phone.strip(),
            time_zone=settings.clinic_time_zone or (row.time_zone if row else ""),
            has_logo=has_logo,
            updated_at=None,
            updated_by="",
        )
    return ClinicProfile(
        name=row.name,
        address=row.address,
        phone=row.phone,
        time_zone=row.time_zone or settings.clinic_time_zone,
        has_logo=has_logo,
        updated_at=row.updated_at,
        updated_by=row.updated_by,
    )


def time_zone(session: Session, settings: Settings) -> tzinfo:
    """Return the clinic's time zone: UTC if none is set."""
    return zone_of(read(session, settings).time_zone)


def adopt_computer_zone(session: Session, settings: Settings) -> None:
    """Store the name of this computer's time zone if the clinic has none. From then on the computer's zone has no effect."""
    name = computer_zone()
    if not name or read(session, settings).time_zone:
        return
    row = session.get(ClinicProfileRow, THE_CLINIC)
    if row is None:
        row = ClinicProfileRow(id=THE_CLINIC, name="", address="", phone="", updated_at=utc_now(), updated_by="")
    row.time_zone = name
    session.add(row)


def change(session: Session, actor: Actor, profile: ClinicProfileUpdate) -> None:
    """Replace the clinic's data.

    :raises ProblemError: 422 when the time zone is unknown or missing.
    """
    try:
        ZoneInfo(profile.time_zone)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise ProblemError(422, "no_time_zone", texts.TIME_ZONE_UNKNOWN(), texts.CHOOSE_TIME_ZONE()) from error
    row = session.get(ClinicProfileRow, THE_CLINIC) or ClinicProfileRow(id=THE_CLINIC)
    for name, value in profile.model_dump().items():
        setattr(row, name, value)
    row.updated_at, row.updated_by = utc_now(), actor.name
    session.add(row)
