"""A therapist's main tasks, in a real browser. Their clicks and seconds are stored in ``artefacts/clicks.json``."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Locator, Page, expect

from kata.motion.builtin import built_in_motions
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import (
    begin_session,
    choose_level,
    confirm_identity,
    hold,
    import_motion,
    load_and_play,
    move_and_play,
    open_station,
    open_tab,
    prepare_station,
    sign_up,
    teach,
)
from tests.support.units import bare_numbers

# At a lower rate the resistance of a playback is measured less often, and a low level does not stop it at the same place.
pytestmark = pytest.mark.shared_clinic("full rate")

IDENTITY: Final = 2
"""The therapist compares and ticks two identifiers."""
APPROACH: Final = 6 + IDENTITY + 1
"""The identity has a button of its own, so that no other press confirms it."""
TEACH: Final = 5 + IDENTITY
WORST_MOTOR: Final = 4
NAME: Final = "Yamada Hanako"
HOLD_MS: Final = 1000

# Clicks on the simulated hand, pedal and switch do not count: at a real apparatus they are no clicks.
_COUNT: Final = """() => {
    window.clicks = 0;
    addEventListener('click', ({isTrusted, detail, target}) => {
        const simulated = target.closest?.('section')?.getAttribute('aria-label') === 'Simulated apparatus';
        if (isTrusted && detail > 0 && !simulated) window.clicks += 1;
    }, true);
}"""

Figures = dict[str, dict[str, float]]


@pytest.fixture
def counted(page: Page, artefacts: Path) -> Iterator[Figures]:
    page.evaluate(_COUNT)
    figures: Figures = {}
    yield figures
    (artefacts / "clicks.json").write_text(json.dumps({"figures": figures}, indent=2))


@contextmanager
def task(page: Page, figures: Figures, name: str) -> Iterator[None]:
    before, since = page.evaluate("window.clicks"), time.monotonic()
    yield
    seconds = round(time.monotonic() - since, 1)
    figures[name] = {"clicks": page.evaluate("window.clicks") - before, "seconds": seconds}


def choose(page: Page) -> None:
    """Go to the station, and choose the patient by the first letters of the name."""
    who = page.get_by_role("combobox", name="Patient")
    who.click()
    who.press_sequentially("yama")
    page.get_by_role("option", name=NAME).click()


def test_teach_stop_reset_play_again_and_read_the_errors(
    page: Page, clinic: Clinic, taught_name: str, counted: Figures
) -> None:
    """The daily tasks take few clicks."""
    hosts: set[str] = set()
    wrong: list[str] = []
    page.on("request", lambda request: hosts.add(urlsplit(request.url).netloc))
    page.on("pageerror", lambda error: wrong.append(str(error)))

    # A new user sees the next step.
    open_station(page)
    first = page.get_by_role("region", name="First steps")
    expect(first).to_contain_text("1 of 6")
    sign_up(page, NAME)
    page.get_by_role("link", name="Station", exact=True).click()
    expect(first).to_contain_text("2 of 6")
    page.get_by_role("link", name="Patients", exact=True).click()
    page.get_by_role("link", name=NAME).click()
    # Once a day, before the first patient.
    prepare_station(page)

    page.get_by_role("link", name="Patients", exact=True).click()
    page.get_by_role("link", name="Station", exact=True).click()
    with task(page, counted, "teach and save a motion"):
        choose(page)
        teach(page, taught_name)
    expect(first).to_contain_text("4 of 6")

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
    expect(first).to_contain_text("5 of 6")
    move_and_play(page)
    expect(page.get_by_test_id("mode")).to_have_text("Playing, torque on")
    page.get_by_role("button", name="Press the e-stop switch").click()
    banner = page.get_by_test_id("stop-banner")
    expect(banner).to_contain_text("The emergency stop was pressed.")
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "pressed")
    expect(page.get_by_test_id("torque")).to_have_text("Torque off")
    acknowledge = banner.get_by_role("button", name="Acknowledge")
    expect(acknowledge).to_be_disabled()
    # The banner replaces the work panels until it is acknowledged.
    expect(page.get_by_role("button", name="Load")).to_be_hidden()
    assert bare_numbers(page) == []
    # Every page shows the banner.
    page.get_by_role("link", name="Sessions").click()
    expect(banner).to_be_visible()
    page.get_by_role("link", name=NAME).click()
    page.get_by_role("link", name="Go to the station").click()

    page.get_by_role("button", name="Release the e-stop switch").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "released")
    acknowledge.click()
    expect(banner).to_be_hidden()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "closed")
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off")

    load_and_play(page)
    expect(page.get_by_test_id("mode")).to_have_text("Playing, torque on")
    expect(page.get_by_test_id("left")).to_contain_text("remaining")
    assert bare_numbers(page) == []
    expect(first).to_contain_text("6 of 6")
    first.get_by_role("button", name="Hide", exact=True).click()
    expect(first).to_be_hidden()
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)
    page.get_by_role("link", name="Compare teaching and playback").click()

    # The page shows the result and the cause of the stop first.
    expect(page.get_by_test_id("verdict")).to_contain_text("A playback was stopped")
    expect(page.get_by_test_id("verdict")).to_contain_text("The emergency stop was pressed.")
    expect(page.get_by_role("region", name="Playback 1")).to_contain_text("The emergency stop was pressed.")
    choice = page.get_by_role("radiogroup", name="Playback shown")
    expect(choice.get_by_role("radio")).to_have_count(2)
    choice.get_by_text("2. Raise the arm").click()
    run = page.get_by_role("region", name="Playback 2")
    expect(run).to_contain_text("Played to its end")
    open_tab(page, "Numbers")
    rows = run.get_by_test_id("errors").locator("tbody tr")
    expect(rows).to_have_count(5)
    for row in rows.all():
        cells = [text.replace("−", "-") for text in row.locator("td").all_inner_texts()]
        motor, peak, _, rmse, start, *_ = cells
        assert abs(float(start)) <= 1.0
        assert float(rmse) <= abs(float(peak))
        assert motor.endswith("5") or abs(float(peak)) <= 6.0
    open_tab(page, "Playbacks")
    expect(run.locator("[data-drawn=true]")).to_have_count(1, timeout=LONG_MS)
    run.get_by_text("All motors", exact=True).click()
    figures = run.locator("[data-drawn=true]")
    expect(figures).to_have_count(5, timeout=LONG_MS)
    for figure in figures.all():
        expect(figure.locator(".legendtext")).to_have_text(["Requested", "Playback", "Error"])
        expect(figure.locator(".ytitle")).to_have_text("Angle, °")
        expect(figure.locator(".y2title")).to_have_text("Error, °")
    # The played motion in 3-D: the time runs while it plays.
    open_tab(page, "Motion in 3D")
    page.get_by_role("button", name="Play it").click()
    expect(page.get_by_test_id("ghost-time")).not_to_contain_text(re.compile("^0.0 of"), timeout=LONG_MS)

    with task(page, counted, "a patient's last session, to its worst motor"):
        page.get_by_role("link", name="Sessions").click()
        page.get_by_role("row", name=NAME).get_by_role("link").first.click()
        open_tab(page, "Numbers")
        expect(page.get_by_test_id("errors").first.locator("tbody tr")).to_have_count(5)
    assert counted["teach and save a motion"]["clicks"] <= TEACH
    assert counted["a returning patient, until the arm is moved to the start"]["clicks"] <= APPROACH
    assert counted["a patient's last session, to its worst motor"]["clicks"] <= WORST_MOTOR
    assert hosts == {urlsplit(clinic.url).netloc}, "the page asked a foreign host"
    assert wrong == []


def hold_beside(page: Page, button: Locator) -> None:
    """Press the button and slide the pointer off before a hold is complete. Wait longer than a hold takes."""
    button.hover()
    page.mouse.down()
    page.mouse.move(0, 0)
    expect(button).to_have_attribute("data-holding", "no")
    page.wait_for_timeout(2 * HOLD_MS)
    page.mouse.up()


def hold_while_it_moves(page: Page, button: Locator) -> None:
    """Hold the button. Meanwhile it moves from under the resting pointer, as if a text above it had appeared."""
    mode = page.get_by_test_id("mode")
    before = mode.inner_text()
    button.hover()
    page.mouse.down()
    expect(button).to_have_attribute("data-holding", "held")
    page.locator("main").evaluate("main => { main.style.paddingTop = '400px'; }")
    expect(mode).not_to_have_text(before, timeout=LONG_MS)
    page.mouse.up()


@pytest.mark.campaign
def test_resistance_reverses_the_arm_and_the_second_time_holds_it(page: Page) -> None:
    sign_up(page, "Tanaka Sora")
    import_motion(page, built_in_motions()[4])
    prepare_station(page)
    begin_session(page)
    level = page.get_by_role("slider", name="Resistance level")
    expect(page.get_by_test_id("level")).to_have_text("Choose a level")
    expect(page.get_by_role("button", name="Load")).to_be_disabled()
    for control in (level, page.get_by_role("button", name="One level lower")):
        box = control.bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= 44
    level.press("Home")
    for _ in range(4):
        level.press("ArrowRight")
    page.get_by_role("button", name="One level higher").click()
    # Too low a level for this arm: its own weight is resistance. High enough for the friction at the start: 0.6 Nm.
    expect(page.get_by_test_id("level")).to_have_text("6 of 25")

    load_and_play(page)
    taken_back = page.get_by_test_id("taken-back")
    expect(taken_back).to_contain_text("Moved back once in this playback", timeout=LONG_MS)
    expect(taken_back).to_contain_text("Motor 4 met resistance at")
    play_on = page.get_by_role("button", name="Resume")
    expect(play_on).to_be_enabled()
    expect(taken_back).to_contain_text("Resume tries again from here")
    expect(page.get_by_test_id("mode")).to_have_text("Holding the arm, torque on")
    expect(page.get_by_test_id("torque")).to_have_text("Torque on")

    hold_beside(page, play_on)
    expect(page.get_by_test_id("mode")).to_have_text("Holding the arm, torque on")
    hold_while_it_moves(page, play_on)
    banner = page.get_by_test_id("stop-banner")
    expect(banner).to_contain_text("The motors still hold the arm", timeout=LONG_MS)
    expect(banner).to_contain_text("Motor 4 met resistance twice at the same place.")
    let_go = banner.get_by_role("button", name="Acknowledge and release the arm")
    expect(let_go).to_be_enabled()
    expect(page.get_by_test_id("mode")).to_have_text("Stopped, holding, torque on")
    expect(page.get_by_test_id("torque")).to_have_text("Torque on")
    hold(page, let_go)
    expect(banner).to_be_hidden()
    expect(page.get_by_test_id("torque")).to_have_text("Torque off")

    # The service remembers this patient's level, also for another computer.
    page.reload()
    expect(page.get_by_test_id("level")).to_have_text("6 of 25, as last time")
    page.get_by_role("link", name="Sessions").click()
    page.get_by_role("row", name=re.compile("Tanaka Sora")).get_by_role("link").first.click()
    expect(page.get_by_role("region", name="Playback 1")).to_contain_text("Resistance level 6 of 25")
