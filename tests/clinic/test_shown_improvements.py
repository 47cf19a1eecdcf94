"""An improvement is counted if the improvement that is shown reaches the limit."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from decimal import Decimal
from uuid import UUID

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.questionnaires.changes import meaning_of
from kata.clinic.questionnaires.definitions import SPADI
from kata.clinic.rounding import change_as_shown
from kata.clinic.statistics import derived_tables, outcomes
from kata.clinic.statistics.measures import MEASURES
from kata.clinic.statistics.schemas import LEAST_SHOWN, OutcomeChange
from kata.clinic.statistics.usage import Span
from kata.database.engine import Database
from kata.reporting.phrases import Phrases
from tests.support.databases import upgraded_file
from tests.support.treatment import treat

IMPORTANT, DETECTABLE = MEASURES["spadi"].important or 0.0, MEASURES["spadi"].detectable or 0.0
ALL_TIME = Span(datetime(2000, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC))
Totals = tuple[float, float]


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Session, list[UUID]]]:
    """A transaction with the fewest patients that are shown, each with two assessments."""
    database = Database(upgraded_file(tmp_path_factory.mktemp("improvements") / "kata.db"))
    with database.write() as session:
        yield session, [treat(session, sessions=0).episode_id for _ in range(LEAST_SHOWN)]
    database.close()


def totals_near(limit: float) -> st.SearchStrategy[Totals]:
    """Return first and last totals whose difference is within 0.2 of a limit."""
    return st.tuples(st.floats(20, 100), st.floats(-0.2, 0.2)).map(lambda near: (near[0], near[0] - limit + near[1]))


@settings(deadline=None)
@given(
    st.lists(
        st.one_of(totals_near(IMPORTANT), totals_near(DETECTABLE), st.tuples(st.floats(0, 100), st.floats(0, 100))),
        min_size=LEAST_SHOWN,
        max_size=LEAST_SHOWN,
    )
)
def test_counted_improvements_are_those_that_are_shown(
    clinic: tuple[Session, list[UUID]], totals: list[Totals]
) -> None:
    change = outcome_of(*clinic, totals)
    shown = [printed_improvement(*pair) for pair in totals]
    assert change.important and change.detectable
    assert round(change.important.value * len(totals)) == sum(fall >= IMPORTANT for fall in shown)
    assert round(change.detectable.value * len(totals)) == sum(fall > DETECTABLE for fall in shown)
    assert (change.weeks_to_important is not None) is all(fall >= IMPORTANT for fall in shown)


def test_an_improvement_shown_at_the_limit_counts(clinic: tuple[Session, list[UUID]]) -> None:
    """79.76 and 66.84 are shown as 79.8 and 66.8: a fall by 13.0, although the exact one is 12.92."""
    change = outcome_of(*clinic, [(79.76, 66.84)] * LEAST_SHOWN)
    assert change.important
    assert change.important.value == 1.0
    assert change.weeks_to_important is not None


@given(st.floats(0, 100), st.floats(0, 100))
def test_verdict_of_a_patient_agrees_with_the_count(first: float, last: float) -> None:
    fall = printed_improvement(first, last)
    meaning = meaning_of(SPADI, change_as_shown(first, last))
    assert (meaning == "better") is (fall > DETECTABLE)


def outcome_of(session: Session, episodes: list[UUID], totals: Sequence[Totals]) -> OutcomeChange:
    """Store these totals, one pair for each episode, and return how the SPADI of all patients changed."""
    for episode_id, pair in zip(episodes, totals, strict=True):
        assessments = select(AssessmentRow).where(AssessmentRow.episode_id == episode_id)
        for row, total in zip(session.scalars(assessments.order_by(AssessmentRow.assessed_at)), pair, strict=True):
            row.spadi_score = total
    session.flush()
    derived_tables.refresh(session, set(), set(), set(episodes))
    everyone = outcomes.outcomes(session, ALL_TIME).groups[0]
    return next(change for change in everyone.changes if change.measure == "spadi")


def printed_improvement(first: float, last: float) -> Decimal:
    """Return the first total minus the last one, as a reader of the printed numbers finds it."""
    before, after = (Decimal(Phrases("en", "").number(total, 1)) for total in (first, last))
    return before - after
