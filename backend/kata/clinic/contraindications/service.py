"""Read and write contraindications, and check them before a motion. The caller commits."""

from collections.abc import Iterable
from uuid import UUID, uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.contraindications.kinds import KINDS, Kind, kind_of
from kata.clinic.contraindications.schemas import (
    Contraindication,
    ContraindicationCreate,
    ContraindicationKind,
    Resolution,
    SignOff,
)
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.database.base import utc_now
from kata.errors import ProblemError, not_found
from kata.station.schemas import TextKey


def kinds() -> list[ContraindicationKind]:
    """Return the list of kinds, in the order of the form."""
    return [ContraindicationKind(**_of_kind(kind)) for kind in KINDS.values()]


def of_patient(session: Session, patient_id: UUID) -> list[Contraindication]:
    """Return a patient's contraindications, including resolved ones, oldest first.

    :raises ProblemError: 404.
    """
    patients.get(session, patient_id)
    query = select(ContraindicationRow).where(ContraindicationRow.patient_id == patient_id)
    return [_as_contraindication(session, row) for row in session.scalars(query.order_by(ContraindicationRow.noted_at))]


def present(session: Session, patient_id: UUID) -> list[Contraindication]:
    """Return a patient's unresolved contraindications, also those of closed episodes. Those that stop motion come first.

    A contraindication applies until a user resolves it, also after the end of its episode.
    """
    query = select(ContraindicationRow).where(
        ContraindicationRow.patient_id == patient_id, ContraindicationRow.resolved_at.is_(None)
    )
    contraindications = [
        _as_contraindication(session, row) for row in session.scalars(query.order_by(ContraindicationRow.noted_at))
    ]
    return sorted(contraindications, key=lambda contraindication: not contraindication.stops_motion)


def of_shoulder(contraindications: Iterable[Contraindication], side: str) -> list[Contraindication]:
    """Return the contraindications that concern this shoulder."""
    return [contraindication for contraindication in contraindications if contraindication.side in (None, side)]


def require_none(session: Session, patient_id: UUID, side: str) -> None:
    """Check that no contraindication forbids a motion of this shoulder.

    :raises ProblemError: 409, see :func:`check`.
    """
    check(of_shoulder(present(session, patient_id), side))


def check(contraindications: Iterable[Contraindication]) -> None:
    """Check that none of the contraindications presently forbids motion. This needs no database.

    :raises ProblemError: 409 ``contraindicated``, or ``sign_off_needed`` if a doctor may allow the motion.
    """
    stopping = [contraindication for contraindication in contraindications if contraindication.stops_motion]
    blocking = [
        KINDS[contraindication.code].name for contraindication in stopping if contraindication.effect == "block"
    ]
    if blocking:
        raise ProblemError(
            409, "contraindicated", texts.MOTION_CONTRAINDICATED(conditions=blocking), texts.RESOLVE_CONTRAINDICATION()
        )
    if stopping:
        names = [KINDS[contraindication.code].name for contraindication in stopping]
        raise ProblemError(
            409, "sign_off_needed", texts.SIGN_OFF_NEEDED(conditions=names), texts.ASK_DOCTOR_TO_SIGN_OFF()
        )


def add(session: Session, patient_id: UUID, new: ContraindicationCreate) -> Contraindication:
    """Record a contraindication.

    :raises ProblemError: 404; 409 for an erased patient, without an open episode for a condition of a shoulder, and for a condition that
        is recorded already; 422 for an episode of another patient.
    """
    patient = patients.get(session, patient_id, to_change=True)
    patients.check_not_erased(patient)
    episode = None
    if KINDS[new.code].scope == "episode":
        chosen = episodes.get(session, new.episode_id) if new.episode_id else patient.episode
        episode = _open(chosen, patient_id)
    same = [recorded for recorded in present(session, patient_id) if recorded.code == new.code]
    if new.code != "other" and any(recorded.side == (episode.side if episode else None) for recorded in same):
        raise ProblemError(
            409, "already_recorded", texts.CONTRAINDICATION_RECORDED(), texts.CHECK_LIST_OF_CONTRAINDICATIONS()
        )
    row = ContraindicationRow(
        id=uuid4(),
        patient_id=patient_id,
        episode_id=episode.id if episode else None,
        code=new.code,
        note=new.note,
        noted_at=utc_now(),
        noted_by=new.noted_by,
    )
    session.add(row)
    session.flush()
    return _as_contraindication(session, row)


def sign_off(session: Session, contraindication_id: UUID, permission: SignOff) -> Contraindication:
    """Record that a doctor allows the treatment.

    The first permission stays as it is. It applies until the contraindication is resolved, so a second one would only replace the doctor's name.

    :raises ProblemError: 404; 409 for a resolved contraindication, for one that a doctor cannot sign off, and for one that is signed off.
    """
    row = _to_change(session, contraindication_id)
    if kind_of(row.code).effect != "sign_off":
        raise ProblemError(409, "no_sign_off", texts.NO_SIGN_OFF_FOR_THIS(), texts.RESOLVE_CONTRAINDICATION())
    if row.signed_off_at:
        raise ProblemError(
            409, "signed_off", texts.SIGNED_OFF_ALREADY(doctor=row.signed_off_by), texts.RESOLVE_AND_RECORD_AGAIN()
        )
    row.signed_off_at, row.signed_off_by = utc_now(), permission.doctor
    session.flush()
    return _as_contraindication(session, row)


def resolve(session: Session, contraindication_id: UUID, resolution: Resolution) -> Contraindication:
    """Record that a contraindication no longer applies.

    :raises ProblemError: 404; 409 when it is already resolved.
    """
    row = _to_change(session, contraindication_id)
    row.resolved_at, row.resolved_by, row.resolution = utc_now(), resolution.resolved_by, resolution.reason
    session.flush()
    return _as_contraindication(session, row)


def _as_contraindication(session: Session, row: ContraindicationRow) -> Contraindication:
    kind = kind_of(row.code)
    side = episodes.get(session, row.episode_id).side if row.episode_id else None
    stops = kind.effect == "block" or (kind.effect == "sign_off" and row.signed_off_at is None)
    columns = {name: getattr(row, name) for name in Contraindication.model_fields if hasattr(row, name)}
    return Contraindication(
        **columns | _of_kind(kind) | {"side": side, "stops_motion": stops and row.resolved_at is None}
    )


def _of_kind(kind: Kind) -> dict[str, object]:
    return {
        "code": kind.code,
        "scope": kind.scope,
        "effect": kind.effect,
        "name": kind.name,
        "name_key": TextKey.of(kind.name),
        "source": kind.source,
        "source_key": TextKey.of(kind.source),
    }


def _open(episode: EpisodeRow | None, patient_id: UUID) -> EpisodeRow:
    if episode is None or episode.closed_at:
        raise ProblemError(409, "no_episode", texts.NO_EPISODE(), texts.OPEN_ONE_FIRST())
    if episode.patient_id != patient_id:
        raise not_found(texts.EPISODE_NOT_FOUND)
    return episode


def _to_change(session: Session, contraindication_id: UUID) -> ContraindicationRow:
    row = session.get(ContraindicationRow, contraindication_id, with_for_update=True)
    if row is None:
        raise not_found(texts.CONTRAINDICATION_NOT_FOUND)
    patients.check_not_erased(patients.get(session, row.patient_id))
    if row.resolved_at:
        raise ProblemError(409, "resolved", texts.CONTRAINDICATION_RESOLVED(), texts.CHECK_LIST_OF_CONTRAINDICATIONS())
    return row
