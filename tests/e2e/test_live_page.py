"""Memory, DOM nodes and processor time of the live page for an hour, with a moving arm in three dimensions."""

import logging
import os
import statistics
import time
from typing import Final

import pytest
from playwright.sync_api import CDPSession, Page, expect

from tests.support.browser_clinic import Clinic
from tests.support.page_actions import open_station

pytestmark = [pytest.mark.shared_clinic("full rate"), pytest.mark.three_dimensions]

log = logging.getLogger(__name__)
MINUTES: Final = float(os.environ.get("KATA_LIVE_MINUTES", "60"))
LOOKS: Final = 60
GROWTH: Final = 0.1
MOTION: Final = "5 Flexion / extension of the shoulder"


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_live_page_keeps_its_memory_flat_for_an_hour(page: Page, clinic: Clinic) -> None:
    open_station(page)
    expect(page.get_by_test_id("apparatus-canvas").locator("canvas")).to_be_visible()
    motion = page.get_by_role("combobox", name="Motion that the hand follows")
    motion.fill(MOTION)
    page.get_by_role("option", name=MOTION).first.click()
    guide = page.get_by_role("button", name="Guide the arm")
    browser = page.context.new_cdp_session(page)
    browser.send("Performance.enable")

    held, nodes, busy = [], [], []
    for look in range(LOOKS):
        before, since = figure(browser, "TaskDuration"), time.monotonic()
        while time.monotonic() - since < 60 * MINUTES / LOOKS:
            if guide.is_enabled():
                guide.click()
            page.wait_for_timeout(1000)
        busy.append((figure(browser, "TaskDuration") - before) / (time.monotonic() - since))
        browser.send("HeapProfiler.collectGarbage")
        held.append(figure(browser, "JSHeapUsedSize") / 1e6)
        nodes.append(figure(browser, "Nodes"))
        log.info(
            "%d of %d: main thread %.0f %%, %.1f MB, %.0f DOM nodes",
            look + 1, LOOKS, 100 * busy[-1], held[-1], nodes[-1],
        )  # fmt: skip
    expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "true")
    # Data that the page fetches and caches at the beginning is no growth.
    early, late = early_and_late(held)
    few, many = early_and_late(nodes)
    log.info(
        "%.0f minutes: main thread busy %.0f %% of the time (median), %.1f MB after a tenth, %.1f MB at the end, "
        "%.0f and %.0f DOM nodes",
        MINUTES, 100 * statistics.median(busy), early, late, few, many,
    )  # fmt: skip
    assert abs(late - early) <= GROWTH * early
    assert abs(many - few) <= GROWTH * few


def early_and_late(figures: list[float]) -> tuple[float, float]:
    """Return the medians after a tenth of the time and at the end."""
    return statistics.median(figures[LOOKS // 10 : LOOKS // 10 + 10]), statistics.median(figures[-10:])


def figure(browser: CDPSession, name: str) -> float:
    return float(
        next(metric["value"] for metric in browser.send("Performance.getMetrics")["metrics"] if metric["name"] == name)
    )
