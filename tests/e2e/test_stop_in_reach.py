"""Pages of every size: they fit the screen, and Stop is in reach of a finger and of the keyboard, also beside a dialog.

`make test` goes through four pages and a few dialogs, the campaign through all.
"""

import json
import re
import time
from collections.abc import Iterator
from itertools import product
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import first_page, wait_until_idle
from tests.support.paths import ROOT
from tests.support.shown_pages import SIZES
from tests.support.shown_station import ShownStation
from tests.support.stop_in_reach import tab_to_stop, untouchable, untouchable_stop

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
_PARTS: Final = re.compile("StationPage|NotificationButton|AxisSparkline|StationApparatus")
"""Scripts of the station page and of parts that load on demand."""

_TOUCHED: Final = ("telephone", "landscape", "tablet")
"""Sizes of devices that have a touch screen."""
_FINGER_PX: Final = 48
_LARGE_PX: Final = 88
"""Stop's size on a desktop."""
_HEADER: Final = """() => {
    const header = document.querySelector('header').getBoundingClientRect();
    const inside = ({left, right, top, bottom}) =>
        left >= header.left && right <= header.right && top >= header.top && bottom <= header.bottom;
    const parts = [...document.querySelectorAll('header :is(button, [data-testid])')]
        .map((part) => [part, part.getBoundingClientRect()])
        .filter(([, box]) => box.width > 0);
    const meet = (one, other) =>
        one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom;
    const name = (part) => part.dataset.testid ?? part.getAttribute('aria-label') ?? part.innerText;
    const over = parts.filter(([part, box], n) => parts.slice(n + 1).some(([other, place]) =>
        !part.contains(other) && meet(box, place)));
    return {
        height: header.height,
        outside: [...parts.filter(([, box]) => !inside(box)), ...over].map(([part]) => name(part)),
    };
}"""
"""The header's height, and its parts that are beyond its edges or over each other."""


_CUT_WORDS: Final = """() => [...document.querySelectorAll('header [data-testid] :not(svg, svg *), header [data-testid]')]
    .filter((part) => getComputedStyle(part).clipPath === 'none' && part.scrollWidth > part.clientWidth + 1)
    .map((part) => part.textContent)"""
"""Words of the header that their frame cuts."""
_EVERY: Final = pytest.param(True, marks=pytest.mark.campaign)
_REDRAWN_S: Final = 10.0
_LOW: Final = ((640, 360), SIZES["landscape"], (800, 360), (932, 430))
"""Sizes of telephones in landscape."""


def _misplaced(tab: Page, name: str) -> dict[str, str]:
    """Return the problems of the open page in all sizes."""
    found = {}
    # Where a chart gets a column of its own, it is too wide until it is drawn again.
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_load_state("networkidle")
        expect(tab.get_by_role("button", name="Stop", exact=True)).to_be_in_viewport(ratio=1)
        until = time.monotonic() + _REDRAWN_S
        while (
            beyond := tab.evaluate("document.documentElement.scrollWidth - innerWidth")
        ) > 0 and time.monotonic() < until:
            tab.wait_for_timeout(100)
        if beyond > 0:
            found[f"{name}, {size}"] = f"{beyond} px too wide"
        tab.evaluate("scrollTo(0, document.body.scrollHeight)")
        if why := untouchable_stop(tab):
            found[f"{name}, {size}, Stop"] = why
    tab.evaluate("scrollTo(0, 0)")
    return found


def _assert_low_header(tab: Page) -> None:
    """On a telephone in landscape the header is one row. Stop is large enough for a finger, and the header's parts are in it."""
    stop = tab.get_by_role("button", name="Stop", exact=True)
    for width, height in _LOW:
        tab.set_viewport_size({"width": width, "height": height})
        header = tab.evaluate(_HEADER)
        assert header["height"] <= height / 5, (width, height)
        assert header["outside"] == [], (width, height)
        box = stop.bounding_box()
        assert box and min(box["width"], box["height"]) >= _FINGER_PX, (width, height, box)
        assert untouchable_stop(tab) == ""


