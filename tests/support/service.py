"""The service in this process with a device process and a simulated apparatus."""

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

from fastapi.testclient import TestClient

from kata.actor import Role
from kata.api.app import create_app
from kata.auth.login_session import COOKIE
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.figure_worker import SharedFigureWorker
from tests.support.login import signed_in
from tests.support.paths import ROOT
from tests.support.silent_device import Disconnected
from tests.support.slow_station import slow_simulated


@cache
def api_document() -> dict[str, Any]:
    """Return the OpenAPI document. All tests of a worker share it and do not change it.

    The service takes two seconds to describe itself. This is the page's copy, and tests/api/test_openapi.py proves that it is fresh.
    """
    document: dict[str, Any] = json.loads((ROOT / "frontend/openapi.json").read_text())
    return document


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
def running(
    folder: Path,
    role: Role = "administrator",
    *,
    starts_device: bool = False,
    shares_worker: bool = True,
    full_rate: bool = False,
    **settings: Any,
) -> Iterator[TestClient]:
    """Run the service during the context, signed in with this role.

    A service without an apparatus starts a device process only if ``starts_device``. ``shares_worker``: its figures come from the worker
    process of all tests. That process has the time zone and the settings of the test that used it first. The simulated
    apparatus runs at 20 Hz, with ``full_rate`` at 100 Hz.
    """
    if "database_url" not in settings and not (folder / "kata.db").exists():
        upgraded_file(folder / "kata.db")
    # A named zone, so that a test does not depend on the computer's.
    usual = {"data": folder, "simulate": True, "allowed_hosts": "testserver", "clinic_time_zone": "UTC"}
    given: dict[str, Any] = usual | settings
    app = create_app(Settings(**given))
    with ExitStack() as stack:
        with ExitStack() as starting:
            if not (starts_device or given["simulate"] or given.get("station")):
                starting.enter_context(patch("kata.station.station.DeviceProcess", Disconnected))
            if not full_rate:
                starting.enter_context(patch("kata.device.config.simulated", slow_simulated))
            if shares_worker:
                starting.enter_context(patch("kata.api.set_up.FigureWorker", SharedFigureWorker))
            client = stack.enter_context(TestClient(app, client=("127.0.0.1", 50_000)))
        client.cookies.set(COOKIE, signed_in(app.state.services.database, role))
        yield client
