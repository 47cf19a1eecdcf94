"""Request and response models of restricted records."""

from typing import Annotated
from uuid import UUID

from pydantic import Field, StrictBool, StringConstraints

from kata.types import NO_NUL, Moment, Schema

Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=10, max_length=1000, pattern=NO_NUL)]


class TeamMember(Schema):
    """A member of the care team."""

    account_id: UUID
    name: str = Field(examples=["Sato Ken"])


class RecordAccess(Schema):
    """Access to a patient's record."""

    restricted: bool = Field(
        description="True if only the care team sees the record. Other users need a break-glass access."
    )
    team: list[TeamMember] = Field(description="The care team of a restricted record.")
    open_to_you: bool = Field(
        description="True if you may see the record: it is not restricted, you are in the team, or you have a break-glass access."
    )
    glass_until: Moment | None = Field(description="End of your break-glass access. UTC.")


class RecordAccessChange(Schema):
    """Restrict a record to a care team, or open it again."""

    restricted: StrictBool
    account_ids: set[UUID] = Field(default_factory=set, max_length=200, description="The complete care team.")


class BreakGlass(Schema):
    """Reason for a break-glass access."""

    reason: Reason = Field(
        description="Reason for the access. An administrator reads it.",
        examples=["Came in with acute pain, her therapist is away."],
    )


class BreakGlassAccess(Schema):
    """A break-glass access to a restricted record."""

    id: UUID
    patient_id: UUID
    account_id: UUID
    name: str = Field(description="Name of the user.", examples=["Sato Ken"])
    reason: str
    at: Moment
    until: Moment
    reviewed_at: Moment | None = Field(
        description="Time of the review; null until an administrator has reviewed the access."
    )
    reviewed_by: str
