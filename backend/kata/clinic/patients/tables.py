"""Tables of patients."""

from datetime import date, datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, Connection, ForeignKey, Index, String, Text, event, false, text
from sqlalchemy.engine.default import DefaultExecutionContext
from sqlalchemy.orm import Mapped, Mapper, mapped_column, relationship

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import search, sorting
from kata.database.base import Base, UtcDateTime

_SORT_KEY: Final = String(sorting.MAX_SORT_LETTERS).with_variant(
    String(sorting.MAX_SORT_LETTERS, collation="C"), "postgresql"
)
"""Compared by the codes of the characters, in every language of a server."""


def _found_by(context: DefaultExecutionContext) -> str:
    values: dict[str, Any] = context.get_current_parameters()  # type: ignore[no-untyped-call]
    return search.text_of(values["name"], values.get("kana"), values["clinic_number"], values.get("birth_date"))


def _sorted_by(context: DefaultExecutionContext) -> str:
    values: dict[str, Any] = context.get_current_parameters()  # type: ignore[no-untyped-call]
    return sorting.sort_key(values["name"], values.get("kana"))


class PatientRow(Base):
    """A patient. Patients are archived, never deleted."""

    __tablename__ = "patients"
    __table_args__ = (
        # A search needs only this index, which has the order of the list.
        Index("ix_patients_sort_key_id", "sort_key", "id", "archived_at", "search_text"),
        # For finding the restricted records without reading the others.
        Index("ix_patients_restricted", "id", sqlite_where=text("restricted = 1"), postgresql_where=text("restricted")),
    )

    id: Mapped[UUID] = mapped_column(primary_key=True)
    clinic_number: Mapped[str] = mapped_column(String(32), unique=True)
    name: Mapped[str] = mapped_column(String(100))
    kana: Mapped[str | None] = mapped_column(String(100))
    birth_date: Mapped[date | None]
    sex: Mapped[str] = mapped_column(String(8))
    dominant_side: Mapped[str | None] = mapped_column(String(8))
    notes: Mapped[str] = mapped_column(Text)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    archived_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    restricted: Mapped[bool] = mapped_column(default=False)
    """True if only the care team sees this record. Other users need a break-glass access."""
    erased_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """Time at which the identifying data were erased at the patient's request."""
    search_text: Mapped[str] = mapped_column(String(search.MAX_SEARCH_LETTERS), default=_found_by)
    """Result of :func:`kata.clinic.patients.search.text_of`; updated with every change of the searched fields."""
    sort_key: Mapped[str] = mapped_column(_SORT_KEY, default=_sorted_by, server_default="")
    """Result of :func:`kata.clinic.patients.sorting.sort_key`; updated with every change of name or reading."""

    episodes: Mapped[list[EpisodeRow]] = relationship(order_by=EpisodeRow.opened_at, lazy="selectin")

    @property
    def episode(self) -> EpisodeRow | None:
        """The newest open episode, or the last one if none is open."""
        open_episodes = [episode for episode in self.episodes if episode.closed_at is None]
        newest = open_episodes or self.episodes
        return newest[-1] if newest else None

    @property
    def episode_id(self) -> UUID | None:
        """Id of :attr:`episode`."""
        return self.episode.id if self.episode else None

    @property
    def affected_side(self) -> str | None:
        """The shoulder that is treated now, or was treated last."""
        return self.episode.side if self.episode else None


@event.listens_for(PatientRow, "before_update")
def _changed(mapper: Mapper[PatientRow], connection: Connection, row: PatientRow) -> None:
    row.search_text = search.text_of(row.name, row.kana, row.clinic_number, row.birth_date)
    row.sort_key = sorting.sort_key(row.name, row.kana)


class ErasureRow(Base):
    """A patient's request for erasure and its decision."""

    __tablename__ = "erasures"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    asked_at: Mapped[datetime] = mapped_column(UtcDateTime)
    reason: Mapped[str] = mapped_column(Text)
    noted_by: Mapped[str] = mapped_column(String(100))
    decided_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    decided_by: Mapped[str] = mapped_column(String(100), default="")
    decision: Mapped[str | None] = mapped_column(String(8))
    """erased or refused."""
    explanation: Mapped[str] = mapped_column(Text, default="")


class ExportedStatementRow(Base):
    """A statement of a FHIR export. The next export withdraws it if it was removed, and marks it as amended if it was changed."""

    __tablename__ = "exported_statements"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    """Id of the FHIR resource."""
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    withdrawal: Mapped[dict[str, Any]] = mapped_column(JSON)
    """The resource that withdraws the statement."""
    final_digest: Mapped[str | None] = mapped_column(String(64))
    """SHA-256 of the statement's values when it was last stated as final; None: never, or only by a version that stored no digest."""
    amended: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if it was changed or withdrawn after it had been stated as final."""