def _assert_low_banner(tab: Page) -> None:
    """On a telephone in landscape the header and the patient's banner take a third of the screen."""
    width, height = SIZES["landscape"]
    tab.set_viewport_size({"width": width, "height": height})
    banner = tab.get_by_test_id("patient-banner")
    expect(banner).to_contain_text("DEMO-001", timeout=LONG_MS)
    box = banner.bounding_box()
    assert box
    assert tab.evaluate(_HEADER)["height"] + box["height"] <= height / 3


@pytest.mark.timeout(600)
@pytest.mark.parametrize("every", [False, _EVERY])
def test_pages_of_all_sizes_fit_and_have_stop(tab: Page, clinic: Clinic, every: bool) -> None:
    """Header and patient banner also leave a telephone's low screen to the page."""
    found: dict[str, str] = {}
    for name, address in addresses(tab, clinic).items():
        if not every and name not in _PAGES:
            continue
        width, height = SIZES["telephone"]
        tab.set_viewport_size({"width": width, "height": height})
        tab.goto(clinic.url + address)
        wait_until_idle(tab)
        found |= _misplaced(tab, name)
        if name in ("home", "station", "station-patient"):
            _assert_low_header(tab)
        if name in ("patient", "session"):
            _assert_low_banner(tab)
    assert found == {}


@pytest.mark.campaign
def test_stop_stays_when_a_script_does_not_load(tab: Page, clinic: Clinic) -> None:
    """A service that is lost while the page loads cannot send the rest of it. The first scripts are taken as loaded.

    The stop's banner has its acknowledgement all the same.
    """
    first = set(re.findall(r'"(/assets/[^"]+\.js)"', tab.request.get(clinic.url).text()))
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url.removeprefix(clinic.url)))
    tab.goto(f"{clinic.url}/station")
    expect(tab.get_by_role("radiogroup", name="View")).to_be_visible(timeout=LONG_MS)
    tab.wait_for_load_state("networkidle")
    later = [path for path in dict.fromkeys(asked) if path.endswith(".js") and path not in first]
    names = [path for path in later if _PARTS.search(path)]
    assert len(names) >= 4, later
    with ShownStation(clinic) as station:
        station.make_idle()
        station.press_estop()
        for path in names:
            tab.route(f"**{path}", lambda route: route.abort())
            tab.goto(f"{clinic.url}/station")
            expect(tab.get_by_role("button", name="Stop", exact=True), path).to_be_visible(timeout=LONG_MS)
            tab.wait_for_load_state("networkidle")
            expect(tab.get_by_role("button", name="Stop", exact=True), path).to_be_in_viewport(ratio=1)
            expect(tab.get_by_role("button", name="Acknowledge"), path).to_be_in_viewport(ratio=1)
            tab.unroute(f"**{path}")
        station.release_estop()


@pytest.mark.campaign
@pytest.mark.parametrize("name", [pytest.param("station-patient", marks=pytest.mark.campaign), "patient"])
def test_telephone_scrolls_past_a_stop(tab: Page, clinic: Clinic, name: str) -> None:
    """A stop comes into view, with its cause, what to do and the acknowledgement, and the page is read below it."""
    tab.set_viewport_size({"width": 360, "height": 640})
    tab.goto(clinic.url + addresses(tab, clinic)[name])
    wait_until_idle(tab)
    tab.wait_for_load_state("networkidle")
    bottom = "scrollTo(0, document.body.scrollHeight)"
    tab.evaluate(bottom)
    with ShownStation(clinic) as station:
        station.press_estop()
        banner = tab.get_by_test_id("stop-banner")
        for part in (banner.get_by_role("heading"), banner.get_by_role("listitem"), banner.get_by_role("button")):
            expect(part).to_be_in_viewport(ratio=1)
        assert untouchable_stop(tab) == ""
        tab.evaluate(bottom)
        expect(banner).not_to_be_in_viewport()
        expect(tab.get_by_test_id("mode")).to_have_text("Stopped, torque off")
        assert untouchable_stop(tab) == ""
        station.release_estop()
    expect(banner).to_be_hidden()


