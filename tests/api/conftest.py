"""The real service, in this process, with its device process and a simulated apparatus."""

import time
from collections.abc import Iterator
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from benchmarks import postgresql
from tests.support.service import running


@pytest.fixture(scope="module")
def server() -> Iterator[postgresql.Server]:
    """PostgreSQL, to be killed and started again."""
    try:
        with postgresql.serving() as url:
            yield postgresql.Server(url)
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """One for a file of tests, begun when the apparatus is idle: they leave it so."""
    with running(tmp_path_factory.mktemp("kata")) as made:
        limit_s = time.monotonic() + 30
        while (mode := made.get("/api/station").json()["live"]["mode"]) != "idle":
            assert time.monotonic() < limit_s, mode
            time.sleep(0.02)
        yield made


@pytest.fixture
def patient(client: TestClient) -> dict[str, Any]:
    """A new one."""
    body = {"clinic_number": f"K-{uuid4().hex[:8]}", "name": "Yamada Hanako", "affected_side": "right"}
    made: dict[str, Any] = client.post("/api/patients", json=body).json()
    return made
