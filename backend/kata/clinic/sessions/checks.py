"""The checklist of a recording or a teaching and its answers. The caller commits.

A session stores its answers. If a motion is taught without a session, the request contains the answers, which are valid only for that
teaching.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session as DatabaseSession

from kata.actor import note_detail
from kata.clinic import texts
from kata.clinic.events import service as events
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import ending, identity, service
from kata.clinic.sessions.checklist import (
    Answer,
    CheckName,
    CheckState,
    Need,
    match_answers,
    playback_fixtures,
    required_checks,
)
from kata.clinic.sessions.identity import Identifier, PatientIdentity
from kata.clinic.sessions.schemas import CheckConfirmation, Checklist, SessionCheck
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError
from kata.motion.linkage import Floats
from kata.station.schemas import Live, TextKey
from kata.types import Fixture, Side, side_of

_CLOCK_TOLERANCE: Final = timedelta(seconds=2)
"""Small corrections of the clock, such as those of NTP, keep a test."""
_ROTATES_DEG: Final = 15.0
"""Degrees. Every motion turns the arm a little, but only motion 6 turns it by more than this."""


@dataclass(frozen=True)
class ApparatusState:
    """The part of the apparatus's state, and the clinic's time zone, that the checklist needs."""

    station: str
    pedal_answers: bool
    verified_since: datetime | None
    """Time since which the apparatus has been connected with configured drives without interruption; None if it is not."""
    zone: tzinfo = UTC
    """The clinic's time zone."""
    tested_since_verified: bool = field(kw_only=True)
    """False if this service knows, by the monotonic clock, that the emergency stop was not tested within a day since the drives were verified."""

    @property
    def today(self) -> datetime:
        """The beginning of today in the clinic's time zone."""
        return today(self.zone)


def apparatus_state(station: str, live: Live, zone: tzinfo, *, tested_since_verified: bool) -> ApparatusState:
    """Return the present state. ``zone``: the clinic's time zone."""
    return ApparatusState(
        station, live.pedal in ("up", "down"), live.verified_since, zone, tested_since_verified=tested_since_verified
    )


def checklist(
    session: DatabaseSession, session_id: UUID, recording_id: UUID | None, apparatus: ApparatusState
) -> tuple[CheckState, ...]:
    """Return the checklist of a recording. Without a recording, return the checks that all recordings have in common.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    clinic_session = service.get(session, session_id)
    tested_at = events.estop_tested_at(session, apparatus.station, apparatus.today)
    return check_states(needs(session, clinic_session, recording_id), answers(clinic_session), apparatus, tested_at)


def check_states(
    required: Sequence[Need], answers: Sequence[Answer], apparatus: ApparatusState, estop_tested_at: datetime | None
) -> tuple[CheckState, ...]:
    """Return the required checks with the given answers and the present answers of the apparatus.

    ``estop_tested_at``: time of the last test of the emergency stop. :func:`estop_test` decides whether the test counts.
    """
    detected: dict[CheckName, datetime | None] = {
        "pedal": utc_now() if apparatus.pedal_answers else None,
        "estop": estop_test(estop_tested_at, apparatus),
    }
    # Identity must be confirmed again today, because a session that was left open may be continued with another patient in the chair.
    of_today = [answer for answer in answers if answer.check != "identity" or answer.at >= apparatus.today]
    return match_answers(required, of_today, detected)


def estop_test(tested_at: datetime | None, apparatus: ApparatusState) -> datetime | None:
    """Return the time of the last emergency stop test if the test counts, else None.

    A test counts if it was made today, and after the apparatus was connected and its drives were configured. The switch is read through a
    drive, and a drive that was reset or replaced since may read it wrongly. A test in the future shows that the clock was set back since.
    When its time has come, the monotonic clock still shows that the test is old.
    """
    if tested_at is None or apparatus.verified_since is None or tested_at > utc_now() + _CLOCK_TOLERANCE:
        return None
    if not apparatus.tested_since_verified:
        return None
    return tested_at if tested_at >= max(apparatus.today, apparatus.verified_since) else None


def today(zone: tzinfo) -> datetime:
    """Return the beginning of today in the clinic's time zone."""
    return utc_now().astimezone(zone).replace(hour=0, minute=0, second=0, microsecond=0)


