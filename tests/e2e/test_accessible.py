"""axe-core checks every page of a clinic with invented patients against WCAG 2.2 AA.

This module checks every second page in the light scheme in English, from the first one; test_japanese.py checks the others in the dark
scheme in Japanese, and the words of all. The campaign checks every page in both.
"""

import json
import re
from itertools import islice
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, Page, expect

from kata.auth.login_session import COOKIE
from tests.support.accessibility import (
    PATIENT_PAGE_NAME,
    SIGN_IN_PAGES,
    addresses,
    misfits_on_telephone,
    missing_routes,
    opened,
    wrong,
)
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import acknowledge, open_station, wait_until_idle
from tests.support.page_dialogs import DIALOGS, OPENED_BY, OPENED_ELSEWHERE, files_with_dialogs, opened_dialogs
from tests.support.units import bare_numbers

pytestmark = [pytest.mark.shared_clinic("invented"), pytest.mark.three_dimensions]

_ALL: Final = [pytest.param(scheme, 1, marks=pytest.mark.campaign) for scheme in ("light", "dark")]


class Findings:
    """Problems of the pages, by the name of the page or dialog."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.found: dict[str, list[str]] = {}

    def look(self, name: str, part: str = "html") -> None:
        """axe checks the page or a part of it, and each number has a unit."""
        if wrongs := [*bare_numbers(self._page), *wrong(self._page, part)]:
            self.found[name] = wrongs

    def look_at_dialogs(self, name: str) -> None:
        """Open each dialog of the page in turn."""
        for button, _ in opened_dialogs(self._page, name, "en"):
            self.look(f"{name}: {button}", "[role=dialog]")

    def look_at_opened_parts(self, name: str) -> None:
        """Open the form of an assessment, and every table of the progress page."""
        if name == "patient-assessments":
            self._page.get_by_role("button", name="New assessment").click()
            expect(self._page.get_by_role("button", name="Save assessment")).to_be_visible(timeout=LONG_MS)
            self.look("New assessment", "main")
        if name == "progress":
            closed = self._page.get_by_role("button", name="Show numbers")
            expect(closed).to_have_count(5)
            for _ in range(5):
                closed.first.click()
            expect(self._page.get_by_role("table")).to_have_count(5)
            self.look("progress with its tables", "main")


@pytest.mark.timeout(600)
@pytest.mark.parametrize(("scheme", "every"), [("light", 2), *_ALL])
def test_every_page_is_accessible(tab: Page, clinic: Clinic, scheme: Any, every: int) -> None:
    """axe checks every second or every page and all dialogs.

    The page fits a telephone, each number has a unit, and a patient's page names the shoulder.
    """
    tab.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    findings = Findings(tab)
    every_page = addresses(tab, clinic)
    assert missing_routes(every_page | SIGN_IN_PAGES) == set()
    chosen = {*islice(every_page, None, None, every), *DIALOGS, "patient-assessments", "progress"}
    pages = {name: address for name, address in every_page.items() if name in chosen}
    for name in opened(tab, clinic, pages, by_links=every > 1):
        expect(tab.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
        wait_until_idle(tab)
        if name in ("station", "station-patient"):
            expect(tab.get_by_role("region", name="Simulated apparatus")).to_be_visible(timeout=LONG_MS)
        findings.look(name)
        if misfits := misfits_on_telephone(tab):
            findings.found[f"{name} on a telephone"] = misfits
        if PATIENT_PAGE_NAME.match(name):
            expect(tab.get_by_test_id("patient-banner")).to_contain_text(re.compile("(Left|Right) shoulder"))
        findings.look_at_dialogs(name)
        findings.look_at_opened_parts(name)
    assert findings.found == {}, json.dumps(findings.found, ensure_ascii=False, indent=1)


def test_every_dialog_is_opened_by_a_walk_or_another_test() -> None:
    assert files_with_dialogs() == OPENED_BY.keys() | OPENED_ELSEWHERE.keys()
    assert {key for keys in OPENED_BY.values() for key in keys} == {key for keys in DIALOGS.values() for key in keys}


def test_numbers_in_printed_reports_have_a_unit(page: Page, clinic: Clinic) -> None:
    pages = addresses(page, clinic)
    for record in (pages["session"], pages["progress"].partition("/progress")[0]):
        page.goto(f"{clinic.url}/api{record}/report.html?language=en")
        expect(page.get_by_role("heading", level=1)).to_be_visible()
        expect(page.get_by_text(re.compile("Right|Left")).first).to_be_visible()
        assert bare_numbers(page) == [], record


def test_walk_finds_a_number_without_a_unit(browser: Browser) -> None:
    page = browser.new_page()
    page.set_content(
        """<main><p>Flexion 95</p><p>Flexion 96°</p><p>3 of 10 repetitions</p><p>25 Nov 2026, 10:30</p>
        <p>A change of 17 points (Roe and Doe 2009, Arthritis Rheum 61(5), 623-632; Poe et al. 2008, BMC 9, 161) and 92</p>
        <table><thead><tr><th>Motion</th><th>Angle, °</th><th>Result</th></tr></thead>
        <tbody><tr><th>Lift</th><td>97</td><td>98</td></tr><tr><th>Play, °</th><td></td><td>90</td></tr></tbody></table>
        <div role="group" aria-labelledby="level"><b id="level">Resistance level</b><div>89</div></div>
        <ol><li>Lift to 94</li></ol><nav><button><b>1</b> Play</button>Angle 93</nav><p>Playbacks that were stopped: 0.</p><h3>Pain, 0&nbsp;to&nbsp;10</h3><table><tbody><tr><td>4</td></tr></tbody></table>
        <p id="caption">Angles, °</p><table aria-labelledby="caption"><tbody><tr><td>5</td></tr></tbody></table>
        <figure><figcaption>Motor 1, ° over s</figcaption><svg width="9" height="9"><text y="9">15</text></svg></figure>
        <figure><figcaption>Motor 1</figcaption><svg width="9" height="9"><text y="9">16</text></svg></figure>
        <div class="js-plotly-plot"><span class="xtick">17</span><span class="ytitle">Angle, °</span></div>
        <div class="js-plotly-plot"><span class="xtick">18</span><span class="ytitle">Angle</span></div></main>
        <div role="dialog"><p>Level 12 of 25</p><p>Flexion 91</p><p>Motors 3 and 4</p></div>"""
    )
    found = bare_numbers(page)
    assert found[0] == 'a figure with the titles "Angle"'
    assert [problem.split(" ")[0] for problem in found[1:]] == ["95", "92", "98", "94", "93", "16", "91"]


def test_walk_reads_the_axes_of_a_drawn_figure(browser: Browser) -> None:
    """The ticks of each axis need a unit, not only those of one of the figure's axes."""
    page = browser.new_page()
    page.set_content('<main><div class="js-plotly-plot"></div></main>')
    layout: dict[str, Any] = {
        "xaxis": {"domain": [0, 0.4], "title": {"text": ""}},
        "xaxis2": {"domain": [0, 0.4], "title": {"text": "Week"}},
        "xaxis3": {"domain": [0.6, 1], "title": {"text": ""}, "ticksuffix": "%"},
        "yaxis": {"domain": [0.6, 1], "title": {"text": ""}},
        "yaxis2": {"domain": [0, 0.4], "title": {"text": ""}},
        "annotations": [{"text": "Flexion, °", "y": 1}, {"text": "Extension", "y": 0.4}],
    }
    page.evaluate("(layout) => { document.querySelector('.js-plotly-plot')._fullLayout = layout; }", layout)
    assert bare_numbers(page) == ['an axis yaxis2 with the titles " |  | Extension"']


