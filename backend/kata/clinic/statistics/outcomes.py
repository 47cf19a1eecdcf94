"""Outcomes of the treatment: change of each measure from the first to the last assessment, by stage and by programme.

Records of restricted patients are counted, because a figure names no patient. Small groups are hidden. If a hidden group could be computed
from the total, the next smallest group of the same kind is also hidden.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from datetime import timedelta
from typing import Any, Final, Literal
from uuid import UUID

import numpy as np
from sqlalchemy import Label, String, cast, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.questionnaires.changes import as_shown
from kata.clinic.statistics import intervals
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.measures import MEASURES
from kata.clinic.statistics.schemas import (
    LEAST_SHOWN,
    Estimate,
    OutcomeChange,
    OutcomeGroup,
    OutcomeMeasure,
    Outcomes,
    ProgrammeAdherence,
)
from kata.clinic.statistics.tables import EpisodeOutcomeRow
from kata.clinic.statistics.usage import Span

_WEEK: Final = timedelta(weeks=1)
_STAGES: Final = ("freezing", "frozen", "thawing", "")
_Row = Any
_By = Literal["stage", "programme"]


def outcomes(session: Session, span: Span, adherence: ProgrammeAdherence) -> Outcomes:
    """Return the outcomes of the episodes whose last assessment is within the time. The station of ``span`` is ignored."""
    rows = session.execute(
        select(
            _text(EpisodeOutcomeRow.episode_id), EpisodeOutcomeRow.measure, EpisodeOutcomeRow.first_at, EpisodeOutcomeRow.first,
            EpisodeOutcomeRow.last, EpisodeOutcomeRow.important_at, _text(EpisodeRow.patient_id),
        ).join(EpisodeRow, EpisodeRow.id == EpisodeOutcomeRow.episode_id)
        .where(
            EpisodeOutcomeRow.last_at >= span.since, EpisodeOutcomeRow.last_at < span.until,
            EpisodeOutcomeRow.last_at > EpisodeOutcomeRow.first_at,
        )
    ).all()  # fmt: skip
    compared = _compared(rows)
    stage_of, programme_of = _stages(session, span), _programmes(session, span)
    groups = [_group("all", "", compared)]
    groups += _groups("stage", compared, [stage_of.get(row.episode_id, "") for row in rows], _STAGES)
    groups += _groups("programme", compared, [programme_of.get(row.episode_id, "") for row in rows])
    return Outcomes(
        limits={name: [measure.important, measure.detectable] for name, measure in MEASURES.items()},
        least_patients=LEAST_SHOWN,
        groups=_without_small(groups),
        adherence=adherence if adherence.programmes >= LEAST_SHOWN else None,
    )


def _text(column: InstrumentedAttribute[UUID]) -> Label[str]:
    """Return an id as text. Making, hashing and comparing thousands of UUID objects takes longer than the queries."""
    return cast(column, String).label(column.key)


def _stages(session: Session, span: Span) -> dict[str, str]:
    """Return the stage of each episode at its first assessment."""
    first = _episodes(span)
    query = (
        select(_text(StageRow.episode_id), StageRow.stage, StageRow.since, first.c.first_at)
        .join(first, first.c.episode_id == StageRow.episode_id)
        .order_by(StageRow.since, StageRow.noted_at)
    )
    # The last stage of an episode replaces the earlier ones.
    return {
        row.episode_id: row.stage
        for row in session.execute(query)
        if row.since <= row.first_at.astimezone(span.zone).date()
    }


def _programmes(session: Session, span: Span) -> dict[str, str]:
    """Return the name of each episode's newest programme. An archived programme is used only if there is no other."""
    first = _episodes(span)
    query = (
        select(_text(ProgrammeRow.episode_id), ProgrammeRow.name)
        .join(first, first.c.episode_id == ProgrammeRow.episode_id)
        .order_by(ProgrammeRow.archived_at.is_(None), ProgrammeRow.created_at)
    )
    return {row.episode_id: row.name for row in session.execute(query)}


def _episodes(span: Span) -> Any:
    return (
        select(EpisodeOutcomeRow.episode_id, func.min(EpisodeOutcomeRow.first_at).label("first_at"))
        .where(EpisodeOutcomeRow.last_at >= span.since, EpisodeOutcomeRow.last_at < span.until)
        .group_by(EpisodeOutcomeRow.episode_id)
        .subquery()
    )


