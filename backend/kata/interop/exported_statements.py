"""Statements of earlier FHIR exports about a patient, compared with the present record.

A receiver keeps what it was sent. An export therefore withdraws what was removed from the record after an earlier export: the resource with
the same id has the status entered-in-error and no value (FHIR R4, Observation.status). A Flag becomes inactive, because a contraindication
or a limit that was taken back need not have been an error.

A value that was final and has changed gets the status amended. It keeps the status even if the value is changed back. FHIR R4 defines amended as "modified subsequent
to being final", with new information or with a correction; corrected would claim an error, which the record does not tell. A value that
follows a withdrawal is amended too. Resources other than an Observation or a QuestionnaireResponse have no such status.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
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
_FINAL: Final = {"Observation": "final", "QuestionnaireResponse": "completed"}
"""Status of a complete value. A kind that is not listed cannot be amended."""
_AMENDED: Final = "amended"
_KEPT: Final = (
    "resourceType", "id", "meta", "partOf", "category", "code", "bodySite", "subject", "effectiveDateTime", "effectivePeriod", "authored",
)  # fmt: skip
"""Elements that identify a withdrawn resource. A Condition is withdrawn without its code, because the code is the statement."""
_COMPARED: Final = (
    "effectiveDateTime", "effectivePeriod", "authored", "performer", "bodySite", "method", "valueQuantity", "valueString", "dataAbsentReason",
    "component", "item",
)  # fmt: skip
"""Elements whose change amends a value. Names of codes, profiles and references are not values: a new version of Kata may change them."""


@dataclass(frozen=True)
class Statement:
    """A statement of an export."""

    withdrawal: Resource
    """The resource that withdraws it."""
    final_digest: str | None = None
    """SHA-256 of its values when it was last stated as final; None: never, or only by a version that stored no digest."""
    amended: bool = False
    """True if it was changed or withdrawn after it had been stated as final."""


def compare(resource: Resource, before: Statement | None) -> Statement | None:
    """Return the statement of a resource after an earlier one, or None if resources of this kind never disappear."""
    kind = resource["resourceType"]
    if kind not in _BY_KIND:
        return None
    kept = {name: resource[name] for name in _KEPT if name in resource and (kind, name) != ("Condition", "code")}
    statement = replace(before or Statement({}), withdrawal=kept | _BY_KIND[kind])
    if kind not in _FINAL:
        return statement
    if resource["status"] == _IN_ERROR:
        return withdrawn(statement)
    if resource["status"] != _FINAL[kind]:
        return statement
    digest = _digest(resource)
    return replace(
        statement,
        final_digest=digest,
        amended=statement.amended or statement.final_digest not in (None, digest),
    )


def with_status(resource: Resource, statement: Statement) -> Resource:
    """Return the resource, with the status amended if it is complete and was amended."""
    is_amended = statement.amended and resource["status"] == _FINAL.get(resource["resourceType"])
    return resource | {"status": _AMENDED} if is_amended else resource


def withdrawn(statement: Statement) -> Statement:
    """Return a statement after its withdrawal. A value that follows is amended if there was a final one."""
    return replace(statement, amended=statement.amended or statement.final_digest is not None)


def _digest(resource: Resource) -> str:
    values = _plain({name: resource[name] for name in _COMPARED if name in resource})
    return hashlib.sha256(json.dumps(values, sort_keys=True, ensure_ascii=False).encode()).hexdigest()


def _plain(part: Any) -> Any:
    """Return a part of a resource without the names of codes."""
    if isinstance(part, list):
        return [_plain(item) for item in part]
    if not isinstance(part, dict):
        return part
    if "coding" in part:
        return [[coding.get("system"), coding["code"]] for coding in part["coding"]]
    return {name: _plain(value) for name, value in part.items()}


def stored(session: Session, patient_id: UUID) -> dict[UUID, Statement]:
    """Return all statements that were exported before, by the id of the resource, in the order of the ids."""
    query = select(ExportedStatementRow).where(ExportedStatementRow.patient_id == patient_id)
    return {
        row.id: Statement(row.withdrawal, row.final_digest, row.amended)
        for row in session.scalars(query.order_by(ExportedStatementRow.id))
    }


def store(session: Session, patient_id: UUID, exported: Mapping[UUID, Statement]) -> None:
    """Store exported statements. The caller commits."""
    for id_, statement in exported.items():
        row: dict[str, Any] = {"id": id_, "patient_id": patient_id, **asdict(statement)}
        session.merge(ExportedStatementRow(**row))
