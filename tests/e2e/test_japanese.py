"""In a browser that prefers Japanese, every page is Japanese, also for screen readers, and can be switched to English."""

import re
from collections.abc import Iterator
from typing import Any, Final
from uuid import uuid4

import pytest
from playwright.sync_api import BrowserContext, Error, Page, Response, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import PATIENT_PAGE_NAME, addresses, misfits_on_telephone, opened, wrong
from tests.support.browser_clinic import LONG_MS, START_LIMIT_S, Clinic
from tests.support.page_accounts import sign_in_new_account
from tests.support.page_actions import acknowledge, first_page
from tests.support.page_dialogs import DIALOGS, opened_dialogs
from tests.support.units import bare_numbers

IDLE: Final = "待機中・トルク切"
STOPPED: Final = "停止・"
OURS: Final = frozenset(
    {
        "Kata",
        "English",
        "Esc",
        "Ctrl",
        "CSV",
        "Parquet",
        "MCAP",
        "LeRobot",
        "UTC",
        "ZIP",
        "PDF",
        "FHIR",
        "Bundle",
        "Patient",
        "ICD",
        "JSON",
        "UTF",
        "SPADI",
        "MCID",
        "SDC",
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
    expect(mode).to_have_text(re.compile(f"^({IDLE}|{STOPPED}.+)$"), timeout=START_LIMIT_S * 1000)
    if mode.inner_text().startswith(STOPPED):
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
    longest_first = sorted(records, key=len, reverse=True)
    cited = r"[A-Z][a-z]+他|MoraisとPascoal|J\. (?:[A-Z][a-z]+\.? )+\d{4}"
    for text in page.evaluate(SEEN):
        # Without paths, commands, the JSON of audit entries, and authors and journals.
        plain = text.replace("\u00a0", " ").replace("\u2060", "")
        left = re.sub(rf'/[\w./-]+|kata( [a-z]+)+( --[a-z]+)*|\w+: \{{".*\}}|{cited}', "", plain)
        if not words_in(left):
            continue
        for record in longest_first:
            left = left.replace(record, "")
        if any("_" not in word for word in words_in(left)):
            found.append(text)
    return found


def _station_names(page: Page, clinic: Clinic) -> set[str]:
    """Return the names of stations, which a page receives over its WebSockets."""
    return {
        name
        for path in ("station", "stations")
        for name in written(page.request.get(f"{clinic.url}/api/{path}").json())
        if len(name) > 2
    }


def words_in(text: str) -> set[str]:
    """Return the words of at least three Latin letters that are not the same in Japanese."""
    return set(re.findall(r"[A-Za-z_]{3,}", text)) - OURS


@pytest.mark.shared_clinic("invented")
@pytest.mark.timeout(900)
@pytest.mark.parametrize("every", [2, pytest.param(1, marks=pytest.mark.campaign)])
def test_every_page_speaks_japanese(tab: Page, clinic: Clinic, every: int) -> None:
    """Check the words of every page, that it fits a telephone, that each number has a unit, and that a patient's page names the shoulder.

    axe checks every second page, from the second one, or every page in the campaign.
    """
    answers: list[Response] = []
    tab.on("response", lambda answer: answers.append(answer))
    tab.emulate_media(color_scheme="dark", reduced_motion="reduce")
    records = _station_names(tab, clinic)
    english: dict[str, list[str]] = {}
    barred: dict[str, list[str]] = {}
    bare_of: dict[str, list[str]] = {}
    for number, name in enumerate(opened(tab, clinic, addresses(tab, clinic), by_links=every > 1)):
        checked = number % every == every - 1
        wait_until_idle(tab)
        if name in ("station", "station-patient"):
            expect(tab.get_by_role("region", name="模擬装置")).to_be_visible(timeout=LONG_MS)
        expect(tab.locator("html")).to_have_attribute("lang", "ja")
        expect(tab.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
        # A page also shows what an earlier one has fetched.
        records |= {
            record
            for response in answers
            if response.ok and "json" in response.headers.get("content-type", "")
            for record in written(answer_of(response))
            if len(record) > 2
        }
        answers.clear()
        if found := english_on(tab, records):
            english[name] = found
        if violations := (wrong(tab) if checked else []) + misfits_on_telephone(tab):
            barred[name] = violations
        if bare := bare_numbers(tab, "ja"):
            bare_of[name] = bare
        if PATIENT_PAGE_NAME.match(name):
            expect(tab.get_by_test_id("patient-banner")).to_contain_text(re.compile("[左右]肩"))
    problems = "\n".join(
        f"{name}: {sorted(set(texts))}" for found in (english, barred, bare_of) for name, texts in found.items()
    )
    assert not problems, problems


@pytest.mark.campaign
@pytest.mark.shared_clinic("invented")
@pytest.mark.timeout(600)
def test_every_dialog_has_units_and_japanese_words(tab: Page, clinic: Clinic) -> None:
    """Check the numbers, the words and the accessibility of the dialogs."""
    answers: list[Response] = []
    tab.on("response", lambda answer: answers.append(answer))
    tab.emulate_media(color_scheme="dark", reduced_motion="reduce")
    records = _station_names(tab, clinic)
    found: dict[str, list[str]] = {}
    pages = {name: address for name, address in addresses(tab, clinic).items() if name in DIALOGS}
    for name in opened(tab, clinic, pages, by_links=True):
        wait_until_idle(tab)
        for button, _ in opened_dialogs(tab, name, "ja"):
            records |= {
                record
                for response in answers
                if response.ok and "json" in response.headers.get("content-type", "")
                for record in written(answer_of(response))
                if len(record) > 2
            }
            answers.clear()
            if problems := [*bare_numbers(tab, "ja"), *english_on(tab, records), *wrong(tab, "[role=dialog]")]:
                found[f"{name}: {button}"] = problems
    assert not found, "\n".join(f"{name}: {sorted(set(texts))}" for name, texts in found.items())


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


@pytest.mark.campaign
@pytest.mark.shared_clinic("invented")
def test_page_uses_the_chosen_language_at_every_login(tab: Page, clinic: Clinic, another: BrowserContext) -> None:
    tab.goto(f"{clinic.url}/kata.svg")
    # An account of its own, because others use the administrator's.
    sign_in_new_account(tab.context, tab, "Ito Mai", f"ito-{uuid4().hex[:8]}", "therapist")
    tab.goto(f"{clinic.url}/account")
    expect(tab.get_by_role("heading", name="表示言語")).to_be_visible(timeout=LONG_MS)
    tab.get_by_text("English", exact=True).click()
    expect(tab.get_by_role("heading", name="Language")).to_be_visible(timeout=LONG_MS)
    expect(tab.locator("html")).to_have_attribute("lang", "en")
    expect(tab.get_by_test_id("mode")).to_have_text("Idle, torque off")
    # Another browser that prefers Japanese shows English as soon as it knows the user.
    another.add_cookies([{"name": COOKIE, "value": cookie_of(tab), "url": clinic.url}])
    elsewhere = first_page(another)
    elsewhere.goto(clinic.url)
    expect(elsewhere.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)
    # Before login the browser's own choice counts.
    another.clear_cookies(name=COOKIE)
    elsewhere.goto(clinic.url)
    expect(elsewhere.get_by_role("heading", name="Sign in")).to_be_visible(timeout=LONG_MS)
    elsewhere.get_by_text("日本語", exact=True).click()
    expect(elsewhere.get_by_role("heading", name="サインイン")).to_be_visible(timeout=LONG_MS)
    tab.reload()
    expect(tab.get_by_role("heading", name="Language")).to_be_visible(timeout=LONG_MS)


def cookie_of(page: Page) -> str:
    """Return the cookie of the page's login session."""
    return next(cookie["value"] for cookie in page.context.cookies() if cookie["name"] == COOKIE)
