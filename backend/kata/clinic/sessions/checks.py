"""The checklist: what a recording or a teaching needs, who has given it. Commits nothing: the request does.

A session keeps its answers. Where a motion is taught without one, they come with the request and are good for that teaching.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.events import service as events
from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import ending, service
from kata.clinic.sessions.checklist import Answer, Checked, CheckName, Need, checked, needed, playback_fixtures
from kata.clinic.sessions.schemas import Checklist, CheckTick, SessionCheck
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError
from kata.motion.linkage import Floats
from kata.station.schemas import Live, TextKey
from kata.types import Fixture, Side, side_of

_ROTATES_DEG: Final = 15.0
"""A hand turns the arm a little along with every motion; motion 6 is what turns it by more."""


@dataclass(frozen=True)
class Apparatus:
    """What the checklist asks of the apparatus itself."""

    station: str
    pedal_answers: bool
    verified_since: datetime | None
    """Since then it has been connected and its drives configured without a break; None while it is not so."""


def apparatus(station: str, live: Live) -> Apparatus:
    """As it is now."""
    return Apparatus(station, live.pedal in ("up", "down"), live.verified_since)


def checklist(
    session: DatabaseSession, session_id: UUID, recording_id: UUID | None, there: Apparatus
) -> tuple[Checked, ...]:
    """What has to be in order before this recording is played; without one, what holds for all of them.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    visit = service.get(session, session_id)
    tested_at = events.estop_tested_at(session, there.station, today())
    return against(needs(session, visit, recording_id), answers(visit), there, tested_at)


def against(
    asked: Sequence[Need], given: Sequence[Answer], there: Apparatus, estop_tested_at: datetime | None
) -> tuple[Checked, ...]:
    """What is asked, with what was answered, and what the apparatus tells now.

    ``estop_tested_at``: when the emergency stop was last tested; it counts as :func:`estop_test` says.
    """
    detected: dict[CheckName, datetime | None] = {
        "pedal": utc_now() if there.pedal_answers else None,
        "estop": estop_test(estop_tested_at, there),
    }
    return checked(asked, given, detected)


def estop_test(tested_at: datetime | None, there: Apparatus) -> datetime | None:
    """Return the time of the last emergency stop test if it counts, else None.

    It must be of today, and from after the apparatus was connected and its drives configured: the switch is read through a drive, and one
    that was reset or exchanged since may read it wrongly.
    """
    if tested_at is None or there.verified_since is None:
        return None
    return tested_at if tested_at >= max(today(), there.verified_since) else None


def today() -> datetime:
    """When today began, by the clock of the computer that the apparatus stands beside: its day is the clinic's."""
    return datetime.now().astimezone().replace(hour=0, minute=0, second=0, microsecond=0)


@dataclass(frozen=True)
class Teach:
    """A motion that is to be taught: what its checklist depends on."""

    patient_id: UUID
    side: Side
    fixtures: Collection[Fixture]


def teaching_checklist(
    session: DatabaseSession, teach: Teach, there: Apparatus, looked: Sequence[Answer] = ()
) -> tuple[Checked, ...]:
    """What has to be in order before a motion is taught: by what the patient's open session keeps, if there is one, and by
    what somebody has ``looked`` at just now.
    """
    visit = service.open_of(session, teach.patient_id)
    given = [*(answers(visit) if visit else ()), *looked]
    return against(_teaching_needs(teach), given, there, events.estop_tested_at(session, there.station, today()))


def require_teaching(
    session: DatabaseSession, teach: Teach, looked_at: Collection[CheckName], by: str, there: Apparatus
) -> None:
    """The motion may be taught: everything is in order. What was answered is kept with the patient's open session, if there is one.

    :raises ProblemError: 409 naming what is open.
    """
    now = utc_now()
    looked = [Answer(need.check, need.subject, now, by) for need in _teaching_needs(teach) if need.check in looked_at]
    checks = teaching_checklist(session, teach, there, looked)
    require_all(checks)
    visit = service.open_of(session, teach.patient_id)
    if visit:
        # Nobody else adds to its answers meanwhile.
        visit = service.to_change(session, visit.id)
        for answer in looked:
            keep(visit, answer)
        _keep_detected(visit, checks)


def teaching_side(patient: PatientRow, side: Side | None) -> Side:
    """Which shoulder is taught: the one that is said, or the patient's treated one.

    :raises ProblemError: 409 for a patient without an episode of care.
    """
    treated = side or patient.affected_side
    if treated is None:
        raise ProblemError(409, "no_episode", texts.NO_EPISODE(), texts.OPEN_ONE_FIRST())
    return side_of(treated)