def _cut_links(tab: Page) -> dict[int, int]:
    """Return by width how many pixels of the page links are out of reach, without a menu that offers them."""
    pages = tab.locator("nav[aria-label=Pages]")
    wrong = {}
    # Also the widths at which the layout changes, such as a tablet's 768 px.
    for width in (360, 767, 768, 769, 800, 900, 991, 992, 1024, 1199, 1200, 1280, 1920):
        tab.set_viewport_size({"width": width, "height": 900})
        if tab.get_by_role("button", name="Pages", exact=True).is_visible():
            continue
        cut = pages.evaluate("(nav) => nav.clientWidth ? nav.scrollWidth - nav.clientWidth : nav.childElementCount")
        if cut > 0:
            wrong[width] = cut
    return wrong


def _assert_menus_leave_states(tab: Page) -> None:
    """On a telephone the states in the header stay visible beside an open menu."""
    width, height = SIZES["telephone"]
    tab.set_viewport_size({"width": width, "height": height})
    for icon in ("menu-2", "user"):
        tab.locator(f"header button:has(.tabler-icon-{icon})").click()
        expect(tab.get_by_role("menu")).to_be_visible()
        for state in ("estop", "mode"):
            assert untouchable(tab.locator("header").get_by_test_id(state)) == "", (icon, state)
        tab.keyboard.press("Escape")
        expect(tab.get_by_role("menu")).to_be_hidden()


def _assert_low_menus(tab: Page) -> None:
    """On a telephone in landscape every page of the menu is in reach, and a dialog reaches to the bottom."""
    width, height = SIZES["landscape"]
    tab.set_viewport_size({"width": width, "height": height})
    tab.get_by_role("button", name="Pages", exact=True).click()
    last = tab.get_by_role("menuitem", name="Administration")
    last.scroll_into_view_if_needed()
    expect(last).to_be_in_viewport(ratio=1)
    tab.keyboard.press("Escape")
    tab.keyboard.press("Control+K")
    dialog = tab.get_by_role("dialog")
    expect(dialog.get_by_role("option")).not_to_have_count(0)
    box = dialog.bounding_box()
    assert box and box["y"] + box["height"] >= height - 16
    tab.keyboard.press("Escape")
    expect(dialog).to_be_hidden()


def _assert_answer_beside_header(tab: Page, *, failing: bool) -> None:
    """Press Stop. The answer neither moves Stop nor the buttons beside it."""
    stop = tab.get_by_role("button", name="Stop", exact=True)
    places = {}
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        places[size] = stop.bounding_box()
    stop.click()
    answer = tab.get_by_test_id("stop-answer")
    expect(answer).to_contain_text("Not confirmed" if failing else "Confirmed by the device", timeout=LONG_MS)
    found = {}
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        assert stop.bounding_box() == places[size], size
        expect(answer).to_be_in_viewport(ratio=1)
        if wrong := [part for part in tab.evaluate(_HEADER)["outside"] if not (failing and part == "stop-answer")]:
            found[size] = wrong
    assert found == {}


def test_header_keeps_links_and_stop_in_reach_at_every_size(tab: Page, clinic: Clinic) -> None:
    """Stop is among the first tabs, the links fit or the menu offers them, and the answer to Stop covers nothing of the header."""
    tab.goto(clinic.url)
    wait_until_idle(tab)
    tab.wait_for_load_state("networkidle")
    tab_to_stop(tab, presses=12)
    assert _cut_links(tab) == {}
    _assert_menus_leave_states(tab)
    _assert_low_menus(tab)
    _assert_answer_beside_header(tab, failing=False)


