"""Check whether recordings can be played with the settings of a programme, and how long that takes.

The database is read first. The samples are then examined outside any transaction, in the worker process that builds figures, because an
hour of motion would block the service's heartbeats.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from uuid import UUID

from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.episodes import limits
from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.programmes.schemas import ProgrammeItemRequest
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import end_range
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.database.arrays import UnreadableError
from kata.database.series import Series, unpack
from kata.device.config import StationConfig
from kata.errors import ProblemError, not_found
from kata.messages import Text, text_of
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import EditError, Motion, PlaybackSettings, with_settings
from kata.motion.end_range import LEAST_RANGE_DEG, end_of_motion
from kata.motion.linkage import OutOfReachError, pose_deg
from kata.motion.method import Method, reference
from kata.motion.repetitions import repetition_times
from kata.motion.texts import SIDES
from kata.motion.tracking import moved_motions
from kata.motion.trajectory import TrajectoryError
from kata.plotting.figures import FigureWorker


@dataclass(frozen=True)
class CheckData:
    """The records that the check needs: problems by position, samples of the other items, and the doctor's limits."""

    problems: dict[int, ProblemError]
    samples: dict[UUID, Series]
    allowed: DoctorLimits


@dataclass(frozen=True)
class ItemProblem:
    """The reason why an item cannot be played."""

    why: Text
    code: str = "unplayable"
    next_step: Text = field(default_factory=texts.CHOOSE_OTHER_SETTINGS_OR_RECORDING)


@dataclass(frozen=True)
class ItemPlayback:
    """One recording with the settings that determine its duration and whether it can be played."""

    recording_id: UUID
    asked: PlaybackSettings
    method: Method
    resistance_level: int
    end_range: EndRangePrescription | None = None


def playback_of(item: ProgrammeItemRequest) -> ItemPlayback:
    """Return the settings on which an item's check depends."""
    settings = PlaybackSettings(item.speed_percent, item.repetitions, item.pause_s, item.range_percent)
    return ItemPlayback(item.recording_id, settings, item.method, item.resistance_level, item.end_range)


def item_problems(
    session: Session, episode: EpisodeRow, items: Sequence[ProgrammeItemRequest]
) -> dict[int, ProblemError]:
    """Return the items that cannot be in this episode's programme, by position from 1, with the reason."""
    problems = {}
    for place, item in enumerate(items, start=1):
        problem = _item_problem(session.get(RecordingRow, item.recording_id), item, episode, place)
        if problem:
            problems[place] = problem
    return problems


def look_up(session: Session, episode: EpisodeRow, items: Sequence[ProgrammeItemRequest]) -> CheckData:
    """Read the records that the check needs from the database."""
    problems = item_problems(session, episode, items)
    fitting = {item.recording_id for place, item in enumerate(items, start=1) if place not in problems}
    samples = {key: recordings.stored_samples(session, key) for key in fitting}
    return CheckData(problems, samples, limits.of_episode(episode))


def check(
    worker: FigureWorker, data: CheckData, items: Sequence[ProgrammeItemRequest], config: StationConfig
) -> list[float | ProblemError]:
    """Return each item's duration in seconds, or why the item cannot be played. This waits for the worker process: call it from a worker
    thread.
    """
    playbacks = {playback_of(item) for place, item in enumerate(items, start=1) if place not in data.problems}
    lasting = dict(worker.build(durations, tuple(playbacks), data.samples, config, data.allowed)) if playbacks else {}
    checked: list[float | ProblemError] = []
    for place, item in enumerate(items, start=1):
        lasts_s = data.problems[place] if place in data.problems else lasting[playback_of(item)]
        checked.append(_unplayable(place, lasts_s) if isinstance(lasts_s, ItemProblem) else lasts_s)
    return checked


def durations(
    playbacks: Sequence[ItemPlayback], samples: dict[UUID, Series], config: StationConfig, allowed: DoctorLimits
) -> list[tuple[ItemPlayback, float | ItemProblem]]:
    """Return each duration in seconds, or why the station cannot play the item or the doctor forbids it. The worker process runs this."""
    return [(playback, _duration(playback, samples[playback.recording_id], config, allowed)) for playback in playbacks]