@dataclass(frozen=True)
class _Compared:
    """Values of measures in episodes, as columns, because loops over thousands of rows take longer than the queries."""

    measure: Any
    """Numbers of the measures in :data:`MEASURES`."""
    patient: Any
    """Numbers that stand for the patients."""
    first: Any
    last: Any
    fall: Any
    """First value minus last value, as shown."""
    weeks: Any
    """Weeks until the first important improvement; NaN if there was none."""

    @property
    def patients(self) -> int:
        """Return the number of persons. A patient may have an episode of each shoulder."""
        return len(np.unique(self.patient))

    def where(self, chosen: Any) -> "_Compared":
        """Return the rows for which ``chosen`` is true."""
        return _Compared(*(getattr(self, column.name)[chosen] for column in fields(self)))


def _compared(rows: Sequence[_Row]) -> _Compared:
    first, last = (np.array([getattr(row, name) for row in rows], dtype=float) for name in ("first", "last"))
    weeks = [(row.important_at - row.first_at) / _WEEK if row.important_at else np.nan for row in rows]
    return _Compared(
        measure=_numbered([row.measure for row in rows], MEASURES),
        patient=_numbered([row.patient_id for row in rows]),
        first=first,
        last=last,
        fall=np.array([as_shown(fall) for fall in (first - last).tolist()], dtype=float),
        weeks=np.array(weeks, dtype=float),
    )


def _numbered(names: Iterable[str], known: Iterable[str] = ()) -> Any:
    """Return the number of each name: its place in ``known``, or else in the order of its first appearance."""
    places = {name: place for place, name in enumerate(known)}
    return np.array([places.setdefault(name, len(places)) for name in names], dtype=int)


def _groups(by: _By, rows: _Compared, names: Sequence[str], order: Sequence[str] = ()) -> list[OutcomeGroup]:
    """Return a group for each name, in this order or else from the largest to the smallest. ``names``: one for each row."""
    found = Counter(names)
    listed = [name for name in order if name in found] or [name for name, _ in found.most_common()]
    numbers = _numbered(names, listed)
    return [_group(by, name, rows.where(numbers == number)) for number, name in enumerate(listed)]


def _group(by: Literal["all", "stage", "programme"], name: str, rows: _Compared) -> OutcomeGroup:
    of_measure = [(measure, rows.where(rows.measure == number)) for number, measure in enumerate(MEASURES)]
    changes = [_change(measure, of) for measure, of in of_measure if of.patients >= LEAST_SHOWN]
    return OutcomeGroup(by=by, name=name, patients=rows.patients, changes=changes)


def _change(measure: OutcomeMeasure, rows: _Compared) -> OutcomeChange:
    change = rows.last - rows.first
    limits = MEASURES[measure]
    improved = rows.where(~np.isnan(rows.weeks))
    return OutcomeChange(
        measure=measure,
        patients=rows.patients,
        shoulders=len(change),
        first=float(rows.first.mean()),
        last=float(rows.last.mean()),
        change=intervals.of_mean(SampleSums(len(change), float(change.sum()), float((change**2).sum()))),
        important=_share(rows.fall, limits.important, np.greater_equal),
        # As for one patient (kata.clinic.questionnaires.changes): a change that is not larger may be due to chance.
        detectable=_share(rows.fall, limits.detectable, np.greater),
        weeks_to_important=[float(quartile) for quartile in np.percentile(improved.weeks, (25, 50, 75))]
        if improved.patients >= LEAST_SHOWN
        else None,
    )


def _share(falls: Any, limit: float | None, reached: np.ufunc) -> Estimate | None:
    if limit is None:
        return None
    return intervals.of_share(int(np.count_nonzero(reached(falls, limit))), len(falls))


def _without_small(groups: list[OutcomeGroup]) -> list[OutcomeGroup]:
    """Hide small groups. A single hidden group could be computed from the total, so the next smallest group is also hidden."""
    hidden = {place for place, group in enumerate(groups) if (group.patients or 0) < LEAST_SHOWN}
    count = Counter(groups[place].by for place in hidden)
    for by in ("stage", "programme"):
        shown = [place for place, group in enumerate(groups) if group.by == by and place not in hidden]
        if count[by] == 1 and shown:
            hidden.add(min(shown, key=lambda place: groups[place].patients or 0))
    empty: dict[str, Any] = {"patients": None, "changes": []}
    return [group.model_copy(update=empty) if place in hidden else group for place, group in enumerate(groups)]
