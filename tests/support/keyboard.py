"""Operating a page by keyboard alone."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS

_OPTIONS: Final = 30
_STOPS: Final = 150
"""More than the focusable elements of any page."""
_FOCUS: Final = "element => [element === document.activeElement, element.isConnected]"


def reach(page: Page, target: Locator) -> None:
    """Wait until the element is enabled; press Tab until it, or the chosen element of its group, has the focus."""
    expect(target).to_be_enabled()
    # The element itself: finding it again by its role after each Tab would take most of the time.
    element = target.element_handle()
    for _ in range(_STOPS):
        # One question: each costs as much time as the key.
        has_focus, is_connected = element.evaluate(_FOCUS)
        if has_focus:
            return
        if is_connected:
            page.keyboard.press("Tab")
        else:
            element = target.element_handle()
    raise AssertionError(f"the tab key does not reach {target}")


def press(page: Page, target: Locator, key: str = "Enter") -> None:
    reach(page, target)
    page.keyboard.press(key)


def write(page: Page, target: Locator, text: str) -> None:
    reach(page, target)
    page.keyboard.type(text)


def choose(page: Page, target: Locator, option: str, *, several: bool = False) -> None:
    """Choose in a list that opens. ``several``: it allows more than one choice and stays open."""
    press(page, target, "ArrowDown")
    wanted = page.get_by_role("option", name=option).first
    expect(wanted).to_be_visible(timeout=LONG_MS)
    # An opened list determines its current option in a timer, a moment later; before that, Enter does nothing.
    page.evaluate("() => new Promise(done => setTimeout(done))")
    for _ in range(_OPTIONS):
        if wanted.get_attribute("data-combobox-selected") == "true":
            break
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    if several:
        page.keyboard.press("Tab")
    expect(wanted).to_be_hidden()


def open_tab(page: Page, name: str) -> None:
    """Open a tab: the arrow keys go from one to the next."""
    wanted = page.get_by_role("tab", name=name, exact=True)
    tabs = page.get_by_role("tablist").filter(has=wanted)
    reach(page, tabs.get_by_role("tab", selected=True))
    for _ in range(tabs.get_by_role("tab").count()):
        if wanted.get_attribute("aria-selected") == "true":
            return
        page.keyboard.press("ArrowRight")
    expect(wanted).to_have_attribute("aria-selected", "true")


@contextmanager
def held(page: Page, target: Locator, key: str = "Enter") -> Iterator[None]:
    """Hold the key down during the context."""
    reach(page, target)
    page.keyboard.down(key)
    yield
    page.keyboard.up(key)
