"""A therapist prescribes a programme, in a real browser."""

import pytest
from playwright.sync_api import Page, expect

from kata.motion.builtin import built_in_motions
from tests.support.browser_clinic import LONG_MS
from tests.support.page_actions import (
    begin_session,
    import_motion,
    load_and_play,
    open_tab,
    prepare_station,
    sign_up,
)


@pytest.mark.campaign
@pytest.mark.shared_clinic("empty")
def test_programme_is_created_changed_played_and_reported(page: Page) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    sign_up(page, "Mori Tsubaki")
    patient = page.url
    service = patient.partition("/patients/")[0]
    recording = import_motion(page, built_in_motions()[0])
    page.goto(f"{service}/recordings/{recording}")
    expect(page.get_by_test_id("margin")).to_contain_text("°")
    less = {"do": "isolate", "motors": [1], "name": "A little less"}
    assert page.request.post(f"{service}/api/recordings/{recording}/derived", data=less).ok

    page.goto(patient)
    open_tab(page, "Programmes")
    page.get_by_role("link", name="New programme").click()
    page.get_by_label("Name of the programme").fill("Morning")
    for name, more in (("Raise the arm", 1), ("A little less", 1)):
        page.get_by_role("combobox", name="Add a recording").click()
        page.get_by_role("option", name=name).click()
        dialog = page.get_by_role("dialog", name=name)
        if name == "Raise the arm":
            expect(page.get_by_test_id("whole")).to_have_text("Resistance level not chosen yet: Raise the arm")
            dialog.get_by_role("slider", name="Resistance level").press("End")
        for _ in range(more):
            dialog.get_by_role("button", name="Repetitions: increase").click()
        dialog.get_by_role("button", name="Done").click()
        expect(dialog).to_be_hidden()
        # The dialog returns the focus when it closes. Until then another focus would be lost.
        expect(page.get_by_role("combobox", name="Add a recording")).to_be_focused()
    table = page.get_by_role("table", name="Recordings in playing order")
    expect(table.get_by_role("row", name="A little less")).to_contain_text("3 repetitions")
    # By keyboard: the row moves up, and the focus stays in the row.
    up = page.get_by_role("button", name="A little less: move up")
    up.focus()
    page.keyboard.press("Enter")
    expect(table.get_by_role("row").nth(1)).to_contain_text("A little less")
    expect(page.get_by_role("button", name="A little less: move down")).to_be_focused()
    for control in (up, page.get_by_role("button", name="Raise the arm: settings")):
        box = control.bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= 42
    for name in ("With timer", "With sessions per week"):
        page.get_by_role("switch", name=name).press(" ")
        expect(page.get_by_role("switch", name=name)).to_be_checked()
    page.get_by_label("Prescribed by").fill("Aoki Rin")
    expect(page.get_by_test_id("whole")).to_contain_text("Total playing time", timeout=LONG_MS)
    page.get_by_role("button", name="Save the programme").click()
    expect(page.get_by_role("heading", name="Morning")).to_be_visible()
    expect(page.get_by_role("table", name="Version 1").first).to_contain_text("Raise the arm")

    page.get_by_role("button", name="Change").click()
    page.get_by_role("button", name="Raise the arm: settings").click()
    page.get_by_role("button", name="Speed: decrease").click()
    page.get_by_role("button", name="Done").click()
    page.get_by_role("button", name="A little less: remove").click()
    page.get_by_label("Reason").fill("It hurt at the end.")
    page.get_by_role("button", name="Save as version 2").click()
    changes = page.get_by_test_id("changes-2")
    expect(changes.get_by_role("listitem")).to_have_text(
        ["A little less removed", "Raise the arm: speed 90 % instead of 100 %"]
    )
    versions = page.get_by_role("region", name="Versions")
    versions.get_by_role("button", name="Show version 1").click()
    expect(versions.get_by_role("table", name="Version 1")).to_contain_text("A little less")

    # Today's session uses the newest version of the newest programme.
    page.get_by_role("link", name="Mori Tsubaki").click()
    prepare_station(page)
    visit = page.get_by_role("region", name="Session")
    expect(visit.get_by_role("combobox", name="Programme")).to_have_value("Morning (version 2)")
    expect(visit.get_by_text("1. Raise the arm: 90 % of the speed")).to_be_visible()
    begin_session(page)
    expect(visit.get_by_role("combobox", name="Recording")).to_have_value("1. Raise the arm")
    load_and_play(page)
    expect(page.get_by_text("The playback is saved.")).to_be_visible(timeout=LONG_MS)
    page.get_by_role("link", name="Compare teaching and playback").click()
    open_tab(page, "Plan")
    expect(page.get_by_test_id("planned").get_by_role("row", name="Raise the arm")).to_contain_text("2 of 2")

    # The report, in both languages, printed and as a PDF.
    open_tab(page, "Record")
    reports = page.get_by_role("group", name="Report", exact=True)
    with page.expect_popup() as opened:
        reports.get_by_role("link", name="Print report").click()
    printed = opened.value
    expect(printed.get_by_role("heading", name="Session report")).to_be_visible()
    expect(printed.get_by_text("Not signed. This is a draft").first).to_be_visible()
    expect(printed.locator("body")).to_contain_text("Mori Tsubaki")
    printed.close()
    reports.get_by_text("日本語").click()
    with page.expect_download() as saving:
        reports.get_by_role("link", name="Report as PDF").click()
    assert saving.value.path().read_bytes().startswith(b"%PDF-")

    page.get_by_role("link", name="Mori Tsubaki").first.click()
    open_tab(page, "Programmes")
    section = page.get_by_role("region", name="Programmes")
    expect(section.get_by_role("row", name="Morning")).to_contain_text("90 % of the speed")
    expect(section.get_by_test_id("regularity")).to_contain_text(
        "This week: 1 of 3 sessions, 2 of 2 planned repetitions"
    )
    assert wrong == []
