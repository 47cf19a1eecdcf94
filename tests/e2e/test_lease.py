"""Two users at one apparatus, in a real browser."""

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_accounts import menu, sign_in_new_account
from tests.support.page_actions import first_page, prepare_station, sign_up


@pytest.mark.campaign
@pytest.mark.shared_clinic("empty")
def test_second_user_watches_until_taking_over(page: Page, clinic: Clinic, another: BrowserContext) -> None:
    sign_in_new_account(another, page, "Ito Mai", "ito-lease", "therapist")
    sign_up(page, "Yamada Hanako")
    prepare_station(page)
    expect(page.get_by_test_id("lease")).to_contain_text("You have operated the apparatus")
    hers = first_page(another)
    hers.goto(f"{clinic.url}/station")
    lease = hers.get_by_test_id("lease")
    expect(lease).to_contain_text("Test administrator has operated the apparatus from another browser", timeout=LONG_MS)
    lease.get_by_role("button", name="Take over").click()
    hers.get_by_role("dialog").get_by_role("button", name="Take over").click()
    expect(lease).to_contain_text("You took over from Test administrator")
    expect(page.get_by_test_id("lease")).to_contain_text("Ito Mai has operated the apparatus from another browser")
    # A watching user can command nothing but Stop.
    expect(page.get_by_role("button", name="Start teaching")).to_be_disabled()
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_test_id("stop-answer")).to_contain_text("Confirmed by the device")
    menu(hers, "Sign out")
