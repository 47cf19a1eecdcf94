"""Derive a recording from another, and check it as the device checks a load.

Run it in the worker process that builds figures, because an hour of motion would block the service's heartbeats.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

from kata.clinic import texts
from kata.clinic.recordings.edits import (
    Edit,
    GuideScapula,
    Hold,
    Isolate,
    Mirror,
    Reteach,
    Retouch,
    Scale,
    Stretch,
    Trim,
    WarmUp,
)
from kata.clinic.recordings.tables import RECORDING_COLUMNS
from kata.database.arrays import UnreadableError
from kata.database.series import Series, pack, unpack
from kata.device.config import StationConfig
from kata.motion import edit
from kata.motion import texts as motion_texts
from kata.motion.axes import OPPOSITE, Side
from kata.motion.edit import LONGEST_S, EditError, Motion
from kata.motion.guided import GuidingMotion, guided
from kata.motion.linkage import OutOfReachError
from kata.motion.method import reference
from kata.motion.retaught import retaught
from kata.motion.retouch import ChangePoint, retouched
from kata.motion.rhythm import rhythm_of
from kata.motion.sides import mirrored_deg
from kata.plotting import downsampling


@dataclass(frozen=True)
class OtherRecording:
    """A recording that an edit needs besides the edited one."""

    name: str
    series: Series


@dataclass(frozen=True)
class Source:
    """The recording to be edited: stored samples, side and earlier edits."""

    series: Series
    side: Side
    done: tuple[str, ...]
    others: tuple[OtherRecording, ...] = ()
    """For a guide: the newest recordings of the sound side. For a reteach: the recording of the new part."""


@dataclass(frozen=True)
class Derived:
    """The new recording: samples to store, side, and all edits as texts."""

    series: Series
    downsampled: bytes | None
    side: Side
    done: tuple[str, ...]
    duration_s: float
    samples: int


def derive(source: Source, edit_request: Edit, config: StationConfig) -> Derived:
    """Apply an edit and check the result.

    :raises UnreadableError: when the samples are damaged.
    :raises EditError: when this motion cannot be edited in this way.
    :raises TrajectoryError: when the station could not play the result. The message names motor and time.
    """
    columns = unpack(source.series)
    motion = Motion(columns["time_s"], columns["angle_deg"], source.done)
    side = OPPOSITE[source.side] if isinstance(edit_request, Mirror) else source.side
    edited = _done(motion, edit_request, source, side)
    if edited.duration_s > LONGEST_S:
        raise EditError(motion_texts.WOULD_LAST_TOO_LONG(minutes=edited.duration_s / 60))
    series = pack({"time_s": edited.times_s, "angle_deg": edited.angles_deg}, RECORDING_COLUMNS)
    # Check the stored samples, because these will be played.
    stored = unpack(series)
    config.check_reference("smooth", reference("smooth", stored["time_s"], stored["angle_deg"]), side)
    downsampled = downsampling.of_recording(stored["time_s"], stored["angle_deg"])
    return Derived(series, downsampled, side, edited.done, float(stored["time_s"][-1]), len(stored["time_s"]))


def _done(motion: Motion, edit_request: Edit, source: Source, to_side: Side) -> Motion:
    match edit_request:
        case Trim():
            return edit.trim(motion, edit_request.start_s, edit_request.end_s)
        case Hold():
            return edit.held(motion, edit_request.at_s, edit_request.hold_s)
        case Scale():
            return edit.scaled(motion, edit_request.percent, edit_request.motors)
        case Isolate():
            return edit.isolated(motion, edit_request.motors)
        case WarmUp():
            return edit.warm_up(motion, edit_request.less_deg, edit_request.step_deg, edit_request.pause_s)
        case Stretch():
            return edit.stretch(motion, edit_request.further_deg, edit_request.back_deg, edit_request.hold_s)
        case Retouch():
            points = [ChangePoint(point.motor, point.at_s, point.change_deg) for point in edit_request.points]
            return retouched(motion, edit_request.start_s, edit_request.end_s, points)
        case Mirror():
            return _mirrored(motion, source.side, to_side)
        case GuideScapula():
            return _guided(motion, source, to_side)
        case Reteach():
            return _retaught(motion, edit_request, source)


def _mirrored(motion: Motion, from_side: Side, to_side: Side) -> Motion:
    try:
        angles = mirrored_deg(motion.angles_deg, from_side, to_side)
    except OutOfReachError as error:
        raise EditError(texts.AT_SECOND(reason=error.text, at_s=motion.times_s[error.index])) from error
    mirrored = texts.DONE_MIRRORED_LEFT() if to_side == "left" else texts.DONE_MIRRORED_RIGHT()
    return replace(motion, angles_deg=angles, done=(*motion.done, mirrored))


def _retaught(motion: Motion, edit_request: Reteach, source: Source) -> Motion:
    (recording,) = source.others
    samples = unpack(recording.series)
    part = Motion(samples["time_s"], samples["angle_deg"])
    return retaught(motion, edit_request.start_s, edit_request.end_s, part, recording.name)


def _guided(motion: Motion, source: Source, side: Side) -> Motion:
    sound = []
    for recording in source.others:
        # A recording without a pose has no rhythm, and a damaged one is left out.
        with suppress(OutOfReachError, UnreadableError):
            samples = unpack(recording.series)
            sound.append(
                GuidingMotion(recording.name, rhythm_of(samples["time_s"], samples["angle_deg"], OPPOSITE[side]))
            )
    try:
        return guided(motion, side, sound)
    except OutOfReachError as error:
        raise EditError(texts.AT_SECOND(reason=error.text, at_s=motion.times_s[error.index])) from error
