"""What the session at this station needs of the database, fetched ahead: it goes on with it while the database does not answer.

Only of the session that somebody was last at here; anew every few seconds, so that what it is played by is the record as it was just
before. Who might have changed it elsewhere meanwhile is not guessed: where the record says something else by the time the run
arrives in it, an alarm of the session says so. Nothing of a restricted patient is fetched.
"""

import logging
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID, uuid4

import msgspec
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.episodes import limits as doctor
from kata.clinic.episodes.limits import Allowed, MotorLimits
from kata.clinic.events import service as events
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.fields import Side
from kata.clinic.programmes import planned
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import checks, learning, plans, runs
from kata.clinic.sessions.checklist import Answer, Checked, CheckName, Need
from kata.clinic.sessions.schemas import Run
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.away import DatabaseAwayError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.motion import edit
from kata.motion.learning import Correction
from kata.motion.method import Method
from kata.problems import ProblemError
from kata.station.schemas import PatientRef

log = logging.getLogger(__name__)

CHANGED_MEANWHILE: Final = "changed_meanwhile"
Change = Literal["ended", "archived", "closed", "limits"]
CHANGED: Final[dict[Change, str]] = {
    "ended": "Played while the database was away; somebody had ended the session elsewhere by then.",
    "archived": "Played while the database was away; somebody had archived the recording elsewhere by then.",
    "closed": "Played while the database was away; somebody had closed the episode of care elsewhere by then.",
    "limits": "Played while the database was away; somebody had changed the doctor's limits elsewhere by then.",
}
_EVERY_S: Final = 10.0