@dataclass(frozen=True)
class TeachingRequest:
    """A motion to teach, with the data on which its checklist depends."""

    patient_id: UUID
    side: Side
    fixtures: Collection[Fixture]


@dataclass(frozen=True)
class ConfirmedNow:
    """The checks that the person who teaches has just made."""

    looked_at: Collection[CheckName]
    identifiers: Collection[Identifier]
    by: str


def teaching_checklist(
    session: DatabaseSession, teaching: TeachingRequest, apparatus: ApparatusState, confirmed: Sequence[Answer] = ()
) -> tuple[CheckState, ...]:
    """Return the checklist of a teaching. Its answers are those of the patient's open session, if there is one, and ``confirmed``."""
    clinic_session = service.open_of(session, teaching.patient_id)
    answered = [*(answers(clinic_session) if clinic_session else ()), *confirmed]
    return check_states(
        _teaching_needs(teaching),
        answered,
        apparatus,
        events.estop_tested_at(session, apparatus.station, apparatus.today),
    )


def require_teaching(
    session: DatabaseSession,
    teaching: TeachingRequest,
    confirmed_now: ConfirmedNow,
    apparatus: ApparatusState,
) -> None:
    """Check that the motion may be taught. Store the answers with the patient's open session, if there is one.

    :raises ProblemError: 409 with the open checks; 422 as in :func:`kata.clinic.sessions.identity.subject`.
    """
    now = utc_now()
    compared = confirmed_now.identifiers
    subjects: dict[CheckName, str] = {
        need.check: need.subject for need in _teaching_needs(teaching) if need.check in confirmed_now.looked_at
    }
    subjects.pop("identity", None)
    if compared:
        subjects["identity"] = identity.subject(compared, patients.get(session, teaching.patient_id).birth_date)
        note_detail("identity", subjects["identity"])
    confirmed = [Answer(check, subject, now, confirmed_now.by) for check, subject in subjects.items()]
    checks = teaching_checklist(session, teaching, apparatus, confirmed)
    require_all(checks)
    clinic_session = service.open_of(session, teaching.patient_id)
    if clinic_session:
        # Lock the session, so that no other request adds answers meanwhile.
        clinic_session = service.to_change(session, clinic_session.id)
        for answer in confirmed:
            store_answer(clinic_session, answer)
        _store_detected(clinic_session, checks)


def teaching_side(patient: PatientRow, side: Side | None) -> Side:
    """Return the shoulder to teach: the given one, or the patient's treated one.

    :raises ProblemError: 409 for a patient without an episode of care.
    """
    treated = side or patient.affected_side
    if treated is None:
        raise ProblemError(409, "no_episode", texts.NO_EPISODE(), texts.OPEN_ONE_FIRST())
    return side_of(treated)


def confirm(
    session: DatabaseSession,
    session_id: UUID,
    check: CheckName,
    confirmation: CheckConfirmation,
    apparatus: ApparatusState,
) -> tuple[CheckState, ...]:
    """Store a user's confirmation of a check.

    :raises ProblemError: 404; 409 for a check that only the apparatus answers, for fixtures without a recording, and when the session has
        ended; 422 as in :func:`kata.clinic.sessions.identity.subject`.
    """
    clinic_session = service.to_change(session, session_id)
    ending.check_not_ended(clinic_session.ended_at)
    need = confirmable(needs(session, clinic_session, confirmation.recording_id), check)
    subject = need.subject
    if check == "identity":
        subject = identity.subject(confirmation.identifiers, clinic_session.patient.birth_date)
        note_detail("identity", subject)
    store_answer(clinic_session, Answer(check, subject, utc_now(), confirmation.checked_by))
    return checklist(session, session_id, confirmation.recording_id, apparatus)


