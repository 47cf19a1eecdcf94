"""Read the content of a draft of the Japanese rehabilitation plan (リハビリテーション実施計画書).

The plan follows form 23 (別紙様式23) of the notice on medical fees of 2024 (診療報酬の算定方法の一部改正に伴う実施上の留意事項について).
"""

from datetime import tzinfo
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.motion.edit import PlaybackSettings
from kata.reporting import episode
from kata.reporting.content import PlaybackDescription, Prescription, PrescriptionItem, RehabilitationPlanContent


def read_content(session: DatabaseSession, episode_id: UUID, zone: tzinfo) -> RehabilitationPlanContent:
    """Return what the record knows for the plan: the episode, and its prescriptions that are not archived.

    :param zone: the clinic's time zone. It determines the weeks.
    :raises ProblemError: 404.
    """
    content = episode.read_content(session, episode_id, zone)
    return RehabilitationPlanContent(content, _prescriptions(session, episode_id))


def _prescriptions(session: DatabaseSession, episode_id: UUID) -> tuple[Prescription, ...]:
    numbers = (
        select(ProgrammeVersionRow.programme_id, func.max(ProgrammeVersionRow.number).label("number"))
        .group_by(ProgrammeVersionRow.programme_id)
        .subquery()
    )
    newest = (ProgrammeVersionRow.programme_id == numbers.c.programme_id) & (
        ProgrammeVersionRow.number == numbers.c.number
    )
    query = (
        select(ProgrammeVersionRow, ProgrammeRow.name)
        .join(ProgrammeRow, ProgrammeRow.id == ProgrammeVersionRow.programme_id)
        .join(numbers, newest)
        .where(ProgrammeRow.episode_id == episode_id, ProgrammeRow.archived_at.is_(None))
        .order_by(ProgrammeRow.created_at, ProgrammeRow.id)
    )
    return tuple(
        Prescription(name, version.sessions_per_week, tuple(_item(item) for item in version.items))
        for version, name in session.execute(query)
    )


def _item(row: ProgrammeItemRow) -> PrescriptionItem:
    settings = PlaybackSettings(
        speed_percent=row.speed_percent,
        repetitions=row.repetitions,
        pause_s=row.pause_s,
        range_percent=row.range_percent,
    )
    playback_settings = PlaybackDescription(settings, row.resistance_level, row.method, row.self_paced)
    return PrescriptionItem(row.recording.name, playback_settings)
