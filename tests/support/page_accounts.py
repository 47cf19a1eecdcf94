"""Accounts on the page."""

import re

from playwright.sync_api import Page

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
