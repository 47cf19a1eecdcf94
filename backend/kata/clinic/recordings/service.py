"""Read and write recordings. The caller commits."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final
from uuid import UUID, uuid4, uuid5

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.patients import service as patients
from kata.clinic.recordings.derive import Derived, OtherRecording, Source
from kata.clinic.recordings.edits import Edit, GuideScapula, Reteach
from kata.clinic.recordings.schemas import MotorRange, ReachMargin, RecordingUpdate
from kata.clinic.recordings.sound_side import NoSound, sound_side
from kata.clinic.recordings.tables import RECORDING_COLUMNS, RECORDING_SAMPLES, RecordingRow, TeachingRow
from kata.clinic.stations import service as stations
from kata.database.arrays import UnreadableError
from kata.database.base import utc_now
from kata.database.series import Series, pack, unpack
from kata.device.journal import Journal
from kata.errors import ProblemError, check_version, not_found
from kata.messages import Template, sent_key
from kata.motion.axes import Side
from kata.motion.reach import nearest, reachable_set
from kata.pagination import Keyset
from kata.plotting import downsampling
from kata.plotting.figures import RecordingFigureSamples, Window
from kata.station.schemas import TextKey
from kata.types import LONGEST_NAME, side_of

SHORTEST_TAKE_S: Final = 0.5
"""Shortest press of the pedal in seconds that makes a recording. A shorter press is ignored."""
_SPEED_WINDOW_S: Final = 0.1
_NO_SOUND: Final[dict[NoSound, Template]] = {
    "sides_unknown": texts.SOUND_SIDE_UNKNOWN,
    "sound_side": texts.IS_SOUND_SIDE,
    "no_recording": texts.NO_SOUND_RECORDING,
}
_NEWEST_FIRST: Final = Keyset(
    tuple[bool, datetime, int, UUID],
    RecordingRow.archived_at.is_(None),
    RecordingRow.taught_at,
    func.coalesce(RecordingRow.take, 0),
    RecordingRow.id,
    descending=True,
)
"""The order of a list of recordings: newest first, archived ones last."""


@dataclass(frozen=True)
class Samples:
    """``times_s``: ``(n,)``, from 0. ``angles_deg``: ``(n, 5)`` motor angles in axis order."""

    times_s: NDArray[np.float64]
    angles_deg: NDArray[np.float64]


def of_patient(
    session: Session, patient_id: UUID, limit: int, after: str | None
) -> tuple[Sequence[RecordingRow], str | None]:
    """Return a page of a patient's recordings (newest first, archived ones last) and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    query = select(RecordingRow).where(RecordingRow.patient_id == patient_id)
    rows = list(session.scalars(_NEWEST_FIRST.page(query, after, limit)))
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.archived_at is None, row.taught_at, row.take or 0, row.id))


def get(session: Session, recording_id: UUID, *, to_change: bool = False) -> RecordingRow:
    """Return one recording without its samples. ``to_change`` locks the row until the commit.

    :raises ProblemError: 404.
    """
    row = session.get(RecordingRow, recording_id, with_for_update=to_change or None)
    if row is None:
        raise not_found(texts.RECORDING_NOT_FOUND)
    return row


def samples(session: Session, recording_id: UUID) -> Samples:
    """Return a recording's samples.

    :raises ProblemError: 404; 410 when they are damaged.
    """
    try:
        columns = unpack(stored_samples(session, recording_id))
    except UnreadableError as error:
        raise ProblemError(
            410,
            "unreadable_samples",
            texts.RECORDING_SAMPLES_DAMAGED(),
            texts.RESTORE_OR_TEACH_AGAIN(),
        ) from error
    return Samples(columns["time_s"], columns["angle_deg"])


def stored_samples(session: Session, recording_id: UUID) -> Series:
    """Return a recording's samples as they are stored; empty if they are missing.

    :raises ProblemError: 404.
    """
    get(session, recording_id)
    return RECORDING_SAMPLES.read(session, recording_id)


