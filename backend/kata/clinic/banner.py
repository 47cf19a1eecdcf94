"""The banner on every page of a patient and at the station. It says who the patient is and what forbids or limits a motion."""

from datetime import date
from uuid import UUID

from pydantic import Field
from sqlalchemy.orm import Session

from kata.clinic.contraindications import service as contraindications
from kata.clinic.contraindications.schemas import Contraindication
from kata.clinic.episodes.schemas import StageName
from kata.clinic.episodes.stages import PROPOSALS, StageProposal
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.types import Schema, Side


class BannerShoulder(Schema):
    """One treated shoulder."""

    episode_id: UUID
    side: Side
    stage: StageName | None = Field(description="The newest stage; null if none is recorded.")
    stage_since: date | None
    contraindications: str = Field(description="The episode's free text.", examples=["No abduction beyond 90 degrees."])
    proposal: StageProposal | None = Field(description="Settings that the stage proposes; null without a stage.")


class PatientBanner(Schema):
    """The patient's identity, and what forbids or limits a motion."""

    patient_id: UUID
    name: str
    kana: str | None
    birth_date: date | None
    age_years: int | None = Field(ge=0, description="Age today in completed years; null without a birth date.")
    clinic_number: str
    shoulders: list[BannerShoulder] = Field(description="Shoulders with an open episode.")
    contraindications: list[Contraindication] = Field(
        description="Unresolved contraindications, also of closed episodes. Those that stop motion come first."
    )

    def contraindications_of(self, side: Side) -> list[Contraindication]:
        """Return the contraindications that concern this shoulder."""
        return contraindications.of_shoulder(self.contraindications, side)


def of_patient(session: Session, patient: PatientRow, today: date) -> PatientBanner:
    """Return the banner of a patient. ``today``: in the clinic's time zone."""
    open_episodes = [episode for episode in patient.episodes if episode.closed_at is None]
    return PatientBanner(
        patient_id=patient.id,
        name=patient.name,
        kana=patient.kana,
        birth_date=patient.birth_date,
        age_years=age_years(patient.birth_date, today) if patient.birth_date else None,
        clinic_number=patient.clinic_number,
        shoulders=[_shoulder(episode) for episode in open_episodes],
        contraindications=contraindications.present(session, patient.id),
    )


def age_years(birth_date: date, today: date) -> int:
    """Return the age in completed years on ``today``."""
    had_birthday = (today.month, today.day) >= (birth_date.month, birth_date.day)
    return max(0, today.year - birth_date.year - (not had_birthday))


def _shoulder(episode: EpisodeRow) -> BannerShoulder:
    stage = episode.stage
    return BannerShoulder(
        episode_id=episode.id,
        side=episode.side,
        stage=stage.stage if stage else None,
        stage_since=stage.since if stage else None,
        contraindications=episode.contraindications,
        proposal=PROPOSALS.get(stage.stage) if stage else None,
    )
