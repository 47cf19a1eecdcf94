"""Actions of a therapist on the page."""

import re
import time
from collections.abc import Callable
from contextlib import suppress
from uuid import uuid4

import numpy as np
from playwright.sync_api import BrowserContext, Locator, Page, expect

from kata.motion.taught import POSE_LAYOUT, Taught
from tests.support.browser_clinic import LONG_MS, START_LIMIT_S

MOTION = "Raise the arm"
"""Name of the recording that a journey teaches or imports."""

Press = Callable[[Page, Locator], None]
_HOLD_AGAIN_MS = 5000
"""A hold takes one second. On a busy computer its effect takes longer to appear."""


def first_page(context: BrowserContext) -> Page:
    """Return the browser's first page. It keeps the scripts that it has compiled; a new page would compile them again."""
    return context.pages[0] if context.pages else context.new_page()


def click(page: Page, target: Locator) -> None:
    target.click()


def open_tab(page: Page, name: str) -> None:
    """Open a tab of a patient's or a session's page."""
    tab = page.get_by_role("tab", name=name, exact=True)
    tab.click()
    expect(tab).to_have_attribute("aria-selected", "true")


def open_station(page: Page) -> None:
    """Open the station's page, which draws the apparatus in three dimensions all the time."""
    page.get_by_role("link", name="Station", exact=True).click()
    expect(page.get_by_role("region", name="Simulated apparatus")).to_be_visible(timeout=LONG_MS)


def choose_work(page: Page, work: str) -> None:
    """Choose what to do at the station: "Teach a motion" or "Session"."""
    page.get_by_role("radiogroup", name="What to do").get_by_text(work, exact=True).click()


def sign_up(page: Page, name: str) -> None:
    """Register a patient with a left shoulder and a new clinic number."""
    page.get_by_role("link", name="Patients", exact=True).click()
    page.get_by_role("button", name="New patient").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Name", exact=False).first.fill(name)
    dialog.get_by_label("Clinic number").fill(f"K-{uuid4().hex[:8]}")
    dialog.get_by_text("Left", exact=True).click()
    dialog.get_by_role("button", name="Register").click()
    expect(page.get_by_role("heading", name=name)).to_be_visible()


def stand_for_left(page: Page, press: Press = click) -> None:
    """Set up the apparatus for the patient's left side. A new one is set up for the right side."""
    side = page.get_by_text(re.compile("^The apparatus is set up for the (left|right) shoulder$"))
    expect(side).to_be_visible()
    if "right" in side.inner_text():
        press(page, page.get_by_role("button", name="Set up for the left shoulder …"))
        press(page, page.get_by_role("button", name="Confirm: set up for the left shoulder"))
        expect(page.get_by_role("dialog")).to_be_hidden(timeout=LONG_MS)
    expect(page.get_by_text("The apparatus is set up for the left shoulder", exact=True)).to_be_visible()
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)


def confirm_identity(part: Locator, page: Page, press: Press = click) -> None:
    """Tick name and clinic number in a checklist, as stated by the patient, and confirm where the check has its own button."""
    identity = part.get_by_test_id("check-identity")
    for identifier in ("Stated name", "Clinic number"):
        box = identity.get_by_role("checkbox", name=identifier)
        press(page, box)
        expect(box).to_be_checked()
    own = identity.get_by_role("button", name="Confirm the identity")
    if own.count():
        press(page, own)
        expect(own).to_be_hidden()


def import_motion(page: Page, motion: Taught) -> str:
    """Import a motion for the patient of the open record, in place of teaching it. Return the recording's id."""
    table = np.column_stack([motion.times_s, motion.poses_deg])
    lines = [",".join(POSE_LAYOUT), *(",".join(f"{value:.4f}" for value in row) for row in table)]
    service, _, record = page.url.partition("/patients/")
    imported = page.request.post(
        f"{service}/api/patients/{record.partition('?')[0]}/recordings/import",
        params={"side": "left", "name": MOTION},
        data="\n".join(lines),
        headers={"content-type": "text/csv", "origin": service},
    )
    assert imported.status == 201, imported.text()
    recording: str = imported.json()["recording"]["id"]
    return recording


