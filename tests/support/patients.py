"""Patients with a clinic number and little else."""

from typing import Final
from uuid import uuid4

from sqlalchemy import select

from kata.clinic.patients.tables import PatientRow
from kata.database.base import utc_now
from kata.database.engine import Database

SECRET_NAME: Final = "Yamada Hanako, who is nobody's business"
"""Name of each of these patients."""


def add_patient(database: Database, number: str) -> None:
    """Store a patient with this clinic number."""
    now = utc_now()
    with database.write() as session:
        session.add(
            PatientRow(
                id=uuid4(), clinic_number=number, name=SECRET_NAME, sex="unknown", notes="", created_at=now, updated_at=now
            )
        )  # fmt: skip


def clinic_numbers(database: Database) -> list[str]:
    """Return the clinic numbers of all patients, sorted."""
    with database.read() as session:
        return list(session.scalars(select(PatientRow.clinic_number).order_by(PatientRow.clinic_number)))
