"""A hundred thousand generated requests of every role get only answers that the OpenAPI document describes.

They are other requests in each run. What they find becomes a test. tests/api/test_fuzz.py sends the same few in every run.
"""

import logging
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, settings

from kata.actor import Role
from tests.support.generated_requests import Case, api_schema, ask_as_everybody, ids_of_a_record
from tests.support.login import signed_in
from tests.support.service import running

log = logging.getLogger(__name__)

exploring = api_schema(deterministic=False, boundaries=True)
_ROLES: Final[tuple[Role, ...]] = ("viewer", "technician", "therapist", "administrator")
_MANY: Final = 240
"""Requests for each operation."""
_WANTED: Final = 100_000


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with running(tmp_path_factory.mktemp("fuzz"), simulate=False) as client:
        yield client


@pytest.fixture(scope="module")
def ids(service: TestClient) -> dict[str, str]:
    return ids_of_a_record(service)


@pytest.fixture(scope="module")
def asked() -> Counter[str]:
    """Return the number of requests by operation."""
    return Counter()


@pytest.fixture
def cookies(service: TestClient) -> list[str]:
    """Return a cookie for each identity, first none. They are new for each operation, because some end a login session or an account."""
    app: Any = service.app
    return ["", *(signed_in(app.state.services.database, role) for role in _ROLES)]


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@exploring.parametrize()
@settings(max_examples=_MANY, phases=[Phase.explicit, Phase.generate], suppress_health_check=list(HealthCheck))
def test_hundred_thousand_generated_requests_get_only_documented_answers(
    case: Case, service: TestClient, ids: dict[str, str], cookies: list[str], asked: Counter[str]
) -> None:
    asked[case.operation.label] += len(cookies)
    ask_as_everybody(case, service, ids, cookies)


@pytest.mark.campaign
def test_they_were_a_hundred_thousand(asked: Counter[str]) -> None:
    """Runs after the test above, in the same process."""
    log.info("%d requests of %d operations, least %s", asked.total(), len(asked), asked.most_common()[:-6:-1])
    assert asked.total() >= _WANTED