def test_walk_finds_a_japanese_number_without_a_unit(browser: Browser) -> None:
    page = browser.new_page()
    page.set_content(
        """<main><p>屈曲 95</p><p>屈曲 96°、外転97度</p><p>10回中3回</p><p>2026年11月25日 10:30</p><p>モータ3</p><p>収録2</p><p>手順2／6</p><p>54.5 → 44.1点（100点満点）</p>
        <h3>痛み（0〜10）</h3><table><thead><tr><th>初回</th></tr></thead><tbody><tr><td>4</td></tr></tbody></table></main>"""
    )
    assert bare_numbers(page, "ja") == ['95 in "屈曲 95"']


def test_walk_finds_a_scrolled_area_that_no_keyboard_reaches(browser: Browser) -> None:
    page = browser.new_page()
    wide = '<p style="width: 2000px; margin: 0">Wide</p>'
    page.set_content(
        f"""<main><div style="overflow-x: auto">Touch {wide}</div><div style="overflow: scroll" tabindex="0">Stop {wide}</div>
        <div style="overflow-x: auto"><button>Press</button>{wide}</div><div style="overflow: auto">Narrow</div></main>"""
    )
    # Nothing on this page is drawn again.
    assert misfits_on_telephone(page, redrawn_s=0.0) == ["Touch Wide is scrolled only by touch or mouse"]


def test_walk_finds_a_divided_range_at_both_sizes(browser: Browser) -> None:
    page = browser.new_page()
    narrow = '<p style="width: 1em">'
    page.set_content(
        f"""<main>{narrow}7 to 8</p>{narrow}7&nbsp;of&nbsp;8 to</p>{narrow}3&nbsp;Nov&nbsp;2026 to 5&nbsp;Nov&nbsp;2026</p>
        <p style="width: 30vw; font-size: 20px">On the screen of a telephone Station 1</p></main>"""
    )
    assert misfits_on_telephone(page, redrawn_s=0.0) == [
        "7 to 8 is on two lines",
        "7 to 8 is on two lines",
    ]


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.campaign)])
def test_alarms_and_the_door_can_be_read_by_everybody(page: Page, clinic: Clinic, scheme: Any) -> None:
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    found: dict[str, list[str]] = {}

    def look(name: str) -> None:
        if violations := [*wrong(page), *misfits_on_telephone(page)]:
            found[name] = violations

    open_station(page)
    page.get_by_role("button", name="Press the e-stop switch").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "pressed")
    expect(page.get_by_test_id("stop-banner")).to_be_visible()
    look("stopped")
    page.get_by_role("link", name="Patients", exact=True).click()
    expect(page.get_by_role("heading", name="Patients")).to_be_visible()
    look("stopped-elsewhere")
    page.get_by_role("link", name="Station", exact=True).click()
    page.get_by_role("button", name="Release the e-stop switch").click()
    expect(page.get_by_test_id("estop")).to_have_attribute("data-state", "released")
    look("released")
    acknowledge(page)
    page.context.clear_cookies(name=COOKIE)
    page.goto(clinic.url)
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    look("door")
    for name, address in SIGN_IN_PAGES.items():
        page.goto(clinic.url + address)
        expect(page.get_by_role("heading", level=1)).to_be_visible(timeout=LONG_MS)
        page.wait_for_load_state("networkidle")
        look(name)
    assert found == {}