def confirmable(required: Sequence[Need], check: CheckName) -> Need:
    """Return a check that a user may confirm.

    :raises ProblemError: 409 for a check that only the apparatus answers, and for fixtures without a recording.
    """
    need = next((need for need in required if need.check == check), None)
    if need is None:
        raise ProblemError(409, "no_recording", texts.FIXTURES_DEPEND_ON_RECORDING(), texts.CHOOSE_RECORDING_FIRST())
    if need.detected:
        raise ProblemError(409, "detected", texts.CHECK_IS_AUTOMATIC(), texts.DO_IT_AND_IT_SHOWS())
    return need


def require(session: DatabaseSession, session_id: UUID, recording_id: UUID, apparatus: ApparatusState) -> None:
    """Check that the recording may be played. Store the answers of the apparatus with the session.

    :raises ProblemError: 409 with the open checks.
    """
    checks = checklist(session, session_id, recording_id, apparatus)
    require_all(checks)
    _store_detected(service.get(session, session_id), checks)


def require_all(checks: Sequence[CheckState]) -> None:
    """Check that every check is answered.

    :raises ProblemError: 409 with the open checks; first ``identity_not_confirmed`` if the identity is not confirmed.
    """
    if any(check.need.check == "identity" and check.answer is None for check in checks):
        raise ProblemError(
            409, "identity_not_confirmed", texts.IDENTITY_NOT_CONFIRMED(), texts.COMPARE_TWO_IDENTIFIERS()
        )
    still_open = [check.need.sentence for check in checks if check.answer is None]
    if still_open:
        raise ProblemError(
            409,
            "checklist_open",
            texts.CHECKS_OPEN(checks=still_open),
            texts.GO_THROUGH_CHECKLIST(),
        )


def as_checklist(checks: tuple[CheckState, ...], patient: PatientIdentity) -> Checklist:
    """Return the response model."""
    return Checklist(
        patient=patient,
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


def needs(session: DatabaseSession, clinic_session: SessionRow, recording_id: UUID | None) -> tuple[Need, ...]:
    """Return the required checks. Without a recording, return those that all recordings have in common.

    :raises ProblemError: 404; 410 when the recording's samples are damaged.
    """
    if recording_id is None:
        side = side_of(clinic_session.episode.side) if clinic_session.episode else "right"
        return tuple(need for need in required_checks(side, ()) if need.check != "fixtures")
    return needs_of(recordings.get(session, recording_id), recordings.samples(session, recording_id).angles_deg)


def needs_of(recording: RecordingRow, angles_deg: Floats) -> tuple[Need, ...]:
    """Return the required checks of a recording. Its angles ``(n, 5)`` show whether it rotates the arm."""
    rotates = bool(np.ptp(angles_deg[:, 4]) >= _ROTATES_DEG)
    return required_checks(side_of(recording.side), playback_fixtures(recording.fixtures, rotates=rotates))


def answers(clinic_session: SessionRow) -> list[Answer]:
    """Return the stored answers."""
    return [Answer(**check | {"at": datetime.fromisoformat(check["at"])}) for check in clinic_session.checks]


def store_answer(clinic_session: SessionRow, answer: Answer) -> None:
    """Add an answer to the session."""
    stored: dict[str, Any] = asdict(answer) | {"at": answer.at.isoformat()}
    # Answers are only added, so no change of the session is overwritten and ``updated_at`` stays the same.
    clinic_session.checks = [*clinic_session.checks, stored]


def _store_detected(clinic_session: SessionRow, checks: Sequence[CheckState]) -> None:
    for answer in newly_detected(checks, answers(clinic_session)):
        store_answer(clinic_session, answer)


def newly_detected(checks: Iterable[CheckState], stored: Iterable[Answer]) -> list[Answer]:
    """Return the answers of the apparatus that are not stored yet. Only one answer per check and session is stored."""
    before = {answer.check for answer in stored}
    return [check.answer for check in checks if check.answer and check.need.detected and check.need.check not in before]
