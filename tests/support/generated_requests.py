"""Requests that Schemathesis generates from the OpenAPI document. Its import takes two seconds: tests import this module when they run."""

from collections.abc import Iterable
from typing import Any, Final
from uuid import UUID

import requests
import schemathesis
from fastapi.testclient import TestClient
from schemathesis.checks import not_a_server_error
from schemathesis.config import SchemathesisConfig
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)
from schemathesis.specs.openapi.schemas import OpenApiSchema
from sqlalchemy import select

from kata.auth.login_session import COOKIE
from kata.clinic import tables
from tests.support.service import api_document
from tests.support.treatment import treat

Case = Any  # schemathesis.Case: its type argument exists for type checkers only.
_CHECKS: Final = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    negative_data_rejection,
]
_NOBODY_TO_ANSWER: Final = 503
"""Documented status of a command without a connected apparatus."""
_TABLES: Final[dict[str, Any]] = {
    "patient_id": tables.PatientRow,
    "episode_id": tables.EpisodeRow,
    "recording_id": tables.RecordingRow,
    "session_id": tables.SessionRow,
    "run_id": tables.RunRow,
    "programme_id": tables.ProgrammeRow,
    "programme_version_id": tables.ProgrammeVersionRow,
    "assessment_id": tables.AssessmentRow,
}


def api_schema(deterministic: bool, *, boundaries: bool) -> OpenApiSchema:
    """Return the schema. ``boundaries``: also generate requests with each field missing, at its bounds and of a wrong type; seconds per operation."""
    config = {
        "generation": {"deterministic": deterministic, "database": "none"},
        "phases": {"coverage": {"enabled": boundaries}},
    }
    return schemathesis.openapi.from_dict(api_document(), config=SchemathesisConfig.from_dict(config))


def ids_of_a_record(service: TestClient) -> dict[str, str]:
    """Add a patient's whole record to the database of a service and return its ids."""
    app: Any = service.app
    with app.state.services.database.write() as writing:
        treat(writing, sessions=2)
        return {name: str(writing.scalars(select(table.id)).first()) for name, table in _TABLES.items()}


def ask_as_everybody(case: Case, service: TestClient, ids: dict[str, str], cookies: Iterable[str]) -> None:
    """Send a request with each cookie, empty for none, and check the answers. Ids of a record replace half of the generated ids."""
    case.path_parameters = _real(case.path_parameters, ids)
    case.body = _real(case.body, ids)
    wanted: Any = requests.Request(**_sent(case)).prepare()
    for cookie in cookies:
        headers = dict(wanted.headers) | ({"cookie": f"{COOKIE}={cookie}"} if cookie else {})
        service.cookies.clear()
        answer = service.request(wanted.method, wanted.url, content=wanted.body, headers=headers)
        checks = [
            check for check in _CHECKS if answer.status_code != _NOBODY_TO_ANSWER or check is not not_a_server_error
        ]
        case.validate_response(answer, checks=checks)


def _sent(case: Case) -> dict[str, Any]:
    known = ("method", "url", "params", "headers", "cookies", "data", "files", "json")
    given = case.as_transport_kwargs(base_url="http://testserver")
    return {name: value for name, value in given.items() if name in known}


def _real(given: Any, ids: dict[str, str]) -> Any:
    """Replace every second generated id by an existing one."""
    if isinstance(given, list):
        return [_real(item, ids) for item in given]
    if not isinstance(given, dict):
        return given
    return {name: ids[name] if name in ids and _is_even(value) else _real(value, ids) for name, value in given.items()}


def _is_even(value: object) -> bool:
    try:
        return isinstance(value, str) and UUID(value).int % 2 == 0
    except ValueError:
        return False
