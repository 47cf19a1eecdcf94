"""Pages on paper: the same from both schemes, and nothing is cut at the margin."""

import re
from io import BytesIO
from typing import Final, Literal

import pytest
from playwright.sync_api import Page, expect
from pypdf import PdfReader

from tests.support.accessibility import addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import wait_until_idle

pytestmark = [pytest.mark.shared_clinic("invented"), pytest.mark.three_dimensions]

_FIGURE: Final = "figure[data-drawn=true]"
PRINTED: Final = {
    "home": "a[href^='/clinic']",
    "patient": "td",
    "patient-assessments": _FIGURE,
    "session": _FIGURE,
    "session-numbers": "td",
}
"""What is on each page when it is complete."""
_OF_EACH_KIND: Final = ("patient-assessments", "session-numbers")
"""Pages with figures and with wide tables, which `make test` prints. The campaign prints the others."""
_AT_THE_MARGIN: Final = "h1, td, th, .xtitle, .legendtext, section > svg[viewBox] text, div > svg[viewBox] text"
"""Texts of which one is cut when a page, a table or a figure is wider than the paper."""


def printed(page: Page, address: str, complete: str, scheme: Literal["light", "dark"]) -> PdfReader:
    """Print a page as the browser does, on A4. The user has chosen the scheme: a browser prints the system's as light."""
    page.add_init_script(f"localStorage.setItem('kata-scheme', '{scheme}')")
    page.goto(address)
    expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
    wait_until_idle(page)
    expect(page.locator(complete).first).to_be_visible(timeout=LONG_MS)
    page.wait_for_load_state("networkidle")
    expect(page.locator(".mantine-Skeleton-root, figure[data-drawn=false]")).to_have_count(0, timeout=LONG_MS)
    sheets = PdfReader(BytesIO(page.pdf(format="A4", print_background=True)))
    expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
    return sheets


def colours(sheets: PdfReader) -> set[bytes]:
    """Return the colours that fill or stroke something."""
    contents = (sheet.get_contents() for sheet in sheets.pages)
    return {
        colour
        for part in contents
        if part is not None
        for colour in re.findall(rb"([\d.]+ [\d.]+ [\d.]+) (?:rg|RG)\b", part.get_data())
    }


def words(text: str) -> str:
    """Return the text without spaces, because a PDF has none at the end of a line."""
    return re.sub(r"\s", "", text)


@pytest.mark.parametrize(
    ("name", "complete"),
    [
        pytest.param(name, complete, id=name, marks=[] if name in _OF_EACH_KIND else pytest.mark.campaign)
        for name, complete in PRINTED.items()
    ],
)
def test_print_is_light_and_complete(tab: Page, clinic: Clinic, name: str, complete: str) -> None:
    address = clinic.url + addresses(tab, clinic)[name]
    light = printed(tab, address, complete, "light")
    dark = printed(tab, address, complete, "dark")
    assert colours(light)
    assert colours(dark) == colours(light)
    assert len(dark.pages) == len(light.pages)
    paper = words("".join(sheet.extract_text() for sheet in dark.pages))
    expected = tab.locator(_AT_THE_MARGIN).filter(visible=True).all_text_contents()
    assert expected
    assert [text for text in expected if words(text) not in paper] == []
    if name.startswith("patient"):
        assert_banner_covers_nothing(tab)


def assert_banner_covers_nothing(page: Page) -> None:
    """On the screen the banner stays below the header, which paper does not have."""
    banner = page.get_by_test_id("patient-banner")
    expect(banner).to_have_css("position", "sticky")
    page.emulate_media(media="print")
    expect(banner).to_have_css("position", "static")


@pytest.mark.campaign
def test_three_dimensional_picture_has_no_dark_area_on_paper(tab: Page, clinic: Clinic) -> None:
    tab.add_init_script("localStorage.setItem('kata-scheme', 'dark')")
    tab.goto(clinic.url + addresses(tab, clinic)["session-motion"])
    frame = tab.get_by_test_id("apparatus-canvas").locator("..")
    expect(frame).to_be_visible(timeout=LONG_MS)
    expect(frame).not_to_have_css("background-image", "none")
    tab.emulate_media(media="print")
    expect(frame).to_have_css("background-image", "none")


@pytest.mark.campaign
def test_tables_of_a_report_stay_on_the_sheet(tab: Page, clinic: Clinic) -> None:
    session = addresses(tab, clinic)["session"]
    tab.goto(f"{clinic.url}/api{session}/report.html")
    expect(tab.locator("table.dense").first).to_be_visible(timeout=LONG_MS)
    beyond = tab.evaluate(
        """() => {
            const sheet = document.querySelector("h1").getBoundingClientRect().right;
            return [...document.querySelectorAll("table")].map((one) => one.getBoundingClientRect().right - sheet);
        }"""
    )
    assert max(beyond) < 1
