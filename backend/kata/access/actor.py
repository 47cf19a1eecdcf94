"""Who acts: known from the sign-in's cookie at the edge, carried along to whatever is done in this request."""

from contextvars import ContextVar
from dataclasses import dataclass
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


ACTING: Final[ContextVar[Actor | None]] = ContextVar("acting", default=None)
"""Whose request this is; None where the program itself acts (importer, nightly backup)."""
