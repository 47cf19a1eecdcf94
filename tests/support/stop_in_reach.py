"""Whether Stop can be touched and reached by keyboard on the page on screen."""

from typing import Final

from playwright.sync_api import Page, expect

_COVERED: Final = """() => {
    const stop = document.querySelector('button[aria-keyshortcuts="Escape"]');
    if (!stop) return 'missing';
    const {left, top, width, height} = stop.getBoundingClientRect();
    const places = [[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]];
    const covers = places
        .map(([x, y]) => document.elementFromPoint(left + x * width, top + y * height))
        .find((found) => !stop.contains(found));
    return covers === undefined ? '' : covers === null ? 'off the screen' : `covered by ${covers.outerHTML.slice(0, 100)}`;
}"""
"""What a finger at the middle of Stop or near its corners would touch instead."""


def untouchable_stop(page: Page) -> str:
    """Return why a finger does not reach Stop, or an empty text."""
    return str(page.evaluate(_COVERED))


def tab_to_stop(page: Page, presses: int) -> None:
    """Press Tab until Stop has the focus, at most so many times."""
    stop = page.get_by_role("button", name="Stop", exact=True, include_hidden=True)
    for _ in range(presses):
        page.keyboard.press("Tab")
        if stop.evaluate("stop => stop === document.activeElement"):
            break
    expect(stop).to_be_focused()
