"""Tables of episodes and their stages."""

from datetime import date, datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, Text, false
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.database.base import Base, UtcDateTime


class EpisodeRow(Base):
    """The care of one shoulder, from referral to discharge."""

    __tablename__ = "episodes"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    side: Mapped[str] = mapped_column(String(8))
    diagnosis: Mapped[str] = mapped_column(String(200), default="")
    diagnosis_code: Mapped[str] = mapped_column(String(8), default="")
    """ICD-10 code that the clinician chose (:mod:`kata.clinic.episodes.diagnoses`); empty if none was chosen."""
    verification: Mapped[str] = mapped_column(String(16), default="")
    """Certainty of the diagnosis in HL7's codes; empty: not stated."""
    onset_on: Mapped[date | None]
    contraindications: Mapped[str] = mapped_column(Text, default="")
    limits: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    """The doctor's limits, at most one entry per motion of Table 2 (:class:`kata.clinic.episodes.schemas.MotionLimit`)."""
    max_resistance_level: Mapped[int | None] = mapped_column("max_load_level")
    """Highest resistance level that the doctor allows, formerly named load level; None: no limit."""
    max_speed_deg_s: Mapped[float | None]
    """Highest speed of every motor, also during approach and return. None: the station's own limit."""
    self_paced_permitted: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if the doctor permits that the patient's effort sets the pace of a playback."""
    limits_by: Mapped[str] = mapped_column(String(100), default="")
    """Name of the doctor who set the limits and gave the permission."""
    opened_at: Mapped[datetime] = mapped_column(UtcDateTime)
    closed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    closing_note: Mapped[str] = mapped_column(Text, default="")
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)

    stages: Mapped[list["StageRow"]] = relationship(order_by="StageRow.since, StageRow.noted_at", lazy="selectin")

    @property
    def stage(self) -> "StageRow | None":
        """The newest stage."""
        return self.stages[-1] if self.stages else None


class StageRow(Base):
    """The stage of the shoulder from a given day on: freezing, frozen or thawing."""

    __tablename__ = "stages"
    # The clinic's outcomes read the stages of thousands of episodes from the index alone.
    __table_args__ = (Index("ix_stages_episode_id", "episode_id", "since", "noted_at", "stage"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    episode_id: Mapped[UUID] = mapped_column(ForeignKey("episodes.id"))
    stage: Mapped[str] = mapped_column(String(16))
    since: Mapped[date]
    noted_at: Mapped[datetime] = mapped_column(UtcDateTime)
