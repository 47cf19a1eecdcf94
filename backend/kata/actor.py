"""The user and the context of the current request. Authorization sets both, and every function that the request calls can read them."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Final, Literal
from uuid import UUID

Role = Literal["therapist", "administrator", "viewer", "technician"]


@dataclass(frozen=True, slots=True)
class Actor:
    """A user who is signed in at one browser, or whose program sends an access token."""

    account_id: UUID
    login_session_id: UUID
    """Identifies the browser, to which the lease belongs. For a program, identifies its access token."""
    name: str
    """The user's name in records, for example as therapist, examiner or signer."""
    role: Role
    stations: frozenset[str]
    """Names of the stations at which this account works; empty: all."""
    locked: bool = False
    """True if the screen is locked. Until the password is given again, the user can only see and stop a running session."""
    enrolling: bool = False
    """The account needs a second factor and has none yet: the user may only set it up."""
    by_token: bool = False
    """True if a program acts with an access token. It may then only read (``TOKEN_PERMISSIONS``)."""


CURRENT_ACTOR: Final[ContextVar[Actor | None]] = ContextVar("current_actor", default=None)
"""The user of the current request; None if the program itself acts (importer, daily backup)."""


@dataclass(slots=True)
class RequestContext:
    """Action and object of a request, for the audit trail. The context is set before the request is allowed or refused."""

    action: str
    """The route's operation id, or an action of the program."""
    patient_id: UUID | None = None
    subject: str = ""
    """Kind and id of the object, in addition to the patient: `recording 0f3c...`."""
    station: str = ""
    address: str = ""
    """Address of the browser, from the connection or a trusted proxy."""
    audits_views: bool = False
    """True if read requests for this action are recorded in the audit trail."""
    is_command: bool = False
    """True if the action is a command to the apparatus. Its answer does not wait for the audit trail."""
    account_id: UUID | None = None
    """The account of an attempted login; None otherwise."""
    why: str = ""
    """Code of the problem in the answer; empty if there is none."""
    detail: dict[str, str] = field(default_factory=dict)
    """Further details for the audit entry of the request's changes. They are codes, never secrets or data of a patient."""
    audited: set[str] = field(default_factory=set)
    """Outcomes that the trail already contains. Worker threads share this object with the request."""


REQUEST_CONTEXT: Final[ContextVar[RequestContext | None]] = ContextVar("request_context", default=None)
"""The context of the current request. It is set for every request with a route, even if the request is refused."""


def note_detail(name: str, code: str) -> None:
    """Add a detail to the audit entry of the current request's changes. Do nothing outside a request."""
    if context := REQUEST_CONTEXT.get():
        context.detail[name] = code


@contextmanager
def by_program(action: str, station: str = "") -> Iterator[None]:
    """Run the block as an action of the program, even within a user's request."""
    acting, context = CURRENT_ACTOR.set(None), REQUEST_CONTEXT.set(RequestContext(action, station=station))
    try:
        yield
    finally:
        CURRENT_ACTOR.reset(acting)
        REQUEST_CONTEXT.reset(context)