def prepare_station(page: Page) -> None:
    """Go to the station with the patient of the open record, set it up for the left side, and test the emergency stop."""
    page.get_by_role("link", name="Go to the station").click()
    stand_for_left(page)
    try_estop(page)


def teach(page: Page, motion: str) -> None:
    """Teach a motion to the patient at the station, after the emergency stop was tested."""
    before = page.get_by_role("region", name="Checks before teaching")
    start = page.get_by_role("button", name="Confirm all 3 checks and start teaching")
    expect(before.get_by_test_id("check-fixtures")).to_be_visible()
    expect(start).to_be_disabled()
    # Once a day is enough.
    expect(before.get_by_test_id("check-estop")).to_be_hidden(timeout=LONG_MS)
    confirm_identity(before, page)
    name = page.get_by_label("Name of the motion")
    name.click()
    page.keyboard.type(MOTION)
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
    expect(page.get_by_test_id("saved")).to_contain_text(MOTION)


def try_estop(page: Page, press: Press = click) -> None:
    """Press and release the emergency stop, and acknowledge."""
    press(page, page.get_by_role("button", name="Press the e-stop switch"))
    banner = page.get_by_test_id("stop-banner")
    expect(banner).to_be_visible()
    press(page, page.get_by_role("button", name="Release the e-stop switch"))
    acknowledge(page, press)


def acknowledge(page: Page, press: Press = click, name: str = "Acknowledge") -> None:
    """Acknowledge the stop, and again when the device refuses. ``name``: the button's.

    On a busy computer the device misses answers and reads every register of a drive again. Until then it refuses.
    """
    banner = page.get_by_test_id("stop-banner")
    for _ in range(3):
        press(page, banner.get_by_role("button", name=name))
        try:
            expect(banner).to_be_hidden()
        except AssertionError:
            continue
        return
    expect(banner).to_be_hidden()


def wait_until_idle(page: Page) -> None:
    """Wait until the apparatus is idle. Acknowledge a stop: on a busy computer the device misses answers while the service starts."""
    mode = page.get_by_test_id("mode")
    expect(mode).to_have_text(re.compile("^(Idle, torque off|Stopped, .+)$"), timeout=START_LIMIT_S * 1000)
    if mode.inner_text().startswith("Stopped"):
        acknowledge(page)
    expect(mode).to_have_text("Idle, torque off")


def begin_session(page: Page) -> None:
    """Do the steps from the beginning to the pain score before playback."""
    choose_work(page, "Session")
    visit = page.get_by_role("region", name="Session")
    visit.get_by_role("button", name="Begin the session").click()
    # The emergency stop was tested before teaching.
    expect(visit.get_by_test_id("check-estop")).to_contain_text("Detected by the apparatus", timeout=LONG_MS)
    confirm_identity(visit, page)
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


def hold(page: Page, button: Locator) -> None:
    """Hold the button until the apparatus has another mode. Like a user, press again if the hold had no effect.

    A hold ends without effect if the command is impossible for a moment, or if the page hung, as on a busy computer.
    """
    # Before it is enabled, the apparatus may still be loading.
    expect(button).to_be_enabled(timeout=LONG_MS)
    mode = page.get_by_test_id("mode")
    before = mode.inner_text()
    limit = time.monotonic() + LONG_MS / 1000
    while mode.inner_text() == before:
        assert time.monotonic() < limit, f"the apparatus stays in {before}"
        button.hover()
        page.mouse.down()
        with suppress(AssertionError):
            expect(mode).not_to_have_text(before, timeout=_HOLD_AGAIN_MS)
        page.mouse.up()


def load_and_play(page: Page) -> None:
    choose_level(page)
    page.get_by_role("button", name="Load").click()
    move_and_play(page)


def move_and_play(page: Page) -> None:
    """Start to play the loaded recording."""
    hold(page, page.get_by_role("button", name="Move to the start"))
    play = page.get_by_role("button", name="Play", exact=True)
    expect(play).to_be_enabled(timeout=LONG_MS)
    expect(page.get_by_test_id("torque")).to_have_text("Torque on")
    hold(page, play)
