"""REST routes of commissionings."""

from typing import Annotated
from uuid import UUID

import msgspec
from fastapi import APIRouter, Query

from kata.clinic.commissionings import service
from kata.clinic.commissionings.schemas import Commissioning, CommissioningDetail, CommissioningStepRun
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import After, Limit, Page

router = APIRouter(tags=["commissioning"])


@router.get("/api/commissionings", summary="List a station's commissionings and checks", responses=PROBLEMS.of(422))
def list_commissionings(
    database: TheDatabase,
    station: Annotated[str, Query(max_length=100, description="Name of the station.")],
    after: After = None,
    limit: Limit = 100,
) -> Page[Commissioning]:
    """Return the finished commissionings and periodic checks of a station, newest first, with the figures that show drift."""
    with database.read() as session:
        rows, following = service.find(session, station, limit, after)
        return Page[Commissioning](items=[Commissioning.model_validate(row) for row in rows], next=following)


@router.get(
    "/api/commissionings/{commissioning_id}",
    summary="Get a commissioning or check with its steps",
    responses=PROBLEMS.of(404, 422),
)
def get_commissioning(database: TheDatabase, commissioning_id: UUID) -> CommissioningDetail:
    """Return a commissioning or check with the values before and after each step, and whether its signature is valid."""
    with database.read() as session:
        row = service.get(session, commissioning_id)
        steps = [
            CommissioningStepRun.model_validate(
                {name: value for name, value in msgspec.to_builtins(step).items() if name != "by"}
            )
            for step in service.steps_of(row)
        ]
        return CommissioningDetail(
            **Commissioning.model_validate(row).model_dump(), signature=service.verify(row), steps=steps
        )
