"""In a browser that prefers Japanese, every page is Japanese, also for screen readers, and can be switched to English."""

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any, Final

import pytest
from playwright.sync_api import Error, Page, Response, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import OF_A_PATIENT, addresses, misfits_on_telephone, opened, wrong
from tests.support.browser_clinic import LONG_MS, START_LIMIT_S, Clinic
from tests.support.page_actions import acknowledge
from tests.support.units import bare_numbers

IDLE: Final = "待機中・トルク切"
STOPPED: Final = "停止"
OURS: Final = frozenset(
    {
        "Kata",
        "English",
        "Esc",
        "CSV",
        "Parquet",
        "MCAP",
        "LeRobot",
        "UTC",
        "ZIP",
        "PDF",
        "FHIR",
        "JSON",
        "UTF",
        "SPADI",
        "RMSE",
        "RMS",
        "OpenID",
        "URL",
    }
    | {"PNG", "RTS", "audit", "verify", "HL7", "TOTP", "TOML", "SHA", "SVG", "USB", "Winter", "Cort", "kata", "DEMO"}
)
"""Words that are the same in Japanese."""
RECORDED: Final = frozenset(
    {"name", "kana", "notes", "note", "text", "diagnosis", "contraindications", "closing_note", "therapist", "station"}
    | {"username", "recording_name", "recording", "made_by", "taught_by", "assessed_by", "signed_by", "limits_by", "by"}
    | {
        "role",
        "subject",
        "action",
        "outcome",
        "reason",
        "agent",
        "file",
        "who",
        "openid",
        "checked_by",
        "clinic_number",
        "programme",
        "version",
        "address",
    }
)
"""Fields with texts of users, which are not translated, and with identifiers."""

SEEN: Final = """() => {
    const texts = [];
    const walker = document.createTreeWalker(document.documentElement, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const within = walker.currentNode.parentElement;
        // Names and values of a file are the same in every language.
        if (within.closest('script, style, noscript, [translate=no]')) continue;
        if (within.checkVisibility({visibilityProperty: true})) texts.push(walker.currentNode.textContent);
    }
    for (const one of document.querySelectorAll('[aria-label], [title], [placeholder], [alt]')) {
        if (one.closest('[aria-hidden=true]')) continue;
        for (const name of ['aria-label', 'title', 'placeholder', 'alt']) texts.push(one.getAttribute(name) ?? '');
    }
    // The value of a radio button or checkbox is not shown.
    for (const one of document.querySelectorAll('input:not([type=radio], [type=checkbox])'))
        if (one.checkVisibility()) texts.push(one.value);
    return texts.filter((text) => text.trim() !== '');
}"""


@pytest.fixture(scope="session")
def browser_context_args(browser_context_args: dict[str, Any]) -> dict[str, Any]:
    return {**browser_context_args, "locale": "ja-JP"}


def wait_until_idle(page: Page) -> None:
    """Wait until the apparatus is idle. Acknowledge a stop: on a busy computer the device misses answers."""
    mode = page.get_by_test_id("mode")
    expect(mode).to_have_text(re.compile(f"^({IDLE}|{STOPPED})$"), timeout=START_LIMIT_S * 1000)
    if mode.inner_text() == STOPPED:
        acknowledge(page, name="確認")
    expect(mode).to_have_text(IDLE, timeout=START_LIMIT_S * 1000)


@pytest.fixture
def page(tab: Page, clinic: Clinic) -> Page:
    """Return the page with the list of patients, signed in as an administrator, with an idle apparatus."""
    tab.goto(f"{clinic.url}/patients")
    wait_until_idle(tab)
    return tab


def written(document: Any) -> Iterator[str]:
    """Return every text in an answer of the service that a user has written."""
    if isinstance(document, dict):
        for name, value in document.items():
            if name in RECORDED and isinstance(value, str):
                yield value
            yield from written(value)
    elif isinstance(document, list):
        for item in document:
            yield from (item,) if isinstance(item, str) else written(item)


def answer_of(response: Response) -> Any:
    """Return what the service answered. Ask again if the browser has left the page that received it."""
    try:
        return response.json()
    except Error:
        return response.frame.page.request.get(response.url).json()


def english_on(page: Page, records: set[str]) -> list[str]:
    """Return texts with a word of at least three Latin letters that is neither a user's nor the same in Japanese."""
    found = []
    cited = r"[A-Z][a-z]+他|MoraisとPascoal|J\. (?:[A-Z][a-z]+\.? )+\d{4}"
    for text in page.evaluate(SEEN):
        # Without paths, commands, the JSON of audit entries, and authors and journals.
        left = re.sub(rf'/[\w./-]+|kata [a-z]+( --[a-z]+)*|\w+: \{{".*\}}|{cited}', "", text)
        for record in sorted(records, key=len, reverse=True):
            left = left.replace(record, "")
        words = set(re.findall(r"[A-Za-z_]{3,}", left)) - OURS
        if any("_" not in word for word in words):
            found.append(text)
    return found


