"""Addresses of every page and its accessibility errors."""

import re
import time
from collections.abc import Iterator
from typing import Any

from playwright.sync_api import Page, Request, expect

from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.paths import ROOT

AXE = ROOT / "tests/fhir_validators/node_modules/axe-core/axe.min.js"


TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]


RULES = ["landmark-no-duplicate-main", "landmark-one-main", "page-has-heading-one", "region"]
"""Further rules: the landmarks and headings that a screen reader uses."""


PATIENT_PAGE_NAME = re.compile("^(patient|session|recording|programme|new-programme|progress|station-patient)(-|$)")
"""Names of pages whose numbers belong to a patient."""


PATIENT_TABS = ["episodes", "assessments", "recordings", "programmes", "sessions", "data"]
SESSION_TABS = ["motion", "rhythm", "numbers", "goniometer", "plan", "compare", "record"]


INCOMPLETE = ".mantine-Skeleton-root, figure[data-drawn=false], [data-testid=checking-login]"
"""What a page shows until it is complete."""


def addresses(page: Page, clinic: Clinic) -> dict[str, str]:
    """Return the address of every page by name."""

    def ask(path: str) -> Any:
        return page.request.get(f"{clinic.url}/api{path}").json()

    patient = next(item for item in ask("/patients?search=DEMO-001")["items"] if item["clinic_number"] == "DEMO-001")[
        "id"
    ]
    visit = ask(f"/patients/{patient}/sessions")["items"][0]["id"]
    recording = ask(f"/patients/{patient}/recordings")["items"][0]["id"]
    episode = ask(f"/patients/{patient}/episodes")["items"][0]["id"]
    programme = ask(f"/patients/{patient}/programmes")["items"][0]["id"]
    return {
        "home": "/",
        "outcomes": "/clinic/outcomes",
        "adherence": "/clinic/adherence",
        "usage": "/clinic/usage",
        "stops": "/clinic/stops",
        "tracking": "/clinic/tracking",
        "station": "/station",
        "station-patient": f"/station?patient={patient}",
        "stations": "/stations",
        "patients": "/patients",
        "patient": f"/patients/{patient}",
        **{f"patient-{tab}": f"/patients/{patient}?tab={tab}" for tab in PATIENT_TABS},
        "progress": f"/episodes/{episode}/progress",
        "programme": f"/programmes/{programme}",
        "new-programme": f"/patients/{patient}/programmes/new",
        "recording": f"/recordings/{recording}",
        "sessions": "/sessions",
        "session": f"/sessions/{visit}",
        **{f"session-{tab}": f"/sessions/{visit}?tab={tab}" for tab in SESSION_TABS},
        "account": "/account",
        "accounts": "/administration/accounts",
        "audit": "/administration/audit",
        "emergency-access": "/administration/emergency-access",
        "backups": "/administration/backups",
        "clinic": "/administration/clinic",
        "commissioning": "/commissioning",
        "procedure": "/commissioning?tab=procedure",
        "settings": "/commissioning?tab=settings",
        "history": "/commissioning?tab=history",
        "nowhere": "/nowhere",
    }


SIGN_IN_PAGES = {
    "sign-in-link": "/sign-in#link=expired",
    "set-up": "/set-up#secret=expired",
    "set-password": "/set-password#secret=expired",
    "openid": "/sign-in/openid",
}
"""Addresses of the pages that links open without a login."""
_REDIRECTS = {"/clinic", "/administration", "/administration/"}
_DEVELOPMENT = {"/design"}
"""Only the development server has this page."""


def missing_routes(pages: dict[str, str]) -> set[str]:
    """Return the routes of the page's router that no address of ``pages`` opens."""
    router = (ROOT / "frontend/src/app/router.tsx").read_text()
    openid = re.findall('OPENID_PATH = "(.+)"', (ROOT / "frontend/src/features/auth/openId.ts").read_text())
    declared = re.findall(r"const (\w+) = createRoute\({\s+getParentRoute: \(\) => (\w+),\s+path: (.+),", router)
    assert len(declared) == router.count("= createRoute({")
    paths = {"rootRoute": ""}
    for name, parent, path in declared:
        paths[name] = paths[parent] + (openid[0] if path == "OPENID_PATH" else path.strip('"'))
    shown = {re.split("[?#]", address)[0] for address in pages.values()}
    patterns = {path: re.compile(re.sub(r"\\\$\w+", "[^/]+", re.escape(path))) for path in paths.values()}
    found = {path for path, pattern in patterns.items() if any(map(pattern.fullmatch, shown))}
    return {*patterns} - found - _REDIRECTS - _DEVELOPMENT - {""}


