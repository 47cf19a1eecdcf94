"""A technician practises commissioning on the page, from a box of drives to a record."""

import time

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS
from tests.support.page_actions import open_station

_WHOLE_MS = 900_000
"""Limits the whole procedure: the simulation computes its eleven steps."""


def press_until(page: Page, end: str, limit_ms: float) -> int:
    """Press the instruction's button, and keep gains, until an element is visible; return the number of presses."""
    buttons = page.get_by_test_id("instruction").get_by_role("button")
    button = buttons.filter(has_text="Do it (simulated hands)").or_(buttons.filter(has_text="Keep these gains"))
    finished, last, presses = page.locator(end), "", 0
    until = time.monotonic() + limit_ms / 1000
    while not finished.is_visible():
        assert time.monotonic() < until, page.get_by_test_id("steps").inner_text()
        # Read at once, because the instruction may end at any time.
        number = page.get_by_test_id("instruction").evaluate_all("all => all[0]?.dataset.number")
        if number and number != last and button.is_visible():
            button.click()
            last, presses = number, presses + 1
        page.wait_for_timeout(100)
    return presses


def begin(page: Page) -> None:
    open_station(page)
    page.get_by_role("link", name="Station settings and commissioning").click()
    page.get_by_role("tab", name="Procedure").click()
    page.get_by_role("button", name="Practise commissioning").click()
    expect(page.get_by_test_id("instruction")).to_contain_text("Connect all five drives", timeout=LONG_MS)


@pytest.mark.campaign
@pytest.mark.shared_clinic("full rate")
@pytest.mark.timeout(1_200)
def test_a_practice_leads_to_a_record_with_pdf(page: Page) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    begin(page)
    expect(page.get_by_test_id("present")).to_contain_text("Step 1 of 11: Find the drives and give them their ids")
    presses = press_until(page, "[data-testid=finished]", _WHOLE_MS)
    assert presses == 51, "33 confirmations and 18 actions that the drives would detect"
    finished = page.get_by_test_id("finished")
    expect(page.get_by_test_id("present")).to_have_count(0)
    expect(finished).to_contain_text(f"You confirmed {presses} instructions")
    expect(page.locator("[data-testid^=step-][data-state=passed]")).to_have_count(11)
    expect(page.get_by_test_id("responses-weight").locator("figure[data-drawn=true]")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_text("control program does not answer")).to_have_count(0)
    expect(page.get_by_test_id("mode")).to_contain_text("Idle", timeout=LONG_MS)
    finished.get_by_role("link", name="Show the records").click()
    rows = page.get_by_test_id("commissionings").get_by_role("row")
    expect(rows).to_have_count(2, timeout=LONG_MS)
    expect(rows.nth(1)).to_contain_text("Passed")
    address = rows.nth(1).get_by_role("link").get_attribute("href")
    printed = page.request.get(f"{page.url.split('/commissioning')[0]}{address}", timeout=LONG_MS)
    assert printed.body().startswith(b"%PDF")
    rows.nth(1).get_by_role("button", name="Steps").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_test_id("step")).to_have_count(11)
    assert columns_beyond(dialog) == []
    assert wrong == []


def columns_beyond(dialog: Locator) -> list[str]:
    """Return the heads of the tables' columns that lie beyond the dialog's width."""
    box = dialog.bounding_box()
    assert box
    heads = [(head.inner_text(), head.bounding_box()) for head in dialog.get_by_role("columnheader").all()]
    assert [name for name, _ in heads].count("After") > 5
    return [name for name, at in heads if at is None or at["x"] + at["width"] > box["x"] + box["width"]]


@pytest.mark.campaign
@pytest.mark.shared_clinic("full rate")
@pytest.mark.timeout(240)
def test_gains_are_compared_and_taken_back(page: Page) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    begin(page)
    press_until(page, "[data-testid=gain-tuning]", 3 * LONG_MS)
    tuning = page.get_by_test_id("gain-tuning")
    measure = tuning.get_by_role("button", name="Measure with the new gains (motors move)")
    expect(measure).to_be_disabled()
    field = tuning.get_by_role("textbox", name="Motor 3, Derivative gain (no unit), next measurement")
    present = int(field.input_value())
    field.fill(str(2 * present + 1))
    expect(measure).to_be_disabled()
    expect(tuning).to_contain_text(f"Outside {present // 2} to {2 * present}")
    field.fill(str(present // 2))
    measure.click()
    former, tried = page.get_by_test_id("motor-3-former"), page.get_by_test_id("motor-3-present")
    expect(former.get_by_role("cell").nth(4)).to_have_text(str(present), timeout=LONG_MS)
    expect(tried.get_by_role("cell").nth(4)).to_have_text(str(present // 2))
    assert overshoot(tried) > overshoot(former)
    both = page.get_by_test_id("comparison-3").locator("figure[data-drawn=true]")
    expect(both.locator(".scatterlayer .trace")).to_have_count(3, timeout=LONG_MS)
    tuning.get_by_role("button", name="Take back").click()
    expect(page.get_by_test_id("motor-3-former")).to_have_count(0, timeout=LONG_MS)
    expect(tried.get_by_role("cell").nth(4)).to_have_text(str(present))
    press_until(page, "[data-testid=step-gains][data-state=passed]", LONG_MS)
    assert wrong == []


def overshoot(row: Locator) -> int:
    return int(row.get_by_role("cell").nth(6).inner_text())


@pytest.mark.campaign
@pytest.mark.shared_clinic("empty")
@pytest.mark.timeout(120)
def test_stop_ends_the_practice_and_the_station_returns(page: Page) -> None:
    begin(page)
    press_until(page, "[data-testid=instruction][data-number='2']", LONG_MS)
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("finished")).to_contain_text("ended before its last step", timeout=LONG_MS)
    expect(page.get_by_text("The technician ended the step.")).to_be_visible()
    expect(page.get_by_test_id("mode")).to_contain_text("Idle", timeout=LONG_MS)
