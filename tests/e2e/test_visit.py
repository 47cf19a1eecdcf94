"""A visit from sign-up to addendum, in a real browser, by keyboard alone."""

import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS
from tests.support.keyboard import held, press, reach, write
from tests.support.page_actions import confirm_identity, stand_for_left, try_estop

MOTION = "1 Abduction / adduction of the scapula"


def sign_up(page: Page, name: str) -> None:
    press(page, page.get_by_role("link", name="Patients", exact=True))
    press(page, page.get_by_role("button", name="New patient"))
    dialog = page.get_by_role("dialog")
    write(page, dialog.get_by_label("Name", exact=False).first, name)
    write(page, dialog.get_by_label("Clinic number"), "K-0042")
    press(page, dialog.get_by_role("radio", name="Left"), "Space")
    press(page, dialog.get_by_role("button", name="Register"))
    expect(page.get_by_role("heading", name=name)).to_be_visible()


def teach(page: Page) -> None:
    press(page, page.get_by_role("link", name="Go to the station"))
    stand_for_left(page, press)
    # The checklist: the therapist confirms checks, and the apparatus detects the test of its switch.
    before = page.get_by_role("region", name="Checks before teaching")
    switch = before.get_by_test_id("check-estop")
    expect(switch).to_contain_text("Not detected yet")
    expect(before.get_by_test_id("check-fixtures")).to_contain_text("arm fixer 1, and all fixtures are closed")
    expect(page.get_by_role("button", name="Start teaching")).to_be_disabled()
    try_estop(page, press)
    expect(switch).to_be_hidden(timeout=LONG_MS)
    confirm_identity(before, page, press_space)
    write(page, page.get_by_label("Name of the motion"), "Raise the arm")
    press(page, page.get_by_role("button", name="Confirm all 3 checks and start teaching"))
    expect(page.get_by_test_id("pedal")).to_contain_text("Press the pedal to record")
    motion = page.get_by_role("combobox", name="Motion that the hand follows")
    reach(page, motion)
    page.keyboard.press("ControlOrMeta+A")
    page.keyboard.type(MOTION)
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(motion).to_have_value(re.compile(re.escape(MOTION)))
    press(page, page.get_by_role("button", name="Guide the arm"))
    expect(page.get_by_test_id("pedal")).to_contain_text("Recording", timeout=LONG_MS)
    expect(page.get_by_test_id("pedal")).to_contain_text("Press the pedal to record", timeout=LONG_MS)
    press(page, page.get_by_role("button", name="Finish teaching"))
    expect(page.get_by_test_id("saved")).to_contain_text("Raise the arm")


def press_space(page: Page, target: Locator) -> None:
    """Press by the key that ticks a checkbox and presses a button."""
    press(page, target, "Space")


def at_least_44(target: Locator) -> None:
    box = target.bounding_box()
    assert box is not None
    assert min(box["width"], box["height"]) >= 44


