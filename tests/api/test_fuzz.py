"""Every request, valid or not, gets an answer that the OpenAPI document describes, and never a server error.

Schemathesis generates the requests: the same ones in every run, new ones in the campaign. A user without a login and an administrator, in
the campaign every role, send each request to the in-process service, whose database has a patient's whole record. Ids of this record replace half of the generated ids, so
that not every request ends with 404.
"""

import json
import logging
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final
from uuid import UUID

import pytest
import requests
import schemathesis
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, settings
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

from kata.actor import Role
from kata.auth.login_session import COOKIE
from kata.clinic import tables
from tests.support.login import signed_in
from tests.support.paths import ROOT
from tests.support.service import running
from tests.support.treatment import treat

log = logging.getLogger(__name__)

Case = Any  # schemathesis.Case: its type argument exists for type checkers only.
# test_openapi.py checks that the page's copy is the service's document.
_DOCUMENT: Final = json.loads((ROOT / "frontend/openapi.json").read_text())


def _schema(deterministic: bool, *, boundaries: bool) -> OpenApiSchema:
    """Return the schema. ``boundaries``: also generate requests with each field missing, at its bounds and of a wrong type; seconds per operation."""
    config = {
        "generation": {"deterministic": deterministic, "database": "none"},
        "phases": {"coverage": {"enabled": boundaries}},
    }
    return schemathesis.openapi.from_dict(_DOCUMENT, config=SchemathesisConfig.from_dict(config))


schema = _schema(deterministic=True, boundaries=False)
exploring = _schema(deterministic=False, boundaries=True)
"""The campaign generates other requests in each run. Its findings become tests."""
_CHECKS: Final = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    negative_data_rejection,
]
_NOBODY_TO_ANSWER: Final = 503
"""Documented statuses of a command without a connected apparatus."""
_ROLES: Final[tuple[Role, ...]] = ("viewer", "technician", "therapist", "administrator")
_FEW: Final = 2
_MANY: Final = 240
"""Requests for each operation."""
_WANTED: Final = 100_000
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


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with running(tmp_path_factory.mktemp("fuzz"), simulate=False) as client:
        yield client


@pytest.fixture(scope="module")
def ids(service: TestClient) -> dict[str, str]:
    app: Any = service.app
    with app.state.services.database.write() as writing:
        treat(writing, sessions=2)
        return {name: str(writing.scalars(select(table.id)).first()) for name, table in _TABLES.items()}


@pytest.fixture(scope="module")
def asked() -> Counter[str]:
    """Return the number of requests by operation."""
    return Counter()


@pytest.fixture
def cookies(request: pytest.FixtureRequest, service: TestClient) -> list[str]:
    """Return a cookie for each identity, first none. They are new for each operation, because some end a login session or an account.

    test_route_permissions.py proves the refusals of every role.
    """
    app: Any = service.app
    roles = _ROLES if request.node.get_closest_marker("campaign") else _ROLES[-1:]
    return ["", *(signed_in(app.state.services.database, role) for role in roles)]


@schema.parametrize()
@settings(max_examples=_FEW, phases=[Phase.explicit, Phase.generate], suppress_health_check=list(HealthCheck))
def test_every_answer_matches_the_api_document(
    case: Case, service: TestClient, ids: dict[str, str], cookies: list[str]
) -> None:
    _ask_as_everybody(case, service, ids, cookies)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@exploring.parametrize()
@settings(max_examples=_MANY, phases=[Phase.explicit, Phase.generate], suppress_health_check=list(HealthCheck))
def test_hundred_thousand_generated_requests_get_only_documented_answers(
    case: Case, service: TestClient, ids: dict[str, str], cookies: list[str], asked: Counter[str]
) -> None:
    asked[case.operation.label] += len(cookies)
    _ask_as_everybody(case, service, ids, cookies)


@pytest.mark.campaign
def test_they_were_a_hundred_thousand(asked: Counter[str]) -> None:
    """Runs after the test above, in the same process."""
    log.info("%d requests of %d operations, least %s", asked.total(), len(asked), asked.most_common()[:-6:-1])
    assert asked.total() >= _WANTED


def _ask_as_everybody(case: Case, service: TestClient, ids: dict[str, str], cookies: list[str]) -> None:
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
