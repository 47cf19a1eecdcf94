"""A shown change is the difference of the shown numbers."""

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.clinic.rounding import as_shown, change_as_shown
from kata.reporting.phrases import Phrases

_TOTALS = st.floats(0, 100)


@pytest.mark.parametrize(
    ("first", "last", "change"), [(79.769, 44.14, "−35.7"), (44.25, 52.25, "+8.0"), (0.04, 0.06, "+0.1"), (3, 3, "0.0")]
)
def test_report_prints_the_difference_of_the_printed_totals(first: float, last: float, change: str) -> None:
    """A report once printed 79.8, 44.1 and −35.6."""
    assert Phrases("en", "").change(first, last, 1) == change


@given(_TOTALS, _TOTALS, st.integers(0, 2))
def test_printed_numbers_differ_by_the_printed_change(first: float, last: float, digits: int) -> None:
    phrases = Phrases("en", "")
    before, after = (Decimal(phrases.number(value, digits)) for value in (first, last))
    assert Decimal(phrases.change(first, last, digits).replace("−", "-")) == after - before


def test_half_a_step_is_rounded_up_as_on_the_page() -> None:
    """The SPADI's total has eighths: the page showed 44.3 where the report printed 44.2."""
    assert [as_shown(value) for value in (44.25, -44.25, 44.75, 44.15)] == [44.3, -44.3, 44.8, 44.1]
    assert change_as_shown(44.25, 44.75) == 0.5
