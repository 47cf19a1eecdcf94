"""The pages of a clinic with history fit the screen. test_clicks.py tests their searches."""

import re
from typing import Final

import pytest
from playwright.sync_api import Page, expect

from tests.support.accessibility import addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import wait_until_idle
from tests.support.shown_pages import SIZES
from tests.support.shown_station import ShownStation
from tests.support.stop_in_reach import untouchable

pytestmark = [pytest.mark.shared_clinic("invented"), pytest.mark.three_dimensions]


@pytest.fixture
def page(tab: Page, clinic: Clinic) -> Page:
    """Return the home page, signed in as an administrator, with an idle apparatus."""
    tab.goto(clinic.url)
    wait_until_idle(tab)
    return tab


@pytest.mark.campaign
def test_search_and_shortcuts_leave_stop_in_reach(page: Page) -> None:
    stop = page.get_by_role("button", name="Stop", exact=True)
    page.keyboard.press("ControlOrMeta+K")
    expect(page.get_by_role("dialog", name="Search everywhere")).to_be_visible()
    expect(stop).to_be_in_viewport()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    page.keyboard.press("ControlOrMeta+/")
    sheet = page.get_by_role("dialog", name="Keyboard shortcuts")
    expect(sheet).to_contain_text("Stop, while the arm moves")
    expect(stop).to_be_in_viewport()
    page.keyboard.press("Escape")
    expect(sheet).to_be_hidden()


_NAME_SEEN: Final = """async () => {
    window.scrollTo(0, 600);
    // The page measures the alarms once per frame.
    for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);
    const name = document.querySelector('[data-testid=patient-banner] h1');
    const {left, top, width, height} = name.getBoundingClientRect();
    return [window.scrollY, name.contains(document.elementFromPoint(left + width / 2, top + height / 2))];
}"""


def alarms(page: Page, clinic: Clinic) -> set[str]:
    """Return the ids of the stored alarms."""
    items = page.request.get(f"{clinic.url}/api/notifications").json()["items"]
    return {item["id"] for item in items if item["kind"] == "alarm"}


@pytest.mark.campaign
def test_alarm_leaves_the_patients_name_and_becomes_a_notification(page: Page, clinic: Clinic) -> None:
    patient = page.request.get(f"{clinic.url}/api/patients").json()["items"][0]["id"]
    page.goto(f"{clinic.url}/patients/{patient}")
    expect(page.get_by_test_id("patient-banner").get_by_role("heading")).to_be_visible(timeout=LONG_MS)
    earlier = alarms(page, clinic)
    with ShownStation(clinic) as station:
        station.press_estop()
        expect(page.get_by_test_id("alarm-sound")).to_be_visible(timeout=LONG_MS)
        for size in ("telephone", "desktop"):
            width, height = SIZES[size]
            page.set_viewport_size({"width": width, "height": height})
            scrolled_px, is_visible = page.evaluate(_NAME_SEEN)
            assert scrolled_px > 100, size
            assert is_visible, size
        station.release_estop()
    # The event is stored after the device has told it, so an alarm could come after all others were read.
    while alarms(page, clinic) <= earlier:
        page.wait_for_timeout(100)
    page.goto(clinic.url)
    page.get_by_role("button", name=re.compile(r"^Notifications: \d+ not read$")).click(timeout=LONG_MS)
    listed = page.get_by_role("dialog", name="Notifications")
    expect(listed.get_by_role("link", name=re.compile("Emergency stop pressed$")).first).to_be_visible()
    listed.get_by_role("button", name="Mark all as read").click()
    expect(listed.get_by_role("button", name="Mark all as read")).to_be_hidden()
    with page.expect_response("**/api/notifications") as answered:
        page.reload()
    assert all(notification["read"] for notification in answered.value.json()["items"])
    expect(page.get_by_role("button", name="Notifications", exact=True)).to_be_visible(timeout=LONG_MS)


@pytest.mark.campaign
def test_archiving_is_taken_back_with_one_press(page: Page) -> None:
    page.get_by_role("link", name="Patients", exact=True).click()
    # The home page also lists the patients of today's sessions.
    expect(page.get_by_role("heading", name="Patients", level=1)).to_be_visible(timeout=LONG_MS)
    page.get_by_role("link", name="Tanaka Ren").click()
    page.get_by_role("button", name="Archive", exact=True).click()
    expect(page.get_by_text("Archived", exact=True)).to_be_visible()
    page.get_by_test_id("undo").get_by_role("button", name="Undo").click()
    expect(page.get_by_role("button", name="Archive", exact=True)).to_be_visible()
    expect(page.get_by_text("Archived", exact=True)).to_be_hidden()


