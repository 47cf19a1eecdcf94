"""What a therapist needs next is on the screen without scrolling."""

import re

import pytest
from playwright.sync_api import Locator, Page, ViewportSize, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.shown_station import ShownStation

pytestmark = pytest.mark.shared_clinic("invented")


def test_the_next_step_of_a_session_is_on_the_screen(tab: Page, clinic: Clinic) -> None:
    """At 1280 x 800 the buttons that end the checklist, the pain after and the note were once below the screen."""
    tab.set_viewport_size(ViewportSize(width=1280, height=800))
    with ShownStation(clinic) as station:
        session, _ = station.begin_session("DEMO-001")
        tab.goto(f"{clinic.url}/station?patient={session['patient']['id']}")
        wizard = tab.get_by_role("region", name="Session")
        try:
            for step, button in (
                ("Pain after", "Skip: not asked"),
                ("Checklist", "Skip to pain score"),
                ("Pain before", "Skip: not asked"),
                ("Note and signature", "End the session"),
            ):
                _open(wizard, step)
                expect(wizard.get_by_role("button", name=button)).to_be_in_viewport(ratio=1, timeout=LONG_MS)
            expect(wizard.get_by_role("textbox")).to_be_in_viewport(ratio=1)
        finally:
            station.end_session(session)


def _open(wizard: Locator, step: str) -> None:
    shown = wizard.get_by_role("navigation").get_by_role("button", name=re.compile(step))
    shown.click(timeout=LONG_MS)
    expect(shown).to_have_attribute("aria-current", "step")


def test_due_patients_and_open_sessions_come_first_on_a_telephone(tab: Page, clinic: Clinic) -> None:
    """The tiles of an administrator once took several screens before them."""
    tab.set_viewport_size(ViewportSize(width=360, height=740))
    tab.goto(clinic.url)
    due = tab.get_by_role("region", name=re.compile("Due today"))
    expect(due.get_by_test_id("due").first).to_be_in_viewport(timeout=LONG_MS)
    with ShownStation(clinic) as station:
        session, _ = station.begin_session("DEMO-001")
        try:
            tab.reload()
            expect(tab.get_by_role("link", name=session["patient"]["name"]).first).to_be_in_viewport(timeout=LONG_MS)
            expect(tab.get_by_text("Open", exact=True)).to_be_in_viewport()
        finally:
            station.end_session(session)