_TELEPHONE_PX = 360
_REDRAWN_S = 20.0
_CUT = """() => {
    const cut = (control) => {
        const label = control.querySelector('.mantine-Button-label');
        if (label && label.scrollWidth > label.clientWidth + 1) return true;
        const {left, right} = control.getBoundingClientRect();
        for (let around = control.parentElement; around; around = around.parentElement) {
            const edges = around.getBoundingClientRect();
            const beyond = left < edges.left - 1 || right > edges.right + 1;
            const overflow = getComputedStyle(around).overflowX;
            // The user scrolls to other tabs. The open one is in view.
            if (overflow === 'auto' || overflow === 'scroll') return beyond && control.matches('[aria-selected=true]');
            if (beyond && (overflow === 'hidden' || overflow === 'clip')) return true;
        }
        return false;
    };
    const outgrown = (heading) => {
        const {paddingRight, borderRightWidth} = getComputedStyle(heading.parentElement);
        const edge = heading.parentElement.getBoundingClientRect().right - parseFloat(paddingRight) - parseFloat(borderRightWidth);
        return heading.offsetWidth > 1 && heading.getBoundingClientRect().right > edge + 1;
    };
    const found = (selector, fails) => [...document.querySelectorAll(selector)]
        .filter((element) => element.checkVisibility({visibilityProperty: true}) && fails(element))
        .map((element) => `${element.textContent} is cut`);
    return [...found('button, a[href], .mantine-SegmentedControl-label', cut), ...found('main :is(h1, h2, h3)', outgrown)];
}"""
"""Controls that are partly outside a frame that does not scroll, labels without space, an open tab out of view, and headings that are wider
than the part of the page that they are in."""
_UNREACHABLE = """() => [...document.querySelectorAll('main *')]
    .filter((area) => {
        const {overflowX, overflowY} = getComputedStyle(area);
        const scrolls = (overflow, content, frame) => ['auto', 'scroll'].includes(overflow) && content > frame + 1;
        return (scrolls(overflowX, area.scrollWidth, area.clientWidth) || scrolls(overflowY, area.scrollHeight, area.clientHeight))
            && area.checkVisibility({visibilityProperty: true});
    })
    .filter((area) => area.tabIndex < 0 && ![...area.querySelectorAll('*')].some((within) => within.tabIndex >= 0))
    .map((area) => `${area.textContent.trim().slice(0, 80)} is scrolled only by touch or mouse`)"""
"""Scrolled areas that no keyboard reaches. axe finds only those that it can prove."""


_CUT_TABLES = """() => [...document.querySelectorAll('main table')].flatMap((table) => {
    const frame = table.closest('.mantine-ScrollArea-viewport') ?? document.querySelector('main');
    const heads = table.querySelectorAll('thead th');
    const cut = table.offsetWidth > frame.clientWidth + 1 && heads.length <= MOST_COLUMNS && table.checkVisibility();
    return cut ? [`the table of ${[...heads].map((head) => head.innerText).join(', ')} is cut`] : [];
})""".replace("MOST_COLUMNS", "6")
"""Tables that are wider than their frame. A table of more columns, such as five motors, is read while it scrolls sideways."""
_BROKEN = r"""() => {
    const kept = new RegExp([
        /\d{4}年\d{1,2}月\d{1,2}日〜\d{1,2}月\d{1,2}日|\d{1,2} [A-Z][a-z]{2,3} to \d{1,2} [A-Z][a-z]{2,3} \d{4}/,
        /\d{4}年\d{1,2}月\d{1,2}日|\d{1,2}月\d{1,2}日|[−\d][\d.]*[°%]?〜[−\d][\d.]*[°%点]?/,
        /\b\d{1,2} [A-Z][a-z]{2,3} \d{4}\b|\b[A-Z][a-z]{2,3} \d{1,2}, \d{4}\b/,
        /(?<![\w.])[+−]?\d[\d.,]*[°%]? (?:to|of) [+−]?\d[\d.,]*(?![\d.,]*(?:°? ±| [A-Z]))/,
        /\b(?:Station|Motor|Take|Version) \d+\b|(?:ステーション|モータ)\d+|\S+ \[[^\][]{1,8}\]/,
    ].map(({source}) => source).join('|'), 'g');
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const found = [];
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
        if (!node.parentElement.checkVisibility({visibilityProperty: true}) || node.parentElement.closest('svg, script, style')) continue;
        const places = [...node.data].flatMap((letter, place) => letter === '\u2060' ? [] : [place]);
        const letters = places.map((place) => node.data[place]).join('').replaceAll('\u00a0', ' ');
        for (const {0: text, index} of letters.matchAll(kept)) {
            const range = document.createRange();
            range.setStart(node, places[index]);
            range.setEnd(node, places[index + text.length - 1] + 1);
            const lines = new Set([...range.getClientRects()].filter(({width}) => width > 0).map(({top}) => Math.round(top)));
            if (lines.size > 1) found.push(`${text} is on two lines`);
        }
    }
    return found;
}"""
"""Dates, ranges of numbers, and names with their numbers, that a line break divides."""


