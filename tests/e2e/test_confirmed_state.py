"""The page shows the device's confirmed state, or shows that it is not up to date, in a real browser."""

import logging
import os
import re
import signal
import time

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import open_station, wait_until_idle

log = logging.getLogger(__name__)
LOST_LIMIT_S = 2.0

pytestmark = pytest.mark.shared_clinic("empty")


def watch(page: Page) -> None:
    """Let the page record when it first shows a lost connection, and when its values are live again."""
    page.evaluate(
        """() => {
            window.noted = {};
            const note = () => {
                const lost = document.querySelector('[data-testid=lost]') !== null;
                const alive = document.querySelector('[data-testid=angles]')?.dataset.alive === 'true';
                if (lost && !alive) window.noted.lost ??= Date.now();
                if (!lost && alive && window.noted.lost) window.noted.back ??= Date.now();
            };
            new MutationObserver(note).observe(document.body, {subtree: true, attributes: true, childList: true});
        }"""
    )


@pytest.mark.campaign
def test_killed_service_shows_within_two_seconds_and_returns_without_reload(page: Page, clinic: Clinic) -> None:
    open_station(page)
    expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "true")
    expect(page.get_by_test_id("age")).to_have_text(re.compile(r"^\d\.\d\u00a0s old$"))
    watch(page)
    clinic.kill()
    killed_s = time.time()
    expect(page.get_by_test_id("lost")).to_contain_text("Connection lost")
    assert page.evaluate("window.noted.lost") / 1000 - killed_s <= LOST_LIMIT_S
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "unknown")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_test_id("stop-answer")).to_contain_text("Use the emergency stop")
    clinic.start()
    returned_s = time.time()
    expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "true", timeout=LONG_MS)
    expect(page.get_by_test_id("lost")).to_be_hidden()
    back_s = page.evaluate("window.noted.back") / 1000 - returned_s
    log.info("alive again %.2f s after the service's return, its device process included", back_s)
    # The next test can share the clinic.
    wait_until_idle(page)


def test_lost_connection_shows_within_two_seconds_and_hides_stale_values(page: Page, clinic: Clinic) -> None:
    open_station(page)
    expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "true")
    page.evaluate(
        """() => new MutationObserver(() => {
            const mark = document.querySelector('[data-testid=connection]');
            if (mark?.dataset.connected === 'false' && !window.lostAt) window.lostAt = Date.now();
        }).observe(document.body, {subtree: true, attributes: true, childList: true})"""
    )
    # Like a pulled cable: the connection stays open without data.
    os.killpg(clinic.process.pid, signal.SIGSTOP)
    silent_since = time.time()
    try:
        expect(page.get_by_test_id("lost")).to_contain_text("Connection lost")
        assert page.evaluate("window.lostAt") / 1000 - silent_since <= LOST_LIMIT_S
        expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "false")
        expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "unknown")
        expect(page.get_by_test_id("mode")).to_have_text("State unknown")
        expect(page.get_by_test_id("torque")).to_have_text("Torque unknown")
    finally:
        os.killpg(clinic.process.pid, signal.SIGCONT)
    expect(page.get_by_test_id("angles")).to_have_attribute("data-alive", "true", timeout=LONG_MS)
