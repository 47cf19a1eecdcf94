"""How many clicks, and how many seconds, what is done every day takes; kept in ``artefacts/clicks.json``."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS
from tests.support.page_actions import HOLD_MS, choose_level, sign_up, stand_for_left, try_estop

APPROACH: Final = 6
TEACH: Final = 5
WORST_MOTOR: Final = 4
NAME: Final = "Yamada Hanako"
MOTION: Final = "5 Flexion / extension of the shoulder"

# What stands in for hand, pedal and switch is no click of the therapist's: their hand and foot are at the apparatus.
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
    """Whoever it is, by the first letters of the name."""
    who = page.get_by_role("combobox", name="Patient")
    who.click()
    who.press_sequentially("yama")
    page.get_by_role("option", name=NAME).click()


def test_daily_tasks_take_few_clicks(page: Page, counted: dict[str, dict[str, float]]) -> None:
    sign_up(page, NAME)
    page.get_by_role("link", name="Go to the station").click()
    stand_for_left(page)
    # The day's first act at the apparatus, whoever comes.
    try_estop(page)

    page.get_by_role("link", name="Patients").click()
    page.get_by_role("link", name="Station", exact=True).click()
    with task(page, counted, "teach and save a motion"):
        choose(page)
        name = page.get_by_label("Name of the motion")
        name.click()
        page.keyboard.type("Raise the arm")
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

    page.get_by_role("link", name="Patients").click()
    page.get_by_role("link", name="Station", exact=True).click()
    visit = page.get_by_role("region", name="Session")
    with task(page, counted, "a returning patient, until the arm is moved to the start"):
        choose(page)
        visit.get_by_role("button", name="Begin the session").click()
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
        rows = page.get_by_role("region", name="Playback 1").get_by_test_id("errors").locator("tbody tr")
        expect(rows).to_have_count(5)

    assert counted["teach and save a motion"]["clicks"] <= TEACH
    assert counted["a returning patient, until the arm is moved to the start"]["clicks"] <= APPROACH
    assert counted["a patient's last session, to its worst motor"]["clicks"] <= WORST_MOTOR