class Begun(msgspec.Struct, frozen=True, tag="begun"):
    """A run that began while the database was away; its id is made here."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    programme_position: int | None
    started_at: datetime
    load_level: int
    asked: edit.Asked
    method: Method
    corrected_by: UUID | None
    allowed: str
    """What the doctor allowed, as it was known."""
    station: str

    @property
    def row(self) -> RunRow:
        """As it is written down."""
        return RunRow(
            id=self.id,
            session_id=self.session_id,
            recording_id=self.recording_id,
            programme_position=self.programme_position,
            started_at=self.started_at,
            ended_at=None,
            outcome="loaded",
            load_level=self.load_level,
            **asdict(self.asked),
            method=self.method,
            corrected_by=self.corrected_by,
        )


class Ticked(msgspec.Struct, frozen=True, tag="ticked"):
    """An answer of the checklist that was given while the database was away."""

    session_id: UUID
    check: CheckName
    subject: str
    at: datetime
    by: str


@dataclass(frozen=True)
class Playable:
    """One recording of the session."""

    name: str
    side: Side
    taught: edit.Motion
    needs: tuple[Need, ...]
    allowed: Allowed
    learned: Mapping[edit.Asked, tuple[UUID, Correction]]
    """By how it is played: what it is corrected by, and the run that has taught it."""


@dataclass(frozen=True)
class Known:
    """The session as it was when the database last told of it."""

    session_id: UUID
    patient: PatientRef
    at_s: float
    """When that was, by the monotonic clock."""
    recordings: Mapping[UUID, Playable]
    items: Mapping[int, UUID]
    """Of its programme: position to recording."""
    timer: planned.PlanTimer | None
    """Of its programme."""
    answers: tuple[Answer, ...]
    estop_tested_at: datetime | None


class Ahead:
    """Holds one session, or none. May be asked from any thread."""

    def __init__(self, database: Database, station: str) -> None:
        """Nothing is fetched before :meth:`attend`."""
        self._database = database
        self._station = station
        self._session_id: UUID | None = None
        self._known: Known | None = None
        self._due_s = 0.0

    def attend(self, session_id: UUID) -> None:
        """Somebody is at this session here: it is the one to be fetched from now on."""
        self._session_id = session_id
        self._due_s = 0.0

    def fetch(self) -> None:
        """If it is time. Asks the database, and may take seconds for recordings of an hour: for a thread of its own."""
        session_id, now_s = self._session_id, time.monotonic()
        if session_id is None or now_s < self._due_s:
            return
        self._due_s = now_s + _EVERY_S
        before = self._known
        try:
            with self._database.read() as session:
                known = _known(session, session_id, self._station, before.recordings if before else {})
        except DatabaseAwayError:
            return
        if self._session_id != session_id:
            return
        self._known = known
        if known is None:
            self._session_id = None

    @property
    def known(self) -> Known | None:
        """What there is to go on with."""
        known = self._known
        return known if known and known.session_id == self._session_id else None

    def whose(self, named: Iterable[tuple[str, UUID]]) -> PatientRef | None:
        """Whose they are, if all the records that a request names, each with what it is, are of this session; None otherwise."""
        known = self.known
        if known is None:
            return None
        mine = {("session_id", known.session_id), *(("recording_id", one) for one in known.recordings)}
        return known.patient if mine.issuperset(named) else None

    def checklist(
        self, session_id: UUID, recording_id: UUID | None, there: checks.Apparatus
    ) -> tuple[Checked, ...] | None:
        """As :func:`kata.clinic.sessions.checks.checklist`; None where session or recording are not known."""
        found = self._find(session_id, recording_id)
        return _checked(*found, there) if found else None

    def tick(self, session_id: UUID, recording_id: UUID | None, check: CheckName, by: str) -> Ticked | None:
        """Somebody has looked; None where session or recording are not known. To be put into the spool.

        :raises ProblemError: 409 for what only the apparatus tells.
        """
        found = self._find(session_id, recording_id)
        if found is None:
            return None
        known, one = found
        need = checks.to_tick(one.needs, check)
        answer = Answer(check, need.subject, utc_now(), by)
        self._known = replace(known, answers=(*known.answers, answer))
        return Ticked(known.session_id, check, need.subject, answer.at, by)

    def begin(
        self,
        session_id: UUID,
        recording_id: UUID,
        load_level: int,
        asked: edit.Asked,
        method: Method,
        programme_position: int | None,
        there: checks.Apparatus,
    ) -> "ToPlay | None":
        """A run, held against all that it would be held against with the database; None where session or recording are not known.

        :raises ProblemError: as :func:`kata.clinic.sessions.runs.to_begin`, :func:`kata.clinic.programmes.planned.check_timer`,
            :meth:`Allowed.check` and :func:`kata.clinic.sessions.checks.require`.
        """
        found = self._find(session_id, recording_id)
        if found is None:
            return None
        known, one = found
        if programme_position is not None:
            plans.check_place(known.items.items(), programme_position, recording_id)
            # How much was played since then nobody has counted yet: no more than the time that has gone by.
            if known.timer and known.timer.left_s <= time.monotonic() - known.at_s:
                raise planned.timer_over(known.timer.minutes)
        motion = runs.as_asked(one.taught, asked)
        limits = one.allowed.check(motion, load_level, method)
        checks.require_all(_checked(known, one, there))
        corrected_by, learned = one.learned.get(asked, (None, None)) if method == "learned" else (None, None)
        begun = Begun(
            id=uuid4(),
            session_id=known.session_id,
            recording_id=recording_id,
            programme_position=programme_position,
            started_at=utc_now(),
            load_level=load_level,
            asked=asked,
            method=method,
            corrected_by=corrected_by,
            allowed=_written(one.allowed),
            station=self._station,
        )
        return ToPlay(begun, known.patient, one, motion, learned, limits)

    def _find(self, session_id: UUID, recording_id: UUID | None) -> tuple[Known, Playable] | None:
        known = self.known
        if known is None or known.session_id != session_id or recording_id is None:
            return None
        one = known.recordings.get(recording_id)
        return (known, one) if one else None


@dataclass(frozen=True)
class ToPlay:
    """A run that has been found in order."""

    begun: Begun
    patient: PatientRef
    recording: Playable
    motion: edit.Motion
    learned: Correction | None
    limits: MotorLimits

    def as_run(self) -> Run:
        """As it goes out."""
        return runs.as_run(self.begun.row, self.recording.name)


def keep_begun(session: DatabaseSession, begun: Begun) -> None:
    """Write a run down that began while the database was away, and what the record says by now that nobody could know then.

    :raises ValueError: when its session or recording is not there any more.
    """
    visit = session.get(SessionRow, begun.session_id)
    try:
        recording = recordings.get(session, begun.recording_id)
    except ProblemError as error:
        raise ValueError(f"run {begun.id}: {error}") from error
    if visit is None:
        raise ValueError(f"run {begun.id}: its session is not there any more")
    session.add(begun.row)
    visit.run_count += 1
    session.add_all(
        DeviceEventRow(
            id=uuid4(),
            station=begun.station,
            at=begun.started_at,
            ended_at=None,
            kind="alarm",
            code=CHANGED_MEANWHILE,
            message=CHANGED[change],
            patient_id=visit.patient_id,
            session_id=visit.id,
            run_id=begun.id,
        )
        for change in _changed(session, visit, recording, begun)
    )


def keep_ticked(session: DatabaseSession, ticked: Ticked) -> None:
    """Write an answer down that was given while the database was away.

    :raises ValueError: when its session is not there any more.
    """
    visit = session.get(SessionRow, ticked.session_id)
    if visit is None:
        raise ValueError(f"an answer of session {ticked.session_id}: it is not there any more")
    checks.keep(visit, Answer(ticked.check, ticked.subject, ticked.at, ticked.by))


def _known(session: DatabaseSession, session_id: UUID, station: str, fetched: Mapping[UUID, Playable]) -> Known | None:
    visit = session.get(SessionRow, session_id)
    if visit is None or visit.ended_at or visit.patient.restricted or visit.patient.archived_at:
        return None
    items = plans.items(visit)
    # The programme's, and whatever else was played today.
    wanted = dict.fromkeys([*(item.recording_id for item in items), *(run.recording_id for run in visit.runs)])
    asked = {
        one: {runs.asked_of(item) for item in items if item.recording_id == one and item.method == "learned"}
        for one in wanted
    }
    found = {one: _playable(session, visit, one, asked[one], station, fetched.get(one)) for one in wanted}
    return Known(
        session_id=visit.id,
        patient=PatientRef(id=visit.patient.id, name=visit.patient.name),
        at_s=time.monotonic(),
        recordings={one: playable for one, playable in found.items() if playable},
        items={item.position: item.recording_id for item in items},
        timer=planned.of_session(session, session_id).timer,
        answers=tuple(checks.answers(visit)),
        estop_tested_at=events.estop_tested_at(session, station, checks.today()),
    )


def _playable(
    session: DatabaseSession,
    visit: SessionRow,
    recording_id: UUID,
    learning_asked: Iterable[edit.Asked],
    station: str,
    before: Playable | None,
) -> Playable | None:
    """None where it could not be played with the database either. Samples never change, nor does what a run has taught: they are
    fetched once. ``learning_asked``: how it is played with what was learned.
    """
    try:
        recording = recordings.get(session, recording_id)
        side: Side = "left" if recording.side == "left" else "right"
        taught = before.taught if before else runs.taught(session, recording_id)
        allowed = doctor.allowed(session, visit.patient_id, side)
    except ProblemError as error:
        log.info("recording %s is not kept ready: %s", recording_id, error)
        return None
    if recording.archived_at:
        return None
    learned: dict[edit.Asked, tuple[UUID, Correction]] = {}
    for asked in learning_asked:
        newest = learning.newest(session, RunRow(recording_id=recording_id, **asdict(asked)), station)
        had = before.learned.get(asked) if before else None
        if had and had[0] == newest:
            learned[asked] = had
        elif newest and (correction := learning.correction(session, newest)):
            learned[asked] = (newest, correction)
    return Playable(
        name=recording.name,
        side=side,
        taught=taught,
        needs=checks.needs_of(recording, taught.angles_deg),
        allowed=allowed,
        learned=learned,
    )


def _checked(known: Known, one: Playable, there: checks.Apparatus) -> tuple[Checked, ...]:
    tested_at = known.estop_tested_at
    return checks.against(
        one.needs, known.answers, there, tested_at if tested_at and tested_at >= checks.today() else None
    )


def _changed(session: DatabaseSession, visit: SessionRow, recording: RecordingRow, begun: Begun) -> Iterator[Change]:
    if visit.ended_at and visit.ended_at <= begun.started_at:
        yield "ended"
    if recording.archived_at and recording.archived_at <= begun.started_at:
        yield "archived"
    try:
        allowed = doctor.allowed(session, visit.patient_id, "left" if recording.side == "left" else "right")
    except ProblemError:
        yield "closed"
    else:
        if _written(allowed) != begun.allowed:
            yield "limits"


def _written(allowed: Allowed) -> str:
    told: dict[str, Any] = {
        "max_load_level": allowed.max_load_level,
        "motions": sorted(limit.model_dump_json() for limit in allowed.motions),
    }
    return msgspec.json.encode(told).decode()