@pytest.mark.parametrize("language", ["en", "ja"])
def test_header_says_simulated_at_every_size(tab: Page, clinic: Clinic, language: str) -> None:
    """A telephone's header once did not say it. The mark neither makes the header higher nor leaves it."""
    tab.goto(clinic.url)
    wait_until_idle(tab)
    tab.evaluate("(language) => localStorage.setItem('kata.language', language)", language)
    tab.reload()
    expect(tab.locator("html")).to_have_attribute("lang", language)
    header = tab.locator("header")
    expect(header.get_by_test_id("connection")).to_have_attribute("data-connected", "true", timeout=LONG_MS)
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        words = header.get_by_role("status").filter(has_text=re.compile("simulated|模擬"))
        mark = header.get_by_test_id("simulated-mark")
        shown = mark if size in ("telephone", "landscape") else words
        expect(shown, size).to_be_in_viewport(ratio=1)
        assert untouchable(shown) == "", size
        assert tab.evaluate(_HEADER)["outside"] == [], size
        if size == "telephone":
            assert tab.evaluate(_HEADER)["height"] == 124


_SHOW: Final = """([state, torque]) => {
    for (const [testid, words] of [['mode', torque], ['estop', state]]) {
        const walker = document.createTreeWalker(document.querySelector(`header [data-testid=${testid}]`), NodeFilter.SHOW_TEXT);
        walker.nextNode().data = words;
    }
}"""
"""Writes other words into the header."""


@pytest.mark.parametrize("language", ["en", "ja"])
def test_header_has_space_for_station_and_every_state(tab: Page, clinic: Clinic, language: str) -> None:
    """With three stations, a telephone's header once did not say whose state and Stop it shows. Long states once were cut."""
    tab.goto(clinic.url)
    tab.evaluate("(language) => localStorage.setItem('kata.language', language)", language)
    tab.reload()
    expect(tab.locator("html")).to_have_attribute("lang", language)
    header = tab.locator("header")
    expect(header.get_by_test_id("connection")).to_have_attribute("data-connected", "true", timeout=LONG_MS)
    words = json.loads((ROOT / f"frontend/src/locales/{language}/common.json").read_text())
    together = words["modes"].pop("withTorque")
    modes = [
        together.replace("{{mode}}", mode).replace("{{torqueState}}", words["torque"][torque])
        for name, mode in words["modes"].items()
        for torque in (["on"] if name == "holding" else words["torque"])
    ]
    estops = [words["estop"]["closed"], words["estop"]["pressed"], words["estop"]["missing"]]
    # The apparatus cannot move before a released switch is acknowledged.
    stopped = [mode for mode in modes if mode.startswith(words["modes"]["stopped"])]
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        before = tab.evaluate(_HEADER)["height"]
        for estop, mode in [*product(estops, modes), *((words["estop"]["released"], mode) for mode in stopped)]:
            tab.evaluate(_SHOW, [estop, mode])
            assert tab.evaluate(_HEADER) == {"height": before, "outside": []}, (size, estop, mode)
            assert tab.evaluate(_CUT_WORDS) == [], (size, estop, mode)
        for part in ("station-name", "estop", "mode", "connection"):
            expect(header.get_by_test_id(part)).to_be_in_viewport(ratio=1)


def test_signs_of_the_header_have_one_height_and_icons(tab: Page, clinic: Clinic) -> None:
    """The e-stop's box once was higher, and on a telephone the torque had no icon."""
    tab.goto(clinic.url)
    wait_until_idle(tab)
    estop, mode = (tab.locator("header").get_by_test_id(name) for name in ("estop", "mode"))
    for size, (width, height) in SIZES.items():
        tab.set_viewport_size({"width": width, "height": height})
        boxes = [sign.bounding_box() for sign in (estop, mode)]
        assert len({box["height"] for box in boxes if box}) == 1, (size, boxes)
        expect(mode.locator("svg"), size).to_be_in_viewport(ratio=1)


