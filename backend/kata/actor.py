"""Who acts: known from the sign-in's cookie at the edge, carried along to whatever is done in this request."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Final, Literal
from uuid import UUID

Role = Literal["therapist", "administrator", "viewer", "technician"]


@dataclass(frozen=True, slots=True)
class Actor:
    """Somebody signed in at one browser."""

    account_id: UUID
    sign_in_id: UUID
    """Of this browser: what the lease belongs to."""
    name: str
    """As it stands in records: therapist, examiner, signature."""
    role: Role
    stations: frozenset[str]
    """Names of the stations that this account works at; empty: at every one."""
    locked: bool = False
    """The screen is locked: what goes on stays visible and may be stopped, until the password is given again."""
    enrolling: bool = False
    """A second factor is asked of this account and there is none yet: nothing but setting it up is allowed."""


CURRENT_ACTOR: Final[ContextVar[Actor | None]] = ContextVar("current_actor", default=None)
"""Whose request this is; None where the program itself acts (importer, nightly backup)."""


@dataclass(slots=True)
class RequestContext:
    """What a request does, and to what: told at the edge, before it is allowed or refused, for the audit trail."""

    action: str
    """The route's operation id, or what the program does by itself."""
    patient_id: UUID | None = None
    subject: str = ""
    """What else it is done to: kind and id, as `recording 0f3c...`."""
    station: str = ""
    address: str = ""
    """Of the browser; from the connection, or from a proxy that is trusted."""
    permission: str = ""
    """That the action needs: whether a mere look is worth a row follows from it."""
    account_id: UUID | None = None
    """Whose, where nobody is signed in and somebody tries to be."""
    why: str = ""
    """Code of the problem that it ended in."""
    told: set[str] = field(default_factory=set)
    """Outcomes that stand in the trail already. One object goes along into worker threads, so that what is told there is known at
    the edge."""


REQUEST_CONTEXT: Final[ContextVar[RequestContext | None]] = ContextVar("request_context", default=None)
"""What is being done in this request; set for every one that has a route, also where it is then refused."""


@contextmanager
def by_program(action: str, station: str = "") -> Iterator[None]:
    """What follows nobody asked for: the program does it by itself, even where a request happened to set it going."""
    acting, context = CURRENT_ACTOR.set(None), REQUEST_CONTEXT.set(RequestContext(action, station=station))
    try:
        yield
    finally:
        CURRENT_ACTOR.reset(acting)
        REQUEST_CONTEXT.reset(context)
