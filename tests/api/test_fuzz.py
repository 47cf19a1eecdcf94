"""Every request, valid or not, gets an answer that the OpenAPI document describes, and never a server error.

Schemathesis generates the requests: the same ones for every sixteenth operation in every run, new ones for all in the campaign
(tests/campaign/test_generated_requests.py). A user without a login and an administrator send each request to the in-process service,
whose database has a patient's whole record.
"""

from pathlib import Path
from typing import Any, Final

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tests.support.login import signed_in
from tests.support.service import running

_FEW: Final = 2
"""Requests for each operation."""
_EVERY: Final = 16
"""Every sixteenth operation gets requests."""


# One test for all operations. With a test for each, every worker generates the requests' parameters when it collects the tests.
@pytest.mark.timeout(600)
def test_every_answer_matches_the_api_document(tmp_path: Path) -> None:
    from schemathesis.core.result import Ok

    from tests.support.generated_requests import api_schema, ids_of_a_record

    with running(tmp_path, simulate=False) as service:
        app: Any = service.app
        ids = ids_of_a_record(service)
        found = list(api_schema(deterministic=True, boundaries=False).get_all_operations())
        operations = [result.ok() for result in found if isinstance(result, Ok)]
        assert len(operations) == len(found) > 150
        for operation in operations[::_EVERY]:
            # Each gets a new login session, because some end one. test_route_permissions.py proves the refusals of every role.
            _ask(operation, service, ids, ["", signed_in(app.state.services.database)])


def _ask(operation: Any, service: TestClient, ids: dict[str, str], cookies: list[str]) -> None:
    """Send a few valid and invalid requests for an operation of the OpenAPI document with each cookie, and check the answers."""
    from schemathesis.generation import GenerationMode

    from tests.support.generated_requests import Case, ask_as_everybody

    sent = 0

    @settings(max_examples=_FEW, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(st.one_of(*(operation.as_strategy(generation_mode=mode) for mode in GenerationMode)))
    def ask(case: Case) -> None:
        nonlocal sent
        sent += 1
        ask_as_everybody(case, service, ids, cookies)

    ask()
    assert sent, operation.label
