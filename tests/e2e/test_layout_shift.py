"""The layout stays in place while a page loads: no control moves away under a finger."""

import logging
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS, Clinic

pytestmark = [pytest.mark.shared_clinic("invented"), pytest.mark.three_dimensions]

log = logging.getLogger(__name__)
LIMIT: Final = 0.1
"""Cumulative Layout Shift that web.dev calls good: the share of the viewport that moves, times the distance."""
SIZES: Final = {"phone": (412, 823), "tablet, upright": (800, 1280), "tablet": (1280, 800), "desktop": (1350, 940)}
ATTEMPTS: Final = 20

# As web.dev defines it: the worst window of at most five seconds whose shifts are at most one second apart, without those that follow input.
NOTED: Final = """() => {
    window.shifts = { worst: 0, sum: 0, first: 0, last: 0, moved: [], lost: false };
    const note = (entries) => {
        const it = window.shifts;
        for (const { startTime, value, hadRecentInput, sources } of entries) {
            if (hadRecentInput) continue;
            if (startTime - it.last > 1000 || startTime - it.first > 5000) Object.assign(it, { sum: 0, first: startTime });
            it.sum += value;
            it.last = startTime;
            it.worst = Math.max(it.worst, it.sum);
            it.moved.push([value, ...sources.map(({ node }) => node?.textContent?.slice(0, 60))]);
        }
    };
    const observer = new PerformanceObserver((list) => note(list.getEntries()));
    observer.observe({ type: 'layout-shift', buffered: true });
    new MutationObserver(() => {
        if (document.querySelector('[data-testid=lost]')) window.shifts.lost = true;
    }).observe(document, { subtree: true, childList: true });
    window.untilNow = () => {
        note(observer.takeRecords());
        return window.shifts;
    };
}"""
DRAWN: Final = "() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))"


@dataclass(frozen=True)
class Screen:
    """A page, and a function that waits until it is complete."""

    path: str
    whole: Callable[[Page], None]


def home_is_whole(page: Page) -> None:
    expect(page.get_by_role("heading", name=re.compile("^Due today"))).to_be_visible(timeout=LONG_MS)
    expect(page.locator("main a[href^='/clinic']").first).to_be_visible(timeout=LONG_MS)
    expect(page.locator(".mantine-Skeleton-root")).to_have_count(0, timeout=LONG_MS)
    expect(page.get_by_test_id("station").first).to_be_visible(timeout=LONG_MS)


def station_is_whole(page: Page) -> None:
    expect(page.get_by_test_id("loop")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("lease")).to_be_visible()
    expect(page.get_by_test_id("angles").locator("canvas")).to_have_count(5, timeout=LONG_MS)
    expect(page.get_by_test_id("hand")).not_to_be_empty()
    expect(page.get_by_role("region", name="First steps")).to_be_visible()


def visit_is_whole(page: Page) -> None:
    station_is_whole(page)
    expect(page.get_by_role("region", name="Session").get_by_role("combobox")).to_be_visible()


def table_is_whole(page: Page) -> None:
    expect(page.get_by_role("row").nth(1)).to_be_visible(timeout=LONG_MS)


def chart_is_whole(page: Page) -> None:
    expect(page.get_by_test_id("since-last-month")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("rom-figure").get_by_role("table")).to_be_visible()
    expect(page.get_by_test_id("verdict")).to_be_visible()


def session_is_whole(page: Page) -> None:
    expect(page.get_by_test_id("verdict")).to_be_visible(timeout=LONG_MS)
    expect(page.locator("figure[data-drawn=true]")).to_have_count(1, timeout=LONG_MS)


def stations_are_whole(page: Page) -> None:
    expect(page.get_by_test_id("station").first).to_be_visible(timeout=LONG_MS)


def screens(page: Page, clinic: Clinic) -> dict[str, Screen]:
    def first(path: str) -> str:
        return str(page.request.get(f"{clinic.url}{path}").json()["items"][0]["id"])

    patient = first("/api/patients?search=DEMO-001")
    session = first(f"/api/patients/{patient}/sessions")
    return {
        "home": Screen("/", home_is_whole),
        "station": Screen("/station", station_is_whole),
        "station with a patient": Screen(f"/station?patient={patient}", visit_is_whole),
        "patients": Screen("/patients", table_is_whole),
        "chart": Screen(f"/patients/{patient}", chart_is_whole),
        "sessions": Screen("/sessions", table_is_whole),
        "session": Screen(f"/sessions/{session}", session_is_whole),
        "stations": Screen("/stations", stations_are_whole),
    }


def loaded(page: Page, url: str, screen: Screen) -> dict[str, Any]:
    """Return the layout shifts until the page was complete. Try again if the banner of a lost connection moved the page."""
    for _ in range(ATTEMPTS):
        page.goto(url + screen.path)
        screen.whole(page)
        page.evaluate(DRAWN)
        shifts: dict[str, Any] = page.evaluate("window.untilNow()")
        if not shifts["lost"]:
            return shifts
    pytest.fail(f"the connection was lost while {screen.path} was loaded, {ATTEMPTS} times")


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_layout_stays_in_place_while_a_page_loads(page: Page, clinic: Clinic) -> None:
    """Load each page in all sizes."""
    page.add_init_script(f"({NOTED})()")
    moved = {}
    for name, screen in screens(page, clinic).items():
        for size, (width, height) in SIZES.items():
            page.set_viewport_size({"width": width, "height": height})
            shifts = loaded(page, clinic.url, screen)
            log.info("%s, %s: %.3f", name, size, shifts["worst"])
            if shifts["worst"] > LIMIT:
                moved[f"{name}, {size}"] = (shifts["worst"], shifts["moved"])
    assert moved == {}
