"""axe-core checks every page of a clinic with invented patients against WCAG 2.2 AA.

This module checks the light scheme in English; test_japanese.py checks the dark scheme in Japanese.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import addresses, wrong
from tests.support.browser_clinic import LONG_MS, Clinic, invented_clinic
from tests.support.page_actions import acknowledge, wait_until_idle


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[Clinic]:
    """Return a clinic with invented patients."""
    with invented_clinic(tmp_path) as clinic:
        yield clinic


# test_japanese.py checks every page in the dark scheme: its colours do not depend on the language.
@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.campaign)])
def test_every_page_is_accessible(page: Page, clinic: Clinic, scheme: Any, artefacts: Path) -> None:
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    found: dict[str, list[str]] = {}
    for name, address in addresses(page, clinic).items():
        page.goto(clinic.url + address)
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
        wait_until_idle(page)
        if name in ("station", "station-patient"):
            expect(page.get_by_role("region", name="Simulated apparatus")).to_be_visible(timeout=LONG_MS)
        page.wait_for_load_state("networkidle")
        expect(page.locator(".mantine-Skeleton-root")).to_have_count(0, timeout=LONG_MS)
        if violations := wrong(page):
            found[name] = violations
        page.screenshot(path=artefacts / f"page-{name}-{scheme}.png", full_page=True)
    assert found == {}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_alarms_and_the_door_can_be_read_by_everybody(page: Page, clinic: Clinic, scheme: Any, artefacts: Path) -> None:
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    found: dict[str, list[str]] = {}

    def look(name: str) -> None:
        if violations := wrong(page):
            found[name] = violations
        page.screenshot(path=artefacts / f"page-{name}-{scheme}.png", full_page=True)

    page.get_by_role("button", name="Press the e-stop switch").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "pressed")
    expect(page.get_by_test_id("stop-banner")).to_be_visible()
    look("stopped")
    page.get_by_role("link", name="Patients").click()
    expect(page.get_by_role("heading", name="Patients")).to_be_visible()
    look("stopped-elsewhere")
    page.get_by_role("link", name="Station", exact=True).click()
    page.get_by_role("button", name="Release the e-stop switch").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "released")
    look("released")
    acknowledge(page)
    page.context.clear_cookies(name=COOKIE)
    page.goto(clinic.url)
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    look("door")
    assert found == {}
