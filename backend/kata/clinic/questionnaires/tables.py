"""Table of licensed texts."""

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class QuestionnaireTextsRow(Base):
    """The texts of one questionnaire in one language (:class:`kata.clinic.questionnaires.licensed_texts.LicensedTexts`)."""

    __tablename__ = "questionnaire_texts"

    questionnaire: Mapped[str] = mapped_column(String(32), primary_key=True)
    """Code of the definition."""
    language: Mapped[str] = mapped_column(String(8), primary_key=True)
    title: Mapped[str] = mapped_column(Text)
    copyright: Mapped[str] = mapped_column(Text)
    items: Mapped[list[dict[str, Any]]] = mapped_column(JSON)
    may_be_exported: Mapped[bool] = mapped_column(default=False)
    """True if the licence allows passing the texts on together with a patient's answers."""
    imported_at: Mapped[datetime] = mapped_column(UtcDateTime)
