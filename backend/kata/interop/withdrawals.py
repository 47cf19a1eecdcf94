"""Statements that an earlier FHIR export made and that the record no longer makes.

A receiver keeps what it was sent. The next export therefore withdraws what was removed from the record in the meantime: the resource with
the same id has the status entered-in-error and no value (FHIR R4, Observation.status). A Flag becomes inactive, because a contraindication
or a limit that was taken back need not have been an error.
"""

from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.patients.tables import ExportedStatementRow
from kata.interop.codes import HL7, Resource, concept

_IN_ERROR: Final = "entered-in-error"
_BY_KIND: Final[dict[str, Resource]] = {
    "Observation": {"status": _IN_ERROR},
    "QuestionnaireResponse": {"status": _IN_ERROR},
    "Condition": {"verificationStatus": concept(f"{HL7}condition-ver-status", _IN_ERROR, "Entered in Error")},
    "Flag": {"status": "inactive"},
}
"""Status of a withdrawn resource. Resources of other kinds never disappear from a record."""
_KEPT: Final = (
    "resourceType", "id", "meta", "partOf", "category", "code", "bodySite", "subject", "effectiveDateTime", "effectivePeriod", "authored",
)  # fmt: skip
"""Elements that say of what a statement was. A Condition has no code then, because the code is the statement."""


def withdrawal(resource: Resource) -> Resource | None:
    """Return the resource that withdraws a statement, or None if resources of this kind never disappear."""
    kind = resource["resourceType"]
    if kind not in _BY_KIND:
        return None
    kept = {name: resource[name] for name in _KEPT if name in resource and (kind, name) != ("Condition", "code")}
    return kept | _BY_KIND[kind]


def stored(session: Session, patient_id: UUID) -> dict[UUID, Resource]:
    """Return the withdrawals of all statements that were exported before, by the id of the resource, in the order of the ids."""
    query = select(ExportedStatementRow).where(ExportedStatementRow.patient_id == patient_id)
    return {row.id: row.withdrawal for row in session.scalars(query.order_by(ExportedStatementRow.id))}


def store(session: Session, patient_id: UUID, exported: Mapping[UUID, Resource]) -> None:
    """Store the withdrawals of exported statements. The caller commits."""
    for id_, given in exported.items():
        row: dict[str, Any] = {"id": id_, "patient_id": patient_id, "withdrawal": given}
        session.merge(ExportedStatementRow(**row))
