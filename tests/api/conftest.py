"""The real service, in this process, with its device process and a simulated apparatus."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from kata.access.actor import Role
from kata.access.sign_in import COOKIE
from kata.api.app import create_app
from kata.bench import postgresql
from kata.settings import Settings
from tests.signed_in import signed_in
from tests.upgraded import upgraded_file


@contextmanager
def running(folder: Path, role: Role = "administrator", **settings: Any) -> Iterator[TestClient]:
    """From start to end; somebody of this role is signed in."""
    if "database_url" not in settings and not (folder / "kata.db").exists():
        upgraded_file(folder / "kata.db")
    given: dict[str, Any] = {"data": folder, "simulate": True, "allowed_hosts": "testserver"} | settings
    app = create_app(Settings(**given))
    with TestClient(app, client=("127.0.0.1", 50_000)) as client:
        client.cookies.set(COOKIE, signed_in(app.state.database, role))
        yield client


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
