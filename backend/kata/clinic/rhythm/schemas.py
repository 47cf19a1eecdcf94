"""Response models of the rhythm."""

from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.motion.rhythm import Direction, NoRatio, Plane, Source
from kata.types import Moment, Schema, Side

CurveOf = Literal["taught", "played", "sound"]
NoSound = Literal["sides_unknown", "sound_side", "no_recording", "no_like_motion"]

_RATIO = "Degrees in the shoulder joint for each degree of upward rotation of the scapula."


class RhythmReference(Schema):
    """A published ratio of healthy people who moved their arm themselves, measured at bones. It is no normal band of this apparatus."""

    source: Source
    ratio: float = Field(description=_RATIO, examples=[2.0])
    ratio_deviation: float | None = Field(
        description="Standard deviation between people; null if it was not published.", examples=[0.4]
    )


class RhythmBand(Schema):
    """The ratio within a band of elevation, or why there is none."""

    from_deg: float = Field(description="Elevation of the upper arm at the band's lower end, degrees.")
    to_deg: float = Field(description="Elevation at its upper end, degrees.")
    ratio: float | None = Field(description=f"{_RATIO} The median of the passes.", examples=[2.1])
    reason: NoRatio | None = Field(description="Why there is no ratio; null with a ratio.")
    scapula_deg: float | None = Field(description="By how much the scapula turned upward within the band, degrees.")
    joint_deg: float | None = Field(description="By how much the elevation in the shoulder joint rose, degrees.")
    passes: int = Field(ge=1, description="Passes that have this ratio.")


class RhythmCurve(Schema):
    """The scapula over the elevation of the upper arm while it is raised or lowered. With several passes, the widest one."""

    of: CurveOf
    direction: Direction
    plane: Plane = Field(
        description="Plane in which the arm is raised: abduction (at the side), scaption (in the scapula's plane), flexion (forward), other, "
        "or changing."
    )
    plane_deg: float = Field(description="Median of that plane from 30 deg of elevation on: 0 at the side, 90 forward.")
    passes: int = Field(ge=1)
    elevation_deg: list[float] = Field(description="Elevation of the upper arm against the trunk, ascending, degrees.")
    scapula_deg: list[float] = Field(description="Upward rotation of the scapula there, degrees.")
    bands: list[RhythmBand] = Field(description="30 to 60, 60 to 90 and 90 to 120 deg of elevation.")
    whole: RhythmBand = Field(
        description="From 30 deg to the end of the pass, or to where the scapula reached the apparatus' limit."
    )
    reference: RhythmReference | None = Field(description="Null if no published ratio fits direction and plane.")


class RhythmLead(Schema):
    """How much further the scapula turned from the start of the motion than the sound side's at the same elevation, while the arm is raised."""

    of: CurveOf
    from_deg: float = Field(description="Lowest elevation that both motions cover, degrees.")
    to_deg: float = Field(description="Highest one, below the apparatus' limit of the scapula.")
    largest_deg: float = Field(description="Largest difference; below 0 where it turned less.")
    at_elevation_deg: float = Field(description="The elevation of that difference.")
    ahead_from_deg: float | None = Field(
        description="Lowest elevation at which the scapula runs ahead by more than 4 deg; null if it does not."
    )


class SoundRecording(Schema):
    """The sound side's recording that is compared."""

    recording_id: UUID
    name: str
    side: Side
    taught_at: Moment


class ApparatusRhythm(Schema):
    """Scapulohumeral rhythm in angles of the apparatus' links, which are not bones."""

    side: Side
    recording_id: UUID
    run_id: UUID | None = Field(description="Null for a recording.")
    moved_at: Moment = Field(description="When the motion was taught, or its run loaded.")
    elevation_min_deg: float = Field(description="Lowest elevation of the upper arm in the motion, degrees.")
    elevation_max_deg: float = Field(description="Highest one.")
    scapula_min_deg: float = Field(description="Lowest upward rotation of the scapula, degrees.")
    scapula_max_deg: float = Field(description="Highest one.")
    curves: list[RhythmCurve] = Field(description="Empty if the arm was never raised or lowered by 30 deg.")
    sound: SoundRecording | None
    no_sound: NoSound | None = Field(description="Why nothing is compared; null with a sound recording.")
    leads: list[RhythmLead]