_UNEVEN_ROWS: Final = """() => [...document.querySelectorAll('[class*="_metrics_"]')].flatMap((grid) => {
    const edge = grid.getBoundingClientRect().right;
    const rows = new Map();
    for (const figure of grid.children) {
        const {top, right} = figure.getBoundingClientRect();
        rows.set(top, Math.max(right, rows.get(top) ?? 0));
    }
    return [...rows.values()].filter((right) => Math.abs(right - edge) > 1).map((right) => edge - right);
})"""
"""Free pixels at the end of each row of key figures."""


def test_rows_of_key_figures_are_filled(page: Page, clinic: Clinic) -> None:
    """In a card of a desktop the last figure once took two thirds of its row."""
    patient = addresses(page, clinic)["patient"]
    page.goto(clinic.url + patient)
    expect(page.get_by_role("region", name="Result")).to_be_visible(timeout=LONG_MS)
    for size, (width, height) in SIZES.items():
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate(_UNEVEN_ROWS) == [], size


@pytest.mark.parametrize("language", ["en", "ja"])
@pytest.mark.parametrize(
    "name", ["sessions", "patient-sessions", "patient-recordings", "accounts", "audit", "history", "stops"]
)
def test_tables_of_a_telephone_are_not_cut(page: Page, clinic: Clinic, name: str, language: str) -> None:
    """Their last column was once beyond the edge. A sorted column is wider by its arrow."""
    page.evaluate("(language) => localStorage.setItem('kata.language', language)", language)
    page.set_viewport_size({"width": 360, "height": 740})
    page.goto(clinic.url + addresses(page, clinic)[name])
    table = page.locator("main table").first
    expect(table).to_be_visible(timeout=LONG_MS)
    heads = table.get_by_role("columnheader").filter(has=page.get_by_role("button"))
    expect(heads).not_to_have_count(0)
    for number in range(heads.count()):
        heads.nth(number).get_by_role("button").click()
        edge = table.evaluate("(table) => table.getBoundingClientRect().right")
        assert edge <= 360 - 16, (heads.nth(number).inner_text(), edge)


def test_japanese_motion_of_the_simulated_hand_fits_a_telephone(page: Page) -> None:
    """The button beside it once cut its name. English names are longer than a telephone's line."""
    page.evaluate("localStorage.setItem('kata.language', 'ja')")
    page.set_viewport_size({"width": 360, "height": 740})
    page.goto(page.url + "station")
    motion = page.locator("section:has(input[type=file])").get_by_role("combobox")
    expect(motion).to_have_value(re.compile("1"), timeout=LONG_MS)
    assert motion.evaluate("(input) => input.scrollWidth - input.clientWidth") == 0


def test_plan_of_a_session_fits_a_telephone(page: Page, clinic: Clinic) -> None:
    """What was planned is below the recording's name there. It was once beyond the edge."""
    page.set_viewport_size({"width": 360, "height": 740})
    page.goto(clinic.url + addresses(page, clinic)["session-plan"])
    table = page.get_by_test_id("planned").get_by_role("table")
    expect(table).to_be_visible(timeout=LONG_MS)
    assert table.evaluate("(table) => table.getBoundingClientRect().right") <= 360 - 16
    expect(table.get_by_text("% of the range").first).to_be_visible()


def test_line_below_scrolled_tabs_has_no_gap(page: Page, clinic: Clinic) -> None:
    """On a telephone it once scrolled with the tabs and ended in the middle of the screen."""
    page.set_viewport_size({"width": 360, "height": 740})
    page.goto(clinic.url + addresses(page, clinic)["session-plan"])
    tabs = page.get_by_role("tablist")
    expect(page.get_by_test_id("planned").get_by_role("table")).to_be_visible(timeout=LONG_MS)

    def line(scroll: str, x: float) -> bytes:
        tabs.evaluate(f"(list) => {{ list.scrollLeft = {scroll}; }}")
        tabs.scroll_into_view_if_needed()
        box = tabs.bounding_box()
        assert box
        return page.screenshot(clip={"x": x, "y": box["y"] + box["height"] - 2, "width": 12, "height": 2})

    assert line("0", 20) == line("list.scrollWidth", 360 - 16 - 16)


_BROWSER_BARS_PX: Final = 128
"""Height of the status bar, address bar and navigation bar of a tablet."""


