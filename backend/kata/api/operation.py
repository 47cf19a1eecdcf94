"""The state of the service for its operators: version, database size and free space. It contains no personal data."""

import shutil
from typing import Literal

from fastapi import APIRouter, Request
from pydantic import Field

from kata import __version__
from kata.api.services import services_of
from kata.dependencies import TheDatabase
from kata.types import Schema

router = APIRouter(tags=["operation"])


class Operation(Schema):
    """Version and storage of this service."""

    version: str
    database: Literal["sqlite", "postgresql"]
    database_bytes: int = Field(ge=0, description="Size of the database.")
    disk_free_bytes: int = Field(
        ge=0, description="Free space on the disk that holds this service's data folder with the journals."
    )
    disk_bytes: int = Field(ge=1, description="Size of that disk.")


@router.get("/api/operation", summary="Get version and storage of the service")
def get_operation(request: Request, database: TheDatabase) -> Operation:
    """Return the version of this service, the size of the database, and the free space on this computer."""
    disk = shutil.disk_usage(services_of(request).settings.data)
    return Operation(
        version=__version__,
        database=database.kind,
        database_bytes=database.size_bytes(),
        disk_free_bytes=disk.free,
        disk_bytes=disk.total,
    )