@pytest.mark.shared_clinic("invented")
@pytest.mark.timeout(900)
@pytest.mark.parametrize("every", [2, pytest.param(1, marks=pytest.mark.campaign)])
def test_every_page_speaks_japanese(tab: Page, clinic: Clinic, every: int) -> None:
    """Check the words of every page, that it fits a telephone, that each number has a unit, and that a patient's page names the shoulder. axe checks every second page, from the second one, or every page in the campaign."""
    tabs = tab, tab.context.new_page()
    heard: defaultdict[Page, list[Response]] = defaultdict(list)
    tab.context.on("response", lambda answer: heard[answer.frame.page].append(answer))
    for opened_tab in tabs:
        opened_tab.emulate_media(color_scheme="dark", reduced_motion="reduce")
    # A page receives the stations' names over its WebSockets.
    stations = {
        name
        for path in ("station", "stations")
        for name in written(tab.request.get(f"{clinic.url}/api/{path}").json())
        if len(name) > 2
    }
    english: dict[str, list[str]] = {}
    barred: dict[str, list[str]] = {}
    bare_of: dict[str, list[str]] = {}
    for number, (name, page) in enumerate(opened(tabs, clinic, addresses(tab, clinic))):
        checked = number % every == every - 1
        wait_until_idle(page)
        if name in ("station", "station-patient"):
            expect(page.get_by_role("region", name="模擬装置")).to_be_visible(timeout=LONG_MS)
        page.wait_for_load_state("networkidle")
        expect(page.locator(".mantine-Skeleton-root")).to_have_count(0, timeout=LONG_MS)
        expect(page.locator("html")).to_have_attribute("lang", "ja")
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
        answers = [
            answer_of(response)
            for response in heard[page]
            if response.ok and "json" in response.headers.get("content-type", "")
        ]
        records = {record for answer in answers for record in written(answer) if len(record) > 2} | stations
        if found := english_on(page, records):
            english[name] = found
        if violations := (wrong(page) if checked else []) + misfits_on_telephone(page):
            barred[name] = violations
        if bare := bare_numbers(page, "ja"):
            bare_of[name] = bare
        if OF_A_PATIENT.match(name):
            expect(page.get_by_test_id("patient-banner")).to_contain_text(re.compile("[左右]肩"))
        heard[page].clear()
    problems = "\n".join(
        f"{name}: {sorted(set(texts))}" for found in (english, barred, bare_of) for name, texts in found.items()
    )
    assert not problems, problems


@pytest.mark.shared_clinic("invented")
def test_a_stop_and_the_door_speak_japanese(page: Page, clinic: Clinic) -> None:
    page.emulate_media(color_scheme="dark")
    page.goto(f"{clinic.url}/station")
    records = set(written(page.request.get(f"{clinic.url}/api/station").json()))
    records |= set(written(page.request.get(f"{clinic.url}/api/me").json()))
    records |= set(written(page.request.get(f"{clinic.url}/api/simulator").json()))
    found: dict[str, list[str]] = {}

    def look(name: str) -> None:
        if texts := english_on(page, records):
            found[name] = texts
        if violations := wrong(page):
            found[f"{name}, barred"] = violations

    page.get_by_role("button", name="非常停止スイッチを押す").click()
    expect(page.get_by_test_id("stop-banner")).to_contain_text("非常停止が押されました。")
    look("stopped")
    page.get_by_role("button", name="非常停止スイッチを解除する").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "released")
    acknowledge(page, name="確認")
    page.get_by_role("button", name="停止", exact=True).click()
    expect(page.get_by_test_id("stop-answer")).to_contain_text("装置から確認応答")
    look("after-stop")
    page.context.clear_cookies(name=COOKIE)
    page.goto(clinic.url)
    expect(page.get_by_role("heading", name="サインイン")).to_be_visible(timeout=LONG_MS)
    expect(page.locator("html")).to_have_attribute("lang", "ja")
    look("door")
    page.get_by_role("textbox", name="ユーザー名").fill("nobody")
    page.get_by_role("textbox", name="パスワード").fill("wrong wrong wrong")
    page.get_by_role("button", name="サインイン", exact=True).click()
    expect(page.get_by_role("alert").filter(has_text="ユーザー名またはパスワードが違います。")).to_be_visible()
    assert found == {}


def test_page_uses_the_chosen_language_at_every_login(page: Page, clinic: Clinic) -> None:
    page.goto(f"{clinic.url}/account")
    expect(page.get_by_role("heading", name="表示言語")).to_be_visible(timeout=LONG_MS)
    page.get_by_text("English", exact=True).click()
    expect(page.get_by_role("heading", name="Language")).to_be_visible(timeout=LONG_MS)
    expect(page.locator("html")).to_have_attribute("lang", "en")
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off")
    # Another browser that prefers Japanese shows English as soon as it knows the user.
    browser = page.context.browser
    assert browser
    other = browser.new_context(locale="ja-JP")
    other.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    elsewhere = other.new_page()
    elsewhere.goto(clinic.url)
    expect(elsewhere.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)
    # Before login the browser's own choice counts.
    other.clear_cookies(name=COOKIE)
    elsewhere.goto(clinic.url)
    expect(elsewhere.get_by_role("heading", name="Sign in")).to_be_visible(timeout=LONG_MS)
    elsewhere.get_by_text("日本語", exact=True).click()
    expect(elsewhere.get_by_role("heading", name="サインイン")).to_be_visible(timeout=LONG_MS)
    other.close()
    page.reload()
    expect(page.get_by_role("heading", name="Language")).to_be_visible(timeout=LONG_MS)
