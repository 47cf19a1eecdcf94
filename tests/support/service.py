"""The service in this process with a device process and a simulated apparatus."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from fastapi.testclient import TestClient

from kata.actor import Role
from kata.api.app import create_app
from kata.auth.login_session import COOKIE
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.login import signed_in


@cache
def api_document() -> dict[str, Any]:
    """Return the OpenAPI document, which takes seconds to describe. All tests of a worker share it and do not change it."""
    return create_app(Settings()).openapi()


@contextmanager
def replaced(app: Any, **services: Any) -> Iterator[None]:
    """Replace some of a running application's services while the context lasts."""
    before = app.state.services
    app.state.services = replace(before, **services)
    try:
        yield
    finally:
        app.state.services = before


def other_browser(service: TestClient) -> TestClient:
    """Return another browser of a running service. It shares the service's event loop: a loop for each request costs a quarter of its time."""
    browser = TestClient(service.app, raise_server_exceptions=False)
    browser.portal = service.portal
    return browser


@contextmanager
def running(folder: Path, role: Role = "administrator", **settings: Any) -> Iterator[TestClient]:
    """Run the service during the context, signed in with this role."""
    if "database_url" not in settings and not (folder / "kata.db").exists():
        upgraded_file(folder / "kata.db")
    # A named zone, so that a test does not depend on the computer's.
    usual = {"data": folder, "simulate": True, "allowed_hosts": "testserver", "clinic_time_zone": "UTC"}
    given: dict[str, Any] = usual | settings
    app = create_app(Settings(**given))
    with TestClient(app, client=("127.0.0.1", 50_000)) as client:
        client.cookies.set(COOKIE, signed_in(app.state.services.database, role))
        yield client
