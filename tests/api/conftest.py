"""The real service, in the test's process, with its device process and a simulated apparatus."""

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
    """Return a PostgreSQL server that tests may kill and start again."""
    try:
        with postgresql.serving() as url:
            yield postgresql.Server(url)
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def client(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return one service for all tests of a module, with an idle apparatus. Each test leaves it idle.

    A module with the mark ``no_apparatus`` has a service without one: the device process and the simulator take a second to
    start. They run at 20 Hz, with the mark ``full_rate`` at 100 Hz, which costs a fifth of a processor.
    """
    without = request.node.get_closest_marker("no_apparatus") is not None
    full_rate = request.node.get_closest_marker("full_rate") is not None
    with running(tmp_path_factory.mktemp("kata"), simulate=not without, full_rate=full_rate) as made:
        limit_s = time.monotonic() + 30
        while not without and (mode := made.get("/api/station").json()["live"]["mode"]) != "idle":
            assert time.monotonic() < limit_s, mode
            time.sleep(0.02)
        yield made


@pytest.fixture
def patient(client: TestClient) -> dict[str, Any]:
    """Return a new patient."""
    body = {"clinic_number": f"K-{uuid4().hex[:8]}", "name": "Yamada Hanako", "affected_side": "right"}
    made: dict[str, Any] = client.post("/api/patients", json=body).json()
    return made