def _duration(
    playback: ItemPlayback, series: Series, config: StationConfig, allowed: DoctorLimits
) -> float | ItemProblem:
    try:
        columns = unpack(series)
        motion = Motion(columns["time_s"], columns["angle_deg"])
        times = repetition_times(motion, playback.asked)
        # Two repetitions contain every transition that many repetitions contain.
        short = with_settings(motion, replace(playback.asked, repetitions=min(playback.asked.repetitions, 2)))
        config.check_reference(
            playback.method, reference(playback.method, short.times_s, short.angles_deg), allowed.side
        )
        allowed.check_path(short, playback.method)
        if playback.end_range:
            prescribed, side = playback.end_range, allowed.side
            if why := _end_range_problem(prescribed, motion, short, side):
                return ItemProblem(why, next_step=texts.CHANGE_END_RANGE())
            if why := end_range.level_problem(motion, side, config, prescribed, playback.resistance_level):
                return ItemProblem(why, next_step=texts.CHANGE_LEVEL_OR_TORQUE())
    except UnreadableError:
        return ItemProblem(texts.ITEM_SAMPLES_DAMAGED())
    except (EditError, TrajectoryError) as error:
        return ItemProblem(text_of(error))
    except ProblemError as problem:
        return ItemProblem(problem.message, problem.code, problem.next_step)
    return times.duration_s


def _end_range_problem(prescribed: EndRangePrescription, taught: Motion, played: Motion, side: Side) -> Text | None:
    """Return the reason why no end-range time of the prescribed motion could be counted, or None."""
    motion = BASIC_MOTIONS[prescribed.motion - 1]
    try:
        moved = moved_motions(pose_deg(taught.angles_deg, side))
    except OutOfReachError:
        # Only the motors of such a run are compared.
        moved = ()
    motor = end_range.motor_of(prescribed)
    end = end_of_motion(taught.angles_deg, motor, end_range.threshold_of(prescribed))
    if motion not in moved or end is None:
        return texts.ITEM_WITHOUT_END(motion=motion.name, least_deg=LEAST_RANGE_DEG)
    short_deg = float(min(end.outward * (end.end_deg - played.angles_deg[:, motor - 1])))
    if short_deg > prescribed.band_deg:
        return texts.ITEM_BEFORE_END(motion=motion.name, short_deg=short_deg, band_deg=prescribed.band_deg)
    return None


def _unplayable(place: int, unfit: ItemProblem) -> ProblemError:
    return ProblemError(422, unfit.code, texts.ITEM_NOT_PLAYABLE(place=place, reason=unfit.why), unfit.next_step)


def _item_problem(
    recording: RecordingRow | None, item: ProgrammeItemRequest, episode: EpisodeRow, place: int
) -> ProblemError | None:
    if recording is None:
        return not_found(texts.RECORDING_NOT_FOUND)
    item_of = {"place": place, "recording": recording.name}
    if recording.patient_id != episode.patient_id:
        return ProblemError(409, "other_patient", texts.ITEM_OF_OTHER_PATIENT(**item_of), texts.CHOOSE_OWN_RECORDING())
    if recording.side != episode.side:
        other = texts.ITEM_OF_OTHER_SIDE(**item_of, side=SIDES[recording.side], treated=SIDES[episode.side])
        return ProblemError(409, "other_side", other, texts.CHOOSE_OTHER_SHOULDER_RECORDING())
    if recording.archived_at:
        return ProblemError(409, "archived", texts.ITEM_ARCHIVED(**item_of), texts.RESTORE_OR_CHOOSE_ANOTHER())
    if episode.max_resistance_level is not None and item.resistance_level > episode.max_resistance_level:
        levels = {"level": item.resistance_level, "highest": episode.max_resistance_level}
        above = (
            texts.ITEM_ABOVE_RESISTANCE_LEVEL_BY(**item_of, **levels, doctor=episode.limits_by)
            if episode.limits_by
            else texts.ITEM_ABOVE_RESISTANCE_LEVEL(**item_of, **levels)
        )
        return ProblemError(409, "above_limit", above, texts.CHOOSE_LOWER_LEVEL())
    return _self_paced_problem(item, episode, place, recording.name) if item.self_paced else None


def _self_paced_problem(
    item: ProgrammeItemRequest, episode: EpisodeRow, place: int, recording: str
) -> ProblemError | None:
    if not episode.self_paced_permitted:
        refused = texts.ITEM_SELF_PACE_NOT_PERMITTED(place=place, recording=recording)
        return ProblemError(409, "self_pace_not_permitted", refused, texts.ASK_DOCTOR_OR_PRESCRIBE_OWN_PACE())
    if item.method != "smooth":
        return ProblemError(
            422,
            "not_self_paced",
            texts.ITEM_SELF_PACED_WITH_METHOD(place=place, recording=recording),
            texts.CHOOSE_SMOOTH_OR_OWN_PACE(),
        )
    return None
