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
    """A published ratio of healthy people who moved their arm themselves, measured on bones. It is not a normal range for this
    apparatus.
    """

    source: Source
    ratio: float = Field(description=_RATIO, examples=[2.0])
    ratio_deviation: float | None = Field(
        description="Standard deviation between people; null if none was published.", examples=[0.4]
    )


class RhythmBand(Schema):
    """The ratio within a band of elevation, or the reason why there is none."""

    from_deg: float = Field(description="Elevation of the upper arm at the band's lower end, degrees.")
    to_deg: float = Field(description="Elevation of the upper arm at the band's upper end, degrees.")
    ratio: float | None = Field(description=f"{_RATIO} The median of the passes.", examples=[2.1])
    reason: NoRatio | None = Field(description="Reason why there is no ratio; null if there is one.")
    scapula_deg: float | None = Field(description="Upward rotation of the scapula within the band, degrees.")
    joint_deg: float | None = Field(
        description="Increase of the elevation in the shoulder joint within the band, degrees."
    )
    passes: int = Field(ge=1, description="Number of passes with this ratio.")


class RhythmCurve(Schema):
    """Upward rotation of the scapula over the elevation of the upper arm while the arm is raised or lowered. Of several passes, it is
    the widest.
    """

    of: CurveOf
    direction: Direction
    plane: Plane = Field(
        description="Plane in which the arm is raised: abduction (at the side), scaption (in the scapula's plane), flexion (forward), other, "
        "or changing."
    )
    plane_deg: float = Field(
        description="Median angle of this plane from 30 deg of elevation on: 0 at the side, 90 forward."
    )
    passes: int = Field(ge=1)
    elevation_deg: list[float] = Field(description="Elevation of the upper arm against the trunk, ascending, degrees.")
    scapula_deg: list[float] = Field(description="Upward rotation of the scapula at each elevation, degrees.")
    bands: list[RhythmBand] = Field(description="Bands of elevation: 30 to 60, 60 to 90 and 90 to 120 deg.")
    whole: RhythmBand = Field(
        description="Band from 30 deg to the end of the pass, or to the elevation at which the scapula reached the apparatus's limit."
    )
    reference: RhythmReference | None = Field(
        description="Null if there is no published ratio for direction and plane."
    )


class RhythmLead(Schema):
    """Additional turn of the scapula since the start of the motion, compared with the sound side at the same elevation, while the
    arm is raised.
    """

    of: CurveOf
    from_deg: float = Field(description="Lowest elevation that both motions cover, degrees.")
    to_deg: float = Field(
        description="Highest elevation that both motions cover, below the apparatus's limit of the scapula."
    )
    largest_deg: float = Field(description="Largest difference, degrees; below 0 if this scapula turned less.")
    at_elevation_deg: float = Field(description="Elevation at which this difference occurs, degrees.")
    ahead_from_deg: float | None = Field(
        description="Lowest elevation at which the scapula is ahead by more than 4 deg; null if there is none."
    )


class SoundRecording(Schema):
    """The recording of the sound side with which the rhythm is compared."""

    recording_id: UUID
    name: str
    side: Side
    taught_at: Moment


class ApparatusRhythm(Schema):
    """Scapulohumeral rhythm in angles of the apparatus's links, which are not bones."""

    side: Side
    recording_id: UUID
    run_id: UUID | None = Field(description="Null for a recording.")
    moved_at: Moment = Field(description="Time at which the motion was taught or its run was loaded.")
    elevation_min_deg: float = Field(description="Lowest elevation of the upper arm in the motion, degrees.")
    elevation_max_deg: float = Field(description="Highest elevation of the upper arm in the motion, degrees.")
    scapula_min_deg: float = Field(description="Lowest upward rotation of the scapula, degrees.")
    scapula_max_deg: float = Field(description="Highest upward rotation of the scapula, degrees.")
    curves: list[RhythmCurve] = Field(description="Empty if the arm was never raised or lowered by 30 deg.")
    sound: SoundRecording | None
    no_sound: NoSound | None = Field(
        description="Reason why there is no comparison; null if there is a recording of the sound side."
    )
    leads: list[RhythmLead]
