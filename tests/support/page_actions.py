"""Actions of a therapist on the page."""

import re
from collections.abc import Callable

from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS, START_LIMIT_S

HOLD_MS = 1500
"""Hold the button for a second, which asks the apparatus to move the arm."""


Press = Callable[[Page, Locator], None]


def click(page: Page, target: Locator) -> None:
    target.click()


def sign_up(page: Page, name: str, number: str = "K-0042") -> None:
    page.get_by_role("link", name="Patients").click()
    page.get_by_role("button", name="New patient").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Name", exact=False).first.fill(name)
    dialog.get_by_label("Clinic number").fill(number)
    dialog.get_by_text("Left", exact=True).click()
    dialog.get_by_role("button", name="Register").click()
    expect(page.get_by_role("heading", name=name)).to_be_visible()


def stand_for_left(page: Page, press: Press = click) -> None:
    """Turn the apparatus, which starts at the right side, for the patient's left side."""
    expect(page.get_by_text("The apparatus is set up for the right shoulder", exact=True)).to_be_visible()
    press(page, page.get_by_role("button", name="Set up for the left shoulder …"))
    press(page, page.get_by_role("button", name="Confirm: set up for the left shoulder"))
    expect(page.get_by_role("dialog")).to_be_hidden(timeout=LONG_MS)
    expect(page.get_by_text("The apparatus is set up for the left shoulder", exact=True)).to_be_visible()
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)


def teach(page: Page, motion: str) -> None:
    page.get_by_role("link", name="Go to the station").click()
    stand_for_left(page)
    before = page.get_by_role("region", name="Checks before teaching")
    start = page.get_by_role("button", name="Confirm all 3 checks and start teaching")
    expect(before.get_by_test_id("check-estop")).to_contain_text("Not detected yet")
    expect(start).to_be_disabled()
    try_estop(page)
    expect(before.get_by_test_id("check-estop")).to_be_hidden(timeout=LONG_MS)
    page.get_by_label("Name of the motion").fill("Raise the arm")
    start.click()
    expect(page.get_by_test_id("pedal")).to_contain_text("Press the pedal to record")
    expect(page.get_by_test_id("torque")).to_have_text("Torque off")
    hand = page.get_by_role("combobox", name="Motion that the hand follows")
    hand.fill(motion)
    expect(page.get_by_role("option", name=motion).first).to_be_visible()
    # By keys: the panels behind the list change while teaching begins.
    hand.press("ArrowDown")
    hand.press("Enter")
    expect(hand).to_have_value(re.compile(re.escape(motion)))
    page.get_by_role("button", name="Guide the arm").click()
    expect(page.get_by_test_id("pedal")).to_contain_text("Recording", timeout=LONG_MS)
    expect(page.get_by_test_id("pedal")).to_contain_text("Press the pedal to record", timeout=LONG_MS)
    page.get_by_role("button", name="Finish teaching").click()
    expect(page.get_by_test_id("saved")).to_contain_text("Raise the arm")


def try_estop(page: Page, press: Press = click) -> None:
    """Press and release the emergency stop, and acknowledge."""
    press(page, page.get_by_role("button", name="Press the e-stop switch"))
    banner = page.get_by_test_id("stop-banner")
    expect(banner).to_be_visible()
    press(page, page.get_by_role("button", name="Release the e-stop switch"))
    acknowledge(page, press)


def acknowledge(page: Page, press: Press = click) -> None:
    """Acknowledge the stop, and again when the device refuses.

    On a busy computer the device misses answers and reads every register of a drive again. Until then it refuses.
    """
    banner = page.get_by_test_id("stop-banner")
    for _ in range(3):
        press(page, banner.get_by_role("button", name="Acknowledge"))
        try:
            expect(banner).to_be_hidden()
        except AssertionError:
            continue
        return
    expect(banner).to_be_hidden()


def wait_until_idle(page: Page) -> None:
    """Wait until the apparatus is idle. Acknowledge a stop: on a busy computer the device misses answers while the service starts."""
    mode = page.get_by_test_id("mode")
    expect(mode).to_have_text(re.compile("^(Idle, torque off|Stopped)$"), timeout=START_LIMIT_S * 1000)
    if mode.inner_text() == "Stopped":
        acknowledge(page)
    expect(mode).to_have_text("Idle, torque off")


def begin_session(page: Page) -> None:
    """Do the steps from the beginning to the pain score before playback."""
    visit = page.get_by_role("region", name="Session")
    visit.get_by_role("button", name="Begin the session").click()
    # The emergency stop was tested before teaching.
    expect(visit.get_by_test_id("check-estop")).to_contain_text("Detected by the apparatus", timeout=LONG_MS)
    for check in ("side", "fixtures"):
        line = visit.get_by_test_id(f"check-{check}")
        line.get_by_role("button").click()
        expect(line).to_contain_text("Test administrator")
    # The last answer of a step opens the next step.
    visit.get_by_test_id("check-belt").get_by_role("button").click()
    visit.get_by_role("button", name="Pain before: 4").click()


def choose_level(page: Page, key: str = "End") -> None:
    """Choose the resistance level with the slider's keys if none is proposed."""
    if page.get_by_test_id("level").inner_text() == "Choose a level":
        page.get_by_role("slider").first.press(key)


def load_and_play(page: Page) -> None:
    choose_level(page)
    page.get_by_role("button", name="Load").click()
    page.get_by_role("button", name="Move to the start").click(timeout=LONG_MS, delay=HOLD_MS)
    play = page.get_by_role("button", name="Play", exact=True)
    expect(play).to_be_enabled(timeout=LONG_MS)
    expect(page.get_by_test_id("torque")).to_have_text("Torque on")
    play.click(delay=HOLD_MS)
    expect(page.get_by_test_id("mode")).to_have_text("Playing")
