"""Wrong input, unknown addresses and the place of Stop, in a real browser."""

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import Clinic
from tests.support.page_actions import acknowledge, open_station

pytestmark = pytest.mark.shared_clinic("empty")


def test_bad_input_and_missing_pages_are_reported(page: Page, clinic: Clinic, tmp_path: Path) -> None:
    page.get_by_role("button", name="New patient").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("button", name="Register").click()
    expect(dialog).to_contain_text("must not be empty")
    expect(dialog).to_contain_text("Choose left or right.")
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()

    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,elbow\n0,1\n")
    open_station(page)
    panel = page.get_by_role("region", name="Simulated apparatus")
    expect(panel.get_by_role("button", name="CSV")).to_be_enabled()
    panel.locator("input[type=file]").set_input_files(bad)
    expect(page.get_by_role("alert").filter(has_text="missing: scapula_abduction")).to_be_visible()

    page.evaluate("history.pushState({}, '', '/nowhere')")
    expect(page.get_by_role("heading", name="Page not found")).to_be_visible()
    page.goto(f"{clinic.url}/patients/00000000-0000-0000-0000-000000000000")
    expect(page.get_by_role("alert").filter(has_text="There is no such patient.")).to_be_visible()
    expect(page.get_by_role("button", name="Stop")).to_be_enabled()


def test_stop_banner_is_in_view_on_a_scrolled_page(page: Page) -> None:
    open_station(page)
    page.set_viewport_size({"width": 1280, "height": 500})
    switch = page.get_by_role("button", name="Press the e-stop switch")
    switch.scroll_into_view_if_needed()
    switch.click()

    expect(page.get_by_test_id("stop-banner").get_by_role("heading")).to_be_in_viewport()
    page.get_by_role("button", name="Release the e-stop switch").click()
    acknowledge(page)