def test_live_view_and_controls_fit_on_one_screen(page: Page, clinic: Clinic) -> None:
    listed = page.request.get(f"{clinic.url}/api/patients").json()["items"]
    patient = next(row["id"] for row in listed if row["affected_side"] == "right")
    # Other tests leave it set up for the left shoulder. For this patient the page would then also tell how to set it up.
    with ShownStation(clinic) as station:
        station.set_side("right")
    # A clinic has hidden the guide of the simulated apparatus.
    page.evaluate("localStorage.setItem('kata.first-steps-hidden', 'true')")
    page.goto(f"{clinic.url}/station?patient={patient}")
    begin = page.get_by_role("button", name="Begin the session")
    for size in ("desktop", "tablet"):
        width, height = SIZES[size]
        page.set_viewport_size({"width": width, "height": height})
        for seen in (begin, page.get_by_test_id("apparatus-canvas"), page.get_by_test_id("angle-5")):
            expect(seen, size).to_be_in_viewport(ratio=1, timeout=LONG_MS)
        assert untouchable(begin) == "", size
        if size == "tablet":
            page.set_viewport_size({"width": width, "height": height - _BROWSER_BARS_PX})
            expect(begin).to_be_in_viewport(ratio=1)
            assert untouchable(begin) == ""
        # What belongs to the simulated apparatus comes after both.
        simulator = page.get_by_role("region", name="Simulated apparatus").bounding_box()
        last, live = begin.bounding_box(), page.get_by_test_id("angle-5").bounding_box()
        assert simulator and last and live
        assert simulator["y"] >= max(last["y"] + last["height"], live["y"] + live["height"]), size


_LIVE_VIEW_BELOW_PX: Final = """(steps) => {
    const live = document.querySelector('[data-testid=apparatus-canvas]');
    return live.getBoundingClientRect().top - steps.getBoundingClientRect().bottom;
}"""


def test_live_view_covers_no_step_of_a_tablet(page: Page, clinic: Clinic) -> None:
    """At the lower edge of an upright tablet it once covered most of the checklist."""
    width, height = SIZES["tablet"]
    page.set_viewport_size({"width": width, "height": height})
    with ShownStation(clinic) as station:
        session, _ = station.begin_session("DEMO-002")
        page.goto(f"{clinic.url}/station?patient={session['patient']['id']}")
        expect(page.get_by_test_id("check-identity").filter(visible=True)).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_test_id("apparatus-canvas")).to_be_visible(timeout=LONG_MS)
        steps = page.get_by_role("region", name="Session", exact=True)
        for seen_from in ("scrollTo(0, 0)", "scrollTo(0, document.body.scrollHeight)"):
            page.evaluate(seen_from)
            assert steps.evaluate(_LIVE_VIEW_BELOW_PX) > 0, seen_from
        station.end_session(session)


_TWO_ALARMS_PX: Final = 300


@pytest.mark.campaign
def test_pause_stays_on_the_screen_below_alarms(page: Page, clinic: Clinic) -> None:
    """Alarms move the page down. On an upright tablet two of them once moved Pause off the screen."""
    with ShownStation(clinic) as station:
        session, recording = station.begin_session("DEMO-002")
        station.play(session, recording)
        page.goto(f"{clinic.url}/station")
        pause = page.get_by_role("button", name="Pause", exact=True)
        width, height = SIZES["tablet"]
        page.set_viewport_size({"width": width, "height": height - _BROWSER_BARS_PX})
        expect(pause).to_be_in_viewport(ratio=1, timeout=LONG_MS)
        page.evaluate(f"document.querySelector('main').style.marginTop = '{_TWO_ALARMS_PX}px'")
        expect(pause).to_be_in_viewport(ratio=1)
        pause.click()
        expect(page.get_by_role("button", name="Return and release")).to_be_in_viewport()
        page.get_by_role("button", name="Stop", exact=True).click()
        station.make_idle()
        station.end_session(session)


_FIRST_CELL_PX: Final = """(table) => {
    const frame = table.closest('.mantine-ScrollArea-viewport');
    frame.scrollLeft = 200;
    const left = table.querySelector('tbody tr > :first-child').getBoundingClientRect().left;
    return [frame.scrollLeft, left - frame.getBoundingClientRect().left];
}"""


def test_names_stay_in_view_while_numbers_scroll(page: Page, clinic: Clinic) -> None:
    """A table of numbers once looked cut: its bar was hidden, and its rows lost their names."""
    width, height = SIZES["tablet"]
    page.set_viewport_size({"width": width, "height": height})
    patient = page.request.get(f"{clinic.url}/api/patients?search=DEMO-001").json()["items"][0]["id"]
    # The newest sessions may be those of other tests, without a playback.
    oldest = page.request.get(f"{clinic.url}/api/patients/{patient}/sessions").json()["items"][-1]["id"]
    page.goto(f"{clinic.url}/sessions/{oldest}?tab=numbers")
    table = page.get_by_test_id("errors")
    expect(table).to_be_visible(timeout=LONG_MS)
    bar = page.locator(".mantine-ScrollArea-root:has([data-testid=errors]) > [data-orientation=horizontal]")
    expect(bar).to_be_visible()
    scrolled_px, first_cell_px = table.evaluate(_FIRST_CELL_PX)
    assert scrolled_px == 200
    assert abs(first_cell_px) < 3