def figure_samples(session: Session, recording_id: UUID, window: Window | None) -> RecordingFigureSamples:
    """Return the data of the recording's figure.

    :raises ProblemError: 404.
    """
    get(session, recording_id)
    if window:
        return RecordingFigureSamples(
            RECORDING_SAMPLES.read_within(session, recording_id, "time_s", *window), None, window
        )
    overview = RECORDING_SAMPLES.read_overview(session, recording_id)
    return RecordingFigureSamples(
        RECORDING_SAMPLES.read(session, recording_id) if overview is None else None, overview, None
    )


def ranges(taught: Samples) -> list[MotorRange]:
    """Return the range and speed of each motor."""
    # The samples of a motion that was joined from parts have irregular times.
    begins_s = taught.times_s[taught.times_s <= taught.times_s[-1] - _SPEED_WINDOW_S]
    motor_ranges = []
    for axis, angles in enumerate(taught.angles_deg.T):
        later = np.interp(begins_s + _SPEED_WINDOW_S, taught.times_s, angles)
        speeds = np.abs(later - angles[: len(begins_s)]) / _SPEED_WINDOW_S
        motor_ranges.append(
            MotorRange(
                motor=axis + 1,
                min_deg=float(angles.min()),
                max_deg=float(angles.max()),
                max_speed_deg_s=float(speeds.max(initial=0.0)),
            )
        )
    return motor_ranges


def margin(taught: Samples, side: Side) -> ReachMargin:
    """Return the point at which the motion is nearest to the edge of the reachable set. Takes 1.4 s for an hour of motion."""
    nearest_point = nearest(taught.angles_deg, lambda motors_deg: reachable_set(motors_deg, side))
    return ReachMargin(
        margin_deg=round(nearest_point.margin_deg, 1),
        at_s=float(taught.times_s[nearest_point.row]),
        quantity=str(nearest_point.quantity),
        quantity_key=TextKey.of(nearest_point.quantity),
        value_deg=round(nearest_point.value_deg, 1),
        limit_deg=nearest_point.limit_deg,
    )


def source(session: Session, recording_id: UUID, edit: Edit) -> Source:
    """Return the recording as the source of an edit, with the other recordings that the edit needs.

    :raises ProblemError: 404; 422 when a recording that the edit needs is missing or belongs to another shoulder.
    """
    row = get(session, recording_id)
    others: list[tuple[RecordingRow, Series]] = []
    if isinstance(edit, GuideScapula):
        others = _of_sound_side(session, row)
    elif isinstance(edit, Reteach):
        others = [_new_part(session, row, edit.recording_id)]
    return Source(
        stored_samples(session, recording_id),
        side_of(row.side),
        tuple(row.done),
        tuple(OtherRecording(other.name, series) for other, series in others),
    )


def _of_sound_side(session: Session, row: RecordingRow) -> list[tuple[RecordingRow, Series]]:
    found = sound_side(session, row.patient_id, simulated=row.simulated)
    reason: NoSound | None = "sound_side" if row.side == found.side else found.reason
    if reason:
        raise ProblemError(422, "impossible", texts.EDIT_REFUSED(reason=_NO_SOUND[reason]()), texts.TEACH_SOUND_SIDE())
    return found.rows


def _new_part(session: Session, row: RecordingRow, part_id: UUID) -> tuple[RecordingRow, Series]:
    part = get(session, part_id)
    if (part.patient_id, part.side, part.simulated) != (row.patient_id, row.side, row.simulated):
        raise ProblemError(422, "impossible", texts.EDIT_REFUSED(reason=texts.PART_OF_OTHER()), texts.TEACH_PART())
    samples(session, part_id)
    return part, stored_samples(session, part_id)