def test_key_of_stop_is_named_beside_a_mouse_only(tab: Page, finger: Page, clinic: Clinic) -> None:
    for page, named in ((tab, True), (finger, False)):
        _open(page, clinic.url, "tablet")
        expect(page.get_by_text("Key: Esc", exact=True)).to_be_visible(visible=named)


@pytest.mark.campaign
def test_unconfirmed_stop_covers_nothing_of_the_header(tab: Page, clinic: Clinic) -> None:
    """A stop that no device confirms has its text below the header."""
    # A page keeps the route of a WebSocket.
    page = tab.context.new_page()
    page.route("**/api/station/stop", lambda route: route.abort())
    page.route_web_socket("**/api/live", lambda socket: socket.close())
    page.goto(clinic.url)
    expect(page.get_by_role("button", name="Stop", exact=True)).to_be_visible(timeout=LONG_MS)
    page.wait_for_load_state("networkidle")
    _assert_answer_beside_header(page, failing=True)


@pytest.mark.parametrize("every", [False, _EVERY])
def test_dialogs_leave_stop_to_finger_and_keyboard(tab: Page, clinic: Clinic, every: bool) -> None:
    missed = {}
    found = addresses(tab, clinic)
    for name, opener in _DIALOGS if every else _DIALOGS[:1]:
        tab.set_viewport_size({"width": 1280, "height": 800})
        tab.goto(clinic.url + found[name])
        wait_until_idle(tab)
        tab.get_by_role("button", name=opener, exact=True).first.click(timeout=LONG_MS)
        dialog = tab.get_by_role("dialog")
        expect(dialog).to_be_visible()
        box = tab.get_by_role("button", name="Stop", exact=True, include_hidden=True).bounding_box()
        assert box and min(box["width"], box["height"]) >= _LARGE_PX
        for size, (width, height) in SIZES.items():
            tab.set_viewport_size({"width": width, "height": height})
            if why := untouchable_stop(tab):
                missed[f"{opener}, {size}"] = why
        tab_to_stop(tab, presses=_MOST_CONTROLS)
        tab.keyboard.press("Tab")
        assert dialog.evaluate("dialog => dialog.contains(document.activeElement)"), opener
        tab.keyboard.press("Escape")
        expect(dialog).to_be_hidden()
    assert missed == {}


@pytest.fixture(scope="module")
def touch_screen(module_browser: Browser, browser_context_args: dict[str, Any]) -> Iterator[BrowserContext]:
    """Return a browser with a touch screen and without a mouse, for all tests of the file."""
    context = module_browser.new_context(**browser_context_args, has_touch=True, is_mobile=True)
    yield context
    context.close()


@pytest.fixture
def finger(touch_screen: BrowserContext, clinic: Clinic) -> Page:
    """Return a page of a touch screen, signed in as an administrator."""
    touch_screen.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    return first_page(touch_screen)


def _open(finger: Page, address: str, size: str) -> None:
    width, height = SIZES[size]
    finger.set_viewport_size({"width": width, "height": height})
    finger.goto(address)
    wait_until_idle(finger)
    finger.wait_for_load_state("networkidle")


_SMALL_SWITCHES: Final = """() => [...document.querySelectorAll('.mantine-SegmentedControl-label, .mantine-Switch-root')]
    .filter((target) => target.checkVisibility({visibilityProperty: true}) && target.getBoundingClientRect().height < 44)
    .map((target) => target.textContent)"""


@pytest.mark.parametrize("name", ["station", "session", "patients", "home", "usage"])
def test_switches_are_high_enough_for_a_finger(finger: Page, clinic: Clinic, name: str) -> None:
    """On a telephone they once were 23 to 28 px high."""
    _open(finger, clinic.url + addresses(finger, clinic)[name], "telephone")
    expect(finger.locator(".mantine-SegmentedControl-label, .mantine-Switch-root").first).to_be_visible(timeout=LONG_MS)
    assert finger.evaluate(_SMALL_SWITCHES) == []


