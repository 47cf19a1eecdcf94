"""The apparatus in three dimensions, which a worker draws beside the page."""

import base64
import time
from typing import Final, Literal

import pytest
from playwright.sync_api import BrowserContext, Page, WebSocketRoute, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import open_station, wait_until_idle

pytestmark = [pytest.mark.shared_clinic("empty"), pytest.mark.three_dimensions]

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


SHOWS: Final = """async ([shown, hidden, some]) => {
    for (;;) {
        await new Promise(requestAnimationFrame);
        const seen = document.querySelector('[data-testid=apparatus-canvas] canvas');
        const copy = new OffscreenCanvas(seen.width, seen.height).getContext('2d');
        copy.drawImage(seen, 0, 0);
        const pixels = copy.getImageData(0, 0, seen.width, seen.height).data;
        const near = (at, colour) => colour.every((part, n) => Math.abs(pixels[at + n] - part) < 12);
        const count = (colour) => {
            let found = 0;
            for (let at = 0; at < pixels.length; at += 4) if (pixels[at + 3] > 250 && near(at, colour)) found += 1;
            return found;
        };
        if (count(shown) >= some && count(hidden) < some) return true;
    }
}"""
"""Wait until the canvas has at least ``some`` opaque pixels of about the colour ``shown``, and fewer of ``hidden``."""
DISC: Final = {"light": (0x2F, 0x7D, 0x4F), "dark": (0x63, 0xB5, 0x86)}
"""The colour of motor 5's number and range in each scheme."""
SOME: Final = 40


def test_model_is_drawn_and_redrawn_from_another_view(page: Page) -> None:
    open_station(page)
    corner = page.evaluate(NEXT_PICTURE)

    page.get_by_role("radiogroup", name="View").get_by_text("Back", exact=True).click()

    assert page.evaluate(NEXT_PICTURE, corner) != corner
    expect(page.get_by_test_id("apparatus-canvas")).not_to_have_class("stale", timeout=LONG_MS)


@pytest.mark.campaign
def test_model_has_the_colours_of_the_scheme(page: Page) -> None:
    open_station(page)
    page.evaluate(NEXT_PICTURE)
    schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark", "light")
    for scheme, other in zip(schemes, ("dark", "light", "dark"), strict=True):
        page.emulate_media(color_scheme=scheme)
        assert page.evaluate(SHOWS, [DISC[scheme], DISC[other], SOME])


COLOURS: Final = """async (png) => {
    const picture = await createImageBitmap(await (await fetch('data:image/png;base64,' + png)).blob());
    const copy = new OffscreenCanvas(picture.width, picture.height).getContext('2d');
    copy.drawImage(picture, 0, 0);
    return new Set(new Uint32Array(copy.getImageData(0, 0, picture.width, picture.height).data.buffer)).size;
}"""
"""Return the number of colours of a screenshot."""
BACKGROUND: Final = 300
"""More colours than the canvas's background has without a picture, which has one for each row of pixels."""


def shown_colours(page: Page, elsewhere: Page) -> int:
    """Return the number of colours in a screenshot of the canvas. ``elsewhere``: a page without the clinic's policy."""
    picture = page.get_by_test_id("apparatus-canvas").screenshot()
    return int(elsewhere.evaluate(COLOURS, base64.b64encode(picture).decode()))


def test_picture_stays_at_a_new_connection(tab: Page, clinic: Clinic, another: BrowserContext) -> None:
    """The page once began an empty canvas at each new connection, which took seconds to draw without a graphics card."""
    connections: list[WebSocketRoute] = []

    def connect(connection: WebSocketRoute) -> None:
        connections.append(connection)
        connection.connect_to_server()

    elsewhere = another.new_page()
    tab.route_web_socket("**/api/live", connect)
    tab.goto(f"{clinic.url}/station")
    wait_until_idle(tab)
    canvas = tab.get_by_test_id("apparatus-canvas").locator("canvas")
    expect(canvas).to_have_attribute("data-drawn", "", timeout=LONG_MS)
    drawn = canvas.element_handle()
    assert shown_colours(tab, elsewhere) > BACKGROUND

    connections[0].close()

    limit_s = time.monotonic() + LONG_MS / 1000
    while len(connections) < 2:
        assert time.monotonic() < limit_s
        tab.wait_for_timeout(50)
    # The first messages of the new connection arrive.
    for _ in range(5):
        tab.wait_for_timeout(200)
        assert shown_colours(tab, elsewhere) > BACKGROUND
    assert canvas.evaluate("(canvas, drawn) => canvas === drawn", drawn)