def store_derived(session: Session, parent_id: UUID, derived: Derived, name: str | None, station: str) -> RecordingRow:
    """Store a derived recording. Its default name is the parent's name and the edit.

    :raises ProblemError: 404.
    """
    parent = get(session, parent_id)
    last_step = derived.done[-1]
    row = RecordingRow(
        id=uuid4(),
        patient_id=parent.patient_id,
        teaching_id=None,
        take=None,
        parent_id=parent.id,
        done=[str(step) for step in derived.done],
        done_keys=[*_known_keys(parent), *(sent_key(step) for step in derived.done[len(parent.done) :])],
        name=name or f"{parent.name[: LONGEST_NAME - len(last_step) - 2]}, {last_step}",
        side=derived.side,
        station=station,
        taught_by=parent.taught_by,
        fixtures=list(parent.fixtures),
        taught_at=utc_now(),
        duration_s=derived.duration_s,
        rate_hz=parent.rate_hz,
        samples=derived.samples,
        simulated=parent.simulated,
        note="",
        archived_at=None,
    )
    session.add(row)
    session.flush()
    RECORDING_SAMPLES.store(session, row.id, derived.series, derived.downsampled)
    return row


def update(session: Session, recording_id: UUID, change: RecordingUpdate) -> RecordingRow:
    """Rename, annotate, archive or restore a recording.

    :raises ProblemError: 404; 409 when the recording was changed meanwhile.
    """
    row = get(session, recording_id, to_change=True)
    patients.check_not_erased(patients.get(session, row.patient_id))
    check_version(row.updated_at, change.updated_at)
    if change.name is not None:
        row.name = change.name
    if change.note is not None:
        row.note = change.note
    if change.archived is not None:
        row.archived_at = (row.archived_at or utc_now()) if change.archived else None
    row.updated_at = utc_now()
    return row


def store_teaching(session: Session, journal: Journal) -> list[RecordingRow] | None:
    """Store a teaching's journal as recordings, one per take. Existing recordings are not changed.

    :returns: the new recordings, or None if this teaching is unknown.
    """
    teaching = session.get(TeachingRow, UUID(journal.id))
    if teaching is None:
        return None
    new = []
    for take in np.unique(journal.take).tolist():
        of_take = journal.take == take
        times_s = (journal.t_ns[of_take] - journal.t_ns[of_take][0]) / 1e9
        recording_id = uuid5(teaching.id, str(take))
        if times_s[-1] < SHORTEST_TAKE_S or session.get(RecordingRow, recording_id):
            continue
        angles_deg = journal.measured_deg[of_take].astype(np.float64)
        taught_at = _wall_time(journal, int(journal.t_ns[of_take][0]))
        row = RecordingRow(
            id=recording_id,
            patient_id=teaching.patient_id,
            teaching_id=teaching.id,
            take=take,
            name=teaching.name if take == 1 else f"{teaching.name[:90]} ({take})",
            side=teaching.side,
            station=journal.station,
            taught_by=teaching.taught_by,
            fixtures=list(teaching.fixtures),
            taught_at=taught_at,
            duration_s=float(times_s[-1]),
            rate_hz=journal.rate_hz,
            samples=len(times_s),
            simulated=stations.is_simulated(session, journal.station, taught_at),
            note="",
            archived_at=None,
        )
        session.add(row)
        session.flush()
        series = pack({"time_s": times_s, "angle_deg": angles_deg}, RECORDING_COLUMNS)
        RECORDING_SAMPLES.store(session, recording_id, series, downsampling.of_recording(times_s, angles_deg))
        new.append(row)
    return new


def _wall_time(journal: Journal, t_ns: int) -> datetime:
    """Return a sample's time in UTC. The journal contains its start time on both clocks."""
    return journal.started_at + timedelta(seconds=(t_ns - journal.started_ns) / 1e9)


def _known_keys(row: RecordingRow) -> list[dict[str, Any] | None]:
    """Return the codes of a recording's edits. An edit of a version that did not store codes has None."""
    return list(row.done_keys) if row.done_keys is not None else [None] * len(row.done)