def _tap_stop(page: Page) -> None:
    """Touch Stop. A touch has no effect on a covered button, and Playwright reports what covers it."""
    page.get_by_role("button", name="Stop", exact=True, include_hidden=True).tap(timeout=LONG_MS)
    expect(page.get_by_test_id("stop-answer")).to_contain_text("Confirmed by the device", timeout=LONG_MS)


@pytest.mark.timeout(900)
@pytest.mark.parametrize("every", [False, _EVERY])
def test_finger_stops_on_every_page(finger: Page, clinic: Clinic, every: bool) -> None:
    """Touch Stop on each page that is scrolled to its end; in `make test` on two pages, each in another size."""
    pages = addresses(finger, clinic)
    names = list(pages) if every else ["station-patient", "session"]
    for place, name in enumerate(names):
        for size in _TOUCHED if every else [_TOUCHED[place % len(_TOUCHED)]]:
            _open(finger, clinic.url + pages[name], size)
            finger.evaluate("scrollTo(0, document.body.scrollHeight)")
            _tap_stop(finger)


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_finger_stops_beside_an_open_dialog_or_menu(finger: Page, clinic: Clinic) -> None:
    pages = addresses(finger, clinic)
    dialogs: list[tuple[str, str]] = [("home", "Pages"), *_DIALOGS, ("home", "Search")]
    for place, (name, opener) in enumerate(dialogs):
        _open(finger, clinic.url + pages[name], _TOUCHED[place % len(_TOUCHED)])
        finger.get_by_role("button", name=re.compile(f"^{opener}")).first.tap(timeout=LONG_MS)
        expect(finger.get_by_role("dialog").or_(finger.get_by_role("menu"))).to_be_visible(timeout=LONG_MS)
        _tap_stop(finger)


@pytest.mark.timeout(600)
@pytest.mark.parametrize("ways", [("touch", "Esc"), pytest.param(("Tab",), marks=pytest.mark.campaign)])
def test_moving_arm_stops_beside_an_open_dialog(finger: Page, clinic: Clinic, ways: tuple[str, ...]) -> None:
    """An arm that is played stops by a touch, by Esc, and by Tab and Enter, while a dialog has the focus; and by Esc in a text field."""
    mode = finger.get_by_test_id("mode")
    with ShownStation(clinic) as station:
        session, recording = station.begin_session("DEMO-002")
        _open(finger, f"{clinic.url}/patients", "tablet")
        for way in ways:
            station.play(session, recording)
            expect(mode).to_have_text("Playing, torque on", timeout=LONG_MS)
            finger.get_by_role("button", name="New patient").tap()
            expect(finger.get_by_role("dialog")).to_be_visible()
            if way == "touch":
                _tap_stop(finger)
            elif way == "Esc":
                finger.keyboard.press("Escape")
            else:
                tab_to_stop(finger, presses=_MOST_CONTROLS)
                finger.keyboard.press("Enter")
            expect(mode, way).to_have_text("Stopped, torque off", timeout=LONG_MS)
            station.make_idle()
            expect(mode).to_have_text("Idle, torque off", timeout=LONG_MS)
            if finger.get_by_role("dialog").is_visible():
                finger.keyboard.press("Escape")
            expect(finger.get_by_role("dialog")).to_be_hidden()
        station.play(session, recording)
        expect(mode).to_have_text("Playing, torque on", timeout=LONG_MS)
        finger.get_by_role("textbox", name="Search").fill("abc")
        finger.keyboard.press("Escape")
        expect(finger.get_by_test_id("stop-answer")).to_contain_text("Confirmed by the device")
        expect(finger.get_by_test_id("stop-banner")).to_contain_text("Stopped by the operator.")
        expect(mode).to_have_text("Stopped, torque off")
        station.make_idle()
        station.end_session(session)
