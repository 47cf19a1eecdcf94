"""Login through the clinic's OpenID provider, in a real browser: to another site and back."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from tests.support.browser_clinic import START_LIMIT_S, Clinic
from tests.support.openid_provider import CLIENT, SECRET, Provider, provider
from tests.support.page_accounts import made, menu


@pytest.fixture
def theirs() -> Iterator[Provider]:
    # Another site than the service's, which is 127.0.0.1.
    with provider("localhost") as made:
        yield made


@pytest.fixture
def clinic(tmp_path: Path, theirs: Provider, monkeypatch: pytest.MonkeyPatch) -> Iterator[Clinic]:
    secret = tmp_path / "openid-secret"
    secret.write_text(SECRET)
    secret.chmod(0o600)
    for name, value in {
        "ISSUER": theirs.issuer,
        "CLIENT_ID": CLIENT,
        "SECRET_FILE": str(secret),
        "NAME": "Clinic ID",
    }.items():
        monkeypatch.setenv(f"KATA_OPENID_{name}", value)
    started = Clinic(tmp_path)
    yield started
    started.close()


@pytest.mark.campaign
def test_linked_user_signs_in_and_unlocks_through_the_provider(
    page: Page, clinic: Clinic, another: BrowserContext, theirs: Provider
) -> None:
    made(page, "Ito Mai", "ito", "Therapist")
    hers = another.new_page()
    hers.goto(f"{clinic.url}/patients")
    hers.get_by_role("link", name="Sign in with Clinic ID").click()
    expect(
        hers.get_by_role("alert").filter(has_text="No account is linked with this identity of Clinic ID")
    ).to_be_visible()
    expect(hers.get_by_role("alert").filter(has_text=theirs.subject)).to_be_visible()

    page.get_by_role("button", name="Change Ito Mai").click()
    page.get_by_label("Identity at Clinic ID").fill(theirs.subject)
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("row").filter(has_text="Ito Mai")).to_contain_text("Clinic's single sign-on")

    hers.goto(f"{clinic.url}/patients")
    hers.get_by_role("link", name="Sign in with Clinic ID").click()
    expect(hers.get_by_role("button", name="Signed in as Ito Mai")).to_be_visible(timeout=START_LIMIT_S * 1000)
    expect(hers).to_have_url(f"{clinic.url}/patients")

    # The locked user signs in again in a new tab. Stop stays on the locked page.
    menu(hers, "Lock the screen")
    expect(hers.get_by_role("heading", name="Locked")).to_be_visible()
    with another.expect_page() as opened:
        hers.get_by_role("link", name="Sign in again with Clinic ID").click()
    expect(hers.get_by_role("button", name="Stop", exact=True)).to_be_visible()
    expect(opened.value.get_by_role("heading", name="You are signed in")).to_be_visible()
    expect(hers.get_by_role("button", name="Signed in as Ito Mai")).to_be_visible()
    assert all("code=" not in page.url and "state=" not in page.url for page in another.pages)
