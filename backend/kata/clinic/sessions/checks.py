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
from kata.clinic.sessions.checklist import (
    Answer,
    CheckName,
    CheckState,
    Need,
    match_answers,
    playback_fixtures,
    required_checks,
)
from kata.clinic.sessions.schemas import CheckConfirmation, Checklist, SessionCheck
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError
from kata.motion.linkage import Floats
from kata.station.schemas import Live, TextKey
from kata.types import Fixture, Side, side_of

_ROTATES_DEG: Final = 15.0
"""A hand turns the arm a little along with every motion; motion 6 is what turns it by more."""


@dataclass(frozen=True)
class ApparatusState:
    """What the checklist asks of the apparatus itself."""

    station: str
    pedal_answers: bool
    verified_since: datetime | None
    """Since then it has been connected and its drives configured without a break; None while it is not so."""


def apparatus_state(station: str, live: Live) -> ApparatusState:
    """As it is now."""
    return ApparatusState(station, live.pedal in ("up", "down"), live.verified_since)


def checklist(
    session: DatabaseSession, session_id: UUID, recording_id: UUID | None, apparatus: ApparatusState
) -> tuple[CheckState, ...]:
    """What has to be in order before this recording is played; without one, what holds for all of them.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    visit = service.get(session, session_id)
    tested_at = events.estop_tested_at(session, apparatus.station, today())
    return check_states(needs(session, visit, recording_id), answers(visit), apparatus, tested_at)


def check_states(
    asked: Sequence[Need], given: Sequence[Answer], apparatus: ApparatusState, estop_tested_at: datetime | None
) -> tuple[CheckState, ...]:
    """What is asked, with what was answered, and what the apparatus tells now.

    ``estop_tested_at``: when the emergency stop was last tested; it counts as :func:`estop_test` says.
    """
    detected: dict[CheckName, datetime | None] = {
        "pedal": utc_now() if apparatus.pedal_answers else None,
        "estop": estop_test(estop_tested_at, apparatus),
    }
    return match_answers(asked, given, detected)


def estop_test(tested_at: datetime | None, apparatus: ApparatusState) -> datetime | None:
    """Return the time of the last emergency stop test if it counts, else None.

    It must be of today, and from after the apparatus was connected and its drives configured: the switch is read through a drive, and one
    that was reset or exchanged since may read it wrongly.
    """
    if tested_at is None or apparatus.verified_since is None:
        return None
    return tested_at if tested_at >= max(today(), apparatus.verified_since) else None


def today() -> datetime:
    """When today began, by the clock of the computer that the apparatus stands beside: its day is the clinic's."""
    return datetime.now().astimezone().replace(hour=0, minute=0, second=0, microsecond=0)


@dataclass(frozen=True)
class TeachingRequest:
    """A motion that is to be taught: what its checklist depends on."""

    patient_id: UUID
    side: Side
    fixtures: Collection[Fixture]


def teaching_checklist(
    session: DatabaseSession, teaching: TeachingRequest, apparatus: ApparatusState, confirmed: Sequence[Answer] = ()
) -> tuple[CheckState, ...]:
    """What has to be in order before a motion is taught: by what the patient's open session keeps, if apparatus is one, and by
    what somebody has ``confirmed`` at just now.
    """
    visit = service.open_of(session, teaching.patient_id)
    given = [*(answers(visit) if visit else ()), *confirmed]
    return check_states(
        _teaching_needs(teaching), given, apparatus, events.estop_tested_at(session, apparatus.station, today())
    )


def require_teaching(
    session: DatabaseSession,
    teaching: TeachingRequest,
    looked_at: Collection[CheckName],
    by: str,
    apparatus: ApparatusState,
) -> None:
    """The motion may be taught: everything is in order. What was answered is stored with the patient's open session, if apparatus is one.

    :raises ProblemError: 409 naming what is open.
    """
    now = utc_now()
    confirmed = [
        Answer(need.check, need.subject, now, by) for need in _teaching_needs(teaching) if need.check in looked_at
    ]
    checks = teaching_checklist(session, teaching, apparatus, confirmed)
    require_all(checks)
    visit = service.open_of(session, teaching.patient_id)
    if visit:
        # Nobody else adds to its answers meanwhile.
        visit = service.to_change(session, visit.id)
        for answer in confirmed:
            store_answer(visit, answer)
        _store_detected(visit, checks)


def teaching_side(patient: PatientRow, side: Side | None) -> Side:
    """Which shoulder is taught: the one that is said, or the patient's treated one.

    :raises ProblemError: 409 for a patient without an episode of care.
    """
    treated = side or patient.affected_side
    if treated is None:
        raise ProblemError(409, "no_episode", texts.NO_EPISODE(), texts.OPEN_ONE_FIRST())
    return side_of(treated)


