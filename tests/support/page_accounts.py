"""Accounts on the page."""

import re

from playwright.sync_api import BrowserContext, Page

from tests.support.browser_clinic import Clinic

PASSWORD = "seven slow swans at dawn"


def made(page: Page, name: str, username: str, role: str) -> str:
    """Create an account on the administrator's page; return its one-time code."""
    page.get_by_role("link", name="Administration").click()
    page.get_by_role("button", name="New account").click()
    dialog = page.get_by_role("dialog", name="New account")
    dialog.get_by_role("textbox", name="Name", exact=True).fill(name)
    dialog.get_by_label("User name").fill(username)
    dialog.get_by_role("radio", name=role).check()
    dialog.get_by_role("button", name="Create account").click()
    code = page.get_by_test_id("code").inner_text()
    page.get_by_role("button", name="Handed over").click()
    return code


def menu(page: Page, item: str) -> None:
    page.get_by_role("button", name=re.compile("^Signed in as")).click()
    page.get_by_role("menuitem", name=item).click()


def first_password(page: Page, clinic: Clinic, username: str, code: str, password: str = PASSWORD) -> None:
    """Set the first password with the one-time code, which also logs in."""
    page.goto(clinic.url)
    page.get_by_role("link", name="I have a one-time code").click()
    page.get_by_label("User name").fill(username)
    page.get_by_label("One-time code").fill(code)
    page.get_by_label("New password", exact=True).fill(password)
    page.get_by_label("New password again").fill(password)
    page.get_by_role("button", name="Set password").click()


def sign_in(page: Page, username: str, password: str = PASSWORD) -> None:
    page.get_by_label("User name").fill(username)
    page.get_by_role("textbox", name="Password").fill(password)
    page.get_by_role("button", name="Sign in", exact=True).click()


def sign_in_new_account(context: BrowserContext, page: Page, name: str, username: str, role: str) -> None:
    """Create an account through the API, as the administrator of ``page``, and sign in with it in ``context``.

    For tests whose subject is neither. The account has the password ``PASSWORD``.
    """
    service = "/".join(page.url.split("/")[:3])
    headers = {"origin": service}
    wanted = {"name": name, "username": username, "role": role}
    created = page.request.post(f"{service}/api/accounts", data=wanted, headers=headers)
    assert created.status == 201, created.text()
    # Signing in ends the browser's former login session, which other tests use.
    context.clear_cookies()
    own = {"username": username, "password": PASSWORD}
    code = created.json()["code"]
    answer = context.request.post(f"{service}/api/set-password", data=own | {"code": code}, headers=headers)
    assert answer.status == 204, answer.text()
    answer = context.request.post(f"{service}/api/sign-in", data=own, headers=headers)
    assert answer.ok, answer.text()
