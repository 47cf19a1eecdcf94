"""The names of lines are beside their ends, and never over each other."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.clinic.progress import line_names
from kata.clinic.progress.line_names import LineName, apart
from kata.plotting import colours

LINE_COLOURS = (
    colours.INDIGO, colours.ORANGE, colours.GREEN, colours.VIOLET, colours.BROWN, colours.SLATE, colours.PALE_GREEN,
)  # fmt: skip


@given(st.lists(st.floats(0, 10), min_size=1, max_size=7).map(sorted))
def test_names_are_apart_and_within_the_panel(values: list[float]) -> None:
    places = apart(values, 1.0, (0.0, 10.0))
    assert all(after - before >= 1.0 - 1e-9 for before, after in pairwise(places))
    assert places[0] >= -1e-9 and places[-1] <= 10.0 + 1e-9


def test_names_of_distant_lines_are_at_their_lines() -> None:
    assert apart([1.0, 4.0, 9.0], 1.0, (0.0, 10.0)) == [1.0, 4.0, 9.0]


def test_equal_lines_share_the_room_around_them() -> None:
    assert apart([5.0, 5.0, 5.0], 1.0, (0.0, 10.0)) == pytest.approx([4.0, 5.0, 6.0])


def test_name_of_two_lines_is_between_them() -> None:
    [name] = line_names.beside([LineName("Other side", (160.0, 164.0))], (0.0, 180.0), 200)
    assert (name["y"], name["yref"], name["xref"]) == (162.0, "y", "x domain")


@pytest.mark.parametrize("colour", LINE_COLOURS)
def test_lines_differ_enough_from_white_paper(colour: str) -> None:
    """Lines of reference were faint: they were drawn with seven tenths of their colour."""
    assert 1.05 / (luminance(colour) + 0.05) >= 3


def luminance(colour: str) -> float:
    """Return the relative luminance of a colour such as #1971c2 (WCAG 2)."""
    parts = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
