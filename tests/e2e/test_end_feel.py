"""A therapist measures the end-feel of three motions, in a real browser."""

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from kata.motion.taught import Taught
from tests.support.browser_clinic import LONG_MS
from tests.support.page_actions import begin_session, choose_level, hold, import_motion, prepare_station, sign_up

_GOAL = 10
_PLAYED_MS = 150_000
"""A test lasts a minute."""
_COUNT = "() => { window.presses = 0; addEventListener('pointerdown', ({isTrusted}) => { window.presses += isTrusted ? 1 : 0; }, true); }"


def motion(column: int, from_deg: float, to_deg: float, abduction_deg: float = 10.0) -> Taught:
    """Return a way of one column of the pose out and back in 8 s."""
    times_s = np.arange(0.0, 8.005, 0.02)
    poses_deg = np.tile([0.0, 0.0, abduction_deg, 5.0, 0.0], (len(times_s), 1))
    poses_deg[:, column] = from_deg + (to_deg - from_deg) * (0.5 - 0.5 * np.cos(2 * np.pi * times_s / 8.0))
    return Taught("way", times_s, poses_deg)


def hold_until_playing(page: Page, button: Locator) -> None:
    """Hold a button, which disappears meanwhile, until the apparatus plays."""
    expect(button).to_be_enabled(timeout=LONG_MS)
    button.hover()
    page.mouse.down()
    expect(page.get_by_test_id("mode")).to_have_text("Playing, torque on", timeout=LONG_MS)
    page.mouse.up()


def until_played(page: Page) -> None:
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=_PLAYED_MS)


# In every run, frontend/src/features/end-feel/presses.test.tsx counts the presses with a page alone.
@pytest.mark.campaign
@pytest.mark.timeout(900)
# At 20 Hz a curve has too few samples for each half degree.
@pytest.mark.shared_clinic("full rate")
def test_three_motions_are_measured_with_at_most_ten_presses(page: Page) -> None:
    sign_up(page, "Mori Kaede")
    # Motions with the same fixtures. A rotation needs others, which are confirmed again.
    for way in (motion(2, 10.0, 36.0), motion(3, 5.0, 31.0), motion(3, 5.0, 31.0, abduction_deg=80.0)):
        import_motion(page, way)
    page.reload()
    prepare_station(page)
    begin_session(page)
    choose_level(page)
    page.evaluate(_COUNT)
    page.get_by_role("button", name="Measure the end-feel").click()
    expect(page.get_by_test_id("end-feel-motion")).to_have_count(3, timeout=LONG_MS)
    for left in (2, 1, 0):
        hold_until_playing(page, page.get_by_role("button", name="Hold to measure the baseline").first)
        until_played(page)
        expect(page.get_by_role("button", name="Hold to measure the baseline")).to_have_count(left, timeout=LONG_MS)
    for place in range(3):
        hold(page, page.get_by_role("button", name="Move to the start of the test").nth(place))
        hold(page, page.get_by_role("button", name="Play", exact=True))
        until_played(page)
        expect(page.get_by_test_id("end-feel-last")).to_have_count(place + 1, timeout=LONG_MS)
    assert page.evaluate("window.presses") <= _GOAL
