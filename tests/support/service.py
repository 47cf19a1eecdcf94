"""The service in this process with a device process and a simulated apparatus."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fastapi.testclient import TestClient

from kata.actor import Role
from kata.api.app import create_app
from kata.auth.sign_in import COOKIE
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.login import signed_in


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
