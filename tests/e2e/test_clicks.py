"""Clicks and seconds of daily tasks, stored in ``artefacts/clicks.json`` and ``artefacts/lookups.json``."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_accounts import sign_in_new_account
from tests.support.page_actions import (
    HOLD_MS,
    choose_level,
    confirm_identity,
    open_tab,
    sign_up,
    stand_for_left,
    try_estop,
)

THERAPIST: Final = "Sato Mai"
"""A therapist with a patient of the invented clinic."""

IDENTITY: Final = 2
"""The therapist compares and ticks two identifiers."""
APPROACH: Final = 6 + IDENTITY + 1
"""The identity has a button of its own, so that no other press confirms it."""
TEACH: Final = 5 + IDENTITY
WORST_MOTOR: Final = 4
NAME: Final = "Yamada Yui"
MOTION: Final = "1 Abduction / adduction of the scapula"
"""The shortest: 3 s."""

# Clicks on the simulated hand, pedal and switch do not count: at a real apparatus they are no clicks.
_COUNT: Final = """() => {
    window.clicks = 0;
    addEventListener('click', ({isTrusted, detail, target}) => {
        const simulated = target.closest?.('section')?.getAttribute('aria-label') === 'Simulated apparatus';
        if (isTrusted && detail > 0 && !simulated) window.clicks += 1;
    }, true);
}"""


@pytest.fixture
def counted(page: Page, artefacts: Path) -> Iterator[dict[str, dict[str, float]]]:
    page.evaluate(_COUNT)
    figures: dict[str, dict[str, float]] = {}
    yield figures
    (artefacts / "clicks.json").write_text(json.dumps({"figures": figures}, indent=2))


@contextmanager
def task(page: Page, figures: dict[str, dict[str, float]], name: str) -> Iterator[None]:
    before, since = page.evaluate("window.clicks"), time.monotonic()
    yield
    seconds = round(time.monotonic() - since, 1)
    figures[name] = {"clicks": page.evaluate("window.clicks") - before, "seconds": seconds}


def choose(page: Page) -> None:
    """Choose the patient by the first letters of the name."""
    who = page.get_by_role("combobox", name="Patient")
    who.click()
    who.press_sequentially("yama")
    page.get_by_role("option", name=NAME).click()


@pytest.mark.shared_clinic("empty")
def test_daily_tasks_take_few_clicks(page: Page, counted: dict[str, dict[str, float]]) -> None:
    sign_up(page, NAME)
    page.get_by_role("link", name="Go to the station").click()
    stand_for_left(page)
    # Once a day, before the first patient.
    try_estop(page)

    page.get_by_role("link", name="Patients", exact=True).click()
    page.get_by_role("link", name="Station", exact=True).click()
    with task(page, counted, "teach and save a motion"):
        choose(page)
        name = page.get_by_label("Name of the motion")
        name.click()
        page.keyboard.type("Raise the arm")
        confirm_identity(page.get_by_role("region", name="Checks before teaching"), page)
        page.get_by_role("button", name="Start teaching").click()
        motion = page.get_by_role("combobox", name="Motion that the hand follows")
        motion.fill(MOTION)
        motion.press("ArrowDown")
        motion.press("Enter")
        page.get_by_role("button", name="Guide the arm").click()
        expect(page.get_by_test_id("pedal")).to_contain_text("Recording", timeout=LONG_MS)
        expect(page.get_by_test_id("pedal")).to_contain_text("Press the pedal to record", timeout=LONG_MS)
        page.get_by_role("button", name="Finish teaching").click()
        expect(page.get_by_test_id("saved")).to_contain_text("Raise the arm")

    page.get_by_role("link", name="Patients", exact=True).click()
    page.get_by_role("link", name="Station", exact=True).click()
    visit = page.get_by_role("region", name="Session")
    with task(page, counted, "a returning patient, until the arm is moved to the start"):
        choose(page)
        visit.get_by_role("button", name="Begin the session").click()
        confirm_identity(visit, page)
        visit.get_by_role("button", name="Confirm all 3 checks").click()
        visit.get_by_role("button", name="Pain before: 4").click()
        choose_level(page)
        visit.get_by_role("button", name="Load").click()
        expect(visit.get_by_role("button", name="Move to the start")).to_be_enabled(timeout=LONG_MS)
    visit.get_by_role("button", name="Move to the start").click(delay=HOLD_MS)
    visit.get_by_role("button", name="Play", exact=True).click(timeout=LONG_MS, delay=HOLD_MS)
    expect(page.get_by_text("The playback is saved.")).to_be_visible(timeout=LONG_MS)

    with task(page, counted, "a patient's last session, to its worst motor"):
        page.get_by_role("link", name="Sessions").click()
        page.get_by_role("row", name=NAME).get_by_role("link").first.click()
        open_tab(page, "Numbers")
        rows = page.get_by_role("region", name="Playback 1").get_by_test_id("errors").locator("tbody tr")
        expect(rows).to_have_count(5)

    assert counted["teach and save a motion"]["clicks"] <= TEACH
    assert counted["a returning patient, until the arm is moved to the start"]["clicks"] <= APPROACH
    assert counted["a patient's last session, to its worst motor"]["clicks"] <= WORST_MOTOR


# A look-up also counts clicks after a reload of the page.
_COUNT_ALWAYS: Final = """() => addEventListener('click', ({isTrusted, detail}) => {
    if (isTrusted && detail > 0) sessionStorage.clicks = Number(sessionStorage.clicks ?? 0) + 1;
}, true)"""


class Office:
    """The page of a clinic with history, opened at home by one role. It counts clicks and seconds from then on."""

    def __init__(self, page: Page, clinic: Clinic) -> None:
        self.page = page
        self._clinic = clinic
        self._since = time.monotonic()

    def ask(self, path: str, **parameters: Any) -> Any:
        """Return what the service answers."""
        return self.page.request.get(f"{self._clinic.url}/api{path}", params=parameters).json()

    @property
    def clicks(self) -> int:
        return int(self.page.evaluate("Number(sessionStorage.clicks ?? 0)"))

    def record(self, artefacts: Path, question: str, goal: int) -> None:
        """Store the figures of a question, and fail above the goal."""
        seconds = round(time.monotonic() - self._since, 1)
        file = artefacts / "lookups.json"
        figures = json.loads(file.read_text()) if file.exists() else {}
        figures[question] = {"clicks": self.clicks, "goal": goal, "seconds": seconds}
        file.write_text(json.dumps(figures, indent=2))
        assert self.clicks <= goal


@pytest.fixture(scope="module")
def therapists() -> dict[str, str]:
    """Return the cookie of the therapist's login session by address of the clinic, for all tests of the file."""
    return {}