# In every run, tests/api/test_visit.py goes through the same steps, and the page tests of the session wizard through its forms.
@pytest.mark.campaign
def test_session_goes_from_checklist_to_addendum_by_keyboard_alone(page: Page) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    sign_up(page, "Yamada Hanako")
    teach(page)
    press(page, page.get_by_role("radio", name="Teach a motion"), "ArrowRight")
    visit = page.get_by_role("region", name="Session")
    press(page, visit.get_by_role("button", name="Begin the session"))

    # The session has its own checklist. It shows what the apparatus has detected today.
    line = visit.get_by_test_id("check-estop")
    expect(line).to_contain_text("Detected by the apparatus", timeout=LONG_MS)
    expect(line.get_by_role("button")).to_have_count(0)
    for check in ("side", "fixtures", "belt"):
        at_least_44(visit.get_by_test_id(f"check-{check}").get_by_role("button"))
    expect(visit.get_by_test_id("check-fixtures")).to_contain_text("arm fixer 1, and all fixtures are closed")
    confirm_identity(visit, page, press_space)
    press(page, visit.get_by_test_id("check-side").get_by_role("button"))
    expect(visit.get_by_test_id("check-side")).to_contain_text("Test administrator")
    # Loading is refused before the checklist is complete.
    steps = visit.get_by_role("navigation", name="Steps of the session")
    press(page, steps.get_by_role("button", name="Play"))
    expect(visit.get_by_role("heading", name="Play")).to_be_focused()
    expect(visit.get_by_role("button", name="Load")).to_be_disabled()
    expect(visit.get_by_test_id("check-belt")).to_be_visible()
    expect(visit.get_by_test_id("check-side")).to_be_hidden()
    press(page, steps.get_by_role("button", name="Checklist"))
    press(page, visit.get_by_role("button", name="Confirm all 2 checks"))
    expect(visit.get_by_role("heading", name="Pain before")).to_be_focused()

    # A reload loses nothing: the service knows the step of the session.
    page.reload()
    expect(visit.get_by_role("heading", name="Pain before")).to_be_visible()
    # An answer opens the next step. The therapist can go back and change it.
    press(page, visit.get_by_role("button", name="Pain before: 7"))
    expect(visit.get_by_role("heading", name="Play")).to_be_focused()
    press(page, steps.get_by_role("button", name="Pain before"))
    expect(visit.get_by_role("button", name="Pain before: 7")).to_have_attribute("aria-pressed", "true")
    press(page, visit.get_by_role("button", name="Pain before: 4"))
    # The arrow keys choose the level on its slider.
    visit.get_by_role("slider", name="Resistance level").press("End")
    press(page, visit.get_by_role("button", name="Load"))
    # A key that is released at once moves no arm.
    move = visit.get_by_role("button", name="Move to the start")
    expect(move).to_be_enabled(timeout=LONG_MS)
    press(page, move)
    expect(page.get_by_test_id("mode")).to_have_text("Recording loaded, torque off")
    with held(page, move):
        expect(page.get_by_test_id("mode")).to_have_text("Moving to the start, torque on", timeout=LONG_MS)
    play = visit.get_by_role("button", name="Play", exact=True)
    expect(play).to_be_enabled(timeout=LONG_MS)
    press(page, visit.get_by_role("button", name="Reduce range", exact=True))
    with held(page, play):
        expect(page.get_by_test_id("mode")).to_have_text("Playing, torque on", timeout=LONG_MS)
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)
    expect(page.get_by_text("The playback is saved.")).to_be_visible(timeout=LONG_MS)
    press(page, visit.get_by_role("button", name="Finish playing: go to pain after"))
    press(page, visit.get_by_role("button", name="Worst pain during the session: 5"))
    expect(visit.get_by_role("button", name="during the session: 5")).to_have_attribute("aria-pressed", "true")
    press(page, visit.get_by_role("button", name="Pain after: 2"))

    # The note is drafted, edited, signed.
    note = visit.get_by_label("Note of this session")
    for part in (
        "Left shoulder, without a programme. Simulated apparatus: the measured values are not those of a patient.",
        "Raise the arm: 1 of 1 repetition.",
        "The range was reduced in Raise the arm",
        "Pain (0 to 10): 4 before, 5 during, 2 after.",
    ):
        expect(note).to_have_value(re.compile(re.escape(part)))
    reach(page, note)
    page.keyboard.press("ControlOrMeta+End")
    page.keyboard.type(" Did well.")
    expect(visit.get_by_text("Saved", exact=True)).to_be_visible(timeout=LONG_MS)
    page.reload()
    expect(note).to_have_value(re.compile(re.escape("2 after. Did well.")))
    press(page, visit.get_by_role("button", name="End the session"))
    press(page, visit.get_by_role("button", name="Sign as Test administrator"))
    press(page, page.get_by_role("link", name="View it"))

    # The session's page: result, answers and measurements, signed. A signed session accepts only addenda.
    expect(page.get_by_test_id("verdict")).to_have_text("Everything was played to its end")
    expect(page.get_by_test_id("result-pain")).to_contain_text("4 → 2")
    expect(page.get_by_test_id("signed")).to_contain_text("Signed by Test administrator")
    expect(page.get_by_test_id("note")).to_contain_text("Did well.")
    expect(page.get_by_test_id("pain")).to_have_text("Pain (0 to 10): 4 before, 5 during, 2 after")
    expect(page.get_by_role("region", name="Checklist")).to_contain_text(
        "Emergency stop tested: detected by the apparatus"
    )
    expect(page.get_by_test_id("end-reason")).to_have_text("Completed as planned")
    expect(page.get_by_label("Note of this session")).to_have_count(0)
    write(page, page.get_by_label("Addendum"), "Slept well.")
    press(page, page.get_by_role("button", name="Add as Test administrator"))
    expect(page.get_by_role("region", name="Note")).to_contain_text("Addendum by Test administrator")
    assert wrong == []
