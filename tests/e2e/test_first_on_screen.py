"""What a therapist needs next is on the screen without scrolling."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import pytest
from playwright.sync_api import Locator, Page, Route, ViewportSize, expect

from tests.support.accessibility import INCOMPLETE, addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import wait_until_idle
from tests.support.shown_pages import SIZES
from tests.support.shown_station import ShownStation
from tests.support.stop_in_reach import untouchable

pytestmark = pytest.mark.shared_clinic("invented")

_CONTROLS: Final = {
    "Pain after": ("Worst pain during the session: 0", "Pain after: 10", "Skip: not asked"),
    "Checklist": ("Skip to pain score",),
    "Pain before": ("Pain before: 0", "Pain before: 10", "Skip: not asked"),
    "Note and signature": ("End the session",),
}
"""Buttons of each step of a session whose checklist is open."""


@pytest.mark.parametrize("size", ["desktop", "tablet"])
def test_step_and_live_view_are_on_the_screen(tab: Page, clinic: Clinic, size: str) -> None:
    """A step that was opened once took the live view off the screen. After a reload the step was below the screen.

    The checklist is longer than a tablet. The live view comes after it, because it once covered the checks.
    """
    width, height = SIZES[size]
    tab.set_viewport_size(ViewportSize(width=width, height=height))
    with ShownStation(clinic) as station:
        session, _ = station.begin_session("DEMO-001")
        tab.goto(f"{clinic.url}/station?patient={session['patient']['id']}")
        wizard = tab.get_by_role("region", name="Session")
        try:
            for step, controls in _CONTROLS.items():
                _open(wizard, step)
                _assert_on_screen(tab, wizard, step, controls, _live_view(tab, size, step))
            live_view = _live_view(tab, size, "Checklist")
            _open(wizard, "Checklist")
            _assert_on_screen(tab, wizard, "Checklist", _CONTROLS["Checklist"], live_view)
            opened_at = wizard.bounding_box()
            tab.reload()
            _assert_on_screen(tab, wizard, "Checklist", _CONTROLS["Checklist"], live_view)
            assert wizard.bounding_box() == opened_at
            expect(tab.locator("body")).to_be_focused()
        finally:
            station.end_session(session)


@contextmanager
def _session_after_a_playback(
    tab: Page, clinic: Clinic, size: tuple[int, int]
) -> Iterator[tuple[ShownStation, Any, Any, Locator]]:
    """Show a session at its last step. Yield the station, session, recording and the steps. The checks of a session are made already."""
    tab.set_viewport_size(ViewportSize(width=size[0], height=size[1]))
    with ShownStation(clinic) as station:
        # The other patient stays due: a later test reads the list.
        session, recording = station.begin_session("DEMO-002")
        station.play(session, recording)
        station.press_estop()
        station.release_estop()
        tab.goto(f"{clinic.url}/station?patient={session['patient']['id']}")
        wizard = tab.get_by_role("region", name="Session")
        try:
            _open(wizard, "Pain after")
            yield station, session, recording, wizard
        finally:
            station.press_estop()
            station.release_estop()
            station.end_session(session)


def test_nothing_covers_the_angles_beside_a_short_panel(tab: Page, clinic: Clinic) -> None:
    """The cards of the second row once covered the angles of motors 4 and 5 on a scrolled page."""
    with _session_after_a_playback(tab, clinic, SIZES["desktop"]) as (station, session, recording, wizard):
        station.load(session, recording)
        expect(wizard.get_by_role("button", name="Move to the start")).to_be_visible(timeout=LONG_MS)
        expect(tab.locator(INCOMPLETE)).to_have_count(0, timeout=LONG_MS)
        angles = tab.get_by_role("region", name="Angles")
        expect(angles).to_be_in_viewport(ratio=1)
        assert untouchable(angles) == ""


@pytest.mark.parametrize("size", ["desktop", "tablet", "telephone"])
def test_station_page_names_its_station(tab: Page, clinic: Clinic, size: str) -> None:
    """The heading was once outside the screen."""
    width, height = SIZES[size]
    tab.set_viewport_size(ViewportSize(width=width, height=height))
    tab.goto(f"{clinic.url}/station")
    expect(tab.get_by_role("heading", level=1, name="Station 1")).to_be_in_viewport(ratio=1, timeout=LONG_MS)


@pytest.mark.parametrize("size", [(768, 1024), SIZES["tablet"]])
def test_pause_stays_on_a_scrolled_tablet(tab: Page, clinic: Clinic, size: tuple[int, int]) -> None:
    """Parts above the controls disappear when a motion is loaded. On a page that a step had scrolled, Pause was once above the screen."""
    with _session_after_a_playback(tab, clinic, size) as (station, session, recording, wizard):
        station.play(session, recording)
        pause = wizard.get_by_role("button", name="Pause")
        expect(pause).to_be_in_viewport(ratio=1, timeout=LONG_MS)
        assert untouchable(pause) == ""


@pytest.mark.parametrize("size", [(768, 1024), SIZES["tablet"]])
def test_loading_a_motion_keeps_the_order_of_the_page(tab: Page, clinic: Clinic, size: tuple[int, int]) -> None:
    """A loaded motion once moved the live view from above the controls to below them."""
    tab.set_viewport_size(ViewportSize(width=size[0], height=size[1]))
    wizard = tab.get_by_role("region", name="Session")
    live = tab.get_by_role("region", name="Arm and apparatus")

    def is_live_below() -> bool:
        controls, view = wizard.bounding_box(), live.bounding_box()
        assert controls and view
        return view["y"] > controls["y"]

    with ShownStation(clinic) as station:
        session, recording = station.begin_session("DEMO-002")
        tab.goto(f"{clinic.url}/station?patient={session['patient']['id']}")
        try:
            expect(wizard).to_be_visible(timeout=LONG_MS)
            before = is_live_below()
            station.play(session, recording)
            expect(wizard.get_by_role("button", name="Pause")).to_be_visible(timeout=LONG_MS)
            assert is_live_below() == before
            station.press_estop()
        finally:
            station.release_estop()
            station.end_session(session)


def _live_view(tab: Page, size: str, step: str) -> list[Locator]:
    """Return the parts of the live view that are on the screen beside or below a step."""
    if (size, step) == ("tablet", "Checklist"):
        return []
    return [tab.get_by_role("region", name=name) for name in ("Arm and apparatus", "Angles")]


def _assert_on_screen(
    tab: Page, wizard: Locator, step: str, controls: tuple[str, ...], live_view: list[Locator]
) -> None:
    """Assert that a finger reaches the step's controls and Stop, and that nothing covers the live view and the state."""
    current = wizard.get_by_role("navigation").get_by_role("button", name=re.compile(step))
    expect(current).to_have_attribute("aria-current", "step", timeout=LONG_MS)
    parts = [
        current,
        *(wizard.get_by_role("button", name=name) for name in controls),
        *live_view,
        *(tab.locator("header").get_by_test_id(name) for name in ("estop", "mode")),
        tab.get_by_role("button", name="Stop", exact=True),
    ]
    if step.startswith("Note"):
        parts.append(wizard.get_by_role("textbox"))
    for part in parts:
        expect(part, step).to_be_in_viewport(ratio=1, timeout=LONG_MS)
    assert {str(part): why for part in parts if (why := untouchable(part))} == {}, step