@pytest.fixture
def office(
    clinic: Clinic, tab: Page, another: BrowserContext, therapists: dict[str, str], request: pytest.FixtureRequest
) -> Office:
    """Open the home page of an administrator if the test asks for one, else of a therapist with own patients."""
    context = tab.context
    if not hasattr(request, "param"):
        context = another
        if clinic.url not in therapists:
            tab.goto(clinic.url)
            sign_in_new_account(another, tab, THERAPIST, f"t-{uuid4().hex[:8]}", "therapist")
            therapists[clinic.url] = next(one["value"] for one in another.cookies() if one["name"] == COOKIE)
        another.add_cookies([{"name": COOKIE, "value": therapists[clinic.url], "url": clinic.url}])
    context.add_init_script(f"({_COUNT_ALWAYS})()")
    page = context.new_page()
    page.goto(clinic.url)
    expect(page.get_by_role("heading", name="Home", level=1)).to_be_visible(timeout=LONG_MS)
    return Office(page, clinic)


@pytest.mark.shared_clinic("invented")
def test_no_click_tells_who_is_due_today(office: Office, artefacts: Path) -> None:
    due = office.page.get_by_role("region", name=re.compile("^Due today: "))
    first = due.get_by_test_id("due").first
    expect(first).to_be_in_viewport(timeout=LONG_MS)
    office.record(artefacts, "who is due today", 0)
    work = office.ask("/worklist")
    assert work["due_count"] > 0, "the seeded clinic has no patient who is due"
    expect(first).to_contain_text(work["due"][0]["patient"]["name"])
    expect(due).to_have_accessible_name(re.compile(rf"^Due today: {work['due_count']} patient"))


