"""Two assessments of a shoulder a week apart, in a real browser."""

import re
from datetime import UTC, datetime, timedelta

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS
from tests.support.page_actions import open_tab, sign_up

# `make test` assesses by keyboard (test_keyboard_work.py), and tests what the page computes in AssessmentForm.test.tsx.
pytestmark = [pytest.mark.campaign, pytest.mark.shared_clinic("empty")]

FIRST_DAY = datetime.now(UTC) - timedelta(days=8)


def assess(page: Page, day: datetime, angles: tuple[int, ...], pain: int, answer: int) -> Locator:
    """Fill in an assessment without saving it: angles by keyboard, down the first column; pain and SPADI by touch."""
    page.get_by_role("button", name="New assessment").click()
    form = page.get_by_role("region", name="New assessment")
    form.get_by_label("Date and time").fill(day.strftime("%Y-%m-%dT%H:%M"))
    form.get_by_role("textbox", name="Flexion, left, active", exact=True).focus()
    for angle in angles:
        page.keyboard.type(str(angle))
        page.keyboard.press("Enter")
    form.get_by_role("textbox", name="Flexion, right, active", exact=True).fill("175")
    form.get_by_role("tab", name="Pain").click()
    for context in ("At rest", "Average over the last week"):
        form.get_by_role("group", name=context).get_by_role("button", name=str(pain), exact=True).click()
    form.get_by_role("tab", name="SPADI").click()
    for item in range(1, 14):
        group = form.get_by_role("group", name=re.compile(rf"^{item}\. "))
        group.get_by_role("button", name=str(answer if item > 5 else answer + 2), exact=True).click()
    expect(form.get_by_role("status")).to_contain_text(f"SPADI {10 * answer + 10} of 100")
    return form


def test_two_assessments_a_week_apart_become_progress(page: Page) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    sign_up(page, "Mori Sakura")
    open_tab(page, "Assessments")
    section = page.get_by_role("region", name="Assessments")
    expect(section).to_contain_text("No assessments yet.")

    form = assess(page, FIRST_DAY, (95, 25, 80, 10), pain=6, answer=6)
    form.get_by_label("Assessed by").fill("Kimura Jun")
    form.get_by_role("button", name="Save assessment").click()
    newest = page.get_by_test_id("newest-assessment")
    expect(newest.get_by_role("row", name=re.compile("^Flexion 95°"))).to_be_visible()

    # The assessor is the signed-in user, unless another name is given. The fields show the last values.
    form = assess(page, FIRST_DAY + timedelta(days=7), (120, 30, 105, 22), pain=3, answer=4)
    expect(form.get_by_label("Assessed by")).to_have_value("Test administrator")
    form.get_by_role("tab", name="Range of motion").click()
    expect(form.get_by_role("textbox", name="Flexion, right, active", exact=True)).to_have_attribute(
        "placeholder", "175"
    )
    form.get_by_role("button", name="Save assessment").click()
    expect(newest.get_by_role("row", name=re.compile(r"^Flexion 120° \(\+25°\)"))).to_be_visible()
    expect(newest).to_contain_text("SPADI 50 of 100 (−20)")
    expect(newest).to_contain_text("Improvement beyond measurement error")
    page.get_by_role("button", name="All assessments").click()

    section.get_by_role("link", name="Progress").click()
    motion = page.get_by_role("region", name="Range of motion")
    expect(motion.locator("[data-drawn=true]")).to_be_visible(timeout=LONG_MS)
    expect(motion.locator(".legendtext").filter(has_text="Reference")).to_be_visible()
    expect(page.get_by_role("region", name="SPADI").locator("[data-drawn=true]")).to_be_visible(timeout=LONG_MS)
    motion.get_by_role("button", name="Show numbers").click()
    expect(motion.get_by_role("row").filter(has_text="Flexion").last).to_contain_text("120")
    page.get_by_role("link", name="Mori Sakura").click()
    expect(page.get_by_role("heading", name="Mori Sakura")).to_be_visible()
    assert wrong == []
