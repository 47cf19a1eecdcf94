"""A therapist edits a motion, in a real browser."""

import re

import pytest
from playwright.sync_api import Page, expect

from kata.motion.builtin import built_in_motions
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import import_motion, open_tab, sign_up


# `make test` edits a motion by keyboard (test_keyboard_work.py), and points by pointer in EditPanel.test.tsx.
@pytest.mark.campaign
@pytest.mark.shared_clinic("empty")
def test_derived_recording_is_previewed_and_saved(page: Page, clinic: Clinic) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    sign_up(page, "Mori Kaede")
    recording = import_motion(page, built_in_motions()[0])
    page.goto(f"{clinic.url}/recordings/{recording}")
    page.get_by_role("button", name="Edit", exact=True).click()
    panel = page.get_by_role("region", name="Edit")
    keep = panel.get_by_role("button", name="Save as a new recording")

    # A reduction larger than the motion is refused, and nothing is saved.
    panel.get_by_role("combobox", name="Type of edit").click()
    page.get_by_role("option", name="Warm-up").click()
    panel.get_by_label("Reduction at the start", exact=True).and_(panel.get_by_role("textbox")).fill("180")
    panel.get_by_role("button", name="Preview").click()
    expect(panel.get_by_role("alert")).to_contain_text(
        "the range cannot be reduced by 180°: the motion covers", timeout=LONG_MS
    )
    expect(keep).to_be_hidden()

    # A point of the curve follows the mouse, with the curve's scale.
    panel.get_by_role("combobox", name="Type of edit").click()
    page.get_by_role("option", name="Change a part of the curve").click()
    panel.get_by_role("button", name="Add a point").click()
    point = panel.get_by_role("slider", name="Point 1")
    point.hover()
    place = point.bounding_box()
    assert place is not None
    page.mouse.down()
    page.mouse.move(place["x"] + place["width"] / 2, place["y"] + place["height"] / 2 + 40, steps=3)
    page.mouse.up()
    expect(point).to_have_attribute("aria-valuenow", re.compile(r"^-\d"))
    panel.get_by_role("button", name="Preview").click()
    expect(keep).to_be_visible(timeout=LONG_MS)

    panel.get_by_role("combobox", name="Type of edit").click()
    page.get_by_role("option", name="Some motors only").click()
    for motor in (2, 3, 4, 5):
        panel.get_by_role("button", name=f"Motor {motor}").click()
    for control in (panel.get_by_role("button", name="Motor 1"), panel.get_by_role("button", name="Preview")):
        box = control.bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= 44
    panel.get_by_role("button", name="Preview").click()
    figure = panel.locator("[data-drawn=true]")
    expect(figure.locator(".legendtext")).to_have_text(["Before", "After"], timeout=LONG_MS)
    keep.click()

    expect(page.get_by_role("heading", name="Raise the arm, motor 1 only")).to_be_visible()
    made_of = page.get_by_test_id("made-of")
    expect(made_of).to_contain_text(
        "Created from Raise the arm. Edits to the taught motion: imported from a CSV file, motor 1 only."
    )
    page.get_by_role("link", name="Mori Kaede").click()
    open_tab(page, "Recordings")
    expect(page.get_by_role("row", name="Raise the arm, motor 1 only")).to_contain_text(
        "Created from Raise the arm: motor 1 only"
    )
    assert wrong == []
