"""Accounts, roles, second factors and restricted records, in a real browser."""

import pyotp
import pytest
from playwright.sync_api import BrowserContext, Page, expect

from kata.client import Kata, KataError
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.keyboard import choose, press, write
from tests.support.keyboard import open_tab as open_tab_by_keys
from tests.support.page_accounts import PASSWORD, first_password, made, menu, sign_in, sign_in_new_account
from tests.support.page_actions import first_page, open_tab, sign_up, wait_until_idle

pytestmark = pytest.mark.shared_clinic("empty")


@pytest.mark.campaign
def test_account_is_created_used_locked_and_closed(page: Page, clinic: Clinic, another: BrowserContext) -> None:
    sign_up(page, "Yamada Hanako")
    record = page.url
    code = made(page, "Ito Mai", "ito", "Therapist")

    # The new user chooses a password and is signed in.
    hers = first_page(another)
    first_password(hers, clinic, "ito", code)
    expect(hers.get_by_role("button", name="Signed in as Ito Mai")).to_be_visible(timeout=LONG_MS)
    expect(hers.get_by_role("link", name="Administration")).to_have_count(0)
    hers.goto(record)
    expect(hers.get_by_role("heading", name="Yamada Hanako")).to_be_visible()

    # A locked page has no data of a patient, and shows the apparatus' state and Stop.
    menu(hers, "Lock the screen")
    expect(hers.get_by_role("heading", name="Locked")).to_be_visible()
    assert "Yamada" not in hers.content()
    assert "Yamada" not in hers.title()
    wait_until_idle(hers)
    expect(hers.get_by_test_id("estop")).to_have_attribute("data-state", "closed")
    hers.get_by_role("button", name="Stop", exact=True).click()
    expect(hers.get_by_test_id("stop-answer")).to_contain_text("Confirmed by the device")
    # A reload and a wrong password unlock nothing. The right password leads back to the same page.
    hers.reload()
    expect(hers.get_by_role("heading", name="Locked")).to_be_visible()
    hers.get_by_label("Password of Ito Mai").fill("not hers")
    hers.get_by_role("button", name="Unlock").click()
    expect(hers.get_by_role("alert").filter(has_text="not your password")).to_be_visible()
    hers.get_by_label("Password of Ito Mai").fill(PASSWORD)
    hers.get_by_role("button", name="Unlock").click()
    expect(hers.get_by_role("heading", name="Yamada Hanako")).to_be_visible()

    # Signing out in one tab signs out the other. Signing in leads back to the same page.
    tab = another.new_page()
    tab.goto(f"{clinic.url}/patients")
    expect(tab.get_by_role("link", name="Yamada Hanako")).to_be_visible()
    menu(hers, "Sign out")
    expect(hers.get_by_text("You are signed out.")).to_be_visible()
    expect(tab.get_by_role("heading", name="Sign in")).to_be_visible()
    for left in (hers, tab):
        assert "Yamada" not in left.content()
    sign_in(hers, "ito", "wrong wrong wrong")
    expect(hers.get_by_role("alert").filter(has_text="User name or password is wrong.")).to_be_visible()
    sign_in(hers, "ito")
    expect(hers.get_by_role("heading", name="Yamada Hanako")).to_be_visible()

    # Disabling the account ends its session at once.
    page.get_by_role("button", name="Disable Ito Mai").click()
    expect(hers.get_by_role("heading", name="Sign in")).to_be_visible(timeout=LONG_MS)
    assert "Yamada" not in hers.content()
    sign_in(hers, "ito")
    expect(hers.get_by_role("alert").filter(has_text="User name or password is wrong.")).to_be_visible()

    # The audit trail has all of it.
    page.get_by_role("link", name="Audit trail").click()
    trail = page.get_by_role("region", name="Audit trail")
    expect(trail.get_by_role("row").filter(has_text="Ito Mai").first).to_be_visible()
    expect(trail.get_by_role("row").filter(has_text="Screen locked").first).to_contain_text("Ito Mai")


@pytest.mark.campaign
def test_access_token_is_created_used_and_revoked(page: Page, clinic: Clinic) -> None:
    menu(page, "My account")
    tokens = page.get_by_role("region", name="Access tokens for scripts")
    tokens.get_by_label("Name of the new token").fill("Progress of the week")
    tokens.get_by_role("button", name="Create an access token").click()
    shown = tokens.get_by_test_id("access-token")
    expect(shown).to_contain_text("kata_")
    with Kata(clinic.url, shown.inner_text()) as program:
        assert list(program.patients("nobody of this name")) == []
        tokens.get_by_role("button", name="I have stored it").click()
        expect(shown).to_have_count(0)
        assert "kata_" not in page.content()
        # Administrators see when each token was used, and revoke it.
        page.goto(f"{clinic.url}/administration/accounts")
        listed = page.get_by_role("region", name="Access tokens for scripts")
        expect(listed).to_contain_text("Last used")
        listed.get_by_role("button", name="Revoke Progress of the week").click()
        expect(listed).to_contain_text("No account has an access token.")
        with pytest.raises(KataError) as refused:
            list(program.patients())
    assert refused.value.code == "token_ended"


