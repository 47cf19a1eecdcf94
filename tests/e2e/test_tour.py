"""Take the pictures of docs/tutorial/tour.md and the README in a demonstration clinic: a session from the patient's page to its plots."""

import pytest
from playwright.sync_api import Browser, Locator, Page, ViewportSize, expect

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import confirm_identity, load_and_play, open_tab, try_estop, wait_until_idle
from tests.support.paths import ROOT

PICTURES = ROOT / "docs" / "tour"
DRAWN_MS = 1000
DESKTOP, TABLET = ViewportSize(width=1280, height=800), ViewportSize(width=800, height=1180)


def page_of(browser: Browser, clinic: Clinic, size: ViewportSize, scheme: str) -> Page:
    context = browser.new_context(viewport=size, color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
    context.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    # A clinic has hidden the guide of the simulated apparatus.
    context.add_init_script("localStorage.setItem('kata.first-steps-hidden', 'true')")
    return context.new_page()


def take(page: Page, name: str, top: Locator | None = None) -> None:
    """Take a picture after everything has been drawn. Scroll ``top`` below header and patient banner first."""
    if top:
        top.evaluate("one => window.scrollBy(0, one.getBoundingClientRect().top - 240)")
    else:
        page.evaluate("window.scrollTo(0, 0)")
    page.mouse.move(0, 0)
    page.wait_for_timeout(DRAWN_MS)
    page.screenshot(path=PICTURES / f"{name}.png")


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_take_the_pictures_of_the_tour(browser: Browser, demonstration: Clinic) -> None:
    clinic = demonstration
    PICTURES.mkdir(exist_ok=True)
    page = page_of(browser, clinic, DESKTOP, "light")
    page.goto(f"{clinic.url}/patients")
    page.get_by_role("link", name="Ishii Nao").click()
    expect(page.get_by_test_id("since-last-month")).to_be_visible(timeout=LONG_MS)
    take(page, "patient", page.get_by_role("heading", name="Ishii Nao"))
    patient = page.url
    open_tab(page, "Assessments")
    page.get_by_role("link", name="Progress").click()
    expect(page.locator(".js-plotly-plot").first).to_be_visible(timeout=LONG_MS)
    take(page, "progress", page.get_by_role("heading", name="Range of motion"))

    tablet = page_of(browser, clinic, TABLET, "light")
    tablet.goto(patient)
    tablet.get_by_role("link", name="Go to the station").click()
    wait_until_idle(tablet)
    visit = tablet.get_by_role("region", name="Session")
    visit.get_by_role("button", name="Begin the session").click()
    expect(visit.get_by_role("heading", name="Checklist")).to_be_visible(timeout=LONG_MS)
    take(tablet, "checklist", visit)
    try_estop(tablet)
    confirm_identity(visit, tablet)
    visit.get_by_role("button", name="Confirm all 3 checks").click()
    visit.get_by_role("button", name="Pain before: 4").click()
    expect(visit.get_by_role("heading", name="Play")).to_be_visible(timeout=LONG_MS)
    load_and_play(tablet)
    expect(tablet.get_by_text("5 s remaining")).to_be_visible(timeout=LONG_MS)
    take(tablet, "playing")
    tablet.set_viewport_size(DESKTOP)
    take(tablet, "../station")
    tablet.set_viewport_size(TABLET)

    watching = page_of(browser, clinic, DESKTOP, "dark")
    watching.goto(f"{clinic.url}/stations")
    expect(watching.get_by_text("Station 1").first).to_be_visible(timeout=LONG_MS)
    take(watching, "stations")

    tablet.get_by_role("button", name="Press the e-stop switch").click()
    expect(tablet.get_by_test_id("stop-banner")).to_be_visible(timeout=LONG_MS)
    take(tablet, "stopped")
    tablet.get_by_role("button", name="Release the e-stop switch").click()
    tablet.get_by_test_id("stop-banner").get_by_role("button", name="Acknowledge").click(timeout=LONG_MS)

    # The last session of the demonstration: the newest one has just been stopped.
    page.goto(patient)
    open_tab(page, "Sessions")
    page.get_by_role("table").last.get_by_role("link").nth(1).click()
    expect(page.locator(".js-plotly-plot").first).to_be_visible(timeout=LONG_MS)
    take(page, "errors", page.get_by_role("region", name="Playback 1"))
    watching.goto(f"{clinic.url}/administration/audit")
    expect(watching.get_by_role("row").nth(5)).to_be_visible(timeout=LONG_MS)
    take(watching, "audit", watching.get_by_role("heading", name="Audit trail"))
