"""A visit from sign-up to addendum, in a real browser."""

import re
from pathlib import Path

from playwright.sync_api import Page, expect

from tests.journeys.test_main_job import LONG_MS, sign_up, teach, try_estop


def test_a_session_goes_from_its_checklist_to_its_addendum(page: Page, artefacts: Path) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    sign_up(page, "Yamada Hanako")
    teach(page, "1 Abduction / adduction of the scapula")
    visit = page.get_by_role("region", name="Session")
    visit.get_by_role("button", name="Begin the session").click()

    # The checklist: somebody looks, and the apparatus sees for itself that its switch was tried.
    line = visit.get_by_test_id("check-estop")
    expect(line).to_contain_text("Not seen yet")
    expect(line.get_by_role("button")).to_have_count(0)
    for check in ("side", "fixtures", "belt"):
        button = visit.get_by_test_id(f"check-{check}").get_by_role("button")
        box = button.bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= 44
        button.click()
    expect(visit.get_by_test_id("check-fixtures")).to_contain_text("arm fixer 1, closed")
    page.screenshot(path=artefacts / "checklist.png", full_page=True)
    # Nothing can be loaded before.
    steps = visit.get_by_role("navigation", name="Steps of the session")
    steps.get_by_role("button", name="Play").click()
    expect(visit.get_by_role("button", name="Load")).to_be_disabled()
    expect(visit.get_by_test_id("check-estop")).to_be_visible()
    expect(visit.get_by_test_id("check-belt")).to_be_hidden()
    steps.get_by_role("button", name="Checklist").click()
    try_estop(page)
    expect(line).to_contain_text("Seen by the apparatus", timeout=LONG_MS)

    # A reload loses nothing: the service knows where the session stands.
    page.reload()
    expect(visit.get_by_role("heading", name="Pain before")).to_be_visible()
    visit.get_by_role("button", name="Pain before: 4").click()
    expect(visit.get_by_role("button", name="Pain before: 4")).to_have_attribute("aria-pressed", "true")
    page.screenshot(path=artefacts / "pain-before.png", full_page=True)
    visit.get_by_role("button", name="Go on", exact=True).click()
    visit.get_by_role("button", name="Load").click()
    visit.get_by_role("button", name="Move to the start").click(timeout=LONG_MS)
    play = visit.get_by_role("button", name="Play", exact=True)
    expect(play).to_be_enabled(timeout=LONG_MS)
    visit.get_by_role("button", name="Less", exact=True).click()
    play.click()
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=LONG_MS)
    expect(page.get_by_text("The playback is saved.")).to_be_visible(timeout=LONG_MS)
    visit.get_by_role("button", name="Enough played: on to pain after").click()
    visit.get_by_role("button", name="Worst pain during the session: 5").click()
    expect(visit.get_by_role("button", name="during the session: 5")).to_have_attribute("aria-pressed", "true")
    visit.get_by_role("button", name="Pain after: 2").click()
    visit.get_by_role("button", name="Go on", exact=True).click()

    # The note is drafted, edited, signed.
    note = visit.get_by_label("Note of this session")
    for part in (
        "Left shoulder, without a programme. Raise the arm: 1 of 1 repetition.",
        "Less range was asked for in Raise the arm",
        "Pain (0 to 10): 4 before, 5 during, 2 after.",
    ):
        expect(note).to_have_value(re.compile(re.escape(part)))
    note.press("ControlOrMeta+End")
    note.type(" Did well.")
    expect(visit.get_by_text("Saved", exact=True)).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=artefacts / "note-drafted.png", full_page=True)
    page.reload()
    expect(note).to_have_value(re.compile(re.escape("2 after. Did well.")))
    visit.get_by_role("button", name="End the session").click()
    visit.get_by_role("button", name="Sign as Test administrator").click()
    page.get_by_role("link", name="Look at it").click()

    # On its own page: what was answered and measured, signed; then only added to.
    expect(page.get_by_test_id("signed")).to_contain_text("Signed by Test administrator")
    expect(page.get_by_test_id("note")).to_contain_text("Did well.")
    expect(page.get_by_test_id("pain")).to_have_text("Pain (0 to 10): 4 before, 5 during, 2 after")
    expect(page.get_by_role("region", name="Checklist")).to_contain_text("Emergency stop tried: seen by the apparatus")
    expect(page.get_by_test_id("end-reason")).to_have_text("Completed as planned")
    expect(page.get_by_label("Note of this session")).to_have_count(0)
    page.get_by_label("Addendum").fill("Slept well.")
    page.get_by_role("button", name="Add as Test administrator").click()
    expect(page.get_by_role("region", name="Note")).to_contain_text("Addendum by Test administrator")
    page.screenshot(path=artefacts / "session-signed.png", full_page=True)
    assert wrong == []