@pytest.mark.campaign
def test_an_administrator_has_to_have_a_second_factor(page: Page, clinic: Clinic, another: BrowserContext) -> None:
    code = made(page, "Mori Sakura", "mori", "Administrator")
    hers = first_page(another)
    first_password(hers, clinic, "mori", code)
    expect(hers.get_by_role("heading", name="A second factor is required")).to_be_visible(timeout=LONG_MS)
    hers.get_by_role("button", name="Set up a second factor").click()
    expect(hers.get_by_role("img", name="QR code")).to_be_visible()
    width = hers.get_by_role("img", name="QR code").evaluate("image => image.naturalWidth")
    assert width > 0, "the picture is drawn"
    app = pyotp.TOTP(hers.get_by_test_id("secret").inner_text())
    hers.get_by_label("Six-digit code shown in the app").fill(app.now())
    hers.get_by_role("button", name="Confirm").click()
    shown = hers.get_by_test_id("recovery-codes").get_by_role("listitem")
    expect(shown).to_have_count(10)
    codes = shown.all_inner_texts()
    hers.get_by_role("button", name="I have stored them").click()
    expect(hers.get_by_role("link", name="Administration")).to_be_visible()

    # The password alone is no longer enough. A recovery code replaces the phone once.
    menu(hers, "Sign out")
    sign_in(hers, "mori")
    hers.get_by_label("Code").fill(codes[0])
    hers.get_by_role("button", name="Sign in", exact=True).click()
    expect(hers.get_by_role("button", name="Signed in as Mori Sakura")).to_be_visible()
    menu(hers, "Sign out")
    sign_in(hers, "mori")
    hers.get_by_label("Code").fill(codes[0])
    hers.get_by_role("button", name="Sign in", exact=True).click()
    expect(hers.get_by_role("alert").filter(has_text="The code is incorrect or was used before")).to_be_visible()

    # Removing the second factor needs the password and a code, also right after signing in.
    hers.get_by_label("Code").fill(codes[1])
    hers.get_by_role("button", name="Sign in", exact=True).click()
    menu(hers, "My account")
    remove = hers.get_by_role("button", name="Remove the second factor")
    remove.click()
    expect(remove).to_be_disabled()
    hers.get_by_label("Your password again").fill(PASSWORD)
    hers.get_by_label("Code").fill(codes[1])
    remove.click()
    expect(hers.get_by_role("alert").filter(has_text="The code is incorrect or was used before")).to_be_visible()
    hers.get_by_label("Code").fill(codes[2])
    remove.click()
    expect(hers.get_by_role("heading", name="A second factor is required")).to_be_visible()


@pytest.mark.campaign
def test_each_role_sees_its_own_pages(page: Page, clinic: Clinic, another: BrowserContext) -> None:
    sign_up(page, "Tanaka Ren")
    record = page.url
    sign_in_new_account(another, page, "Abe Rin", "abe", "viewer")
    hers = first_page(another)
    hers.goto(record)
    expect(hers.get_by_role("heading", name="Tanaka Ren")).to_be_visible()
    for tab in hers.get_by_role("tab").all_inner_texts():
        open_tab(hers, tab)
        for name in ("Edit", "Archive", "Change", "New assessment", "Close episode"):
            expect(hers.get_by_role("button", name=name, exact=True)).to_have_count(0)

    sign_in_new_account(another, page, "Oda Ken", "oda", "technician")
    hers.goto(clinic.url)
    expect(hers.get_by_role("button", name="Signed in as Oda Ken")).to_be_visible(timeout=LONG_MS)
    expect(hers.get_by_role("link", name="Patients", exact=True)).to_have_count(0)
    hers.get_by_role("link", name="Station", exact=True).click()
    expect(hers.get_by_role("region", name="Simulated apparatus")).to_be_visible()
    hers.goto(record)
    expect(hers.get_by_role("alert").filter(has_text="role does not allow")).to_be_visible()
    assert "Tanaka" not in hers.content()


def test_restricted_record_opens_in_an_emergency_and_is_reviewed_afterwards(
    page: Page, clinic: Clinic, another: BrowserContext
) -> None:
    sign_up(page, "Sato Yui")
    record = page.url
    sign_in_new_account(another, page, "Endo Rei", "endo", "therapist")
    # By keyboard alone.
    page.goto(record)
    open_tab_by_keys(page, "Data")
    press(page, page.get_by_role("button", name="Restrict to a care team"))
    dialog = page.get_by_role("dialog", name="Who can see this record")
    choose(page, dialog.get_by_role("combobox", name="Care team"), "Test administrator", several=True)
    press(page, dialog.get_by_role("button", name="Save"))
    expect(page.get_by_test_id("record-access")).to_contain_text("Test administrator")

    hers = first_page(another)
    hers.goto(record)
    expect(hers.get_by_role("heading", name="This record is restricted")).to_be_visible()
    write(hers, hers.get_by_label("Reason for opening it now"), "Acute pain, her therapist is away.")
    press(hers, hers.get_by_role("button", name="Open in an emergency"))
    expect(hers.get_by_role("heading", name="Sato Yui")).to_be_visible()
    expect(hers.get_by_test_id("break-glass-access")).to_contain_text("in an emergency")

    press(page, page.get_by_role("link", name="Administration"))
    press(page, page.get_by_role("link", name="Emergency access"))
    opened = page.get_by_test_id("opened")
    expect(opened).to_contain_text("Acute pain, her therapist is away.")
    press(page, opened.get_by_role("button", name="Mark as reviewed"))
    expect(opened).to_contain_text("Reviewed by Test administrator")


@pytest.mark.campaign
def test_backup_is_made_by_keyboard_and_its_trial_reported(page: Page) -> None:
    press(page, page.get_by_role("link", name="Administration"))
    press(page, page.get_by_role("link", name="Backups"))
    expect(page.get_by_test_id("last-good")).to_contain_text("No backup has passed a test restore")
    press(page, page.get_by_role("button", name="Back up now"))
    expect(page.get_by_test_id("last-good")).to_contain_text("matched completely", timeout=LONG_MS)
