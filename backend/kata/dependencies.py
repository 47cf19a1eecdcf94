"""Dependencies that routes share, and the documentation of their error answers."""

from typing import Annotated, Any, Final, Protocol

from fastapi import Depends, Query, Request
from pydantic import BaseModel, Field

from kata import texts
from kata.actor import CURRENT_ACTOR, Actor
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.plotting.figures import FigureWorker, Window
from kata.station.schemas import OptionalKey
from kata.station.station import Station

_LONGEST_S: Final = 86_400.0
_Second = Annotated[float, Field(ge=0.0, le=_LONGEST_S, allow_inf_nan=False)]


class ProblemField(BaseModel):
    """One invalid field."""

    pointer: str = Field(
        description="JSON pointer into the request's body, or query/path parameter.", examples=["#/name"]
    )
    field: str = Field(description="Name of the field.", examples=["birth date"])
    detail: str = Field(description="Why the field is invalid.", examples=["must be between 1900 and today"])
    field_key: OptionalKey = None
    detail_key: OptionalKey = None


class Problem(BaseModel):
    """A problem document (RFC 9457), media type application/problem+json."""

    type: str = Field("about:blank", description="Always about:blank; ``code`` identifies the kind.")
    title: str = Field(description="The HTTP status in words.", examples=["Conflict"])
    status: int = Field(ge=400, le=599, examples=[409])
    detail: str = Field(description="The problem in one sentence for the user.", examples=["No recording is loaded."])
    code: str = Field(description="Stable code of the kind of problem, for programs.", examples=["is_idle"])
    next_step: str = Field("", description="What the user can do.", examples=["Load a recording first."])
    detail_key: OptionalKey = None
    next_step_key: OptionalKey = None
    errors: list[ProblemField] = Field(default_factory=list, description="Invalid fields, if the request is invalid.")


class _Problems:
    """Documentation of error answers."""

    _SENTENCES: Final = {
        401: "No user is signed in at this browser.",
        403: "Not allowed for this account, or the request came from another site's page.",
        404: "Not found.",
        409: "Refused in the present state, with cause and next step.",
        410: "The data exists but can no longer be read.",
        422: "The request is invalid; see its errors.",
        423: "The screen is locked: give the password first. Stop works nevertheless.",
        429: "Too many attempts: wait for the seconds in Retry-After.",
        503: "The apparatus' control program or the database does not answer.",
    }

    def of(self, *statuses: int) -> dict[int | str, dict[str, Any]]:
        """Return the value of a route's ``responses`` for these statuses."""
        return {
            status: {
                "description": self._SENTENCES[status],
                "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}},
            }
            for status in statuses
        }


PROBLEMS: Final = _Problems()


class CoreServices(Protocol):
    """The services that routes of every package use. ``kata.api.services.Services`` provides them."""

    @property
    def database(self) -> Database:
        """Return the database."""

    @property
    def station(self) -> Station:
        """Return the station."""

    @property
    def figures(self) -> FigureWorker:
        """Return the worker process that draws figures."""


def _services(request: Request) -> CoreServices:
    services: CoreServices = request.app.state.services
    return services


def _database(request: Request) -> Database:
    return _services(request).database


def _station(request: Request) -> Station:
    return _services(request).station


def _figures(request: Request) -> FigureWorker:
    return _services(request).figures


def _window(
    start_s: Annotated[
        _Second | None, Query(description="Start of the time window, seconds on the figure's clock.")
    ] = None,
    end_s: Annotated[_Second | None, Query(description="End of the time window, seconds.")] = None,
) -> Window | None:
    if start_s is None and end_s is None:
        return None
    window = (start_s or 0.0, _LONGEST_S if end_s is None else end_s)
    if window[0] >= window[1]:
        raise ProblemError(422, "empty_window", texts.WINDOW_ENDS_BEFORE_START(), texts.GIVE_END_AFTER_START())
    return window


async def _actor() -> Actor:
    actor = CURRENT_ACTOR.get()
    # Only routes that require a login use this dependency.
    assert actor is not None
    return actor


TheActor = Annotated[Actor, Depends(_actor)]
TheWindow = Annotated[Window | None, Depends(_window)]
TheDatabase = Annotated[Database, Depends(_database)]
TheStation = Annotated[Station, Depends(_station)]
TheFigures = Annotated[FigureWorker, Depends(_figures)]