def _open(wizard: Locator, step: str) -> None:
    shown = wizard.get_by_role("navigation").get_by_role("button", name=re.compile(step))
    shown.click(timeout=LONG_MS)
    expect(shown).to_have_attribute("aria-current", "step")


def test_result_of_a_session_is_on_a_telephones_screen(tab: Page, clinic: Clinic) -> None:
    """Banner, title and the note of the range once took the first screen. A contraindication stays on it, too."""
    tab.set_viewport_size(ViewportSize(width=360, height=740))
    pages = addresses(tab, clinic)
    tab.route("**/banner", _add_warning)
    tab.goto(clinic.url + pages["session"])
    wait_until_idle(tab)
    expect(tab.get_by_test_id("contraindications")).to_be_visible(timeout=LONG_MS)
    parts = [
        tab.get_by_test_id("contraindications"),
        tab.get_by_role("heading", level=1),
        tab.get_by_test_id("verdict"),
        *(tab.get_by_test_id(f"result-{name}").locator("[data-long]") for name in ("pain", "range", "worst")),
    ]
    for part in parts:
        expect(part).to_be_in_viewport(ratio=1, timeout=LONG_MS)
    assert {str(part): why for part in parts if (why := untouchable(part))} == {}


def _add_warning(route: Route) -> None:
    """Answer with the banner of a patient who has osteoporosis."""
    answer = route.fetch()
    warning = {
        "id": "1", "code": "osteoporosis", "name": "Osteoporosis", "effect": "warn", "side": None, "note": "",
        "signed_off_at": None, "signed_off_by": "", "stops_motion": False,
    }  # fmt: skip
    route.fulfill(response=answer, json=answer.json() | {"contraindications": [warning]})


def test_due_patients_and_open_sessions_come_first_on_a_telephone(tab: Page, clinic: Clinic) -> None:
    """The tiles of an administrator once took several screens before them."""
    tab.set_viewport_size(ViewportSize(width=360, height=740))
    tab.goto(clinic.url)
    due = tab.get_by_role("region", name=re.compile("Due today"))
    expect(due.get_by_test_id("due").first).to_be_in_viewport(timeout=LONG_MS)
    with ShownStation(clinic) as station:
        session, _ = station.begin_session("DEMO-001")
        try:
            tab.reload()
            expect(tab.get_by_role("link", name=session["patient"]["name"]).first).to_be_in_viewport(timeout=LONG_MS)
            expect(tab.get_by_test_id("open")).to_be_in_viewport()
        finally:
            station.end_session(session)
