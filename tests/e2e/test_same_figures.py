"""A tile of the home page and the page behind it show the same figure. tests/clinic/test_same_figures.py compares what they ask for."""

import re
from typing import Final

import pytest
from playwright.sync_api import Page, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.shown_station import ShownStation

pytestmark = pytest.mark.shared_clinic("invented")

TILES: Final = {
    "Shoulders improved by at least the MCID in 12 months": (
        r"\n(\d+)\s%\n",
        r"Shoulders improved by at least the MCID\n{0}\s%",
    ),
    "Sessions in 7 days": (r"\n(\d+) sessions?\n", r"Sessions: {0}, hours"),
    "Sessions with a stop in 4 weeks": (r"\n(\d+\sof\s\d+) sessions?\n", r"\b{0} sessions with a stop"),
    "Unsigned notes": (r"\n(\d+) sessions?\n", r"\b{0} rows?\b"),
}
"""By the beginning of a tile's label: its figure, and how the page behind it shows the figure."""


@pytest.mark.parametrize("label", TILES)
def test_the_page_behind_a_tile_shows_its_figure(tab: Page, clinic: Clinic, label: str) -> None:
    on_tile, behind = TILES[label]
    with ShownStation(clinic) as station:
        # Its note is not signed.
        station.end_session(station.begin_session("DEMO-001")[0])
    tab.goto(clinic.url)
    tile = tab.get_by_role("link", name=re.compile(label))
    expect(tile).to_have_text(re.compile(r"\d"), timeout=LONG_MS)
    found = re.search(on_tile, tile.inner_text())
    assert found, tile.inner_text()
    tile.click()
    expect(tile).to_be_hidden()
    shown = re.compile(behind.format(found[1]))
    expect(tab.get_by_role("main")).to_contain_text(shown, use_inner_text=True, timeout=LONG_MS)
