"""Find a patient's sound side and the motions that were taught there."""

from dataclasses import dataclass
from typing import Final, Literal
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.recordings.tables import RECORDING_SAMPLES, RecordingRow
from kata.database.series import Series
from kata.motion.axes import OPPOSITE
from kata.types import Side, side_of

NoSound = Literal["sides_unknown", "sound_side", "no_recording", "no_like_motion"]

_MOST: Final = 5
"""Maximum number of the sound side's recordings that are compared, newest first."""


@dataclass(frozen=True)
class SoundSide:
    """The recordings of the sound side with their samples, newest first, or the reason why there are none."""

    side: Side | None
    """None unless exactly one side has episodes of care."""
    rows: list[tuple[RecordingRow, Series]]
    reason: NoSound | None


def sound_side(session: Session, patient_id: UUID, *, simulated: bool) -> SoundSide:
    """Return the newest recordings that were taught on the sound side, which is the side that never had an episode.

    :param simulated: whether to return recordings of simulated apparatus, or of real ones.
    """
    treated = set(session.scalars(select(EpisodeRow.side).where(EpisodeRow.patient_id == patient_id)))
    if len(treated) != 1:
        return SoundSide(None, [], "sides_unknown")
    side = OPPOSITE[side_of(treated.pop())]
    found = session.scalars(
        select(RecordingRow)
        .where(
            RecordingRow.patient_id == patient_id,
            RecordingRow.side == side,
            # A derived recording may be a mirrored recording of the treated side.
            RecordingRow.parent_id.is_(None),
            RecordingRow.archived_at.is_(None),
            RecordingRow.simulated == simulated,
        )
        .order_by(RecordingRow.taught_at.desc(), RecordingRow.take.desc())
        .limit(_MOST)
    )
    rows = [(row, RECORDING_SAMPLES.read(session, row.id)) for row in found]
    return SoundSide(side, rows, None if rows else "no_recording")
