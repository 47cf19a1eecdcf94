"""Read the samples of a motion and of the sound side, and calculate the rhythm in the worker process."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.patients import service as patients
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.sound_side import NoSound, SoundSide, sound_side
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.rhythm.schemas import (
    ApparatusRhythm,
    RhythmLead,
    SoundMotion,
    SoundRecording,
    SoundRhythm,
)
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RUN_SAMPLES
from kata.database.arrays import UnreadableError
from kata.database.series import Series, unpack
from kata.device.journal import PHASE_PLAYING, PHASE_REDUCED_RANGE
from kata.errors import ProblemError
from kata.motion.linkage import OutOfReachError
from kata.motion.rhythm import Lead, MotionRhythm, lead, rhythm_of
from kata.plotting.figures import FigureWorker
from kata.station.rhythm_schemas import CurveOf, curve_of, maybe_rounded, rounded
from kata.types import Side, side_of


@dataclass(frozen=True)
class StoredSound:
    """The recordings of the sound side with their samples, newest first, or the reason why there are none."""

    side: Side | None
    """None unless exactly one side has episodes of care."""
    rows: list[tuple[SoundRecording, Series]]
    reason: NoSound | None


@dataclass(frozen=True)
class _NoPose:
    reason: str


@dataclass(frozen=True)
class StoredMotion:
    """The stored data of a recording, or of a run and its recording."""

    recording_id: UUID
    run_id: UUID | None
    side: Side
    moved_at: datetime
    taught: Series
    played: Series | None
    sound: StoredSound


def of_recording(session: Session, recording_id: UUID) -> StoredMotion:
    """Return the stored data of a recording.

    :raises ProblemError: 404.
    """
    row = recordings.get(session, recording_id)
    stored = recordings.stored_samples(session, recording_id)
    return StoredMotion(row.id, None, side_of(row.side), row.taught_at, stored, None, _sound(session, row))


def of_run(session: Session, run_id: UUID) -> StoredMotion:
    """Return the stored data of a run.

    :raises ProblemError: 404; 409 when nothing was played.
    """
    run = runs.get(session, run_id)
    played = RUN_SAMPLES.read(session, run_id)
    if not played.head:
        raise ProblemError(409, "nothing_played", texts.NOTHING_PLAYED(), texts.NOTHING_TO_COMPARE())
    row = run.recording
    taught = recordings.stored_samples(session, row.id)
    return StoredMotion(row.id, run.id, side_of(row.side), run.started_at, taught, played, _sound(session, row))


def rhythm(worker: FigureWorker, stored: StoredMotion) -> ApparatusRhythm:
    """Return the rhythm of a motion.

    :raises ProblemError: 409 when nothing was played; 410 when samples are damaged; 422 when no scapula can have a pose with these angles.
    """
    result = worker.build(_rhythm, stored)
    if result is None:
        raise ProblemError(409, "nothing_played", texts.NOTHING_PLAYED(), texts.NOTHING_TO_COMPARE())
    if isinstance(result, _NoPose):
        raise ProblemError(422, "no_pose", texts.RHYTHM_NO_POSE(reason=result.reason), texts.RHYTHM_CHECK_APPARATUS())
    return result


def _sound(session: Session, row: RecordingRow) -> StoredSound:
    """Return the newest recordings that were taught on the sound side, which is the side that never had an episode."""
    found = sound_side(session, row.patient_id, simulated=row.simulated)
    return StoredSound(found.side, [], "sound_side") if row.side == found.side else _stored(found)


def _stored(found: SoundSide) -> StoredSound:
    rows = [
        (
            SoundRecording(recording_id=row.id, name=row.name, side=side_of(row.side), taught_at=row.taught_at),
            series,
        )
        for row, series in found.rows
    ]
    return StoredSound(found.side, rows, found.reason)


def of_sound_side(session: Session, patient_id: UUID, *, simulated: bool) -> StoredSound:
    """Return the stored data of a patient's sound side.

    :raises ProblemError: 404.
    """
    patients.get(session, patient_id)
    return _stored(sound_side(session, patient_id, simulated=simulated))


def sound_rhythm(worker: FigureWorker, stored: StoredSound) -> SoundRhythm:
    """Return the rhythm of the sound side. A recording without a pose, or with damaged samples, is left out."""
    return SoundRhythm(side=stored.side, no_sound=stored.reason, motions=worker.build(_sound_motions, stored))


def _sound_motions(sound: StoredSound) -> list[SoundMotion]:
    motions: list[SoundMotion] = []
    for recording, series in sound.rows:
        with suppress(OutOfReachError, UnreadableError):
            taught = _taught(series, recording.side)
            motions.append(
                SoundMotion(
                    recording=recording,
                    start_elevation_deg=rounded(taught.start_deg[0]),
                    start_scapula_deg=rounded(taught.start_deg[1]),
                    curves=[curve_of("sound", one) for one in taught.rhythms],
                )
            )
    return motions


def _rhythm(stored: StoredMotion) -> ApparatusRhythm | _NoPose | None:
    """Return the rhythm, or the reason why there is none, or None if a run played nothing. The reason is returned instead of raised,
    because an exception would lose its parts on the way from the worker.
    """
    try:
        motions = _motions(stored)
        return _compared(stored, motions) if motions else None
    except OutOfReachError as error:
        return _NoPose(error.text)


def _motions(stored: StoredMotion) -> dict[CurveOf, MotionRhythm]:
    """Return the taught motion and, for a run, the played motion. Return nothing if the run played nothing."""
    taught = _taught(stored.taught, stored.side)
    if stored.played is None:
        return {"taught": taught}
    samples = unpack(stored.played)
    moving = np.isin(samples["phase"], (PHASE_PLAYING, PHASE_REDUCED_RANGE))
    if not np.any(moving):
        return {}
    measured = samples["measured_deg"][moving].astype(np.float64)
    return {"played": rhythm_of(samples["time_s"][moving], measured, stored.side), "taught": taught}


def _compared(stored: StoredMotion, motions: dict[CurveOf, MotionRhythm]) -> ApparatusRhythm:
    own_rhythm = next(iter(motions.values()))
    sound, compared = _like(own_rhythm, stored.sound.rows)
    no_sound = None if sound else stored.sound.reason or "no_like_motion"
    curves = [curve_of(of, other) for of, motion in motions.items() for other in motion.rhythms]
    leads: list[RhythmLead] = []
    if compared is not None:
        curves += [curve_of("sound", other) for other in compared.rhythms if own_rhythm.like(other.widest)]
        found_leads = ((of, lead(motion, compared)) for of, motion in motions.items())
        leads = [_lead(of, found_lead) for of, found_lead in found_leads if found_lead is not None]
    return ApparatusRhythm(
        side=stored.side,
        recording_id=stored.recording_id,
        run_id=stored.run_id,
        moved_at=stored.moved_at,
        elevation_min_deg=rounded(own_rhythm.elevation_range_deg[0]),
        elevation_max_deg=rounded(own_rhythm.elevation_range_deg[1]),
        scapula_min_deg=rounded(own_rhythm.scapula_range_deg[0]),
        scapula_max_deg=rounded(own_rhythm.scapula_range_deg[1]),
        curves=curves,
        sound=sound,
        no_sound=no_sound,
        leads=leads,
    )


def _taught(series: Series, side: Side) -> MotionRhythm:
    samples = unpack(series)
    return rhythm_of(samples["time_s"], samples["angle_deg"], side)


def _like(
    own_motion: MotionRhythm, sound: Sequence[tuple[SoundRecording, Series]]
) -> tuple[SoundRecording | None, MotionRhythm | None]:
    """Return the first recording that has a pass in the same direction and plane as a pass of ``own_motion``."""
    for row, series in sound:
        taught = _taught(series, row.side)
        if any(taught.like(own_rhythm.widest) for own_rhythm in own_motion.rhythms):
            return row, taught
    return None, None


def _lead(of: CurveOf, motion_lead: Lead) -> RhythmLead:
    return RhythmLead(
        of=of,
        from_deg=rounded(motion_lead.from_deg),
        to_deg=rounded(motion_lead.to_deg),
        largest_deg=rounded(motion_lead.largest_deg),
        at_elevation_deg=rounded(motion_lead.at_elevation_deg),
        ahead_from_deg=maybe_rounded(motion_lead.ahead_from_deg),
    )