def confirm(
    session: DatabaseSession, session_id: UUID, check: CheckName, given: CheckConfirmation, apparatus: ApparatusState
) -> tuple[CheckState, ...]:
    """Somebody has confirmed.

    :raises ProblemError: 404; 409 for what only the apparatus tells, for fixtures of no recording, and when the session has
        ended.
    """
    visit = service.to_change(session, session_id)
    ending.check_goes_on(visit.ended_at)
    need = confirmable(needs(session, visit, given.recording_id), check)
    store_answer(visit, Answer(check, need.subject, utc_now(), given.checked_by))
    return checklist(session, session_id, given.recording_id, apparatus)


def confirmable(asked: Sequence[Need], check: CheckName) -> Need:
    """What somebody who has confirmed gives an answer to.

    :raises ProblemError: 409 for what only the apparatus tells, and for fixtures of no recording.
    """
    need = next((need for need in asked if need.check == check), None)
    if need is None:
        raise ProblemError(409, "no_recording", texts.FIXTURES_DEPEND_ON_RECORDING(), texts.CHOOSE_RECORDING_FIRST())
    if need.detected:
        raise ProblemError(409, "detected", texts.CHECK_IS_AUTOMATIC(), texts.DO_IT_AND_IT_SHOWS())
    return need


def require(session: DatabaseSession, session_id: UUID, recording_id: UUID, apparatus: ApparatusState) -> None:
    """The recording may be played: everything is in order. What the apparatus told is stored with the session.

    :raises ProblemError: 409 naming what is open.
    """
    checks = checklist(session, session_id, recording_id, apparatus)
    require_all(checks)
    _store_detected(service.get(session, session_id), checks)


def require_all(checks: Sequence[CheckState]) -> None:
    """Everything is in order.

    :raises ProblemError: 409 naming what is open.
    """
    still_open = [check.need.sentence for check in checks if check.answer is None]
    if still_open:
        raise ProblemError(
            409,
            "checklist_open",
            texts.CHECKS_OPEN(checks=still_open),
            texts.GO_THROUGH_CHECKLIST(),
        )


def as_checklist(checks: tuple[CheckState, ...]) -> Checklist:
    """As it goes out."""
    return Checklist(
        checks=[
            SessionCheck(
                check=check.need.check,
                subject=check.need.subject,
                sentence=check.need.sentence,
                sentence_key=TextKey.of(check.need.sentence),
                detected=check.need.detected,
                given=check.answer is not None,
                checked_by=(check.answer.by or None) if check.answer else None,
                checked_at=check.answer.at if check.answer else None,
            )
            for check in checks
        ],
        complete=all(check.answer for check in checks),
    )


def _teaching_needs(teaching: TeachingRequest) -> tuple[Need, ...]:
    return required_checks(teaching.side, sorted(teaching.fixtures))


def needs(session: DatabaseSession, visit: SessionRow, recording_id: UUID | None) -> tuple[Need, ...]:
    """What has to be in order; without a recording, what holds for all of them.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    if recording_id is None:
        side = side_of(visit.episode.side) if visit.episode else "right"
        return tuple(need for need in required_checks(side, ()) if need.check != "fixtures")
    return needs_of(recordings.get(session, recording_id), recordings.samples(session, recording_id).angles_deg)


def needs_of(recording: RecordingRow, angles_deg: Floats) -> tuple[Need, ...]:
    """What has to be in order before this one is played; its angles ``(n, 5)`` tell whether it turns the arm."""
    rotates = bool(np.ptp(angles_deg[:, 4]) >= _ROTATES_DEG)
    return required_checks(side_of(recording.side), playback_fixtures(recording.fixtures, rotates=rotates))


def answers(visit: SessionRow) -> list[Answer]:
    """All that were given so far."""
    return [Answer(**check | {"at": datetime.fromisoformat(check["at"])}) for check in visit.checks]


def store_answer(visit: SessionRow, answer: Answer) -> None:
    """Add an answer."""
    stored: dict[str, Any] = asdict(answer) | {"at": answer.at.isoformat()}
    # Only added to: nobody's change of the session is lost by it, so that it counts as none.
    visit.checks = [*visit.checks, stored]


def _store_detected(visit: SessionRow, checks: Sequence[CheckState]) -> None:
    for answer in newly_detected(checks, answers(visit)):
        store_answer(visit, answer)


def newly_detected(checks: Iterable[CheckState], stored: Iterable[Answer]) -> list[Answer]:
    """What the apparatus told, once a session: that is not among what is stored."""
    before = {answer.check for answer in stored}
    return [check.answer for check in checks if check.answer and check.need.detected and check.need.check not in before]
