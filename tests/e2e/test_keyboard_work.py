"""Desk work in a real browser, by keyboard alone: assess, edit a motion, prescribe, look up, administer."""

import csv
import re
from io import StringIO

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.keyboard import choose, press, reach, write
from tests.support.keyboard import open_tab as open_tab_by_keys
from tests.support.page_actions import wait_until_idle

PATIENT = "Yamada Hanako"


@pytest.mark.campaign
@pytest.mark.shared_clinic("invented")
def test_the_work_at_a_desk_is_done_by_keyboard_alone(page: Page, clinic: Clinic) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(clinic.url)
    wait_until_idle(page)

    # Find the patient.
    press(page, page.get_by_role("link", name="Patients", exact=True))
    write(page, page.get_by_role("textbox", name=re.compile("^Search")), "Yamada")
    expect(page.get_by_role("row")).to_have_count(2, timeout=LONG_MS)
    press(page, page.get_by_role("link", name=PATIENT))
    expect(page.get_by_role("heading", name=PATIENT)).to_be_visible(timeout=LONG_MS)

    # Assess.
    open_tab_by_keys(page, "Assessments")
    press(page, page.get_by_role("button", name="New assessment"))
    form = page.get_by_role("region", name="New assessment")
    write(page, form.get_by_role("textbox", name="Flexion, right, active", exact=True), "131")
    press(page, form.get_by_role("tab", name="Range of motion"), "ArrowRight")
    press(page, form.get_by_role("group", name="At rest").get_by_role("button", name="1", exact=True))
    press(page, form.get_by_role("tab", name="Pain"), "ArrowRight")
    for item in range(1, 14):
        group = form.get_by_role("group", name=re.compile(rf"^{item}\. "))
        press(page, group.get_by_role("button", name="3", exact=True))
    expect(form.get_by_role("status")).to_contain_text("SPADI 30 of 100")
    press(page, form.get_by_role("button", name="Save assessment"))
    newest = page.get_by_test_id("newest-assessment")
    expect(newest.get_by_role("row", name=re.compile("^Flexion 131°"))).to_be_visible(timeout=LONG_MS)

    # Derive a motion.
    open_tab_by_keys(page, "Recordings")
    press(page, page.get_by_role("link", name="Abduction / adduction of the shoulder", exact=True).first)
    press(page, page.get_by_role("button", name="Edit", exact=True))
    panel = page.get_by_role("region", name="Edit")
    choose(page, panel.get_by_role("combobox", name="Type of edit"), "Some motors only")
    for motor in (1, 2, 5):
        press(page, panel.get_by_role("button", name=f"Motor {motor}"))
    press(page, panel.get_by_role("button", name="Preview"))
    expect(panel.locator("[data-drawn=true]")).to_be_visible(timeout=LONG_MS)
    press(page, panel.get_by_role("button", name="Save as a new recording"))
    expect(page.get_by_role("heading", name=re.compile("motors 3, 4 only"))).to_be_visible(timeout=LONG_MS)

    # Prescribe it.
    press(page, page.get_by_role("link", name=PATIENT).first)
    open_tab_by_keys(page, "Programmes")
    press(page, page.get_by_role("link", name="New programme"))
    write(page, page.get_by_label("Name of the programme"), "Evening")
    choose(page, page.get_by_role("combobox", name="Add a recording"), "motors 3, 4 only")
    dialog = page.get_by_role("dialog")
    press(page, dialog.get_by_role("button", name="Repetitions: increase"))
    press(page, dialog.get_by_role("slider", name="Resistance level"), "End")
    press(page, dialog.get_by_role("button", name="Done"))
    expect(dialog).to_be_hidden()
    write(page, page.get_by_label("Prescribed by"), "Aoki Rin")
    press(page, page.get_by_role("button", name="Save the programme"))
    expect(page.get_by_role("heading", name="Evening")).to_be_visible(timeout=LONG_MS)

    # Look up a session by therapist.
    press(page, page.get_by_role("link", name="Sessions", exact=True))
    choose(page, page.get_by_role("combobox", name="Therapist"), "Sato Mai")
    rows = page.get_by_role("row").filter(has_text="Sato Mai")
    expect(rows.first).to_be_visible(timeout=LONG_MS)
    press(page, rows.first.get_by_role("link").first)
    expect(page.get_by_role("heading", name="Session", exact=True)).to_be_visible(timeout=LONG_MS)

    # Zoom into a part of the figures, and back to the whole.
    part = page.get_by_role("group", name="Part shown in the figures").first
    with page.expect_response(lambda answer: "/figures?start_s=" in answer.url):
        press(page, part.get_by_role("slider", name="From"), "ArrowRight")
    expect(part.get_by_test_id("window")).not_to_contain_text("Shown: 0.0")
    press(page, part.get_by_role("button", name="Whole recording"))
    expect(part.get_by_test_id("window")).to_contain_text("Shown: 0.0")

    open_tab_by_keys(page, "Compare")
    beside = page.get_by_role("region", name="Compare with another session")
    choose(page, beside.get_by_role("combobox", name="Session"), "2026")
    expect(beside.get_by_test_id("beside")).to_contain_text("Resistance level", timeout=LONG_MS)
    expect(beside.get_by_test_id("beside").get_by_role("row", name="RMSE, °").first).to_be_visible()

    # Export the record, and request an erasure, which an administrator decides.
    press(page, page.get_by_role("link", name=PATIENT).first)
    open_tab_by_keys(page, "Data")
    with page.expect_download() as taken:
        press(page, page.get_by_role("link", name="All data (ZIP)"))
    assert taken.value.suggested_filename.endswith(".zip")
    press(page, page.get_by_role("button", name="Record an erasure request"))
    asking = page.get_by_role("dialog")
    write(page, asking.get_by_role("textbox", name="How and why it was requested"), "By letter, has moved away.")
    press(page, asking.get_by_role("button", name="Record request"))
    press(page, page.get_by_role("button", name="Decide on the erasure"))
    deciding = page.get_by_role("dialog")
    write(page, deciding.get_by_role("textbox", name="Explanation"), "Records are kept for five years.")
    press(page, deciding.get_by_role("button", name="Refuse and keep the record"))
    expect(page.get_by_test_id("erasure")).to_contain_text("Refused by", timeout=LONG_MS)

    # Administer: create an account, and read the audit trail.
    press(page, page.get_by_role("link", name="Administration"))
    press(page, page.get_by_role("button", name="New account"))
    account = page.get_by_role("dialog", name="New account")
    write(page, account.get_by_role("textbox", name="Name", exact=True), "Kubo Rin")
    write(page, account.get_by_label("User name"), "kubo")
    viewer = account.get_by_role("radio", name="Viewer")
    reach(page, account.get_by_role("radio", checked=True))
    for _ in range(4):
        if not viewer.is_checked():
            page.keyboard.press("ArrowDown")
    expect(viewer).to_be_checked()
    press(page, account.get_by_role("button", name="Create account"))
    expect(page.get_by_test_id("code")).to_be_visible(timeout=LONG_MS)
    press(page, page.get_by_role("button", name="Handed over"))
    expect(page.get_by_role("row", name="Kubo Rin")).to_contain_text("Viewer")
    press(page, page.get_by_role("link", name="Audit trail"))
    expect(page.get_by_role("link", name="Administration")).to_have_attribute("aria-current", "page")
    choose(page, page.get_by_role("combobox", name="Outcome"), "Done")
    expect(page.get_by_role("row").nth(1)).to_be_visible(timeout=LONG_MS)
    number = page.get_by_role("columnheader", name="No.")
    press(page, number.get_by_role("button"))
    expect(number).to_have_attribute("aria-sort", "ascending")
    with page.expect_download() as download:
        press(page, page.get_by_role("button", name="Save as CSV"))
    entries = list(csv.reader(StringIO(download.value.path().read_text("utf-8-sig"))))
    assert entries[0][:3] == ["No.", "Time", "User"]
    assert [int(entry[0]) for entry in entries[1:]] == sorted(int(entry[0]) for entry in entries[1:])
    assert wrong == []