def tick(
    session: DatabaseSession, session_id: UUID, check: CheckName, given: CheckTick, there: Apparatus
) -> tuple[Checked, ...]:
    """Somebody has looked.

    :raises ProblemError: 404; 409 for what only the apparatus tells, for fixtures of no recording, and when the session has
        ended.
    """
    visit = service.to_change(session, session_id)
    ending.check_goes_on(visit.ended_at)
    need = to_tick(needs(session, visit, given.recording_id), check)
    keep(visit, Answer(check, need.subject, utc_now(), given.checked_by))
    return checklist(session, session_id, given.recording_id, there)


def to_tick(asked: Sequence[Need], check: CheckName) -> Need:
    """What somebody who has looked gives an answer to.

    :raises ProblemError: 409 for what only the apparatus tells, and for fixtures of no recording.
    """
    need = next((one for one in asked if one.check == check), None)
    if need is None:
        raise ProblemError(409, "no_recording", texts.FIXTURES_DEPEND_ON_RECORDING(), texts.CHOOSE_RECORDING_FIRST())
    if need.detected:
        raise ProblemError(409, "detected", texts.CHECK_IS_AUTOMATIC(), texts.DO_IT_AND_IT_SHOWS())
    return need


def require(session: DatabaseSession, session_id: UUID, recording_id: UUID, there: Apparatus) -> None:
    """The recording may be played: everything is in order. What the apparatus told is kept with the session.

    :raises ProblemError: 409 naming what is open.
    """
    checks = checklist(session, session_id, recording_id, there)
    require_all(checks)
    _keep_detected(service.get(session, session_id), checks)


def require_all(checks: Sequence[Checked]) -> None:
    """Everything is in order.

    :raises ProblemError: 409 naming what is open.
    """
    still_open = [one.need.sentence for one in checks if one.answer is None]
    if still_open:
        raise ProblemError(
            409,
            "checklist_open",
            texts.CHECKS_OPEN(checks=still_open),
            texts.GO_THROUGH_CHECKLIST(),
        )


def as_checklist(checks: tuple[Checked, ...]) -> Checklist:
    """As it goes out."""
    return Checklist(
        checks=[
            SessionCheck(
                check=one.need.check,
                subject=one.need.subject,
                sentence=one.need.sentence,
                sentence_key=TextKey.of(one.need.sentence),
                detected=one.need.detected,
                given=one.answer is not None,
                checked_by=(one.answer.by or None) if one.answer else None,
                checked_at=one.answer.at if one.answer else None,
            )
            for one in checks
        ],
        complete=all(one.answer for one in checks),
    )


def _teaching_needs(teach: Teach) -> tuple[Need, ...]:
    return needed(teach.side, sorted(teach.fixtures))


def needs(session: DatabaseSession, visit: SessionRow, recording_id: UUID | None) -> tuple[Need, ...]:
    """What has to be in order; without a recording, what holds for all of them.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    if recording_id is None:
        side = side_of(visit.episode.side) if visit.episode else "right"
        return tuple(need for need in needed(side, ()) if need.check != "fixtures")
    return needs_of(recordings.get(session, recording_id), recordings.samples(session, recording_id).angles_deg)


def needs_of(recording: RecordingRow, angles_deg: Floats) -> tuple[Need, ...]:
    """What has to be in order before this one is played; its angles ``(n, 5)`` tell whether it turns the arm."""
    rotates = bool(np.ptp(angles_deg[:, 4]) >= _ROTATES_DEG)
    return needed(side_of(recording.side), playback_fixtures(recording.fixtures, rotates=rotates))


def answers(visit: SessionRow) -> list[Answer]:
    """All that were given so far."""
    return [Answer(**one | {"at": datetime.fromisoformat(one["at"])}) for one in visit.checks]


def keep(visit: SessionRow, answer: Answer) -> None:
    """Add an answer."""
    stored: dict[str, Any] = asdict(answer) | {"at": answer.at.isoformat()}
    # Only added to: nobody's change of the session is lost by it, so that it counts as none.
    visit.checks = [*visit.checks, stored]


def _keep_detected(visit: SessionRow, checks: Sequence[Checked]) -> None:
    for answer in told_only_now(checks, answers(visit)):
        keep(visit, answer)


def told_only_now(checks: Iterable[Checked], kept: Iterable[Answer]) -> list[Answer]:
    """What the apparatus told, once a session: that is not among what is kept."""
    before = {one.check for one in kept}
    return [one.answer for one in checks if one.answer and one.need.detected and one.need.check not in before]
