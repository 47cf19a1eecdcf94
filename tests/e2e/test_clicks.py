"""Clicks and seconds of look-ups, stored in ``artefacts/lookups.json``. test_main_job.py counts those of a session."""

import json
import re
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pytest
from playwright.sync_api import Page, expect

from kata.database.base import utc_now
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_accounts import sign_in_new_account

THERAPIST: Final = "Sato Mai"
"""A therapist with a patient of the invented clinic."""

# A look-up also counts clicks after a reload of the page.
_COUNT_ALWAYS: Final = """() => {
    if (window.countsClicks) return;
    window.countsClicks = true;
    addEventListener('click', ({isTrusted, detail}) => {
        if (isTrusted && detail > 0) sessionStorage.clicks = Number(sessionStorage.clicks ?? 0) + 1;
    }, true);
}"""


class Office:
    """The page of a clinic with history, opened at home by one role. It counts clicks and seconds from then on."""

    def __init__(self, page: Page, clinic: Clinic) -> None:
        self.page = page
        self._clinic = clinic
        self._since = time.monotonic()

    def ask(self, path: str, **parameters: Any) -> Any:
        """Return what the service answers."""
        return self.page.request.get(f"{self._clinic.url}/api{path}", params=parameters).json()

    def go_home(self) -> None:
        """Return to the home page, and count from zero."""
        self.page.get_by_role("link", name="Home", exact=True).click()
        expect(self.page.get_by_role("heading", name="Home", level=1)).to_be_visible(timeout=LONG_MS)
        self.page.evaluate("() => { sessionStorage.clicks = 0; }")
        self._since = time.monotonic()

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


@pytest.fixture
def office(clinic: Clinic, tab: Page, request: pytest.FixtureRequest) -> Office:
    """Open the home page of an administrator if the test asks for one, else of a therapist with own patients."""
    if not hasattr(request, "param"):
        tab.goto(f"{clinic.url}/kata.svg")
        sign_in_new_account(tab.context, tab, THERAPIST, f"t-{uuid4().hex[:8]}", "therapist")
    tab.add_init_script(f"({_COUNT_ALWAYS})()")
    tab.goto(clinic.url)
    return Office(tab, clinic)


def due_today(office: Office, artefacts: Path) -> None:
    due = office.page.get_by_role("region", name=re.compile("^Due today: "))
    first = due.get_by_test_id("due").first
    expect(first).to_be_in_viewport(timeout=LONG_MS)
    office.record(artefacts, "who is due today", 0)
    work = office.ask("/worklist")
    assert work["due_count"] > 0, "the seeded clinic has no patient who is due"
    expect(first).to_contain_text(work["due"][0]["patient"]["name"])
    expect(due).to_have_accessible_name(re.compile(rf"^Due today: {work['due_count']} patient"))


def better_than_last_month(office: Office, artefacts: Path) -> None:
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


def why_stopped(office: Office, artefacts: Path) -> None:
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


def find_by_kana(office: Office, artefacts: Path) -> None:
    page = office.page
    page.keyboard.press("ControlOrMeta+K")
    expect(page.get_by_role("dialog", name="Search everywhere")).to_be_visible()
    page.keyboard.type("やまだ はなこ")
    chosen = page.get_by_role("option", name="Yamada Hanako").first
    expect(chosen).to_have_attribute("data-combobox-selected", "true", timeout=LONG_MS)
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Yamada Hanako", level=1)).to_be_visible(timeout=LONG_MS)
    office.record(artefacts, "find a patient by kana", 0)


def improved_in_twelve_months(office: Office, artefacts: Path) -> None:
    tile = office.page.get_by_role(
        "link", name=re.compile(r"^Shoulders improved by at least the MCID in 12 months \(SPADI\)")
    )
    expect(tile).to_be_in_viewport(timeout=LONG_MS)
    expect(tile).to_contain_text(re.compile(r"\d+\s%"), timeout=LONG_MS)
    tile.click()
    verdict = office.page.get_by_text(re.compile(r"^\d+\s% of the shoulders improved by at least the MCID")).first
    expect(verdict).to_be_in_viewport(timeout=LONG_MS)
    office.record(artefacts, "what share of patients improved in twelve months", 1)
    today = utc_now()
    first_day = datetime(today.year - 1, today.month, 1, tzinfo=UTC) + timedelta(days=today.day - 1)
    shown_day = verdict.page.get_by_role("textbox", name="From").input_value()
    assert shown_day.split()[::2] == [f"{first_day.day}", f"{first_day.year}"]
    changes = office.ask("/statistics/outcomes", since=first_day.isoformat())["groups"][0]["changes"]
    share = next(change["important"]["value"] for change in changes if change["measure"] == "spadi")
    expect(verdict).to_contain_text(f"{100 * share:.0f} %")


def drifting_station(office: Office, artefacts: Path) -> None:
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


@pytest.mark.campaign
@pytest.mark.shared_clinic("invented")
def test_therapist_finds_answers_with_few_clicks(office: Office, artefacts: Path) -> None:
    for question in (due_today, find_by_kana, better_than_last_month, why_stopped):
        office.go_home()
        question(office, artefacts)


@pytest.mark.campaign
@pytest.mark.shared_clinic("invented")
@pytest.mark.parametrize("office", ["administrator"], indirect=True)
def test_administrator_finds_answers_with_few_clicks(office: Office, artefacts: Path) -> None:
    for question in (improved_in_twelve_months, drifting_station):
        office.go_home()
        question(office, artefacts)
