"""Stop in reach of a finger and of the keyboard: on every page in every size, and beside every kind of dialog.

`make test` goes through four pages and three dialogs, the campaign through all.
"""

from typing import Final

import pytest
from playwright.sync_api import Page, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import wait_until_idle
from tests.support.shown_pages import SIZES
from tests.support.stop_in_reach import tab_to_stop, untouchable_stop

pytestmark = pytest.mark.shared_clinic("invented")

_PAGES: Final = ("home", "station-patient", "patient", "session")
_DIALOGS: Final = (
    ("patients", "New patient"),
    ("patients", "Import"),
    ("patient", "Edit"),
    ("patient-data", "Restrict to a care team"),
    ("patient-data", "Import motion from CSV file"),
    ("patient-data", "Record an erasure request"),
    ("patient-assessments", "Questionnaire for the patient"),
    ("programme", "Rename"),
    ("accounts", "New account"),
)
"""Page, and the button that opens the dialog."""
_MOST_CONTROLS: Final = 40


@pytest.fixture
def page(page: Page, clinic: Clinic) -> Page:
    page.context.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    return page


_EVERY: Final = pytest.param(True, marks=pytest.mark.campaign)


@pytest.mark.parametrize("every", [False, _EVERY])
def test_stop_can_be_touched_on_pages_of_all_sizes(page: Page, clinic: Clinic, every: bool) -> None:
    missed = {}
    for name, address in addresses(page, clinic).items():
        if not every and name not in _PAGES:
            continue
        page.goto(clinic.url + address)
        wait_until_idle(page)
        for size, (width, height) in SIZES.items():
            page.set_viewport_size({"width": width, "height": height})
            page.evaluate("scrollTo(0, document.body.scrollHeight)")
            if why := untouchable_stop(page):
                missed[f"{name}, {size}"] = why
    assert missed == {}


def test_stop_is_among_the_first_tabs_of_a_page(page: Page, clinic: Clinic) -> None:
    page.goto(clinic.url)
    wait_until_idle(page)
    tab_to_stop(page, presses=12)


@pytest.mark.parametrize("every", [False, _EVERY])
def test_dialogs_leave_stop_to_finger_and_keyboard(page: Page, clinic: Clinic, every: bool) -> None:
    missed = {}
    found = addresses(page, clinic)
    for name, opener in _DIALOGS if every else _DIALOGS[::4]:
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(clinic.url + found[name])
        wait_until_idle(page)
        page.get_by_role("button", name=opener, exact=True).first.click(timeout=LONG_MS)
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible()
        for size, (width, height) in SIZES.items():
            page.set_viewport_size({"width": width, "height": height})
            if why := untouchable_stop(page):
                missed[f"{opener}, {size}"] = why
        tab_to_stop(page, presses=_MOST_CONTROLS)
        page.keyboard.press("Tab")
        assert dialog.evaluate("dialog => dialog.contains(document.activeElement)"), opener
        page.keyboard.press("Escape")
        expect(dialog).to_be_hidden()
    assert missed == {}
