"""Outcomes of the treatment: change of each measure from the first to the last assessment, by stage and by programme.

Records of restricted patients are counted, because a figure names no patient. Small groups are hidden. If a hidden group could be computed
from the total, the next smallest group of the same kind is also hidden.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
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
from kata.clinic.statistics.local_days import local_day
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
    compared = session.execute(
        select(
            _text(EpisodeOutcomeRow.episode_id), EpisodeOutcomeRow.measure, EpisodeOutcomeRow.first_at, EpisodeOutcomeRow.first,
            EpisodeOutcomeRow.last, EpisodeOutcomeRow.important_at, _text(EpisodeRow.patient_id),
        ).join(EpisodeRow, EpisodeRow.id == EpisodeOutcomeRow.episode_id)
        .where(
            EpisodeOutcomeRow.last_at >= span.since, EpisodeOutcomeRow.last_at < span.until,
            EpisodeOutcomeRow.last_at > EpisodeOutcomeRow.first_at,
        )
    ).all()  # fmt: skip
    stage_of, programme_of = _stages(session, span), _programmes(session, span)
    groups = [_group("all", "", compared)]
    groups += _groups("stage", compared, lambda row: stage_of.get(row.episode_id, ""), _STAGES)
    groups += _groups("programme", compared, lambda row: programme_of.get(row.episode_id, ""))
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
        select(_text(StageRow.episode_id), StageRow.stage)
        .join(first, first.c.episode_id == StageRow.episode_id)
        .where(StageRow.since <= local_day(first.c.first_at, span.utc_offset_minutes))
        .order_by(StageRow.since, StageRow.noted_at)
    )
    # The last stage of an episode replaces the earlier ones.
    return {row.episode_id: row.stage for row in session.execute(query)}


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


def _groups(
    by: _By, rows: Iterable[_Row], name_of: Callable[[_Row], str], order: Sequence[str] = ()
) -> list[OutcomeGroup]:
    of_name: dict[str, list[_Row]] = defaultdict(list)
    for row in rows:
        of_name[name_of(row)].append(row)
    names = [name for name in order if name in of_name] or sorted(of_name, key=lambda name: -len(of_name[name]))
    return [_group(by, name, of_name[name]) for name in names]


def _group(by: Literal["all", "stage", "programme"], name: str, rows: Sequence[_Row]) -> OutcomeGroup:
    of_measure: dict[OutcomeMeasure, list[_Row]] = {measure: [] for measure in MEASURES}
    for row in rows:
        of_measure[row.measure].append(row)
    changes = [_change(measure, of) for measure, of in of_measure.items() if _patients(of) >= LEAST_SHOWN]
    return OutcomeGroup(by=by, name=name, patients=_patients(rows), changes=changes)


def _patients(rows: Sequence[_Row]) -> int:
    """Return the number of persons. A patient may have an episode of each shoulder."""
    return len({row.patient_id for row in rows})


def _change(measure: OutcomeMeasure, rows: Sequence[_Row]) -> OutcomeChange:
    first, last = (np.array([getattr(row, name) for row in rows]) for name in ("first", "last"))
    change = last - first
    limits = MEASURES[measure]
    improved = [row for row in rows if row.important_at is not None]
    weeks = [(row.important_at - row.first_at) / _WEEK for row in improved]
    return OutcomeChange(
        measure=measure,
        patients=_patients(rows),
        shoulders=len(rows),
        first=float(first.mean()),
        last=float(last.mean()),
        change=intervals.of_mean(SampleSums(len(rows), float(change.sum()), float((change**2).sum()))),
        important=_share(change, limits.important, lambda fall, limit: fall >= limit),
        # As for one patient (kata.clinic.questionnaires.changes): a change that is not larger may be due to chance.
        detectable=_share(change, limits.detectable, lambda fall, limit: fall > limit),
        weeks_to_important=[float(quartile) for quartile in np.percentile(weeks, (25, 50, 75))]
        if _patients(improved) >= LEAST_SHOWN
        else None,
    )


def _share(change: Any, limit: float | None, reached: Callable[[float, float], bool]) -> Estimate | None:
    if limit is None:
        return None
    return intervals.of_share(sum(reached(as_shown(-one), limit) for one in change.tolist()), len(change))


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
