"""A shared screen keeps nothing of the last user: passwords, sign-out and browser storage."""

import re
from collections.abc import Callable, Iterator
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_accounts import PASSWORD, made, menu
from tests.support.page_actions import sign_up

pytestmark = pytest.mark.shared_clinic("empty")

NAME: Final = "Kondo Miyu"
NOBODYS: Final = {
    "kata-scheme",
    "kata.language",
    "kata.first-steps-hidden",
    "kata.report-language",
    "kata.columns.accounts",
    "kata.columns.audit",
    "kata.columns.patients",
    "kata.columns.sessions",
}
"""Keys that a browser keeps after a user has signed out: colours, languages, hidden hints, columns of tables."""
SCREENS: Final = (
    "/", "/stations", "/patients", "/sessions", "/account", "/administration/accounts", "/administration/audit",
    "/administration/emergency-access", "/administration/backups", "/commissioning", "/nowhere",
)  # fmt: skip


@pytest.fixture
def stranger(browser: Browser, browser_context_args: dict[str, Any], clinic: Clinic) -> Iterator[Page]:
    """Return a page of a browser without a login, whose clipboard a test may fill."""
    context = browser.new_context(**browser_context_args)
    context.grant_permissions(["clipboard-read", "clipboard-write"], origin=clinic.url)
    yield context.new_page()
    context.close()


def pasted(page: Page, field: Locator, text: str) -> None:
    """Paste a password like a password manager. The field is masked before and after."""
    expect(field).to_have_attribute("type", "password")
    assert field.get_attribute("autocomplete") in ("current-password", "new-password")
    page.evaluate("text => navigator.clipboard.writeText(text)", text)
    field.focus()
    page.keyboard.press("Control+V")
    expect(field).to_have_value(text)
    expect(field).to_have_attribute("type", "password")


@pytest.mark.campaign
def test_passwords_are_masked_pasted_and_filled_in(page: Page, clinic: Clinic, stranger: Page) -> None:
    code = made(page, "Ito Nana", "ito-nana", "Therapist")
    # A new password, by the one-time code.
    stranger.goto(clinic.url)
    stranger.get_by_role("link", name="I have a one-time code").click()
    stranger.get_by_label("User name").fill("ito-nana")
    expect(stranger.get_by_label("User name")).to_have_attribute("autocomplete", "username")
    stranger.get_by_label("One-time code").fill(code)
    pasted(stranger, stranger.get_by_label("New password", exact=True), PASSWORD)
    pasted(stranger, stranger.get_by_label("New password again"), PASSWORD)
    stranger.get_by_role("button", name="Set password").click()
    expect(stranger.get_by_role("button", name="Signed in as Ito Nana")).to_be_visible(timeout=LONG_MS)

    # The account's page, the lock screen and the login.
    stranger.goto(f"{clinic.url}/account")
    fields = stranger.locator("input[autocomplete$=password]")
    expect(fields.first).to_be_visible()
    assert fields.count() >= 3
    for field in fields.all():
        pasted(stranger, field, "pasted, and long enough to be one")
    menu(stranger, "Lock the screen")
    pasted(stranger, stranger.get_by_label("Password of Ito Nana"), PASSWORD)
    stranger.get_by_role("button", name="Unlock").click()
    expect(stranger.get_by_role("button", name="Signed in as Ito Nana")).to_be_visible()
    menu(stranger, "Sign out")
    stranger.get_by_label("User name").fill("ito-nana")
    expect(stranger.get_by_label("User name")).to_have_attribute("autocomplete", "username")
    pasted(stranger, stranger.locator("input[autocomplete=current-password]"), PASSWORD)
    stranger.get_by_role("button", name="Sign in", exact=True).click()
    expect(stranger.get_by_role("button", name="Signed in as Ito Nana")).to_be_visible()


def browser_storage(page: Page) -> dict[str, Any]:
    """Return everything that the page has stored in the browser."""
    storage: dict[str, Any] = page.evaluate(
        """async () => ({
            local: {...localStorage}, session: {...sessionStorage}, cookie: document.cookie,
            databases: (await indexedDB.databases()).map((one) => one.name), caches: await caches.keys(),
        })"""
    )
    return storage


@pytest.fixture
def page(page: Page, clinic: Clinic) -> Page:
    """Return a page whose cookie is set as the service sets it."""
    page.context.clear_cookies()
    page.context.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url, "httpOnly": True}])
    return page


def assert_nobodys(page: Page, context: BrowserContext) -> None:
    storage = browser_storage(page)
    assert set(storage["local"]) | set(storage["session"]) <= NOBODYS, storage
    assert NAME not in str(storage)
    assert (storage["cookie"], storage["databases"], storage["caches"]) == ("", [], [])
    assert {(cookie.get("name"), cookie.get("httpOnly")) for cookie in context.cookies()} <= {(COOKIE, True)}


def test_signing_out_is_in_sight_everywhere_and_leaves_nothing(page: Page, clinic: Clinic) -> None:
    sign_up(page, NAME)
    record = page.url
    for screen in (*SCREENS, record.removeprefix(clinic.url), f"/station?patient={record.rpartition('/')[2]}"):
        # As a link does, without loading the scripts again.
        page.evaluate("path => history.pushState({}, '', path)", screen)
        page.wait_for_load_state("networkidle")
        expect(page).to_have_url(clinic.url + screen)
        button = page.get_by_role("button", name=re.compile("^Signed in as"))
        expect(button).to_be_in_viewport()
        button.click()
        expect(page.get_by_role("menuitem", name="Sign out")).to_be_in_viewport()
        page.keyboard.press("Escape")
        assert_nobodys(page, page.context)
    page.goto(record)
    expect(page.get_by_role("heading", name=NAME)).to_be_visible()
    menu(page, "Sign out")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    ways: tuple[Callable[[], object], ...] = (page.content, page.go_back, page.reload, lambda: page.goto(record))
    for way in ways:
        way()
        expect(page.get_by_role("heading", name="Sign in")).to_be_visible(timeout=LONG_MS)
        assert NAME not in page.content()
        assert NAME not in page.title()
    assert_nobodys(page, page.context)


@pytest.mark.campaign
def test_signing_out_without_a_service_leaves_nothing_either(page: Page, clinic: Clinic) -> None:
    sign_up(page, NAME)
    clinic.kill()
    menu(page, "Sign out")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    assert NAME not in page.content()
    assert NAME not in page.title()
    assert_nobodys(page, page.context)