def _misfits(page: Page) -> list[str]:
    wider_px = int(page.evaluate("document.documentElement.scrollWidth - innerWidth"))
    wide = [f"{wider_px} px wider than the screen"] if wider_px > 0 else []
    return [
        *wide,
        *(str(found) for script in (_CUT, _UNREACHABLE, _CUT_TABLES, _BROKEN) for found in page.evaluate(script)),
    ]


def misfits_on_telephone(page: Page, redrawn_s: float = _REDRAWN_S) -> list[str]:
    """Return what does not fit the width of a telephone (WCAG 1.4.10 Reflow), and tables that scroll there only by touch.

    Divided dates and ranges are also those at the page's own size.

    Leave the page's size as it was. ``redrawn_s``: how long the page may take to draw its figures for the new width.
    """
    before = page.viewport_size
    assert before
    divided = [str(found) for found in page.evaluate(_BROKEN)]
    page.set_viewport_size({"width": _TELEPHONE_PX, "height": before["height"]})
    try:
        # Figures are drawn again for the new width, and the open tab is scrolled into view. ``wait_for_function`` needs an evaluation that
        # the page's policy forbids.
        until = time.monotonic() + redrawn_s
        while (found := _misfits(page)) and time.monotonic() < until:
            page.wait_for_timeout(100)
        return divided + found
    finally:
        page.set_viewport_size(before)


_QUIET_S = 0.4


class Traffic:
    """The requests of a page that are not answered. A page's load state says only once after each load that there are none."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._unanswered: set[Request] = set()
        self._last_s = time.monotonic()
        page.on("request", self._begun)
        for end in ("requestfinished", "requestfailed"):
            page.on(end, self._ended)

    def _begun(self, request: Request) -> None:
        self._unanswered.add(request)

    def _ended(self, request: Request) -> None:
        self._unanswered.discard(request)
        self._last_s = time.monotonic()

    def wait(self) -> None:
        """Wait until nothing was requested for a while.

        :raises AssertionError: when requests remain unanswered.
        """
        limit_s = time.monotonic() + LONG_MS / 1000
        while self._unanswered or time.monotonic() - self._last_s < _QUIET_S:
            assert time.monotonic() < limit_s, [request.url for request in self._unanswered]
            self._page.wait_for_timeout(50)


def opened(page: Page, clinic: Clinic, pages: dict[str, str], *, by_links: bool) -> Iterator[str]:
    """Open one page after the other, and yield the name of each when it is complete.

    ``by_links``: as a link does, without loading the scripts again.
    """
    traffic = Traffic(page)
    for number, (name, path) in enumerate(pages.items()):
        if by_links and number > 0:
            page.evaluate("path => history.pushState({}, '', path)", path)
        else:
            page.goto(clinic.url + path)
        traffic.wait()
        expect(page).to_have_url(clinic.url + path)
        expect(page.get_by_role("heading", level=1)).to_be_visible(timeout=LONG_MS)
        expect(page.locator(INCOMPLETE)).to_have_count(0, timeout=LONG_MS)
        traffic.wait()
        yield name


def wrong(page: Page, part: str = "html") -> list[str]:
    """Return the errors that axe-core finds in the page, or in the part with this CSS selector."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text())
    found = page.evaluate(
        """async ([tags, rules, part]) => {
            const kinds = Object.fromEntries(axe.getRules(tags).map((rule) => [rule.ruleId, {enabled: true}]));
            for (const rule of rules) kinds[rule] = {enabled: true};
            const results = await axe.run(part === 'html' ? document : part, {
                runOnly: {type: 'rule', values: Object.keys(kinds)}, resultTypes: ['violations'],
            });
            return results.violations.flatMap((violation) => violation.nodes.map(
                (node) => `${violation.id}: ${node.html.slice(0, 200)} ${node.failureSummary.slice(0, 300)}`));
        }""",
        [TAGS, RULES if part == "html" else [], part],
    )
    return [str(text) for text in found]
