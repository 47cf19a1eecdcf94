"""Whether Stop and other parts of the page on screen can be touched, and Stop reached by keyboard."""

from typing import Final

from playwright.sync_api import Locator, Page, expect

_COVERED: Final = """(part) => {
    const {left, top, width, height} = part.getBoundingClientRect();
    const places = [[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]];
    const covers = places
        .map(([x, y]) => document.elementFromPoint(left + x * width, top + y * height))
        .find((found) => !part.contains(found));
    return covers === undefined ? '' : covers === null ? 'off the screen' : `covered by ${covers.outerHTML.slice(0, 100)}`;
}"""
"""What a finger at the middle of a part or near its corners would touch instead."""


def untouchable_stop(page: Page) -> str:
    """Return why a finger does not reach Stop, or an empty text."""
    stop = page.locator('button[aria-keyshortcuts="Escape"]')
    return untouchable(stop.first) if stop.count() else "missing"


def untouchable(part: Locator) -> str:
    """Return what covers a part of the page, or an empty text."""
    return str(part.evaluate(_COVERED))


def tab_to_stop(page: Page, presses: int) -> None:
    """Press Tab until Stop has the focus, at most so many times."""
    stop = page.get_by_role("button", name="Stop", exact=True, include_hidden=True)
    for _ in range(presses):
        page.keyboard.press("Tab")
        if stop.evaluate("stop => stop === document.activeElement"):
            break
    expect(stop).to_be_focused()
