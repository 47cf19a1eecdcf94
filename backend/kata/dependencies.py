"""What routes ask for, and how their errors are documented."""

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
    """One field that is wrong."""

    pointer: str = Field(
        description="JSON pointer into the request's body, or query/path parameter.", examples=["#/name"]
    )
    field: str = Field(description="What the field is called.", examples=["birth date"])
    detail: str = Field(description="What is wrong with it.", examples=["must be between 1900 and today"])
    field_key: OptionalKey = None
    detail_key: OptionalKey = None


class Problem(BaseModel):
    """A problem document (RFC 9457), media type application/problem+json."""

    type: str = Field("about:blank", description="Always about:blank: ``code`` tells the kind.")
    title: str = Field(description="The HTTP status in words.", examples=["Conflict"])
    status: int = Field(ge=400, le=599, examples=[409])
    detail: str = Field(description="What is wrong, in a sentence for the user.", examples=["No recording is loaded."])
    code: str = Field(description="Stable name of the kind of problem, for programs.", examples=["is_idle"])
    next_step: str = Field("", description="What the user can do.", examples=["Load a recording first."])
    detail_key: OptionalKey = None
    next_step_key: OptionalKey = None
    errors: list[ProblemField] = Field(
        default_factory=list, description="Which fields, where the request itself is wrong."
    )


class _Problems:
    """Documentation of error answers."""

    _SENTENCES: Final = {
        401: "Nobody is signed in at this browser.",
        403: "Not from this page, or not for this account.",
        404: "There is no such thing.",
        409: "Not now: refused, with cause and next step.",
        410: "It was there, and can no longer be read.",
        422: "The request itself is wrong: see its errors.",
        423: "The screen is locked: give the password first. Stop works all the same.",
        429: "Too many tries: wait for as many seconds as Retry-After says.",
        503: "What this takes does not answer: the apparatus' control program, or the database.",
    }

    def of(self, *statuses: int) -> dict[int | str, dict[str, Any]]:
        """For a route's ``responses``."""
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
    start_s: Annotated[_Second | None, Query(description="Begin of a window, seconds on the figure's clock.")] = None,
    end_s: Annotated[_Second | None, Query(description="End of that window, seconds.")] = None,
) -> Window | None:
    if start_s is None and end_s is None:
        return None
    window = (start_s or 0.0, _LONGEST_S if end_s is None else end_s)
    if window[0] >= window[1]:
        raise ProblemError(422, "empty_window", texts.WINDOW_ENDS_BEFORE_START(), texts.GIVE_END_AFTER_START())
    return window


async def _actor() -> Actor:
    actor = CURRENT_ACTOR.get()
    # Whoever asks for this is asked for by a route that only lets in who has signed in.
    assert actor is not None
    return actor


TheActor = Annotated[Actor, Depends(_actor)]
TheWindow = Annotated[Window | None, Depends(_window)]
TheDatabase = Annotated[Database, Depends(_database)]
TheStation = Annotated[Station, Depends(_station)]
TheFigures = Annotated[FigureWorker, Depends(_figures)]
