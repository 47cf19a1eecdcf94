"""The apparatus in three dimensions, which a worker draws beside the page."""

from typing import Final

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS

pytestmark = pytest.mark.shared_clinic("empty")

NEXT_PICTURE: Final = """async (before) => {
    for (;;) {
        await new Promise(requestAnimationFrame);
        const seen = document.querySelector('[data-testid=apparatus-canvas] canvas');
        if (!seen?.width) continue;
        const copy = new OffscreenCanvas(seen.width, seen.height).getContext('2d');
        copy.drawImage(seen, 0, 0);
        const pixels = new Uint32Array(copy.getImageData(0, 0, seen.width, seen.height).data.buffer);
        const sum = pixels.reduce((sum, one) => (sum * 31 + one) | 0, 0);
        if (new Set(pixels).size > 100 && sum !== before) return sum;
    }
}"""
"""Wait until the canvas shows something other than ``before``; return a checksum of the picture."""


def test_model_is_drawn_and_redrawn_from_another_view(page: Page) -> None:
    corner = page.evaluate(NEXT_PICTURE)

    page.get_by_role("radiogroup", name="View").get_by_text("Back", exact=True).click()

    assert page.evaluate(NEXT_PICTURE, corner) != corner
    expect(page.get_by_test_id("apparatus-canvas")).not_to_have_class("stale", timeout=LONG_MS)
