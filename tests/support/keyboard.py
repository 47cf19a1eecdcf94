"""Operating a page by keyboard alone."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS

_OPTIONS: Final = 30
_STOPS: Final = 150
"""More than any page has places for the focus: once around, and it would have been met."""


def reach(page: Page, target: Locator) -> None:
    """Go by the tab key until it, or the chosen one of its group, has the focus; wait first until it can be worked with."""
    expect(target).to_be_enabled()
    for _ in range(_STOPS):
        if target.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"the tab key does not reach {target}")


def press(page: Page, target: Locator, key: str = "Enter") -> None:
    reach(page, target)
    page.keyboard.press(key)


def write(page: Page, target: Locator, text: str) -> None:
    reach(page, target)
    page.keyboard.type(text)


def choose(page: Page, target: Locator, option: str, *, several: bool = False) -> None:
    """In a list that opens. ``several``: more than one may be chosen, and it stays open until one goes on."""
    press(page, target, "ArrowDown")
    wanted = page.get_by_role("option", name=option).first
    expect(wanted).to_be_visible(timeout=LONG_MS)
    # A list that has opened works out a moment later, in timers, at which option it stands: sooner than any hand, Enter says
    # nothing to it.
    page.evaluate("() => new Promise(done => setTimeout(done))")
    for _ in range(_OPTIONS):
        if wanted.get_attribute("data-combobox-selected") == "true":
            break
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    if several:
        page.keyboard.press("Tab")
    expect(wanted).to_be_hidden()


@contextmanager
def held(page: Page, target: Locator, key: str = "Enter") -> Iterator[None]:
    """The key stays down for as long as the context lasts."""
    reach(page, target)
    page.keyboard.down(key)
    yield
    page.keyboard.up(key)
