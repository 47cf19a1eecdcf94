"""Response models of the rhythm."""

from uuid import UUID

from pydantic import Field

from kata.clinic.recordings.sound_side import NoSound
from kata.station.rhythm_schemas import CurveOf, RhythmCurve
from kata.types import Moment, Schema, Side


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


class SoundMotion(Schema):
    """A recording of the sound side: its start and its curves."""

    recording: SoundRecording
    start_elevation_deg: float = Field(description="Elevation of the upper arm at the start of the motion, degrees.")
    start_scapula_deg: float = Field(description="Upward rotation of the scapula at the start of the motion, degrees.")
    curves: list[RhythmCurve]


class SoundRhythm(Schema):
    """The rhythm of a patient's sound side, with which a live motion of the other side is compared."""

    side: Side | None = Field(description="The sound side; null unless exactly one side has episodes of care.")
    no_sound: NoSound | None = Field(description="Reason why there are no motions; null if there are.")
    motions: list[SoundMotion] = Field(
        description="The newest recordings of the sound side, newest first, at most five."
    )
