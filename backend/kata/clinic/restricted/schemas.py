"""Access to restricted records as it goes in and out."""

from typing import Annotated
from uuid import UUID

from pydantic import Field, StrictBool, StringConstraints

from kata.types import NO_NUL, Moment, Schema

Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=10, max_length=1000, pattern=NO_NUL)]


class TeamMember(Schema):
    """Somebody of the care team."""

    account_id: UUID
    name: str = Field(examples=["Sato Ken"])


class RecordAccess(Schema):
    """Who sees a patient's record."""

    restricted: bool = Field(description="Only the care team sees it; others break the glass.")
    team: list[TeamMember] = Field(description="Of a restricted record.")
    open_to_you: bool = Field(
        description="You see it: it is not restricted, you are in the team, or you broke the glass."
    )
    glass_until: Moment | None = Field(description="You broke the glass: so long it stays open to you. UTC.")


class RecordAccessChange(Schema):
    """Restrict a record to a care team, or open it again."""

    restricted: StrictBool
    account_ids: set[UUID] = Field(default_factory=set, max_length=200, description="The whole care team.")


class BreakGlass(Schema):
    """Why a restricted record has to be opened now."""

    reason: Reason = Field(
        description="What for; an administrator reads it.", examples=["Came in with acute pain, her therapist is away."]
    )


class BreakGlassAccess(Schema):
    """A restricted record that somebody opened in an emergency."""

    id: UUID
    patient_id: UUID
    account_id: UUID
    name: str = Field(description="Of who did.", examples=["Sato Ken"])
    reason: str
    at: Moment
    until: Moment
    reviewed_at: Moment | None = Field(description="Null until an administrator has looked at it.")
    reviewed_by: str


class BreakGlassAccessList(Schema):
    """Those that nobody has looked at come first, then the newest."""

    items: list[BreakGlassAccess]
