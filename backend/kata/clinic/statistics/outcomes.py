"""Outcomes of the treatment: change of each measure from the first to the last assessment, by stage and by programme.

Records of restricted patients are counted, because a figure names no patient. Small groups are hidden. If a hidden group could be computed
from the total, the next smallest group of the same kind is also hidden.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from datetime import datetime, timedelta
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from sqlalchemy import ColumnElement, Label, String, cast, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.statistics import intervals
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.measures import MEASURES, improvement
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
    row = EpisodeOutcomeRow
    query = select(
        _text(row.episode_id), row.measure, _text(row.first_at), row.first, row.last, _text(row.important_at)
    ).where(*_within(span), row.last_at > row.first_at)
    rows = session.connection().execute(query).all()
    episodes_by_id = _episodes(session, span)
    episodes = episodes_by_id.values()
    compared = _compared(rows, episodes_by_id)
    groups = [_group("all", "", compared)]
    groups += _groups("stage", compared, [episode.stage for episode in episodes], _STAGES)
    groups += _groups("programme", compared, [episode.programme for episode in episodes])
    return Outcomes(
        limits={name: [measure.important, measure.detectable] for name, measure in MEASURES.items()},
        least_patients=LEAST_SHOWN,
        groups=_without_small(groups),
        adherence=adherence if adherence.programmes >= LEAST_SHOWN else None,
    )


def _text(column: InstrumentedAttribute[Any]) -> Label[str]:
    """Return ids and times as text. Making thousands of UUIDs and times takes longer than the queries."""
    return cast(column, String).label(column.key)


def _within(span: Span) -> tuple[ColumnElement[bool], ColumnElement[bool]]:
    return EpisodeOutcomeRow.last_at >= span.since, EpisodeOutcomeRow.last_at < span.until


class _Episode(NamedTuple):
    """By what an episode is grouped."""

    patient: str
    stage: str
    """Stage at the first assessment; empty if none was recorded."""
    programme: str
    """Name of the newest programme; empty if there is none. An archived programme is used only if there is no other."""


def _episodes(session: Session, span: Span) -> dict[str, _Episode]:
    """Return the episodes by id."""
    first = (
        select(EpisodeOutcomeRow.episode_id, func.min(EpisodeOutcomeRow.first_at).label("first_at"))
        .where(*_within(span))
        .group_by(EpisodeOutcomeRow.episode_id)
        .subquery()
    )
    programme = (
        select(ProgrammeRow.name)
        .where(ProgrammeRow.episode_id == EpisodeRow.id)
        .order_by(ProgrammeRow.archived_at.is_(None).desc(), ProgrammeRow.created_at.desc())
        .limit(1)
        .scalar_subquery()
    )
    query = (
        select(_text(EpisodeRow.id), _text(EpisodeRow.patient_id), first.c.first_at, StageRow.stage, StageRow.since, programme)
        .join(first, first.c.episode_id == EpisodeRow.id)
        .outerjoin(StageRow, StageRow.episode_id == EpisodeRow.id)
        .order_by(StageRow.since, StageRow.noted_at)
    )  # fmt: skip
    episodes: dict[str, _Episode] = {}
    # An episode has a row for each of its stages, the earliest first.
    for episode_id, patient, first_at, stage, since, name in session.connection().execute(query).all():
        if since is not None and since <= first_at.astimezone(span.zone).date():
            episodes[episode_id] = _Episode(patient, stage, name or "")
        elif episode_id not in episodes:
            episodes[episode_id] = _Episode(patient, "", name or "")
    return episodes


@dataclass(frozen=True)
class _Compared:
    """Values of measures in episodes, as columns, because loops over thousands of rows take longer than the queries."""

    episode: Any
    """Numbers of the episodes, in the order of :func:`_episodes`."""
    measure: Any
    """Numbers of the measures in :data:`MEASURES`."""
    patient: Any
    """Numbers that stand for the patients."""
    first: Any
    last: Any
    improvement: Any
    """By how much each value fell, as shown."""
    weeks: Any
    """Weeks until the first important improvement; NaN if there was none."""

    @property
    def patients(self) -> int:
        """Return the number of persons. A patient may have an episode of each shoulder."""
        return int(np.count_nonzero(np.bincount(self.patient)))

    def subset(self, chosen: Any) -> "_Compared":
        """Return these rows: their numbers, or true for each."""
        return _Compared(*(getattr(self, column.name)[chosen] for column in fields(self)))


def _compared(rows: Sequence[_Row], episodes: dict[str, _Episode]) -> _Compared:
    ids, measures, first_at, first_values, last_values, important_at = zip(*rows, strict=True) if rows else ((),) * 6
    first, last = np.array(first_values, dtype=float), np.array(last_values, dtype=float)
    weeks = [
        (datetime.fromisoformat(important) - datetime.fromisoformat(begin)) / _WEEK if important else np.nan
        for begin, important in zip(first_at, important_at, strict=True)
    ]
    episode = _numbered(ids, episodes)
    return _Compared(
        episode=episode,
        measure=_numbered(measures, MEASURES),
        patient=_numbered([episode_row.patient for episode_row in episodes.values()])[episode],
        first=first,
        last=last,
        improvement=np.array(list(map(improvement, first_values, last_values)), dtype=float),
        weeks=np.array(weeks, dtype=float),
    )


def _numbered(names: Sequence[str], first_names: Iterable[str] = ()) -> Any:
    """Return the number of each name: its place in ``first_names``, or else in the order of its first appearance."""
    numbers = {name: place for place, name in enumerate(dict.fromkeys((*first_names, *names)))}
    return np.array([numbers[name] for name in names], dtype=int)


def _groups(by: _By, rows: _Compared, names: Sequence[str], order: Sequence[str] = ()) -> list[OutcomeGroup]:
    """Return a group for each name, in this order or else from the largest to the smallest. ``names``: one for each episode."""
    group_names = list(dict.fromkeys((*order, *names)))
    numbers = _numbered(names, group_names)[rows.episode]
    counts = np.bincount(numbers, minlength=len(group_names))
    listed = range(len(group_names)) if order else np.argsort(-counts, kind="stable").tolist()
    return [_group(by, group_names[n], rows.subset(np.flatnonzero(numbers == n))) for n in listed if counts[n]]


def _group(by: Literal["all", "stage", "programme"], name: str, rows: _Compared) -> OutcomeGroup:
    patients = rows.patients
    # A small group is hidden, and has no measure that is not.
    of_measure = [
        (measure, rows.subset(np.flatnonzero(rows.measure == number)))
        for number, measure in enumerate(MEASURES)
        if patients >= LEAST_SHOWN
    ]
    changes = [_change(measure, of) for measure, of in of_measure if of.patients >= LEAST_SHOWN]
    return OutcomeGroup(by=by, name=name, patients=patients, changes=changes)


def _change(measure: OutcomeMeasure, rows: _Compared) -> OutcomeChange:
    change = rows.last - rows.first
    limits = MEASURES[measure]
    improved = rows.subset(~np.isnan(rows.weeks))
    return OutcomeChange(
        measure=measure,
        patients=rows.patients,
        shoulders=len(change),
        first=float(rows.first.mean()),
        last=float(rows.last.mean()),
        change=intervals.of_mean(SampleSums(len(change), float(change.sum()), float((change**2).sum()))),
        important=_share(rows.improvement, limits.important, np.greater_equal),
        # As for one patient (kata.clinic.questionnaires.changes): a change that is not larger may be due to chance.
        detectable=_share(rows.improvement, limits.detectable, np.greater),
        weeks_to_important=[float(quartile) for quartile in np.percentile(improved.weeks, (25, 50, 75))]
        if improved.patients >= LEAST_SHOWN
        else None,
    )


def _share(improvements: Any, limit: float | None, reached: np.ufunc) -> Estimate | None:
    if limit is None:
        return None
    return intervals.of_share(int(np.count_nonzero(reached(improvements, limit))), len(improvements))


def _without_small(groups: list[OutcomeGroup]) -> list[OutcomeGroup]:
    """Hide small groups. A single hidden group could be computed from the total, so the next smallest group is also hidden."""
    hidden = {place for place, group in enumerate(groups) if (group.patients or 0) < LEAST_SHOWN}
    count = Counter(groups[place].by for place in hidden)
    for by in ("stage", "programme"):
        shown_places = [place for place, group in enumerate(groups) if group.by == by and place not in hidden]
        if count[by] == 1 and shown_places:
            hidden.add(min(shown_places, key=lambda place: groups[place].patients or 0))
    empty: dict[str, Any] = {"patients": None, "changes": []}
    return [group.model_copy(update=empty) if place in hidden else group for place, group in enumerate(groups)]
