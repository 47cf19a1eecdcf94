"""An idle page writes nothing into the audit trail: its timers refresh what it shows, and a refresh is not a view.

The campaign looks at every page, as a user of each role.
"""

from collections.abc import Iterator
from typing import Any, Final

import pytest
from playwright.sync_api import APIRequestContext, Browser, Page, Playwright, expect

from kata.actor import Role
from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from tests.support.accessibility import addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.invented_clinic import invented_file
from tests.support.login import signed_in

ROLES: Final[tuple[Role, ...]] = ("administrator", "therapist", "viewer", "technician")
_EVERY_VIEW: Final = """
from kata.audit import deduplication
deduplication.WINDOW_S = 0.0
from kata.__main__ import main
main()
"""
"""The service, recording a view that repeats another one within a minute, too."""

_QUICK_TIMERS: Final = """
    const slow_ms = 5_000, least_ms = 200;
    const start = window.setInterval.bind(window), end = window.clearInterval.bind(window);
    // What runs at intervals, and how often each has run since a new address was last requested or answered.
    const running = new Map();
    const ran = new Map();
    // How often each interval runs in quick succession, and 0 before and after.
    let quick = 0;
    const together = (ms) => [...running.values()].filter((other) => other === ms).length;
    window.setInterval = (run, ms, ...given) => {
        if (ms < slow_ms) return start(run, ms, ...given);
        let due = performance.now() + ms;
        const timer = start(() => {
            if (quick ? (ran.get(ms) ?? 0) >= quick * together(ms) : performance.now() < due) return;
            due = performance.now() + ms;
            ran.set(ms, (ran.get(ms) ?? 0) + 1);
            run(...given);
        }, Math.max(least_ms, ms / 1000));
        running.set(timer, ms);
        return timer;
    };
    window.clearInterval = (timer) => {
        running.delete(timer);
        end(timer);
    };
    const requested = new Set();
    let unanswered = 0;
    const send = window.fetch.bind(window);
    window.fetch = (request, ...given) => {
        const address = request.url ?? String(request);
        if (requested.has(address)) return send(request, ...given);
        requested.add(address);
        unanswered += 1;
        return send(request, ...given).finally(() => {
            unanswered -= 1;
            ran.clear();
        });
    };
    window.standIdle = (times) => new Promise((done) => {
        quick = times;
        ran.clear();
        const look = start(() => {
            if (unanswered > 0 || running.size === 0 || [...running.values()].some((ms) => (ran.get(ms) ?? 0) < times)) return;
            end(look);
            quick = 0;
            done();
        }, least_ms);
    });
"""
"""While a page stands idle, timers of 5 s and more run a few times every fifth of a second."""
_TABS: Final = 4
"""Pages that stand idle at the same time: each waits for its timers, not for a processor."""


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Clinic, dict[str, str]]]:
    """Return a clinic with invented patients, and the cookie of a user of each role."""
    folder = tmp_path_factory.mktemp("kata")
    database = Database(invented_file(folder / "kata.db"))
    cookies: dict[str, str] = {role: signed_in(database, role) for role in ROLES}
    database.close()
    clinic = Clinic(folder, program=("-c", _EVERY_VIEW))
    try:
        yield clinic, cookies
    finally:
        clinic.close()


@pytest.fixture
def trail(playwright: Playwright, clinic: tuple[Clinic, dict[str, str]]) -> Iterator[APIRequestContext]:
    """Return an administrator's API, who watches the trail."""
    cookie = f"{COOKIE}={clinic[0].cookie}"
    context = playwright.request.new_context(base_url=clinic[0].url, extra_http_headers={"cookie": cookie})
    yield context
    context.dispose()


def rows_of(trail: APIRequestContext, account_id: str) -> dict[int, str]:
    """Return the actions of a user's audit rows by number. All rows before this call are in the answer."""

    def ask(**wanted: Any) -> list[dict[str, Any]]:
        items: list[dict[str, Any]] = trail.get("/api/audit", params={"limit": 200, **wanted}).json()["items"]
        return items

    watching = trail.get("/api/me").json()["account_id"]
    before = max((row["number"] for row in ask(account_id=watching)), default=0)
    # Rows are delivered in their order, so the row of an earlier question of the watching user comes after them.
    while max(row["number"] for row in ask(account_id=watching)) <= before:
        pass
    return {row["number"]: row["action"] for row in ask(account_id=account_id)}


def stand_idle(pages: list[Page]) -> None:
    """Wait until every timer of each page has run three times since the page last requested something new and got its answer."""
    for page in pages:
        page.evaluate("() => { window.idle = standIdle(3); }")
    for page in pages:
        page.evaluate("() => window.idle")


@pytest.mark.campaign
@pytest.mark.timeout(900)
@pytest.mark.parametrize("role", ROLES)
def test_idle_page_writes_no_audit_entry(
    browser_without_3d: Browser,
    clinic: tuple[Clinic, dict[str, str]],
    trail: APIRequestContext,
    role: Role,
) -> None:
    service, cookies = clinic
    context = browser_without_3d.new_context(locale="en-GB")
    context.add_init_script(_QUICK_TIMERS)
    context.add_cookies([{"name": COOKIE, "value": cookies["administrator"], "url": service.url}])
    tabs = [context.new_page() for _ in range(_TABS)]
    pages = [*addresses(tabs[0], service).items()]
    context.add_cookies([{"name": COOKIE, "value": cookies[role], "url": service.url}])
    account_id = tabs[0].request.get(f"{service.url}/api/me").json()["account_id"]
    written: dict[str, list[str]] = {}
    for begin in range(0, len(pages), _TABS):
        shown = dict(pages[begin : begin + _TABS])
        for tab, address in zip(tabs, shown.values(), strict=False):
            tab.goto(service.url + address, wait_until="commit")
        for tab in tabs:
            tab.wait_for_load_state("networkidle")
            expect(tab.get_by_role("heading", level=1)).to_be_visible(timeout=LONG_MS)
            expect(tab.locator(".mantine-Skeleton-root")).to_have_count(0, timeout=LONG_MS)
            assert tab.evaluate("document.visibilityState") == "visible", "a hidden page refreshes nothing"
        stand_idle(tabs)
        opened = rows_of(trail, account_id)
        stand_idle(tabs)
        if new := [action for number, action in rows_of(trail, account_id).items() if number not in opened]:
            written[" or ".join(shown)] = new
    context.close()
    assert written == {}
