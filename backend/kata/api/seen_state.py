"""The live state that the sender of a command saw, and the guard made from it."""

from typing import Annotated

from fastapi import Depends
from pydantic import AwareDatetime, Field, StrictInt

from kata.api.errors import refused
from kata.dependencies import TheStation
from kata.device.ipc_messages import Refusal
from kata.station.guard import Guard
from kata.types import Schema


class SeenState(Schema):
    """The live state that the sender saw last. The command is refused if a stop has occurred since, or if the state is more than 2 s
    old.
    """

    stops: Annotated[StrictInt, Field(ge=0, le=2**53)] = Field(
        description="`live.stops` of the state that the sender saw.", examples=[3]
    )
    seen_at: AwareDatetime = Field(
        description="`live.at` of the state that the sender saw.", examples=["2026-11-21T09:30:00.125Z"]
    )


async def guarded(station: TheStation, seen_state: SeenState) -> Guard:
    """Return the guard of a command that can start motion, release an arm or reset a stop.

    :raises ProblemError: 409 when the state is too old or lies in the future.
    """
    guard = station.clock.guard(seen_state.stops, seen_state.seen_at)
    if isinstance(guard, Refusal):
        raise refused(guard)
    return guard


Guarded = Annotated[Guard, Depends(guarded)]