@pytest.mark.shared_clinic("invented")
@pytest.mark.parametrize("office", ["administrator"], indirect=True)
def test_one_click_tells_what_share_improved_this_year(office: Office, artefacts: Path) -> None:
    tile = office.page.get_by_role("link", name=re.compile(r"^Important improvement this year \(SPADI\)"))
    expect(tile).to_be_in_viewport(timeout=LONG_MS)
    expect(tile).to_contain_text(re.compile(r"\d+ %"), timeout=LONG_MS)
    tile.click()
    verdict = office.page.get_by_text(re.compile(r"^\d+ % had an important improvement")).first
    expect(verdict).to_be_in_viewport(timeout=LONG_MS)
    office.record(artefacts, "what share of patients improved this year", 1)
    first_day = verdict.page.get_by_role("textbox", name="From").input_value()
    assert first_day.startswith("1 Jan ")
    changes = office.ask("/statistics/outcomes", since=f"{first_day[-4:]}-01-01T00:00:00Z")["groups"][0]["changes"]
    share = next(change["important"]["value"] for change in changes if change["measure"] == "spadi")
    expect(verdict).to_contain_text(f"{100 * share:.0f} %")


@pytest.mark.shared_clinic("invented")
@pytest.mark.parametrize("office", ["administrator"], indirect=True)
def test_two_clicks_tell_which_station_drifts(office: Office, artefacts: Path) -> None:
    tile = office.page.get_by_role("link", name=re.compile("^Tracking error"))
    expect(tile).to_be_in_viewport(timeout=LONG_MS)
    tile.click()
    rising = office.page.get_by_test_id("drift").get_by_role("row", name=re.compile("Rising"))
    expect(rising.first).to_be_in_viewport(timeout=LONG_MS)
    office.record(artefacts, "which station is drifting", 2)
    drifting = [row["station"] for row in office.ask("/statistics/tracking")["drift"] if row["drifting"]]
    assert drifting, "the seeded clinic has no drifting station"
    expect(rising).to_have_count(len(drifting))
    expect(rising.first).to_contain_text(drifting[0])


@pytest.mark.shared_clinic("invented")
def test_two_clicks_tell_whether_a_patient_is_better(office: Office, artefacts: Path) -> None:
    page = office.page
    page.get_by_role("link", name="Patients", exact=True).click()
    # The home page names a patient who is due more than once.
    expect(page.get_by_role("heading", name="Patients", level=1)).to_be_visible(timeout=LONG_MS)
    page.get_by_role("link", name="Yamada Hanako", exact=True).click()
    change = page.get_by_test_id("since-last-month")
    expect(change).to_contain_text("compared with", timeout=LONG_MS)
    flexion = change.get_by_role("region", name="Better than a month ago?")
    expect(flexion).to_contain_text("Flexion, active")
    expect(flexion).to_be_in_viewport()
    office.record(artefacts, "is my patient better than last month", 2)


@pytest.mark.shared_clinic("invented")
def test_two_clicks_tell_why_a_session_was_stopped(office: Office, artefacts: Path) -> None:
    page = office.page
    page.get_by_role("link", name="Sessions", exact=True).click()
    stopped = next(item for item in office.ask("/sessions", limit=50)["items"] if item["stops"])
    page.locator(f'a[href="/sessions/{stopped["id"]}"]').click()
    verdict = page.get_by_test_id("verdict")
    expect(verdict).to_have_attribute("data-verdict", "stopped", timeout=LONG_MS)
    expect(verdict).to_be_in_viewport()
    office.record(artefacts, "why was this session stopped", 2)
    causes = [run["stop"]["message"] for run in office.ask(f"/sessions/{stopped['id']}")["runs"] if run["stop"]]
    expect(verdict).to_contain_text(causes[0])


@pytest.mark.shared_clinic("invented")
def test_a_patient_is_found_by_kana_with_the_keyboard_alone(office: Office, artefacts: Path) -> None:
    page = office.page
    page.keyboard.press("ControlOrMeta+K")
    expect(page.get_by_role("dialog", name="Search everywhere")).to_be_visible()
    page.keyboard.type("やまだ はなこ")
    chosen = page.get_by_role("option", name="Yamada Hanako").first
    expect(chosen).to_have_attribute("data-combobox-selected", "true", timeout=LONG_MS)
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Yamada Hanako", level=1)).to_be_visible(timeout=LONG_MS)
    office.record(artefacts, "find a patient by kana", 0)
